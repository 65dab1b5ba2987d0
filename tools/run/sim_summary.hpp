// SPDX-License-Identifier: MIT
// The summary of `hal sim`, for one machine and for several.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "commands/shell.hpp"
#include "machine/session.hpp"
#include "run/sim.hpp"

namespace hal::tools {

/// The process's own output, noting whether anything was written to stdout.
class TrackedOutput final : public Output {
public:
    void out(std::string_view text) override {
        printed = printed || !text.empty();
        process_.out(text);
    }
    void err(std::string_view text) override { process_.err(text); }
    bool is_process() const override { return true; }
    bool printed = false;

private:
    ProcessOutput process_;
};

/// Returns the names of lists that are separated by commas.
std::vector<std::string> names_in(const std::vector<std::string>& lists);

/// Prints what --show names. Returns the exit status. Takes the session's lock.
int show_values(const SimOptions& options, Session& session);

/// "simulated 2 s in 12 ms, 163 times as fast as real time"
std::string simulated_for(std::int64_t virtual_ns, std::chrono::steady_clock::duration wall);

/// Prints the summary in a terminal, and where nothing else was printed, unless --quiet.
bool summary_wanted(const SimOptions& options, bool printed);

}  // namespace hal::tools
