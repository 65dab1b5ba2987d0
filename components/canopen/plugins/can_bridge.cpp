// SPDX-License-Identifier: MIT
#include <array>
#include <memory>
#include <stdexcept>

#include "hal/component.hpp"
#include "link/can.hpp"

namespace {

/// One end of the bridge, and what came there.
struct End {
    std::unique_ptr<hal::can::Link> link;
    std::uint64_t passed = 0, refused = 0;
};

struct CanBridge : hal::Component {
    using Component::Component;

    hal::TextArgument a{*this, "a", "sim:can0", "one bus, as in sim:arm"};
    hal::TextArgument b{*this, "b", "udp:239.74.163.2:43113", "the other, as in udp:239.74.163.2:43113 or can:can0"};

    hal::In<bool> enable{*this, "enable", "false: nothing crosses", {.initial = true}};
    hal::In<bool> read_only{*this, "read-only", "true: what is on b does not reach a"};
    hal::Out<std::uint64_t> a_to_b{*this, "a-to-b", "frames of a that were sent on b"};
    hal::Out<std::uint64_t> b_to_a{*this, "b-to-a", "frames of b that were sent on a"};
    hal::Out<std::uint64_t> dropped{*this, "dropped", "frames that the other bus did not take: full, down, bus off, or FD on a bus without"};
    hal::Out<bool> a_up{*this, "a-up", "bus a takes frames"};
    hal::Out<bool> b_up{*this, "b-up", "bus b takes frames"};

    hal::Function run{*this, "update", &CanBridge::update, "carries what came on each bus since the last cycle to the other"};

    void start() {
        if (a.get() == b.get()) throw hal::ArgumentError("a", "a= and b= are one bus, " + a.get() + "; a bridge has two ends");
        open(ends_[0], a.get());
        open(ends_[1], b.get());
    }
    void stop() noexcept {
        for (End& end : ends_) end.link.reset();
    }

    void update(hal::Cycle cycle) noexcept {
        carry(ends_[0], ends_[1], cycle.start_ns(), enable);
        carry(ends_[1], ends_[0], cycle.start_ns(), enable && !read_only);
        a_to_b = ends_[0].passed;
        b_to_a = ends_[1].passed;
        dropped = ends_[0].refused + ends_[1].refused;
        a_up = is_up(ends_[0]);
        b_up = is_up(ends_[1]);
    }

private:
    static void open(End& end, const std::string& address) {
        auto opened = hal::can::open(address, {.stamps = true});
        if (!opened) throw std::runtime_error(opened.problem);
        end = {std::move(opened.link)};
    }
    static bool is_up(const End& end) noexcept {
        const auto state = end.link->state();
        return state != hal::can::State::down && state != hal::can::State::bus_off;
    }
    /// At most what fits the room: a babbling bus costs a bounded time, and the rest waits in its link for the next cycle.
    void carry(End& from, const End& to, std::int64_t now, bool pass) noexcept {
        const auto count = from.link->receive(room_, now);
        for (std::size_t n = 0; n < count && pass; ++n) {
            if (to.link->send(room_[n], now) == hal::can::Sent::queued) ++from.passed;
            else ++from.refused;
        }
        to.link->flush(now);
    }

    std::array<End, 2> ends_;
    std::array<hal::can::Frame, 64> room_;
};

}  // namespace

HAL_COMPONENT(CanBridge, "can_bridge", "Carries CAN frames between two buses", R"(
What comes on one bus is sent on the other, in both directions; at most 64 frames each way and cycle, so put `update` into a thread that is
as fast as the buses need. Frames keep identifier, length and data; times and arbitration are those of each bus.

A `sim:` bus lives in the memory of its machine. A bridge makes it reachable for `hal can`, python-can and other programs while the
machine runs, here over the UDP group where stock tools meet:

    loadrt canopen_io link=sim:arm id=5 start_by_itself=1
    loadrt can_bridge a=sim:arm b=udp:239.74.163.2:43113
    addf canopen-io.0.update servo
    addf can-bridge.0.update servo
    start

    hal can scan udp:239.74.163.2:43113

`read-only` shows the bus and lets nobody speak on it. Two bridges between the same two buses would send each frame round for ever.
)")
