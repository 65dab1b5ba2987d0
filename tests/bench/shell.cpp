// SPDX-License-Identifier: MIT
// What a command costs from another process: one-shot, many in one session, and `save`; on a small
// and on a large machine.
#include <fmt/core.h>
#include <thread>
#include <unistd.h>

#include "bench.hpp"
#include "linuxcnc.hpp"
#include "machine.hpp"
#include "process.hpp"
#include "sample.hpp"

namespace hal::bench {
namespace {

std::string gates(std::size_t count, bool nets) {
    std::string text = fmt::format("loadrt and2 count={}\n", count);
    for (std::size_t i = 0; nets && i + 1 < count; ++i) {
        text += fmt::format("net n{} and2.{}.out => and2.{}.in0\n", i, i, i + 1);
    }
    for (std::size_t i = 0; i < count; ++i) {
        text += fmt::format("addf and2.{} t\n", i);
    }
    return text + "start\n";
}

std::string setps(std::size_t instances) {
    std::string text;
    for (std::size_t i = 0; i < 1000; ++i) {
        text += fmt::format("setp and2.{}.in1 {}\n", i * 7919 % instances, i % 2);
    }
    return text;
}

/// An instance of its own name, started by `hal run`.
class Instance {
public:
    Instance(const Options& options, std::size_t gate_count)
        : hal_(options.programs + "/hal"),
          name_(fmt::format("bench-{}", getpid())),
          process_({.arguments = {hal_, "run", "--no-picture", "--name", name_,
                                  files_.file("bench.hal",
                                              "newthread t 1000000\n" + gates(gate_count, true))},
                    .everywhere = true}) {
        for (const Stopwatch watch; run(shell({"getp", "and2.0.out"})).status != 0;
             std::this_thread::sleep_for(std::chrono::milliseconds(10))) {
            if (watch.ms() > 10'000) throw std::runtime_error("'hal run' does not answer");
        }
    }
    Start shell(const std::vector<std::string>& words) const {
        Start start{.arguments = {hal_, "shell", "--name", name_}};
        start.arguments.insert(start.arguments.end(), words.begin(), words.end());
        return start;
    }
    std::string file(const std::string& name, const std::string& text) const {
        return files_.file(name, text);
    }

private:
    std::string hal_, name_;
    TemporaryFolder files_;
    Child process_;
};

/// Median wall time of that many runs; of two programs in turn where there is a second.
std::pair<double, std::optional<double>> wall_ms(int runs, const Start& ours,
                                                 const Start* peer = nullptr) {
    std::vector<double> own, theirs;
    for (int i = 0; i < runs; ++i) {
        own.push_back(run(ours).ms);
        if (peer) {
            theirs.push_back(run(*peer).ms);
        }
    }
    return {median(own), peer ? std::optional(median(theirs)) : std::nullopt};
}

}  // namespace

void shell(const Options& options, Report& report) {
    report.section("shell: commands from another process, wall time");
    if (access((options.programs + "/hal").c_str(), X_OK) != 0) {
        return report.note("the program hal is not built here");
    }
    const int spawns = options.quick ? 40 : 200;
    const int sessions = options.quick ? 5 : 15;
    double save_small = 0;
    double save_large = 0;
    double nothing_done = 0;
    constexpr std::size_t small = 1000;
    constexpr std::size_t large = 10'000;
    for (const std::size_t count : {std::size_t{10}, small, large}) {
        const Instance instance(options, count);
        const std::size_t peer_count = count == 10 ? 10 : 1000;
        const auto peer = count <= 1000 ? LinuxCnc::start("name1=t period1=1000000") : nullptr;
        if (peer) {
            peer->file(gates(peer_count, false));
        }
        const std::string peer_name = count > 1000 ? ""
                                      : peer       ? LinuxCnc::name()
                                                   : LinuxCnc::absent();
        const std::string size = fmt::format(", {} instances", count);
        wait_for_quiet(1.0);

        const Start their_getp = peer ? peer->program({"halcmd", "getp", "and2.0.out"}) : Start{};
        const auto [getp, halcmd_getp] =
            wall_ms(spawns, instance.shell({"getp", "and2.0.out"}), peer ? &their_getp : nullptr);
        report.row({"one-shot getp" + size, "ms", getp, peer_name, halcmd_getp, limit(2.7)});

        const std::string file = instance.file("setp.hal", setps(count));
        const Start their_setp = peer ? peer->program({"halcmd", "-f", file}) : Start{};
        const auto [setp, halcmd_setp] =
            wall_ms(sessions, instance.shell({"-f", file}), peer ? &their_setp : nullptr);
        report.row(
            {"1000 setp in one session" + size, "ms", setp, peer_name, halcmd_setp, limit(3)});

        if (count == large) {
            nothing_done =
                wall_ms(sessions, instance.shell({"-f", instance.file("empty.hal", "")})).first;
        }
        if (count == small) {
            save_small = wall_ms(sessions, instance.shell({"save"})).first - getp;
        }
        if (count == large) {
            save_large = wall_ms(sessions, instance.shell({"save"})).first - getp;
        }
    }
    report.row(
        {.what = fmt::format("save, {} instances", large), .unit = "ms", .ours = save_large});
    report.row({.what = fmt::format("save, growth from {} to {}: time ~ size ^ b, b", small, large),
                .unit = "",
                .ours = exponent(small, save_small, large, save_large),
                .goal = limit(1.25)});
    const Start nothing{.arguments = {"true"}};
    report.row({.what = "reference: start of `true`",
                .unit = "ms",
                .ours = wall_ms(spawns, nothing).first});
    report.note(fmt::format(
        "Of a session {:.2f} ms are the start of the program and its connection.", nothing_done));
    report.note(
        fmt::format("Medians of {} one-shots and {} sessions (hal shell -f, halcmd -f), the "
                    "program's start included, in turn with the peer.",
                    spawns, sessions));
}

}  // namespace hal::bench
