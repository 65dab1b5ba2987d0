// SPDX-License-Identifier: MIT
#include "bus/tdma/node_station.hpp"

#include <sched.h>
#include <sys/mman.h>

#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <fmt/core.h>
#include <thread>

#include "bus/timeline/plan_output.hpp"
#include "link/system.hpp"

namespace hal::tools {

namespace {

constexpr int priority = 70;
constexpr tdma::Time spin_ns = 200'000;  // a frame due so soon after the thread needs no pacer

/// Returns true when a station that may be this one has a slot further after its thread.
bool has_far_slot(const tdma::config::Schedule& schedule, const std::string& station) {
    const auto which = tdma::config::find(schedule, station);
    for (std::size_t n = 0; n < schedule.stations.size(); ++n) {
        const auto& s = schedule.stations[n];
        if (which && n != *which) continue;
        for (const auto& slot : s.slots) {
            if ((slot.setup.offset - s.phase - s.lead + schedule.cycle) % schedule.cycle >
                spin_ns * 9 / 10) {
                return true;
            }
        }
    }
    return false;
}

/// Parses "200ppm", "-35.5ppm"; nullopt when invalid.
std::optional<double> parts_per_million(std::string_view text) {
    double value = 0;
    const auto [end, wrong] = std::from_chars(text.data(), text.data() + text.size(), value);
    const std::string_view unit(end, static_cast<std::size_t>(text.data() + text.size() - end));
    if (wrong != std::errc{} || unit != "ppm" || !(std::abs(value) <= 500.0)) return std::nullopt;
    return value * 1e-6;
}

}  // namespace

std::string TdmaStation::Request::read(const NodeOptions& options) {
    const auto given_skew = parts_per_million(options.skew.empty() ? "0ppm" : options.skew);
    const auto given_drift = parts_per_million(options.drift.empty() ? "0ppm" : options.drift);
    if (!given_skew) {
        return fmt::format("invalid --skew '{}'; write --skew 200ppm, at most 500ppm",
                           options.skew);
    }
    if (!given_drift) {
        return fmt::format(
            "invalid --drift '{}'; write --drift 0.1ppm, the change of the skew per second",
            options.drift);
    }
    skew = *given_skew;
    drift = *given_drift;
    by_rtcfg = options.tdma == "auto";
    if (by_rtcfg) return "";
    std::string text;
    if (!tdma::config::read_from_disk(options.tdma, text)) {
        return fmt::format("cannot read '{}': {}", options.tdma, text);
    }
    tdma::config::ReadResult reading = tdma::config::read(text);
    const auto code = [](const tdma::config::Message& m) {
        return Code::named(tdma::config::code_of(m.topic)).value_or(Code("tdma-line"));
    };
    if (!print_findings(options.tdma, text, reading.messages, code)) {
        return fmt::format("invalid schedule '{}'; see the errors above", options.tdma);
    }
    schedule = std::move(reading.schedule);
    return "";
}

std::string TdmaStation::find_entry(const NodeOptions& options, const Request& request,
                                    const ethernet::Port& port, const std::string& segment,
                                    std::size_t& index) {
    const std::string who =
        options.station.empty() ? ethernet::to_string(port.address()) : options.station;
    const auto which = tdma::config::find(request.schedule, who);
    if (!which) {
        return fmt::format("{} has no station '{}'; write --station with one of: {}", options.tdma,
                           who, tdma::config::names(request.schedule));
    }
    const tdma::config::StationEntry& entry = request.schedule.stations[*which];
    if (entry.mac && *entry.mac != port.address()) {
        return fmt::format(
            "{} has the address {}, but {} gives {} {}; correct the line 'mac' of its block",
            segment, ethernet::to_string(port.address()), options.tdma, entry.name,
            ethernet::to_string(*entry.mac));
    }
    if (entry.slots.empty()) {
        return fmt::format("station '{}' of {} has no slot to send in; add one: slot 0 300",
                           entry.name, options.tdma);
    }
    index = *which;
    return "";
}

std::string TdmaStation::make(const NodeOptions& options, std::string& link,
                              const hal::LinePrefix& prefix, const std::function<bool()>& ended,
                              std::unique_ptr<TdmaStation>& made) {
    const std::string segment = can::describe(link).segment;
    if (segment.empty()) {
        return "--tdma needs an Ethernet link; write --link cane:eth0, or remove --tdma";
    }
    Request request;
    if (std::string problem = request.read(options); !problem.empty()) return problem;

    ethernet::Options how;
    how.types = {tdma::Station::types.begin(), tdma::Station::types.end()};
    how.spin_ns = spin_ns;
    how.pacer = request.by_rtcfg || !options.tunnel.empty() ||
                has_far_slot(request.schedule, options.station);
    auto opened = ethernet::open(segment, how);
    if (!opened) return opened.problem;
    if (opened.port->description().simulated) {
        return segment +
               " is a segment in memory of this process only; write an interface, as in cane:eth0";
    }
    const tdma::config::StationEntry* entry = nullptr;
    if (request.by_rtcfg) {
        tdma::StationSetup unknown;
        unknown.configured = false;
        unknown.slot_capacity = tdma::max_slots;
        made.reset(new TdmaStation(unknown, {}, segment, std::move(opened.port), request.skew,
                                   request.drift, prefix));
        if (std::string problem = made->receive_schedule(options, ended); !problem.empty()) {
            return problem;
        }
        entry = &made->applicant_->accepted()->schedule.stations.front();
    } else {
        std::size_t index = 0;
        if (std::string problem = find_entry(options, request, *opened.port, segment, index);
            !problem.empty()) {
            return problem;
        }
        entry = &request.schedule.stations[index];
        made.reset(new TdmaStation(tdma::config::setup_of(request.schedule, index),
                                   request.schedule, segment, std::move(opened.port), request.skew,
                                   request.drift, prefix));
    }
    if (link.find("slot=") == std::string::npos) {
        made->slot_ = entry->slots.front().setup.id;
        const bool has_options = link.find('?') != std::string::npos;
        link += has_options ? '&' : '?';
        link += fmt::format("slot={}", *made->slot_);
    }
    if (!ethernet::offer_discipline(made->port_, &made->discipline_)) {
        return segment + " already has a TDMA station";
    }
    return options.tunnel.empty() ? std::string{} : made->open_tunnel(options, *entry);
}

std::string TdmaStation::receive_schedule(const NodeOptions& options,
                                          const std::function<bool()>& ended) {
    tdma::rtcfg::Logical own;
    if (!options.station.empty()) {
        const auto ip = tdma::config::parse_ip(options.station);
        if (!ip) {
            return "invalid --station; with --tdma auto it is the station's IP address, as in "
                   "10.0.0.3; without it the MAC address is used";
        }
        own = {true, *ip};
    }
    applicant_ = std::make_unique<tdma::rtcfg::Applicant>(prefix_, station_, own, "",
                                                          static_cast<tdma::Events&>(*this));
    station_.accompany(&applicant_->client(), nullptr);
    const std::string who =
        own.by_ip ? "ip " + options.station : "mac " + ethernet::to_string(station_.address());
    fmt::print(stderr,
               "hal node: waiting for the master of {} to send the schedule (RTcfg); the master's "
               "file must have a block with '{}'\n",
               segment_, who);
    while (applicant_->accepted() == nullptr) {
        if (ended()) {
            return fmt::format("no master on {} sent a schedule for '{}'", segment_, who);
        }
        station_.receive(clock_.local(link::monotonic_ns()));
        look();
        applicant_->cycle();
    }
    return {};
}

std::string TdmaStation::open_tunnel(const NodeOptions& options,
                                     const tdma::config::StationEntry& entry) {
    tunnel_ = std::make_unique<tdma::Tunnel>(station_);
    if (tunnel_->mtu() == 0) {
        return fmt::format(
            "--tunnel {}: ordinary packets need slot 1, and {} has none; add slot 1 OFFSET to its "
            "block of {}",
            options.tunnel, entry.name, options.tdma);
    }
    auto opened = tdma::open_tap(*tunnel_, {options.tunnel, station_.address(), entry.ip}, prefix_);
    if (!opened.tap) return "--tunnel: " + opened.problem;
    tap_ = std::move(opened.tap);
    station_.accompany(applicant_ ? &applicant_->client() : nullptr, tunnel_.get());
    return {};
}

TdmaStation::TdmaStation(const tdma::StationSetup& setup, tdma::config::Schedule schedule,
                         std::string segment, std::unique_ptr<ethernet::Port> port, double skew,
                         double drift, hal::LinePrefix prefix)
    : schedule_(std::move(schedule)),
      prefix_(std::move(prefix)),
      clock_(link::monotonic_ns(), skew, drift),
      segment_(std::move(segment)),
      port_(std::move(port), clock_),
      station_(setup, this) {
    station_.attach(port_);
}

TdmaStation::~TdmaStation() { ethernet::withdraw_discipline(&discipline_); }

/// Does not spin before its wake-up as the runtime's threads do: only the departure of the frame
/// must be exact, and for that the port waits. Six nodes that spin for 40 us each would take a
/// quarter of a CPU.
std::int64_t TdmaStation::sleep_until(std::int64_t local_ns) const noexcept {
    const auto due = clock_.from_local(local_ns);
    const timespec at = link::to_timespec(due);
    while (link::monotonic_ns() < due) {
        clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &at, nullptr);
    }
    return clock_.local(link::monotonic_ns());
}

void TdmaStation::take_over() noexcept {
    const tdma::rtcfg::Accepted& accepted = *applicant_->accepted();
    if (tap_) {
        tap_->scheduled(accepted.schedule.stations.front().ip, tdma::tunnel_mtu(accepted.setup));
    }
    if (slot_ && station_.capacity(*slot_) == 0) {
        lacks_slot_ = true;
    }
}

void TdmaStation::look() noexcept {
    const std::int64_t now = link::monotonic_ns();
    if (applicant_) {
        applicant_->work(now);
    }
    for (tdma::EventRecord h; reported_.pop(h);) {
        if (const std::string sentence = texts_.line(h); !sentence.empty()) {
            log_.print(tdma::subject(h), sentence, now);
        }
    }
    if (lacks_slot_.exchange(false)) {
        log_.print("the new schedule has no slot " + std::to_string(*slot_) +
                       " for this station, which sends in it; add one, or restart this node",
                   now);
    }
    log_.flush(now);
}

void TdmaStation::run(const std::function<bool(std::int64_t, bool)>& turn) {
    std::jthread beside([this](const std::stop_token& ended) {
        while (!ended.stop_requested()) {
            look();
            std::this_thread::sleep_for(std::chrono::milliseconds(20));
        }
        look();
    });
    mlockall(MCL_CURRENT | MCL_FUTURE);
    const sched_param real_time{priority};
    sched_setscheduler(0, SCHED_FIFO, &real_time);  // without permission it runs with more jitter
    auto due = clock_.local(link::monotonic_ns()) + station_.setup().cycle;
    for (bool goes_on = true; goes_on; ++cycles_) {
        if (applicant_ && applicant_->cycle()) {
            take_over();
        }
        const auto cycle = station_.setup().cycle;
        const auto now = sleep_until(due);
        for (; due < now - cycle / 2; due += cycle) {
            ++missed_;
        }
        station_.receive(due);
        goes_on = turn(due, station_.status().synchronous);
        station_.transmit(due);
        due += cycle;
        // From the first sync on: being in phase is part of synchronising.
        const bool beat = station_.status().state != tdma::State::listening;
        if (beat) {
            due += beat_.follow(station_.error(), cycle);
        } else if (had_beat_) {
            beat_.lose();
        }
        had_beat_ = beat;
    }
}

std::string TdmaStation::summary() const {
    const auto& s = station_.status();
    const ethernet::Statistics port = port_.statistics();
    return fmt::format(
        "TDMA: {}, {} cycles, {} missed; syncs {} received, {} lost; frames {} sent, {} late, {} "
        "dropped; clock {:+.1f} ppm, "
        "{} ns to the master, sync jitter {:.0f} ns\n",
        tdma::to_string(s.state), cycles_, missed_, s.count.syncs, s.count.syncs_lost, s.count.sent,
        port.late, station_.dropped(port), s.drift * 1e6, s.delay, s.jitter);
}

std::string make_tdma_station(const NodeOptions& options, std::string& link,
                              const hal::LinePrefix& prefix, const std::function<bool()>& ended,
                              std::unique_ptr<NodeStation>& made) {
    std::unique_ptr<TdmaStation> station;
    std::string problem = TdmaStation::make(options, link, prefix, ended, station);
    made = std::move(station);
    return problem;
}

}  // namespace hal::tools
