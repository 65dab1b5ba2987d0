// SPDX-License-Identifier: MIT
// What an instance acquires while it starts: the descriptors and threads that this process has
// afterwards and had not before.
#pragma once

#include <map>
#include <string>

#include "machine/run/execution_sink.hpp"

namespace hal {

/// Made before start(). Sockets of the control protocol do not count; another file that a thread of
/// the runtime opens meanwhile does. [setup]
class Acquisition {
public:
    Acquisition();
    /// Returns what is new since the constructor.
    OutsideWorld result() const;

private:
    std::map<std::string, std::string> files_;  // by number of the descriptor
    std::size_t threads_;
};

}  // namespace hal
