// SPDX-License-Identifier: MIT
// `hal record FILE NAMES…`.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "cli/option_set.hpp"

namespace hal::tools {

/// What is recorded, and how long.
struct Recording {
    std::string file;
    std::vector<std::string> names, groups;
    bool all = false;
    std::uint32_t every = 1;
    std::int64_t for_ns = -1;
    std::int64_t rotate_ns = -1;  ///< -1: not given
    double max_mb = 0;                        ///< 0: no limit
    unsigned keep = 0;                         ///< files of a rotation, or of triggers; 0: all
    std::int64_t last_ns = -1;                 ///< flight recorder: how much it keeps
    std::int64_t after_ns = -1;                ///< -1: not given
    std::string trigger;
    std::string profile;                       ///< of an .mcap: "ros2", or ""

    void declare(OptionSet& set) {
        set.flag("-a,--all", all,
                 "record all signals, and all pins and parameters without a signal");
        set.values(
            "--group", groups, "NAME",
            "record the signals and pins of a component, an instance, a thread or a netlist file");
        set.value("--every", every, "N", "record each N-th cycle of each thread (default 1)")
            .in(1, 1'000'000);
        set.duration("--for", for_ns, "end after this time of the machine", 1);
        set.value("--limit", max_mb, "MB", "end when the file has this size").not_negative();
        set.duration("--rotate", rotate_ns,
                     "start another file, FILE-001, FILE-002 …, after each such time", 1'000'000,
                     "10min, 1h or 30s");
        set.value("--keep", keep, "N",
                  "keep only the newest N files of --rotate, or the first and the newest of --last")
            .in(0, 1'000'000);
        set.duration("--last", last_ns,
                     "flight recorder: keep the last TIME in memory, write it on a fault, a "
                     "trigger, or the end of the machine",
                     1'000'000, "60s, 10s or 5min");
        set.value("--trigger", trigger, "NAME",
                  "with --last: also write when this pin or signal becomes TRUE or non-zero");
        set.value("--profile", profile, "PROFILE",
                  "ros2: write an .mcap of ROS 2 messages only, for rosbags and ros2 bag");
        set.duration("--after", after_ns,
                     "with --last: what to record after the event (default 5s)");
    }
    bool operator==(const Recording&) const = default;
    /// Returns whether an option was given: then the words are FILE NAMES.
    bool asked() const {
        Recording without_names = *this;
        without_names.file.clear();
        without_names.names.clear();
        return without_names != Recording();
    }
};

/// Records until the end that was asked for, Ctrl-C, or the end of the machine. Returns the exit
/// code.
int record_values(const Options& options, const std::string& instance, Recording what);

}  // namespace hal::tools
