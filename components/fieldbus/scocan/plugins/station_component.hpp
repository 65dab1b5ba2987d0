// SPDX-License-Identifier: MIT
// What all SCoCAN components are: a station on a link, with pins, events and faults.
#pragma once

#include <array>
#include <deque>
#include <limits>
#include <memory>
#include <optional>

#include "bus/component/bit_rate.hpp"
#include "bus/component/bus_component.hpp"
#include "event_texts.hpp"
#include "hal/reporter.hpp"
#include "message_pins.hpp"
#include "slot_links.hpp"
#include "station_pins.hpp"
#include "table_arguments.hpp"

namespace hal::scocan {

class StationComponent : public hal::bus::BusComponent, protected Events {
public:
    StationComponent(const hal_host* host, const char* fallback_name,
                     std::initializer_list<Role> roles)
        : BusComponent(host, fallback_name) {
        arguments_.load(roles);
        if (!arguments_.loaded) return;
        const Table& t = arguments_.table;
        texts_.emplace(t, arguments_.own, "setp " + name_ + ".reset TRUE");
        station_ = std::make_unique<Station>(t, arguments_.own, arguments_.options(),
                                             static_cast<Events&>(*this));
        reporter_ = std::make_unique<hal::Reporter<EventRecord>>(
            name_, [this](const EventRecord& h) { return texts_->line(h); }, 256,
            &EventTexts::subject);
        for (const Message& m : t.messages) {
            const bool is_own = m.node == arguments_.own;
            if (is_own && t.nodes[m.node].role != Role::bridge) {
                sent_.emplace_back(*this, transmit_, receive_,
                                   m);  // a bridge sends the participant's
            } else if (!is_own && arguments_.wants(m)) {
                by_id_[m.id] = &received_.emplace_back(*this, receive_, m);
            }
        }
    }

    /// Opens the link, offers the slots to other components, and claims the clock of the threads.
    /// Throws the reason when one of them fails; then nothing is kept. [setup]
    void start() {
        if (!arguments_.loaded) {
            throw std::runtime_error(
                "missing table: write link=sim:NAME config=FILE.scocan node=NAME");
        }
        std::unique_ptr<can::Link> link = open_link();
        if (!links_.offer(arguments_.node.get(), link->description())) {
            throw std::runtime_error("node " + arguments_.node.get() +
                                     " is in this process already; load each node once");
        }
        claim_clock();
        link_ = std::move(link);
        station_->attach(*link_);
        begin_cycles();
        followed_ = 0;
        raised_.fill(std::numeric_limits<Time>::min());
        for (auto& m : sent_) {
            m.begin();
        }
        for (auto& m : received_) {
            m.begin();
        }
        reporter_->start();
    }

    void stop() noexcept {
        links_.withdraw();
        if (station_) {
            station_->detach();
        }
        if (reporter_) {
            reporter_->stop();
        }
        link_.reset();
    }

    void receive(hal::Cycle cycle) noexcept {
        if (!link_) return;
        now_ = cycle.start_ns();
        if (pins_.reset && !was_reset_) {
            station_->reset();
            recover();
        }
        was_reset_ = pins_.reset;
        const hal::bus::Turn turn = receive_turn(cycle);
        if (turn == hal::bus::Turn::leaves || begins_anew(turn)) {
            restart();  // it listens before it sends
        }
        if (turn == hal::bus::Turn::leaves || turn == hal::bus::Turn::returns) {
            pins_.fault = is_offline(turn) || fault_.lasts();
        }
        if (is_offline(turn)) {
            links_.set_state(can::State::down);
            links_.publish();
            for (auto& m : received_) {
                m.show(now_);
            }
            pins_.show(*station_);
            received();
            return;
        }
        station_->receive(now_);
        links_.set_state(station_->state() == State::running ? can::State::active
                                                             : can::State::down);
        links_.publish();
        for (auto& m : received_) {
            m.show(now_);
        }
        if (arguments_.follow != 0) {
            follow(cycle.period_ns());
        }
        pins_.show(*station_);
        received();
    }

    void transmit(hal::Cycle cycle) noexcept {
        if (!link_) return;
        if (!functions_.transmit(cycle)) {
            if (functions_.receive_is_missing()) {
                interrupt();
                links_.set_state(can::State::down);
                links_.publish();
            }
            return;
        }
        now_ = cycle.start_ns();
        for (auto& m : sent_) {
            m.transmit(*station_, now_);
        }
        links_.forward(*station_);
        before_slots(cycle.period_ns());
        station_->transmit(now_, cycle.period_ns());
    }

    void make_safe(hal::Cycle) noexcept { interrupt(); }

protected:
    virtual void received() noexcept {}  ///< behind receive(). [realtime]
    /// Before the slots are planned; `period_ns` of the thread. [realtime]
    virtual void before_slots(Time /*period_ns*/) noexcept {}
    virtual void passed(const can::Frame&) noexcept {}  ///< a frame of another node. [realtime]

    void on_frame(const can::Frame& frame, Time begin) noexcept override {
        if (ReceivedMessage* const m = by_id_[frame.id % identifiers]) {
            m->receive(frame, begin);
        }
        const bool is_configuration =
            frame.id >= configuration_ids && frame.id <= node_id + arguments_.table.nodes.size();
        if (!is_configuration) {
            links_.accept(frame);
        }
        passed(frame);
    }
    void on_sent(const can::Frame& frame, Time) noexcept override {
        for (auto& m : sent_) {
            if (m.id() == frame.id) {
                m.sent();
            }
        }
    }
    void on_event(Event e, std::uint32_t who, std::uint32_t id, Time value) noexcept override {
        reporter_->tell({e, who, id, value});
        if (event_rows[static_cast<std::size_t>(e)].effect == bus::Effect::ends) {
            recover();
        }
        const bus::FaultTexts::Fault* const fault = texts_->fault(e, id);
        if (fault == nullptr) return;
        pins_.fault = true;
        Time& last = raised_[static_cast<std::size_t>(e)];
        if (last != std::numeric_limits<Time>::min() && now_ - last < 1'000'000'000 &&
            fault_.lasts()) {
            return;  // one a second of each kind
        }
        last = now_;
        begin(fault_, fault->text, fault->detail(value));
    }

    /// Opens the link with the options that a station needs. Throws when it cannot be opened, or
    /// does not fit to the table and the load arguments. [setup]
    std::unique_ptr<can::Link> open_link() const {
        const std::string& address = arguments_.link.get();
        const can::Description bus = can::describe(address);
        can::Options options{.own_frames = true, .stamps = bus.has_stamps};
        if (bus.in_memory && bus.has_bit_rate) {
            options.bit_rate = arguments_.table.bit_rate;
        }
        if (bus.in_memory) {
            options.receive_capacity = Station::receive_capacity;
        }
        auto opened = can::open(address, options);
        if (!opened) throw std::runtime_error(opened.problem);
        const can::Description& description = opened.link->description();
        hal::bus::check_bit_rate(description, address, arguments_.table.bit_rate, "bitrate ");
        if ((arguments_.ppm != 0.0 || arguments_.tick_ns != 0) && !description.in_memory) {
            throw std::runtime_error("ppm= and tick_ns= are for simulated nodes; " + address +
                                     " has clocks of its own");
        }
        return std::move(opened.link);
    }

    /// Claims the clock of the threads. In start() behind what can fail: a claim is not given back.
    /// [setup]
    void claim_clock() {
        if (arguments_.follow == 0) return;
        try {
            clock_.claim();
        } catch (...) {
            links_.withdraw();
            throw;
        }
    }

    /// The fault is over. [realtime]
    void recover() noexcept {
        pins_.fault = false;
        end(fault_);
    }

    /// Begins anew after the thread was stopped. [realtime]
    void restart() noexcept {
        station_->restart(now_);
        links_.drop_queued();
        discipline_.lose();
    }

    /// Synchronises the threads of this process: their cycles begin with slots. [realtime]
    void follow(Time period) noexcept {
        const std::uint64_t syncs = station_->count().syncs;
        if (station_->state() == State::silent || station_->state() == State::listening) {
            return discipline_.lose();
        }
        if (syncs == followed_ || !station_->clock().known() || station_->leading()) return;
        followed_ = syncs;
        Time error = (station_->slot_start(0) - now_) % period;
        if (error > period / 2) {
            error -= period;
        }
        if (error < -period / 2) {
            error += period;
        }
        follow_reference(error, arguments_.table.cycle);
    }

    TableArguments arguments_{*this};
    hal::Function receive_{*this,
                           "receive",
                           &StationComponent::receive,
                           "receives frames and follows the SYNC; first in the thread",
                           {.required = true}};
    hal::Function transmit_{*this,
                            "transmit",
                            &StationComponent::transmit,
                            "sends in the slots until the next cycle; last in the thread",
                            {.required = true}};
    hal::Emergency interruption_{*this, &StationComponent::make_safe,
                                 "when the thread runs again, the node listens before it sends"};
    StationPins pins_{*this, receive_};
    std::deque<SentMessage> sent_;
    std::deque<ReceivedMessage> received_;
    std::vector<ReceivedMessage*> by_id_ = std::vector<ReceivedMessage*>(identifiers, nullptr);
    std::optional<EventTexts> texts_;
    std::unique_ptr<Station> station_;
    std::unique_ptr<hal::Reporter<EventRecord>> reporter_;  // behind the texts that its thread uses
    SlotLinks links_;
    std::unique_ptr<can::Link> link_;
    hal::LastingFault fault_;
    std::array<Time, 32> raised_{};
    std::uint64_t followed_ = 0;
    Time now_ = 0;
    bool was_reset_ = false;
};

}  // namespace hal::scocan
