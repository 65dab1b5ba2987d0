// SPDX-License-Identifier: MIT
// How late a thread wakes: the runtime's hybrid wait and its plain sleep against cyclictest, at the
// same priority, on the same CPU, in turn.
#include <cstdlib>
#include <cstring>
#include <fmt/core.h>
#include <string_view>
#include <thread>

#include "bench.hpp"
#include "machine.hpp"
#include "process.hpp"
#include "runtime.hpp"
#include "sample.hpp"

namespace hal::bench {
namespace {

constexpr int histogram_ns = 300'000;  // later than that is as late as that

struct Lateness {
    double p50 = 0;
    double p99 = 0;  // us
};

Lateness ours(const Options& options, long period_ns, double seconds, const char* how) {
    Runtime runtime;
    runtime.apply(new_thread("t", period_ns, options.cpu, how));
    std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
    const ThreadReport report = runtime.session.reports().threads().front();
    return {report.wakeup_p50_ns / 1000, report.wakeup_p99_ns / 1000};
}

std::optional<Lateness> cyclictest(const Options& options, long period_ns, double seconds) {
    const auto loops = static_cast<long>(seconds * 1e9 / static_cast<double>(period_ns));
    const Finished finished =
        run({.arguments = {"cyclictest", "-q", "-m", "-N", "-t1", fmt::format("-a{}", options.cpu),
                           fmt::format("-p{}", priority), fmt::format("-i{}", period_ns / 1000),
                           fmt::format("-l{}", loops), fmt::format("-h{}", histogram_ns)},
             .everywhere = true});
    if (finished.status != 0) return std::nullopt;
    // "000123 000456": so many wake-ups were 123 ns late; beyond the last line: "# Histogram
    // Overflows: 00007"
    std::vector<std::pair<double, double>> histogram;
    double total = 0;
    for (const char* line = finished.out.c_str(); *line;) {
        const char* const end = std::strchr(line, '\n');
        static constexpr std::string_view overflow = "# Histogram Overflows:";
        double late = 0;
        double count = 0;
        if (*line >= '0' && *line <= '9') {
            char* next = nullptr;
            late = static_cast<double>(std::strtol(line, &next, 10));
            count = static_cast<double>(std::strtol(next, nullptr, 10));
        } else if (std::string_view(line).starts_with(overflow)) {
            late = histogram_ns;
            count = std::atof(line + overflow.size());
        }
        if (count > 0) {
            histogram.emplace_back(late, count);
        }
        total += count;
        if (!end) break;
        line = end + 1;
    }
    const auto at = [&](double share) {
        double seen = 0;
        for (const auto& [late, count] : histogram) {
            if ((seen += count) >= share * total) return late / 1000;
        }
        return histogram_ns / 1000.0;
    };
    return Lateness{at(0.5), at(0.99)};
}

}  // namespace

void wakeup(const Options& options, Report& report) {
    report.section("wake-up: how late, at the same priority on the same CPU");
    const bool has_peer = !find_program("cyclictest").empty();
    const bool has_load = !find_program("stress-ng").empty();
    const int rounds = options.quick ? 1 : 3;
    const double seconds = options.quick ? 0.6 : 1.0;
    for (const bool loaded : {false, true}) {
        std::unique_ptr<Child> stress;
        if (loaded && !has_load) {
            report.note("loaded: stress-ng is not installed (stress-ng)");
            break;
        }
        if (loaded) {
            stress = std::make_unique<Child>(
                Start{.arguments = {"stress-ng", "--cpu", "2", "--quiet"}, .everywhere = true});
        } else {
            wait_for_quiet(2.0);
        }
        for (const long period_ns : {1'000'000L, 100'000L}) {
            std::vector<double> hybrid50, hybrid99, sleep50, sleep99, peer50, peer99;
            for (int round = 0; round < rounds; ++round) {
                if (has_peer) {
                    if (const auto peer = cyclictest(options, period_ns, seconds)) {
                        peer50.push_back(peer->p50);
                        peer99.push_back(peer->p99);
                    }
                }
                const Lateness hybrid = ours(options, period_ns, seconds, "");

                const Lateness sleep = ours(options, period_ns, seconds, "spin=0");
                hybrid50.push_back(hybrid.p50);
                hybrid99.push_back(hybrid.p99);
                sleep50.push_back(sleep.p50);
                sleep99.push_back(sleep.p99);
            }
            const std::string name = fmt::format("{} kHz, {}", 1'000'000 / period_ns,
                                                 loaded ? "stress-ng --cpu 2" : "idle");
            const std::string peer =
                has_peer ? "cyclictest" : "cyclictest: not installed (rt-tests)";
            const auto of = [](std::vector<double>& v) {
                return v.empty() ? std::optional<double>() : median(v);
            };
            report.row({name + ", p50", "us", of(hybrid50), peer, of(peer50), times_less(10)});
            report.row({name + ", p99", "us", of(hybrid99), peer, of(peer99), not_above()});
            report.row({name + ", spin=0, p50", "us", of(sleep50), peer, of(peer50), not_above()});
            report.row({name + ", spin=0, p99", "us", of(sleep99), peer, of(peer99), not_above()});
        }
    }
    report.note(
        fmt::format("Medians of {} rounds of {} s, cyclictest, ours and ours with spin=0 in turn.",
                    rounds, seconds));
}

}  // namespace hal::bench
