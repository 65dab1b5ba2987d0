// SPDX-License-Identifier: MIT
// A device as a TDMA station: its clock, its entry in the schedule, its real-time loop.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "bus/node/node_station.hpp"
#include "bus/tdma/skewed_port.hpp"
#include "fieldbus/tdma/config/event_texts.hpp"
#include "fieldbus/tdma/config/schedule.hpp"
#include "fieldbus/tdma/rtcfg/rtcfg_applicant.hpp"
#include "fieldbus/tdma/station/station.hpp"
#include "fieldbus/tdma/tunnel/tap.hpp"
#include "hal/discipline.hpp"
#include "hal/queue.hpp"

namespace hal::tools {

class TdmaStation final : public NodeStation, private tdma::Events {
public:
    ~TdmaStation() override;
    /// The same as make_tdma_station(). [setup]
    static std::string make(const NodeOptions&, std::string& link, const hal::LinePrefix& prefix,
                            const std::function<bool()>& ended, std::unique_ptr<TdmaStation>& made);

    void run(const std::function<bool(std::int64_t local_ns, bool synchronous)>& turn) override;
    std::string summary() const override;

private:
    /// What the options ask for.
    struct Request {
        double skew = 0.0;   ///< of the clock
        double drift = 0.0;  ///< change of the skew per second
        bool by_rtcfg = false;  ///< the master sends the schedule
        tdma::config::Schedule schedule;  ///< empty by RTcfg

        /// Reads options and schedule. Returns what is wrong with them, empty: nothing.
        std::string read(const NodeOptions&);
    };
    /// Finds this station in the schedule and sets `index`. Returns the problem, or an empty text on
    /// success.
    static std::string find_entry(const NodeOptions&, const Request&, const ethernet::Port&,
                                  const std::string& segment, std::size_t& index);

    TdmaStation(const tdma::StationSetup&, tdma::config::Schedule, std::string segment,
                std::unique_ptr<ethernet::Port>, double skew, double drift, hal::LinePrefix prefix);
    /// Returns the problem, or "".
    std::string receive_schedule(const NodeOptions&, const std::function<bool()>& ended);
    /// Returns the problem, or "".
    std::string open_tunnel(const NodeOptions&, const tdma::config::StationEntry&);
    std::int64_t sleep_until(std::int64_t local_ns) const noexcept;  ///< Returns the time after it.
    void take_over() noexcept;  ///< Switches to a new schedule. [realtime]
    void look() noexcept;  ///< Reads files and prints messages, outside the loop.
    void on_event(tdma::Event event, const tdma::Address& who, tdma::Time value) noexcept override {
        reported_.push({event, who, value});
    }

    const tdma::config::Schedule schedule_;  // empty if received from the master
    const tdma::EventTexts texts_{schedule_, "start this node again"};
    hal::Queue<tdma::EventRecord> reported_{64};  // filled by the loop
    const hal::LinePrefix prefix_;
    hal::MessageLog log_{prefix_};
    std::optional<unsigned> slot_;  // slot of its frames, if chosen by the station
    std::atomic<bool> lacks_slot_{false};
    const SkewedClock clock_;
    const std::string segment_;
    SkewedPort port_;
    tdma::Station station_;
    SkewedDiscipline discipline_{station_, clock_};
    // if the schedule is received from the master
    std::unique_ptr<tdma::rtcfg::Applicant> applicant_;
    std::unique_ptr<tdma::Tunnel> tunnel_;  // before tap_, which uses it
    std::unique_ptr<tdma::Tap> tap_;
    hal::Discipline beat_;
    bool had_beat_ = false;
    std::uint64_t cycles_ = 0;
    std::uint64_t missed_ = 0;
};

}  // namespace hal::tools
