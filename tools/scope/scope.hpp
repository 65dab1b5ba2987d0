// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>

#include "cli/option_set.hpp"

namespace hal::tools {

struct ScopeOptions : Options {
    std::string name;  ///< of the instance; empty: not given
    std::string trigger, mode, svg, csv, png;
    std::int64_t pre_ns = 20'000'000;
    std::int64_t post_ns = 80'000'000;
    std::int64_t timeout_ns = 10'000'000'000;
    int every = 1;

    void declare(OptionSet& set) override {
        set.words("NAME", "pins, signals or parameters: the channels");
        set.value("--trigger", trigger, "TRIGGER",
                  "'x-error > 0.1', 'x-error < 0', 'x-error <> 0' (either edge), '|x-error| > "
                  "0.1', 'level x > 1', 'estop', '!estop'");
        set.duration("--pre", pre_ns, "time before the trigger (default 20 ms)");
        set.duration("--post", post_ns, "time after the trigger (default 80 ms)", 1000);
        set.value("--every", every, "N", "sample each N-th cycle").in(1, 1000000);
        set.value("--svg", svg, "FILE", "write the first record as a picture, and exit");
        set.value("--csv", csv, "FILE",
                  "write the first record as a table, and exit (\"-\": standard output)");
        set.value("--png", png, "FILE",
                  "write the first record as a picture with rsvg-convert, and exit");
        set.duration("--timeout", timeout_ns,
                     "with a file: the longest wait for the trigger (default 10 s)", 1'000'000,
                     "10s or 500ms");
        set.value("--mode", mode, "MODE",
                  "in the terminal: auto (default), normal, single or roll (20 s, unless --pre or "
                  "--post is given)");
        set.value("--name", name, "NAME", "instance");
    }
};

/// Runs `hal scope`. Returns the exit code.
int run_scope(const ScopeOptions&);

}  // namespace hal::tools
