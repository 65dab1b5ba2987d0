// SPDX-License-Identifier: MIT
// How large the program is, and how long a fresh clone takes to its first motion, to a complete
// build and to its second start.
#include <algorithm>
#include <filesystem>
#include <fmt/core.h>
#include <sys/resource.h>
#include <unistd.h>

#include "bench.hpp"
#include "machine.hpp"
#include "process.hpp"

namespace hal::bench {
namespace {

double stripped_mb(const std::string& program, const TemporaryFolder& folder) {
    const std::string copy = folder.path() + "/stripped";
    if (run({{"strip", "-o", copy, program}}).status != 0) return 0;
    return static_cast<double>(std::filesystem::file_size(copy)) / 1e6;
}

/// CPU time of all children that have ended.
double cpu_s() {
    rusage used{};
    getrusage(RUSAGE_CHILDREN, &used);
    const auto seconds = [](const timeval& time) {
        return static_cast<double>(time.tv_sec) + static_cast<double>(time.tv_usec) / 1e6;
    };
    return seconds(used.ru_utime) + seconds(used.ru_stime);
}

/// What the script `hal` takes in a clone of the sources, without a compiler cache. False when it
/// failed.
bool clone_to_motion(const TemporaryFolder& folder, Report& report) {
    const std::string tree = folder.path() + "/tree";
    const std::string script = tree + "/hal";
    const std::vector<std::string> no_cache{"CCACHE_DISABLE=1"};
    if (run({.arguments = {"git", "-c", "safe.directory=*", "clone", "-q", HALCYON_SOURCE, tree},
             .everywhere = true},
            120'000)
            .status != 0) {
        return false;
    }
    const auto start = [&](std::vector<std::string> words) {
        words.insert(words.begin(), script);
        return run({.arguments = words, .environment = no_cache, .everywhere = true}, 3'600'000);
    };
    const double before = cpu_s();
    const Finished first = start({"sim", tree + "/halfiles/furuta/hang.hal", "--for", "1ms"});
    const double used_first = cpu_s() - before;
    if (first.status != 0) return false;
    report.row({.what = "first command in a clone: hang.hal",
                .unit = "s",
                .ours = first.ms / 1000,
                .goal = limit(150)});
    report.row({.what = "  CPU time of it", .unit = "s", .ours = used_first});
    std::optional<double> second;
    for (int i = 0; i < 5; ++i) {
        if (const Finished done = start({"version"}); done.status == 0) {
            second = std::min(second.value_or(done.ms), done.ms);
        }
    }
    report.row(
        {.what = "second start, best of 5", .unit = "ms", .ours = second, .goal = limit(300)});
    const Finished rest = start({"build"});
    if (rest.status != 0) return false;
    report.row({.what = "complete build", .unit = "s", .ours = (first.ms + rest.ms) / 1000});
    report.row(
        {.what = "  CPU time of it", .unit = "s", .ours = cpu_s() - before, .goal = limit(480)});
    return true;
}

}  // namespace

void size(const Options& options, Report& report) {
    report.section("size: the program without optional parts");
    const std::string program = options.programs + "/hal";
    if (access(program.c_str(), X_OK) != 0) return report.note("the program hal is not built here");
    const TemporaryFolder folder;
    report.row({.what = "hal, stripped",
                .unit = "MB",
                .ours = stripped_mb(program, folder),
                .goal = limit(3)});
    if (!options.full) {
        report.note("A build from a fresh clone is measured with --full.");
    } else if (!clone_to_motion(folder, report)) {
        report.note("The clone could not be built: is git there, and are the sources committed?");
    }
}

}  // namespace hal::bench
