// SPDX-License-Identifier: MIT
// What a trace costs the cycle that it records, and nothing after its end.
#include <cstring>
#include <fmt/core.h>
#include <stdexcept>
#include <thread>

#include "bench.hpp"
#include "machine.hpp"
#include "machine/traces.hpp"
#include "runtime.hpp"
#include "sample.hpp"

namespace hal::bench {
namespace {

constexpr int traced_functions = 100;

class TracedMachine {
public:
    explicit TracedMachine(const Options& options) {
        std::string text = new_thread("t", 1'000'000, options.cpu) + fmt::format("loadrt and2 count={}\n", traced_functions);
        for (int i = 0; i < traced_functions; ++i) text += fmt::format("addf and2.{} t\n", i);
        runtime_.apply(text);
        runtime_.session.threads().start();
    }
    ~TracedMachine() { runtime_.session.threads().stop(); }

    /// Returns the median of the execution time, ns, over some seconds.
    double cycle_ns(double seconds, bool trace) {
        Session& session = runtime_.session;
        std::string problem = trace ? session.traces().begin() : "";
        const auto probe = session.probes().attach({std::vector<std::string>{"t.time"}}, problem);
        if (!probe || !problem.empty()) throw std::runtime_error(problem);
        std::vector<double> samples;
        for (const Stopwatch watch; watch.ms() < seconds * 1000;) {
            std::this_thread::sleep_for(std::chrono::milliseconds(20));
            for (const TraceBatch::Part& part : session.traces().take().parts) events_ += part.events.size(), lost_ += part.lost;
            for (const ProbeRows& rows : session.probes().take(*probe))
                for (std::size_t at = 2 * 8; at < rows.bytes.size(); at += 3 * 8) {  // number of the cycle, time, value
                    std::int64_t value = 0;
                    std::memcpy(&value, rows.bytes.data() + at, sizeof value);
                    samples.push_back(static_cast<double>(value));
                }
        }
        if (trace) session.traces().end();
        session.probes().detach(probe);
        return median(samples);
    }
    std::uint64_t events() const { return events_; }
    std::uint64_t lost() const { return lost_; }

private:
    Runtime runtime_;
    std::uint64_t events_ = 0, lost_ = 0;
};

}  // namespace

void trace(const Options& options, Report& report) {
    report.section(fmt::format("Traces: a cycle of {} functions at 1 kHz", traced_functions));
    const double seconds = options.quick ? 1 : 5;
    TracedMachine machine(options);
    const double before = machine.cycle_ns(seconds, false), traced = machine.cycle_ns(seconds, true),
                 after = machine.cycle_ns(seconds, false);
    report.row({"the cycle, never traced", "ns", before});
    report.row({"the cycle, after a trace", "ns", after, "never traced", before, not_above()});
    report.row({"each event of a trace, in the cycle", "ns", (traced - before) / (traced_functions + 1)});
    report.row({fmt::format("events lost of {}", machine.events()), "", static_cast<double>(machine.lost()), "", {}, limit(0)});
}

}  // namespace hal::bench
