// SPDX-License-Identifier: MIT
// The peer: an installed LinuxCNC (Debian: linuxcnc-uspace), driven by its own programs. One at a
// time.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "bench.hpp"
#include "process.hpp"

namespace hal::bench {

class LinuxCnc {
public:
    /// Empty when it can be measured here, else why not.
    static const std::string& absent();
    /// "LinuxCNC 2.9"
    static const std::string& name();

    /// Starts its real-time side with threads on the last CPU: `name1=t period1=1000000`. nullptr:
    /// it did not come up.
    static std::unique_ptr<LinuxCnc> start(const std::string& threads);
    ~LinuxCnc();  ///< unloads all and takes its shared memory away

    /// `halcmd -f` of that text.
    Finished file(const std::string& text);
    /// `halcmd WORD…`
    Finished command(const std::vector<std::string>& words);
    /// How to start one of its programs.
    Start program(std::vector<std::string> words) const;
    /// Reads a pin again and again, `every_us` apart.
    std::vector<double> sample(const std::string& pin, std::size_t count, int every_us);
    /// What one unit of a `.time` pin is, ns: cycles of the time-stamp counter until 2.9, then ns.
    static double ns_per_time_unit();

private:
    LinuxCnc() = default;
    TemporaryFolder home_;
    std::unique_ptr<Child> master_;
};

}  // namespace hal::bench
