// SPDX-License-Identifier: MIT
// The scope's picture: a status line, the traces or the help, a line per channel, the keys.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "cli/raster.hpp"
#include "scope/acquisition.hpp"
#include "scope/view.hpp"

namespace hal::tools {

/// Draws a ScopeView in characters. It reads the view and the acquisition, and changes neither.
class ScopePicture {
public:
    static constexpr std::size_t min_columns = 40;
    static constexpr std::size_t min_rows = 10;

    /// `colour` false: one colour, channels are marked by numbers only.
    ScopePicture(const ScopeView& view, const Acquisition& acquisition, bool unicode, bool colour)
        : view_(view), acquisition_(acquisition), unicode_(unicode), colour_(colour) {}

    /// Returns `rows` lines of `columns` characters; one line that asks for more when they are
    /// fewer than the minimum. `lost`: samples.
    std::vector<std::string> lines(std::size_t columns, std::size_t rows, std::uint64_t lost) const;

private:
    std::string status_line(const Record&, std::uint64_t lost) const;
    std::string channel_line(const Record&, std::size_t channel) const;
    std::string cursor_values(const Record&, std::size_t channel) const;
    std::string last_line() const;
    std::vector<std::string> help(std::size_t columns, std::size_t rows) const;
    std::vector<std::string> traces(const Record&, std::size_t columns, std::size_t rows) const;
    void draw_grid(Raster&) const;
    void draw_level(Raster&) const;
    void draw_time(Raster&, const Record&, std::int64_t time_ns, std::size_t step,
                   std::uint8_t colour) const;
    void draw_cursors(Raster&, const Record&) const;
    void draw_trace(Raster&, const Record&, std::size_t channel) const;
    void draw_arrows(Raster&, const Record&, std::size_t columns, std::size_t rows) const;
    std::uint8_t colour_of(std::size_t channel) const;

    const ScopeView& view_;
    const Acquisition& acquisition_;
    const bool unicode_;
    const bool colour_;
};

}  // namespace hal::tools
