// SPDX-License-Identifier: MIT
// How large the program is, and how long its core takes to build from nothing.
#include <filesystem>
#include <fmt/core.h>
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

/// Configures and builds the program in a folder of its own, without a compiler cache. Seconds, or nothing when it failed.
std::optional<double> cold_build_s(const TemporaryFolder& folder) {
    const std::string build = folder.path() + "/build";
    const std::vector<std::string> no_cache{"CCACHE_DISABLE=1"};
    const Finished configured = run({.arguments = {"cmake", "-S", HALCYON_SOURCE, "-B", build, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release", "-DHALCYON_TESTS=OFF"},
                                     .environment = no_cache, .everywhere = true}, 120'000);
    if (configured.status != 0) return std::nullopt;
    const Finished built = run({.arguments = {"ninja", "-C", build, "-j2", "hal"}, .environment = no_cache, .everywhere = true}, 1'800'000);
    return built.status == 0 ? std::optional((configured.ms + built.ms) / 1000) : std::nullopt;
}

}  // namespace

void size(const Options& options, Report& report) {
    report.section("size: the program without optional parts");
    const std::string program = options.programs + "/hal";
    if (access(program.c_str(), X_OK) != 0) return report.note("the program hal is not built here");
    const TemporaryFolder folder;
    report.row({.what = "hal, stripped", .unit = "MB", .ours = stripped_mb(program, folder), .goal = limit(3)});
    if (options.full) report.row({.what = "configure and build it from cold, 2 jobs", .unit = "s", .ours = cold_build_s(folder), .goal = limit(90)});
    else report.note("A build from cold is measured with --full.");
}

}  // namespace hal::bench
