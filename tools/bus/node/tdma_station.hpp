// SPDX-License-Identifier: MIT
// A device as a TDMA station of its own: its clock, its place in the schedule, its real-time loop.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "bus/node/node_options.hpp"
#include "bus/node/skewed_port.hpp"
#include "fieldbus/tdma/config/event_words.hpp"
#include "fieldbus/tdma/config/schedule.hpp"
#include "fieldbus/tdma/rtcfg/rtcfg_applicant.hpp"
#include "fieldbus/tdma/station/station.hpp"
#include "fieldbus/tdma/tunnel/tap.hpp"
#include "hal/discipline.hpp"
#include "hal/queue.hpp"

namespace hal::tools {

class TdmaStation : private tdma::Events {
public:
    ~TdmaStation() override;
    /// The station that the options and the schedule name, on the interface of the link; offers its slots to `cane:` links. What is wrong,
    /// or nothing. `link` gets the slot behind it when it names none. With `--tdma auto` the master sends the station's block: it waits for
    /// that, and asks `ended`, which takes some milliseconds, whether it is to give up. [setup]
    static std::string make(const NodeOptions&, std::string& link, const std::function<bool()>& ended, std::unique_ptr<TdmaStation>& made);

    /// Turns until `turn` says false: once a cycle, a little before the slot, with the time on the station's clock. What happens on the segment
    /// is said on standard error.
    void run(const std::function<bool(std::int64_t local_ns, bool synchronous)>& turn);
    std::string summary() const;  ///< a line on what became of the cycles

private:
    TdmaStation(const tdma::StationSetup&, tdma::config::Schedule, std::string segment, std::unique_ptr<ethernet::Port>, double skew,
                double drift);
    std::string take_schedule(const NodeOptions&, const std::function<bool()>& ended);  ///< what is wrong, or nothing
    std::string open_tunnel(const NodeOptions&, const tdma::config::StationEntry&);  ///< what is wrong, or nothing
    std::int64_t sleep_until(std::int64_t local_ns) const noexcept;  ///< what time it is then
    void take_over() noexcept;  ///< another schedule than the first. [realtime]
    void look() noexcept;       ///< beside the loop: what is to be read, and to be said
    void on_event(tdma::Event event, const tdma::Address& who, tdma::Time value) noexcept override { told_.push({event, who, value}); }

    const tdma::config::Schedule schedule_;  // empty of a station that has its own from the master
    const tdma::EventWords words_{schedule_, "start this node again"};
    hal::Queue<tdma::Happened> told_{64};  // by the loop
    hal::MessageLog log_{"hal node"};
    std::optional<unsigned> slot_;  // that its frames leave in, when nobody named one
    std::atomic<bool> lacks_slot_{false};
    const SkewedClock clock_;
    const std::string segment_;
    SkewedPort port_;
    tdma::Station station_;
    SkewedDiscipline discipline_{station_, clock_};
    std::unique_ptr<tdma::rtcfg::Applicant> applicant_;  // of a station that has its schedule from the master
    std::unique_ptr<tdma::Tunnel> tunnel_;  // before tap_, which uses it
    std::unique_ptr<tdma::Tap> tap_;
    hal::Discipline beat_;
    bool had_beat_ = false;
    std::uint64_t cycles_ = 0, missed_ = 0;
};

}  // namespace hal::tools
