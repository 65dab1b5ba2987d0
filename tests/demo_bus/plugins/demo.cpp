// SPDX-License-Identifier: MIT
#include <deque>
#include <memory>
#include <stdexcept>

#include "bus/component/bus_component.hpp"
#include "demo_arguments.hpp"
#include "demo_pins.hpp"
#include "event_texts.hpp"
#include "hal/reporter.hpp"

namespace {

using namespace hal::demo;

struct Demo : hal::bus::BusComponent, protected Events {
    explicit Demo(const hal_host* host) : BusComponent(host, "demo.0") {
        arguments_.load();
        if (!arguments_.loaded) return;
        const Bus& bus = arguments_.bus;
        texts_ = std::make_unique<EventTexts>(bus);
        reporter_ = std::make_unique<hal::Reporter<EventRecord>>(
            name_, [this](const EventRecord& record) { return texts_->line(record); }, 256,
            &EventTexts::subject);
        station_ = std::make_unique<Station>(bus, static_cast<Events&>(*this));
        for (const Device& device : bus.devices) {
            pins_.emplace_back(*this, receive_, transmit_, device, pins_.size());
            offline_faults_.emplace_back();
        }
    }

    // What can fail comes first: stop() does not run after a throw.
    void start() {
        if (!arguments_.loaded) throw std::runtime_error("missing configuration");
        hal::can::Opened opened = hal::can::open(arguments_.link.get(), {});
        if (!opened) throw std::runtime_error(opened.problem);
        link_ = std::move(opened.link);
        station_->attach(*link_);
        begin_cycles();
        reporter_->start();
    }
    void stop() noexcept {
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
        const hal::bus::Turn turn = receive_turn(cycle);
        if (begins_anew(turn) || turn == hal::bus::Turn::leaves) {
            station_->restart();
        }
        if (!is_offline(turn)) {
            station_->receive(cycle.start_ns());
        }
        for (DevicePins& pins : pins_) {
            pins.show(*station_);
        }
    }
    void transmit(hal::Cycle cycle) noexcept {
        if (!link_) return;
        if (!functions_.transmit(cycle)) {  // receive() is missing, or in another thread
            if (functions_.receive_is_missing()) {
                interrupt();
            }
            return;
        }
        bool is_invalid = false;
        for (const DevicePins& pins : pins_) {
            is_invalid = pins.transmit(*station_) || is_invalid;
        }
        record_invalid_inputs(is_invalid);
        station_->transmit(cycle.start_ns());
    }
    /// Runs in any thread, also beside a cycle. A bus that can sends safe values here.
    void make_safe(hal::Cycle) noexcept { interrupt(); }

private:
    void on_event(Event event, std::uint32_t device, std::int64_t silence_ns) noexcept override {
        reporter_->tell({event, device, silence_ns});
        const auto& row = event_rows[static_cast<std::size_t>(event)];
        if (row.effect == hal::bus::Effect::ends) {
            end(offline_faults_[device]);
        }
        if (const auto* const fault = texts_->fault(event, device)) {
            begin(offline_faults_[device], fault->text, fault->detail(silence_ns));
        }
    }

    DemoArguments arguments_{*this};
    hal::Function receive_{*this,
                           "receive",
                           &Demo::receive,
                           "receives frames; first in the thread",
                           {.required = true}};
    hal::Function transmit_{
        *this, "transmit", &Demo::transmit, "sends frames; last in the thread", {.required = true}};
    hal::Emergency emergency_{*this, &Demo::make_safe, "the bus begins anew"};
    std::deque<DevicePins> pins_;  // a pin does not move
    std::unique_ptr<EventTexts> texts_;
    std::unique_ptr<Station> station_;
    std::unique_ptr<hal::Reporter<EventRecord>> reporter_;  // its thread uses texts_
    std::unique_ptr<hal::can::Link> link_;
    std::deque<hal::LastingFault> offline_faults_;  // one for each device
};

}  // namespace

HAL_COMPONENT(Demo, "demo", "Master of a demo bus", R"(
The example of docs/internals/a-bus.md. It sends a set-point to each device in each cycle, and shows
the value that the device sends.

`pumps.demo`:

    [device 5 pump]
    scale = 0.01

    loadrt threads name1=bus period1=1000000
    loadrt demo config=pumps.demo link=sim:pumps
    addf demo.0.receive bus
    addf demo.0.transmit bus
)")
