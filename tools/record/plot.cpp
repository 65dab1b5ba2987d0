// SPDX-License-Identifier: MIT
#include "record/plot.hpp"

#include <algorithm>
#include <cstdio>
#include <fmt/core.h>
#include <fnmatch.h>

#include "cli/filter.hpp"
#include "cli/output.hpp"
#include "text/suggest.hpp"

namespace hal::tools {
namespace {

constexpr std::size_t max_traces = 24;

/// The columns of a name or a pattern, in the order of the file.
std::size_t add_traces(const mcap::Recording& recording, const std::string& wanted,
                       std::vector<Trace>& traces) {
    const std::size_t before = traces.size();
    for (const mcap::Table& table : recording.tables) {
        for (std::size_t c = 0; c < table.columns.size(); ++c) {
            const mcap::Column& column = table.columns[c];
            if (column.name == wanted || ::fnmatch(wanted.c_str(), column.name.c_str(), 0) == 0) {
                traces.push_back({column.name, column.unit, column.type, &table, c});
            }
        }
    }
    return traces.size() - before;
}

int complain_unknown(const PlotOptions& options, const mcap::Recording& recording,
                     const std::string& wanted) {
    std::vector<std::string> names;
    for (const mcap::Table& table : recording.tables) {
        for (const mcap::Column& column : table.columns) {
            names.push_back(column.name);
        }
    }
    const std::string hint = suggestion(wanted, names, "it has");
    return fail(options, fmt::format("'{}' has no value '{}'{}", options.words.front(), wanted,
                                     hint.empty() ? "" : "; " + hint));
}

/// Finds the values that are named; all without a name. Returns the exit status of a failure, or 0.
int choose_traces(const PlotOptions& options, const mcap::Recording& recording,
                  std::vector<Trace>& traces) {
    for (std::size_t i = 1; i < options.words.size(); ++i) {
        if (add_traces(recording, options.words[i], traces) == 0) {
            return complain_unknown(options, recording, options.words[i]);
        }
    }
    if (options.words.size() == 1) {
        add_traces(recording, "*", traces);
    }
    if (traces.size() <= max_traces) return 0;
    return fail(
        options,
        fmt::format(
            "{} values are too many for one picture (limit {}); name some: hal plot FILE NAME…",
            traces.size(), max_traces));
}

bool is_picture(const std::string& file) {
    return file.ends_with(".svg") || file.ends_with(".png");
}

/// Writes the picture in the format of the file's name, and prints that name.
int write_picture(const PlotOptions& options, const std::string& svg) {
    if (options.output == "-") return exit_code(print(svg));
    const std::string& file = options.words.front();
    const std::string output =
        options.output.empty() ? file.substr(0, file.rfind('.')) + ".svg" : options.output;
    std::string picture = svg;
    if (output.ends_with(".png")) {
        const std::string problem =
            run_filter({"rsvg-convert", "--format=png"}, svg, picture, "librsvg2-bin");
        if (!problem.empty()) {
            return fail(options, fmt::format("cannot draw '{}': {} (or name the file .svg)", output,
                                             problem));
        }
    }
    const std::string problem = write_file(output, picture);
    if (!problem.empty()) return fail(options, problem);
    return exit_code(print(fmt::format("{}\n", output)));
}

}  // namespace

int run_plot(const PlotOptions& options) {
    const std::string& file = options.words.front();
    const std::string& to = options.output;
    if (!to.empty() && to != "-" && !is_picture(to)) {
        return fail(options, fmt::format("unknown format of '{}'; name the file .svg or .png", to));
    }
    mcap::Recording recording;
    std::string problem;
    if (!mcap::load(file, recording, problem)) return fail(options, problem);
    for (const std::string& note : recording.notes()) {
        std::fputs(fmt::format("{}: {}\n", options.program, note).c_str(), stderr);
    }
    if (recording.tables.empty()) {
        return fail(options, fmt::format("'{}' has no rows{}", file,
                                         recording.unread.empty() ? "" : "; " + recording.unread));
    }
    std::vector<Trace> traces;
    if (const int status = choose_traces(options, recording, traces); status != 0) return status;
    const std::int64_t begin_ns = recording.begin_ns() + options.from_ns;
    const std::int64_t last_ns = recording.end_ns();
    const std::int64_t end_ns =
        options.for_ns < 0 ? last_ns : std::min(last_ns, begin_ns + options.for_ns);
    if (begin_ns >= last_ns && options.from_ns > 0) {
        return fail(options,
                    fmt::format("--from is after the end: '{}' has {:.6g} s", file,
                                static_cast<double>(last_ns - recording.begin_ns()) * 1e-9));
    }
    return write_picture(options,
                         plot_svg(traces, recording.events, begin_ns, end_ns, options.width));
}

}  // namespace hal::tools
