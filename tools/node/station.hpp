// SPDX-License-Identifier: MIT
// A device as a TDMA station of its own: its clock, its place in the schedule, its real-time loop.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "fieldbus/tdma/config.hpp"
#include "fieldbus/tdma/rtcfg_applicant.hpp"
#include "fieldbus/tdma/station.hpp"
#include "fieldbus/tdma/tap.hpp"
#include "hal/discipline.hpp"
#include "node/node_options.hpp"
#include "node/skewed_port.hpp"

namespace hal::tools {

class TdmaStation {
public:
    ~TdmaStation();
    /// The station that the options and the schedule name, on the interface of the link; offers its slots to `cane:` links. What is wrong,
    /// or nothing. `link` gets the slot behind it when it names none. With `--tdma auto` the master sends the station's block: it waits for
    /// that, and asks `ended`, which takes some milliseconds, whether it is to give up. [setup]
    static std::string make(const NodeOptions&, std::string& link, const std::function<bool()>& ended, std::unique_ptr<TdmaStation>& made);

    /// Turns until `turn` says false: once a cycle, a little before the slot, with the time on the station's clock. `false` also ends it.
    void run(const std::function<bool(std::int64_t local_ns, bool synchronous)>& turn);
    std::string summary() const;  ///< a line on what became of the cycles

private:
    TdmaStation(const tdma::StationSetup&, std::string segment, std::unique_ptr<ethernet::Port>, double skew, double drift);
    std::string take_schedule(const NodeOptions&, const std::function<bool()>& ended);  ///< what is wrong, or nothing
    std::string open_tunnel(const NodeOptions&, const tdma::config::StationEntry&);  ///< what is wrong, or nothing
    std::int64_t sleep_until(std::int64_t local_ns) const noexcept;  ///< what time it is then

    const SkewedClock clock_;
    const std::string segment_;
    SkewedPort port_;
    tdma::Station station_;
    std::unique_ptr<tdma::rtcfg::Applicant> applicant_;  // of a station that has its schedule from the master
    std::unique_ptr<tdma::Tunnel> tunnel_;  // before tap_, which uses it
    std::unique_ptr<tdma::Tap> tap_;
    hal::Discipline beat_;
    bool had_beat_ = false;
    std::uint64_t cycles_ = 0, missed_ = 0;
};

}  // namespace hal::tools
