// SPDX-License-Identifier: MIT
// `hal plot`: chosen values of a recording as an SVG picture.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "cli/option_set.hpp"
#include "recording/mcap/recording.hpp"

namespace hal::tools {

struct PlotOptions : Options {
    std::string output;
    std::int64_t from_ns = 0;
    std::int64_t for_ns = -1;
    int width = 1000;

    void declare(OptionSet& set) override {
        set.words("FILE NAMES",
                  "a recording (.mcap or .csv), then the values to draw, or patterns like 'x-*' "
                  "(default: all, at most 24)");
        set.value("-o,--output", output, "OUT",
                  "write to this file, .svg or .png (with rsvg-convert), '-' for standard output "
                  "(default: FILE with the ending .svg)");
        set.duration("--from", from_ns, "begin at this time after the first row");
        set.duration("--for", for_ns, "draw this much (default: to the end)", 1);
        set.value("--width", width, "PIXELS", "width of the picture (default 1000)")
            .in(300, 10'000);
    }
};

int run_plot(const PlotOptions& options);

/// One value to be drawn.
struct Trace {
    std::string name, unit;
    hal_type type = HAL_TYPE_FLOAT;
    const mcap::Table* table = nullptr;
    std::size_t column = 0;
};

/// Returns the picture of the traces between two times. Values of one unit share a scale; those
/// without a unit do when their ranges differ by a factor of 20 at most; each bit has a strip of
/// its own. Traces are stairs, as the thread had the values; where several rows fall on a pixel,
/// their smallest and largest value are drawn.
std::string plot_svg(const std::vector<Trace>& traces, const std::vector<mcap::Event>& events,
                     std::int64_t begin_ns, std::int64_t end_ns, int width);

}  // namespace hal::tools
