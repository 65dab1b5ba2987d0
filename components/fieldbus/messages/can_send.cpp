// SPDX-License-Identifier: MIT
#include <memory>
#include <stdexcept>

#include "hal/component.hpp"
#include "hal/setup_time.hpp"
#include "link/can.hpp"
#include "link/send_counter.hpp"
#include "message_fields.hpp"

namespace {

using namespace hal::messages;

struct CanSend : hal::Component {
    using Component::Component;

    hal::TextArgument address{*this,
                              "link",
                              "sim:can0",
                              "address of the bus, as in sim:can0 or can:can0",
                              {.per_instance = true}};
    hal::Argument id{*this,
                     "id",
                     0x100,
                     "identifier; above 0x7ff: 29 bits",
                     {.per_instance = true, .min = 0, .max = 0x1fffffff}};
    hal::Argument ids{*this,
                      "ids",
                      1,
                      "consecutive identifiers, chosen by the pin id-offset",
                      {.per_instance = true, .min = 1, .max = 256}};
    hal::TextArgument fields{
        *this, "fields", "",
        "data, little endian: NAME:TYPE,... with types bit, u8, s8, u16, s16, u32, s32, f32, f64"};

    hal::In<bool> trigger{*this, "trigger", "TRUE: sends one message in each cycle"};
    hal::In<std::uint32_t> id_offset{*this, "id-offset",
                                     "added to the identifier, at most ids - 1"};
    hal::Param<bool> on_change{*this, "on-change",
                               "TRUE: also sends when the data differ from those sent last"};
    hal::Param<double> period{
        *this, "period", "also sends at multiples of this time; 0: only by trigger", {.unit = "s"}};
    hal::Param<double> phase{*this, "phase", "delay of these instants", {.unit = "s"}};
    hal::Out<std::uint64_t> sent{*this, "sent", "messages sent or waiting"};
    hal::Out<std::uint64_t> dropped{
        *this, "dropped",
        "messages not sent: queue full, bus down or off, no sync of the slots, "
        "or replaced by a newer one while they waited"};
    hal::Out<std::uint32_t> waiting{*this, "waiting",
                                    "messages of this instance waiting for the bus"};

    Layout layout{fields.get()};
    LayoutPins<HAL_DIR_IN> pins{*this, layout, "field of the message"};
    std::unique_ptr<hal::Out<std::uint64_t>> invalid =
        pins.has_reals() ? std::make_unique<hal::Out<std::uint64_t>>(
                               *this, invalid_pin,
                               "messages with a field that was not finite: its last value was sent")
                         : nullptr;
    hal::Function run{*this, "update", &CanSend::update, "sends the message when it is due"};

    void start() {
        first_ = identifier(id, ids - 1);
        auto opened = hal::can::open(address.get(), {.stamps = true});
        if (!opened) throw std::runtime_error(opened.problem);
        link_ = std::move(opened.link);
        counter_.open();
        setup_time_.start();
        const hal::can::Filter nothing{.id = 0x1fffffff, .mask = 0x1fffffff, .extended = true};
        link_->set_filters(std::span(&nothing, 1));
    }
    void stop() noexcept {
        if (link_) {
            setup_time_.expect(link_->closing_ns(), hal::can::closing_text);
        }
        link_.reset();
    }

    void update(hal::Cycle cycle) noexcept {
        const std::int64_t now = cycle.start_ns();
        hal::can::Frame frame;
        frame.length = layout.bytes();
        const bool is_invalid = pins.transmit(frame.data);
        const bool is_new = on_change && frame.data != last_data_;
        if (due(cycle) || trigger || is_new) {
            frame.id =
                first_ + std::min<std::uint32_t>(id_offset, static_cast<std::uint32_t>(ids - 1));
            frame.extended = first_ > 0x7ff;
            last_data_ = frame.data;
            if (counter_.count(link_->send(frame, now)) && is_invalid) {
                *invalid = *invalid + 1;
            }
        }
        link_->flush(now);
        while (link_->receive(buffer_, now) == buffer_.size()) {
        }
        const hal::can::Statistics statistics = link_->statistics();
        counter_.update(statistics);
        sent = counter_.sent();
        dropped = counter_.dropped();
        waiting = statistics.queued;
    }

private:
    /// True once per instant phase + k * period; an instant within the cycle belongs to its start.
    bool due(hal::Cycle cycle) noexcept {
        const double wanted = period * 1e9;
        const double late = phase * 1e9;
        if (!(wanted >= 1.0 && wanted < 1e18 && std::fabs(late) < 1e18)) return false;
        const auto every = static_cast<std::int64_t>(std::llround(wanted));

        const auto shift = static_cast<std::int64_t>(std::llround(late));
        if (!started_) {
            begin_ = cycle.start_ns();
            started_ = true;
        }
        const std::int64_t since = cycle.start_ns() - begin_ - shift;
        const std::int64_t instant = since >= 0 ? since / every : -1;
        const bool is_due = instant >= 0 && (instant != last_);
        last_ = instant;
        return is_due;
    }

    std::unique_ptr<hal::can::Link> link_;
    hal::can::SendCounter counter_;
    hal::SetupTime setup_time_;
    std::array<hal::can::Frame, 16> buffer_;
    std::array<std::uint8_t, 64> last_data_{};
    std::uint32_t first_ = 0;
    std::int64_t begin_ = 0;
    std::int64_t last_ = -1;
    bool started_ = false;
};

}  // namespace

HAL_COMPONENT(CanSend, "can_send", "Sends one CAN message whose data are pins", R"(
For nodes without a protocol: one instance is one message. `fields=` names its data in order, little
endian, at most 8 bytes; each field is a pin (`u8`, `u16` and `u32` are u32 pins, `s8`, `s16`, `s32`
are s32 pins, `f32` and `f64` are float pins). Values out of the range of a field are limited to it.
NaN and infinity are not sent: the last valid value is, and `invalid` counts these messages. Without
`fields=` the message has no data.

A message leaves in each cycle in which `trigger` is TRUE, at multiples of `period`, counted from
the first cycle, and with `on-change` when its data are not those sent last (at the start: zeros).
Each instance is a node of its own on a `sim:` bus, so the messages of several instances are sent in
order of their identifiers, as by a controller with a buffer for each. Each message is counted in
`sent` or in `dropped`. On a bus with time slots, frames that the station has taken and drops later,
when it loses the sync, are counted by the station: `frames-dropped` of tdma, `dropped` of scocan. With `ids=8` the pin
`id-offset` selects one of eight consecutive identifiers.

    loadrt can_send link=sim:robot names=position id=0x10a fields=a:s32,b:s32
    addf position.update servo
    setp position.period 0.01
    net left-counts  => position.a
    net right-counts => position.b
)")
