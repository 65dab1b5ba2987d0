// SPDX-License-Identifier: MIT
// EtherCAT machines with emulated slaves in memory: many slaves, a slave that is plugged in again,
// a broken ring, the shortest cycle.
#include <fmt/core.h>
#include <sstream>

#include "ethercat.hpp"
#include "process.hpp"
#include "sample.hpp"

namespace hal::bench {
namespace {

std::vector<std::string> lines_of(const std::string& text) {
    std::vector<std::string> lines;
    std::istringstream in(text);
    for (std::string line; std::getline(in, line);) {
        lines.push_back(line);
    }
    return lines;
}

std::string bus(const std::string& link, int drives, const std::string& more = "") {
    std::string text = "[bus]\nlink = " + link + "\ncycle = 1ms\n" + more +
                       "[type drive]\ndevice = cia402\nvendor = 0xFFFFFF\noutputs = 6040 607A\n"
                       "inputs = 6041 6064\ndc = sync0\n";
    for (int i = 0; i < drives; ++i) {
        text += fmt::format("[slave {} d{}]\ntype = drive\n", i, i);
    }
    return text;
}

std::string netlist(const std::string& link, int drives, const std::string& file,
                    const std::string& then) {
    std::string devices;
    for (int i = 0; i < drives; ++i) {
        devices += i == 0 ? "servo" : ", servo";
    }
    return "loadrt threads name1=servo period1=1000000\n"
           "loadrt ethercat_segment devices=\"" +
           devices + "\" link=" + link + "\nloadrt ethercat config=" + file +
           "\naddf ethercat.0.receive servo\naddf ethercat.0.transmit servo\naddf "
           "ethercat-segment.0.update servo\nstart\n" +
           then;
}

void many(const Options& options, Report& report, const TemporaryFolder& folder) {
    constexpr int slaves = 500;
    // their frames are on the wire for longer than a cycle
    const std::string file =
        folder.file("many.ethercat", bus("sim:many", slaves, "frame-timeout = 3ms\n"));
    const auto took = [&](int seconds) {
        const std::string text =
            netlist("sim:many", slaves, file,
                    fmt::format("advance {}s\ngetp ethercat.0.all-op\n", seconds));
        return run({{options.programs + "/hal", "sim", folder.file("many.hal", text)}}, 300'000);
    };
    const Finished start = took(4);
    const Finished more = took(options.quick ? 6 : 14);
    if (start.out != "TRUE\n" || more.out != "TRUE\n") {
        return report.note(
            fmt::format("{} drives were not operational after 4 s of virtual time", slaves));
    }
    const double seconds = options.quick ? 2 : 10;
    report.row(
        {.what = fmt::format("{} drives in memory, 1 ms, times as fast as real time", slaves),
         .unit = "times",
         .ours = seconds * 1000 / (more.ms - start.ms),
         .goal = at_least(1)});
}

void plugged_again(const Options& options, Report& report, const TemporaryFolder& folder) {
    std::string then =
        "advance 2s\nsetp ethercat-segment.0.slave-2.power FALSE\nadvance 500ms\nsetp "
        "ethercat-segment.0.slave-2.power TRUE\n";
    constexpr int step_ms = 5;
    for (int n = 0; n < 400; ++n) {
        then += fmt::format("advance {}ms\ngetp ethercat.0.d2.operational\n", step_ms);
    }
    then += "getp ethercat.0.d0.losses\ngetp ethercat.0.d1.losses\n";
    const std::string text =
        netlist("sim:three", 3, folder.file("three.ethercat", bus("sim:three", 3)), then);
    const auto lines = lines_of(
        run({{options.programs + "/hal", "sim", folder.file("three.hal", text)}}, 60'000).out);
    std::size_t at = 0;
    while (at < lines.size() && lines[at] == "FALSE") {
        ++at;
    }
    if (lines.size() != 402 || at >= 400) {
        return report.note(
            "a drive that was switched off and on was not operational again within 2 s");
    }
    report.row({.what = "a drive switched off and on, until it is operational again",
                .unit = "ms",
                .ours = static_cast<double>(at + 1) * step_ms,
                .goal = limit(500)});
    report.note(fmt::format("virtual clock, steps of {} ms; the other drives were lost {} times",
                            step_ms, std::stoi(lines[400]) + std::stoi(lines[401])));
}

void broken_ring(const Options& options, Report& report, const TemporaryFolder& folder) {
    const std::string text =
        std::string("source ") +
        HALCYON_SOURCE
        "/halfiles/ethercat-cnc/cnc.hal\nadvance 2s\ngetp ethercat.0.cycles-incomplete\n" +
        "setp ethercat-segment.0.slave-2.cable FALSE\nadvance 1s\ngetp "
        "ethercat.0.cycles-incomplete\ngetp ethercat.0.ring-broken\n";
    const auto lines = lines_of(
        run({{options.programs + "/hal", "sim", folder.file("ring.hal", text)}}, 60'000).out);
    if (lines.size() != 3 || lines[2] != "TRUE") {
        return report.note("the ring of halfiles/ethercat-cnc was not measured");
    }
    report.row({.what = "cable of a ring broken: cycles without fresh data",
                .unit = "cycles",
                .ours = std::stod(lines[1]) - std::stod(lines[0]),
                .goal = limit(0)});
}

/// The machine halfiles/ethercat-cnc in real time, master and slaves in one thread, in shorter and
/// shorter cycles.
void shortest_cycle(const Options& options, Report& report, const TemporaryFolder& folder) {
    const std::string machine = HALCYON_SOURCE "/halfiles/ethercat-cnc/";
    std::string said;
    double best_us = 0;
    const int seconds = options.quick ? 2 : 5;
    for (const int ns : {1'000'000, 500'000, 250'000, 125'000, 100'000, 62'500, 50'000}) {
        const std::string text = fmt::format(
            "loadrt threads name1=servo-thread period1={0} cpu1={2}\nsource {1}ring.hal\nloadrt "
            "ethercat config={1}cnc.ethercat cycle={0}\n"
            "source {1}control.hal\naddf ethercat-segment.0.update servo-thread\nstart\n",
            ns, machine, options.cpu);
        Child child({{options.programs + "/hal", "run", "--name", "bench-ethercat", "--no-picture",
                      folder.file("cnc.hal", text)},
                     {},
                     static_cast<uid_t>(-1),
                     true});
        const auto ask = [&](const char* name) {
            return run({{options.programs + "/hal", "shell", "--name", "bench-ethercat", "-s",
                         "getp", name}},
                       3000)
                .out;
        };
        const Stopwatch watch;
        while (ask("ethercat.0.all-op") != "TRUE\n" && watch.ms() < 5000) {
        }
        const std::string missed_before = ask("servo-thread.missed");

        const std::string incomplete_before = ask("ethercat.0.cycles-incomplete");
        const Stopwatch measured;
        while (measured.ms() < seconds * 1000) {
            run({{"/bin/sleep", "0.2"}}, 3000);
        }
        const std::string missed = ask("servo-thread.missed");

        const std::string incomplete = ask("ethercat.0.cycles-incomplete");

        const std::string op = ask("ethercat.0.all-op");
        child.end();
        if (missed.empty() || missed_before.empty() || op != "TRUE\n") break;
        const double cycles = measured.ms() * 1e6 / ns;

        const double late = std::stod(missed) - std::stod(missed_before);

        const double without = std::stod(incomplete) - std::stod(incomplete_before);
        said += fmt::format("{}{:g} us: {:.0f} of {:.0f} missed", said.empty() ? "" : ", ",
                            ns / 1000.0, late, cycles);
        // a moment of noise does not end the search
        if (late <= cycles / 1000 && without <= cycles / 1000) {
            best_us = ns / 1000.0;
        }
    }
    if (best_us == 0) return report.note("halfiles/ethercat-cnc did not run in real time here");
    report.row({.what = "5 axes and 64 + 64 I/O, shortest cycle with at most 0.1 % missed",
                .unit = "us",
                .ours = best_us,
                .goal = limit(1000)});
    report.note(
        fmt::format("in memory, master and slaves in one thread; {}; it runs with: loadrt ethercat "
                    "config=cnc.ethercat cycle={:.0f}",
                    said, best_us * 1000));
}

}  // namespace

void ethercat_machines(const Options& options, Report& report) {
    const TemporaryFolder folder;
    many(options, report, folder);
    plugged_again(options, report, folder);
    broken_ring(options, report, folder);
    shortest_cycle(options, report, folder);
}

}  // namespace hal::bench
