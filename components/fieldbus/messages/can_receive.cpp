// SPDX-License-Identifier: MIT
#include <memory>
#include <stdexcept>

#include "hal/age.hpp"
#include "hal/component.hpp"
#include "link/can.hpp"
#include "message_fields.hpp"

namespace {

using namespace hal::messages;

struct CanReceive : hal::Component {
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
                      "consecutive identifiers that are received",
                      {.per_instance = true, .min = 1, .max = 256}};
    hal::TextArgument fields{
        *this, "fields", "",
        "data, little endian: NAME:TYPE,... with types bit, u8, s8, u16, s16, u32, s32, f32, f64"};

    hal::Param<bool> one_by_one{*this, "one-by-one",
                                "TRUE: one message per cycle, in order; the others wait"};
    hal::Param<double> timeout{
        *this,
        "timeout",
        "time without a message after which valid becomes FALSE; 0: no timeout",
        {.unit = "s"}};
    hal::Out<bool> fresh{
        *this, "new", "TRUE for the cycle in which a message arrived", {.safe = false}};
    hal::Out<bool> valid{*this, "valid", "TRUE: a message arrived within timeout", {.safe = false}};
    hal::Out<std::uint32_t> id_offset{*this, "id-offset",
                                      "identifier of the newest message, less id"};
    hal::Out<double> age{
        *this,
        "age",
        "time since the end of the newest message; infinite without one, and while the thread is "
        "stopped",
        {.initial = hal::infinite_age, .unit = "s", .safe = hal::infinite_age}};
    hal::Out<std::uint64_t> received{*this, "received", "messages received"};
    hal::Out<std::uint64_t> overwritten{*this, "overwritten",
                                        "messages that a later one of the same cycle replaced"};
    hal::Out<std::uint64_t> malformed{*this, "malformed", "messages of another length, ignored"};

    Layout layout{fields.get()};
    LayoutPins<HAL_DIR_OUT> pins{*this, layout, "field of the newest message"};
    std::unique_ptr<hal::Out<std::uint64_t>> invalid =
        pins.has_reals()
            ? std::make_unique<hal::Out<std::uint64_t>>(
                  *this, invalid_pin, "messages with a field that was not finite: its pin was kept")
            : nullptr;
    hal::Function run{*this, "update", &CanReceive::update,
                      "reads the messages received since the last cycle"};

    void start() {
        first_ = identifier(id, ids - 1);
        auto opened = hal::can::open(address.get(), {.stamps = true});
        if (!opened) throw std::runtime_error(opened.problem);
        link_ = std::move(opened.link);
        std::array<hal::can::Filter, 256> filters;
        const auto count = static_cast<std::size_t>(ids);
        for (std::size_t i = 0; i < count; ++i) {
            filters[i] = {.id = first_ + static_cast<std::uint32_t>(i),
                          .mask = 0x1fffffff,
                          .extended = first_ > 0x7ff};
        }
        // a link that supports fewer passes more; is_mine() decides
        link_->set_filters(std::span(filters.data(), count));
    }
    void stop() noexcept { link_.reset(); }

    void update(hal::Cycle cycle) noexcept {
        const std::int64_t now = cycle.start_ns();
        bool any = false;
        const std::size_t max = one_by_one ? 1 : buffer_.size();
        for (int batch = 0; batch < 8; ++batch) {  // a babbling bus costs a bounded time
            const std::size_t count = link_->receive(std::span(buffer_.data(), max), now);
            for (std::size_t i = 0; i < count; ++i) {
                any = take(buffer_[i], any) || any;
            }
            if (count < max || (one_by_one && any)) break;
        }
        link_->flush(now);
        fresh = any;
        ever_ = ever_ || any;
        age = ever_ ? 1e-9 * static_cast<double>(now - newest_) : hal::infinite_age;
        valid = ever_ && !(timeout > 0.0 && age > timeout);
    }

private:
    bool take(const hal::can::Frame& frame, bool again) noexcept {
        if (frame.remote || frame.error || frame.own || frame.extended != (first_ > 0x7ff)) {
            return false;
        }
        if (frame.id < first_ || frame.id - first_ >= static_cast<std::uint32_t>(ids)) return false;
        if (frame.length != layout.bytes()) {
            malformed = malformed + 1;
            return false;
        }
        if (pins.show(frame.data)) {
            *invalid = *invalid + 1;
        }
        id_offset = frame.id - first_;
        newest_ = frame.time_ns;
        received = received + 1;
        if (again) {
            overwritten = overwritten + 1;
        }
        return true;
    }

    std::unique_ptr<hal::can::Link> link_;
    std::array<hal::can::Frame, 32> buffer_;
    std::uint32_t first_ = 0;
    std::int64_t newest_ = 0;
    bool ever_ = false;
};

}  // namespace

HAL_COMPONENT(CanReceive, "can_receive", "Receives one CAN message whose data become pins", R"(
The counterpart of `can_send`: `fields=` names the data of the message in order, little endian. The
pins keep the values of the newest message; `new` is TRUE for the cycle in which it arrived, `age`
is the time since its last bit. If several messages arrive within a cycle, the last one remains and
the others are counted in `overwritten`; with `one-by-one` they wait for the next cycles instead. A
message of another length is ignored and counted in `malformed`. NaN and infinity are ignored: the
pin keeps its value, and `invalid` counts these messages.

With `ids=8` eight consecutive identifiers are received; `id-offset` is that of the newest message.

    loadrt can_receive link=sim:robot names=position id=0x10a fields=a:s32,b:s32
    addf position.update servo
    setp position.timeout 0.05
    net left-counts  <= position.a
    net right-counts <= position.b
)")
