// SPDX-License-Identifier: MIT
// How large the program is, and what a fresh clone takes to its first motion, to a complete build
// and to a complete test, beside an earlier commit that is built in the same way.
#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fmt/core.h>
#include <fstream>
#include <sys/resource.h>
#include <thread>
#include <unistd.h>

#include "bench.hpp"
#include "machine.hpp"
#include "process.hpp"
#include "sample.hpp"

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

/// Space that a folder takes on disk. Sockets and files that vanish meanwhile do not count.
double disk_mb(const std::string& folder) {
    std::error_code ignored;
    double bytes = 0;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder, ignored)) {
        if (entry.is_regular_file(ignored) && !entry.is_symlink(ignored)) {
            bytes += static_cast<double>(entry.file_size(ignored));
        }
    }
    return bytes / 1e6;
}

/// Resident memory of a process, in MB; nothing when it has ended.
std::optional<double> resident_mb(pid_t process) {
    std::ifstream status(fmt::format("/proc/{}/status", process));
    for (std::string line; std::getline(status, line);) {
        if (line.starts_with("VmRSS:")) return std::strtod(line.c_str() + 6, nullptr) * 1024 / 1e6;
    }
    return std::nullopt;
}

/// The figures of one commit. What could not be measured is empty.
struct Figures {
    std::optional<double> motion_s, motion_cpu_s, motion_disk_mb;
    std::optional<double> memory_mb, program_mb, second_start_ms;
    std::optional<double> build_s, build_cpu_s, build_disk_mb;
    std::optional<double> test_s, test_cpu_s;
};

/// A clone of the committed sources, built by its own script `hal` without a compiler cache.
class Clone {
public:
    /// An empty commit: what the clone's HEAD names.
    Clone(const std::string& name, const std::string& commit) : tree_(folder_.path() + "/" + name) {
        std::vector<std::string> clone{"git", "-c", "safe.directory=*", "clone", "-q"};
        clone.insert(clone.end(), {HALCYON_SOURCE, tree_});
        present_ = run({.arguments = clone, .everywhere = true}, 120'000).status == 0;
        if (present_ && !commit.empty()) {
            present_ = run({{"git", "-C", tree_, "checkout", "-q", commit}}).status == 0;
        }
    }
    bool present() const { return present_; }

    Figures measure() {
        Figures figures;
        const double before = cpu_s();
        const std::string machine = tree_ + "/halfiles/furuta/hang.hal";
        const Finished first = start({"run", machine, "--for", "10s"});
        if (first.status != 0) return figures;
        figures.motion_s = first.ms / 1000;
        figures.motion_cpu_s = cpu_s() - before;
        figures.motion_disk_mb = disk_mb(tree_ + "/build");
        figures.program_mb = stripped_mb(program(), folder_);
        figures.memory_mb = memory_mb(machine);
        figures.second_start_ms = second_start_ms();

        const double before_build = cpu_s();
        const Finished build = start({"build"});
        if (build.status != 0) return figures;
        figures.build_s = (first.ms + build.ms) / 1000;
        figures.build_cpu_s = *figures.motion_cpu_s + cpu_s() - before_build;
        figures.build_disk_mb = disk_mb(tree_ + "/build");

        // A failed test does not spoil the time of the others.
        const double before_test = cpu_s();
        const Finished test = start({"test"});
        if (test.status < 0) return figures;
        figures.test_s = test.ms / 1000;
        figures.test_cpu_s = cpu_s() - before_test;
        return figures;
    }

private:
    std::string program() const { return tree_ + "/build/release/bin/hal"; }

    Finished start(std::vector<std::string> words) const {
        words.insert(words.begin(), tree_ + "/hal");
        const double max_ms = 24 * 3'600'000.0;
        return run({.arguments = words, .environment = {"CCACHE_DISABLE=1"}, .everywhere = true},
                   max_ms);
    }

    /// Of the pendulum that hangs, two seconds after it has begun to answer.
    std::optional<double> memory_mb(const std::string& machine) const {
        const std::string name = fmt::format("bench-size-{}", getpid());
        Child running({.arguments = {program(), "run", "--no-picture", "--name", name, machine},
                       .everywhere = true});
        const Start ask{{program(), "shell", "--name", name, "getp", "furuta.arm-angle"}};
        for (const Stopwatch watch; run(ask).status != 0;
             std::this_thread::sleep_for(std::chrono::milliseconds(50))) {
            if (watch.ms() > 10'000 || !running.alive()) return std::nullopt;
        }
        std::this_thread::sleep_for(std::chrono::seconds(2));
        return resident_mb(running.pid());
    }

    std::optional<double> second_start_ms() const {
        std::optional<double> best;
        for (int i = 0; i < 5; ++i) {
            if (const Finished done = start({"version"}); done.status == 0) {
                best = std::min(best.value_or(done.ms), done.ms);
            }
        }
        return best;
    }

    TemporaryFolder folder_;
    std::string tree_;
    bool present_ = false;
};

/// A clone of this commit, beside the commit that the targets compare with, built in the same way.
void builds(Report& report) {
    const std::string reference = "5c79bfe9";
    Clone present("tree", "");
    if (!present.present()) {
        return report.note("The sources cannot be cloned: is git there, and are they committed?");
    }
    Clone past("tree", reference);
    const Figures ours = present.measure();
    const Figures theirs = past.present() ? past.measure() : Figures{};
    const std::string peer = past.present() ? reference : reference + " is not in this clone";
    const auto row = [&](const char* what, const char* unit,
                         std::optional<double> Figures::* figure, Goal goal) {
        report.row({what, unit, ours.*figure, peer, theirs.*figure, goal});
    };
    row("clone to first motion (hang.hal for 10 s)", "s", &Figures::motion_s, {});
    row("  CPU time of it", "s", &Figures::motion_cpu_s, limit(150));
    row("  disk space of the build", "MB", &Figures::motion_disk_mb, {});
    row("the program hal, stripped", "MB", &Figures::program_mb, limit(3));
    row("memory of the running pendulum", "MB", &Figures::memory_mb, at_most(0.7));
    row("second start, best of 5", "ms", &Figures::second_start_ms, limit(300));
    row("complete build", "s", &Figures::build_s, {});
    row("  CPU time of it", "s", &Figures::build_cpu_s, limit(480));
    row("  disk space of the build", "MB", &Figures::build_disk_mb, {});
    row("complete test", "s", &Figures::test_s, {});
    row("  CPU time of it", "s", &Figures::test_cpu_s, {});
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
        report.note("Builds and tests of fresh clones are measured with --full: it takes hours.");
    } else {
        builds(report);
    }
}

}  // namespace hal::bench
