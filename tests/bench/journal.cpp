// SPDX-License-Identifier: MIT
// What the execution journal costs a cycle, beside a recording of the same machine.
#include <algorithm>
#include <filesystem>
#include <fmt/core.h>
#include <optional>
#include <sstream>

#include "bench.hpp"
#include "process.hpp"

namespace hal::bench {
namespace {

constexpr int functions = 1000;

std::string netlist() {
    std::string text = fmt::format(
        "loadrt threads name1=servo period1=1000000\nloadrt lowpass count={}\n", functions);
    for (int i = 0; i < functions; ++i) {
        text += fmt::format("setp lowpass.{0}.gain 0.1\naddf lowpass.{0} servo\n", i);
    }
    return text + "start\n";
}

double us_per(const std::string& unit) {
    if (unit == "ns") return 1e-3;
    return unit == "us" ? 1.0 : 1e3;
}

/// Returns the median of the execution time in the table that `hal run` prints at its end, in us;
/// nothing without that table.
std::optional<double> median_us(const std::string& printed) {
    std::istringstream lines(printed);
    for (std::string line; std::getline(lines, line);) {
        std::istringstream words(line);
        std::vector<std::string> word;
        for (std::string one; words >> one;) {
            word.push_back(one);
        }
        // servo, period, cycles, missed, three wake-up latencies, the median
        constexpr std::size_t median = 11;
        if (word.size() <= median + 1 || word[0] != "servo") continue;
        return std::stod(word[median]) * us_per(word[median + 1]);
    }
    return std::nullopt;
}

class Machine {
public:
    Machine(const Options& options, double seconds)
        : program_(options.programs + "/hal"),
          time_(fmt::format("{}s", seconds)),
          environment_("XDG_RUNTIME_DIR=" + folder_.path()),
          path_(folder_.file("machine.hal", netlist())) {}

    /// Runs the machine. `options`: further ones of `hal run`.
    std::optional<double> run_once(const std::vector<std::string>& options) const {
        std::vector<std::string> words = {program_, "run", path_, "--for", time_};
        words.insert(words.end(), options.begin(), options.end());
        return median_us(run({.arguments = words, .environment = {environment_}}).out);
    }
    /// Runs the machine beside a recorder; nothing when that has recorded nothing.
    std::optional<double> recorded() const {
        const std::string file = folder_.path() + "/values.mcap";
        std::filesystem::remove(file);
        // it waits for the machine
        const Child recorder({.arguments = {"/bin/sh", "-c",
                                            fmt::format("until {0} shell show thread; do sleep "
                                                        "0.05; done; exec {0} record {1} "
                                                        "'lowpass.*.out' --for {2}",
                                                        program_, file, time_)},
                              .environment = {environment_}});
        const std::optional<double> median = run_once({});
        return std::filesystem::exists(file) ? median : std::nullopt;
    }
    std::string journal() const { return folder_.path() + "/journal.mcap"; }

private:
    const TemporaryFolder folder_;
    const std::string program_;
    const std::string time_;
    const std::string environment_;
    const std::string path_;
};

/// Returns the median; nothing when a run has no figure.
std::optional<double> median(const std::vector<std::optional<double>>& measured) {
    std::vector<double> values;
    for (const std::optional<double>& one : measured) {
        if (!one) return std::nullopt;
        values.push_back(*one);
    }
    std::ranges::sort(values);
    return values[values.size() / 2];
}

}  // namespace

void journal(const Options& options, Report& report) {
    report.section("Journal: its cost in each cycle");
    const Machine machine(options, options.quick ? 2 : 5);
    const int runs = options.quick ? 3 : 7;
    std::vector<std::optional<double>> without, with, recorded;
    for (int i = 0; i < runs; ++i) {  // alternating: the load of the machine changes
        without.push_back(machine.run_once({}));
        with.push_back(machine.run_once({"--journal", machine.journal()}));
        recorded.push_back(machine.recorded());
    }
    const std::optional<double> off = median(without);
    const std::optional<double> on = median(with);
    const bool measured = off && on;
    const auto difference = measured ? std::optional(*on - *off) : std::nullopt;
    report.row({fmt::format("cycle of {} functions, no journal, median", functions), "us", off});
    report.row({"the same, journaled", "us", on, "no journal", off, at_most(1.05)});
    report.row({"the journal", "us", difference, "the limit", 1.0, limit(1.0)});
    report.row({fmt::format("the same, journaled, beside {} values recorded", functions), "us", on,
                "hal record", median(recorded)});
    report.note(fmt::format("{} runs of each, alternating; the medians of 1 kHz cycles", runs));
}

}  // namespace hal::bench
