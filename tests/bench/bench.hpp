// SPDX-License-Identifier: MIT
// What the sections of the bench share: options, and the table they fill.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace hal::bench {

struct Options {
    bool quick = false;       ///< shorter runs, wider spread
    bool full = false;        ///< what takes minutes as well: a cold build, a million edits
    std::string programs;     ///< folder of the built `hal`
    /// of the real-time thread; everything else of the bench stays off it
    int cpu = 0;
};

/// What a ratio has to be. `at_most`: ours / theirs. `not_above`: the same with 1, where a tenth is
/// the spread of the measurement. `times_less`: theirs / ours. `limit`: ours against a figure;
/// `at_least`: where more is better.
struct Goal {
    enum class Kind { none, at_most, not_above, times_less, limit, at_least } kind = Kind::none;
    double value = 0.0;
    /// of `limit` and `at_least`: on a machine where the peer misses the limit, the ratio of times
    /// to the peer counts
    double beside = 0.0;
};
inline Goal not_above() { return {Goal::Kind::not_above, 1.1}; }
inline Goal at_most(double ratio) { return {Goal::Kind::at_most, ratio}; }
inline Goal times_less(double ratio) { return {Goal::Kind::times_less, ratio}; }
inline Goal limit(double figure, double beside = 0.0) {
    return {Goal::Kind::limit, figure, beside};
}
inline Goal at_least(double figure, double beside = 0.0) {
    return {Goal::Kind::at_least, figure, beside};
}

struct Row {
    std::string what;
    std::string unit;  ///< of ours and theirs
    std::optional<double> ours = {};
    std::string peer = {};  ///< what theirs is of, or why there is no figure of it
    std::optional<double> theirs = {};
    Goal goal = {};
};

/// The table printed at the end. Rows stand in the order in which they were added.
class Report {
public:
    void section(const std::string& title);
    void row(const Row& row);
    void note(const std::string& sentence);
    std::string text() const;

private:
    struct Line {
        enum class Kind { section, row, note } kind;
        /// of a row: what, ours, peer, ratio, target, verdict; else the text in the first
        std::string cells[6];
    };
    std::vector<Line> lines_;
};

void dispatch(const Options&, Report&);
void modules(const Options&, Report&);
void wakeup(const Options&, Report&);
void load(const Options&, Report&);
void shell(const Options&, Report&);
void edit(const Options&, Report&);
void probe(const Options&, Report&);
void trace(const Options&, Report&);
void journal(const Options&, Report&);
void coherence(const Options&, Report&);
void python(const Options&, Report&);
void can(const Options&, Report&);
void estimation(const Options&, Report&);
void dds(const Options&, Report&);
void vision(const Options&, Report&);
void size(const Options&, Report&);
void canopen_boot(const Options&, Report&);

/// What `canopen-boot` starts where there is a vcan0: `hal-bench` with this word prints seconds and
/// what went wrong.
inline constexpr const char* canopen_boot_inside_word = "canopen-boot-inside";
int canopen_boot_inside();

}  // namespace hal::bench
