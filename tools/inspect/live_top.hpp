// SPDX-License-Identifier: MIT
#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <vector>

#include "cli/signals.hpp"
#include "inspect/seen_instance.hpp"

namespace hal::tools {

/// The table of `hal top` on the whole terminal, until `q`, Ctrl-C or the end of a duration.
class LiveTop {
public:
    using Source = std::function<std::vector<SeenInstance>()>;
    /// `source` returns the instances; it is called twice a second.
    explicit LiveTop(Source source) : source_(std::move(source)) {}
    /// Returns false when the terminal is gone. No duration: without end. [setup]
    bool run(const StopRequest& stop, std::optional<std::chrono::nanoseconds> duration);

private:
    std::vector<std::string> lines(std::size_t columns, std::size_t rows);

    Source source_;
    std::vector<SeenInstance> seen_;
    std::size_t first_ = 0;  // of the rows, the first that is visible
};

}  // namespace hal::tools
