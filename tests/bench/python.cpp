// SPDX-License-Identifier: MIT
// What a component in Python can do: 50 inputs read and 50 outputs written, all of them linked,
// again and again.
#include <cstdlib>
#include <filesystem>
#include <fmt/core.h>
#include <unistd.h>

#include "bench.hpp"
#include "process.hpp"

namespace hal::bench {
namespace {

constexpr const char* program = R"(import hal, time
c = hal.component("bench")
for i in range(50):
    c.newpin(f"in-{i}", hal.HAL_FLOAT, hal.HAL_IN)
    c.newpin(f"out-{i}", hal.HAL_FLOAT, hal.HAL_OUT)
c.ready()
for i in range(50):
    for signal, pins in ((f"to-{i}", (f"bench.out-{i}", f"s.{i}.in0")), (f"from-{i}", (f"s.{i}.out", f"bench.in-{i}"))):
        hal.new_sig(signal, hal.HAL_FLOAT)
        for pin in pins: hal.connect(pin, signal)
ins, outs = [f"in-{i}" for i in range(50)], [f"out-{i}" for i in range(50)]
def rate(action, seconds):
    count, begin = 0, time.perf_counter()
    while time.perf_counter() - begin < seconds:
        action(count)
        count += 1
    return (time.perf_counter() - begin) / count
def update(n):
    c._core.look()  # the copy is old: fetch it, however young it is
    for name in ins: c[name]
    for name in outs: c[name] = n
def reads(n):
    for name in ins: c[name]
print(rate(update, SECONDS) * 1e3, rate(reads, SECONDS) / 50 * 1e6, flush=True)
)";

}  // namespace

void python(const Options& options, Report& report) {
    report.section("Python: a component of 100 linked pins");
    if (!std::filesystem::exists(options.programs + "/../python/hal")) {
        return report.note("the module hal is not built here (python3-dev, pybind11-dev)");
    }
    const TemporaryFolder files;
    std::string text = program;
    text.replace(text.find("SECONDS"), 7, options.quick ? "0.5" : "3");
    text.replace(text.find("SECONDS"), 7, options.quick ? "0.5" : "3");
    files.file("bench.py", text);
    std::string names;
    for (int i = 0; i < 50; ++i) {
        names += fmt::format("{}s.{}", i == 0 ? "" : ",", i);
    }
    const std::string netlist =
        files.file("bench.hal", fmt::format("newthread t 1000000\nloadrt sum2 names={}\naddf "
                                            "s.[0..49] t\nstart\nloadusr -w python3 {}/bench.py\n",
                                            names, files.path()));
    const Finished done =
        run({.arguments = {options.programs + "/hal", "run", "--no-picture", "--for", "10ms",
                           "--name", fmt::format("bench-{}", getpid()), netlist},
             .everywhere = true});
    char* end = nullptr;
    const double update = std::strtod(done.out.c_str(), &end);
    const double read = std::strtod(end, nullptr);
    if (update <= 0) return report.note("the component did not run");
    report.row({.what = "100 pins, each read or written once",
                .unit = "ms",
                .ours = update,
                .goal = limit(2)});
    report.row({.what = "one pin read", .unit = "us", .ours = read});
    report.note(fmt::format("{:.0f} updates a second, one request each, beside a thread of 1 ms.",
                            1e3 / update));
}

}  // namespace hal::bench
