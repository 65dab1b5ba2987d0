// SPDX-License-Identifier: MIT
#include <array>
#include <memory>
#include <stdexcept>

#include "hal/component.hpp"
#include "hal/setup_time.hpp"
#include "link/can.hpp"
#include "link/send_counter.hpp"
#include "link/stale.hpp"

namespace {

/// One end of the bridge.
struct End {
    std::unique_ptr<hal::can::Link> link;
    hal::can::SendCounter forwarded{};  // to this end
    std::uint64_t stale = 0;          // for this end
};

struct CanBridge : hal::Component {
    using Component::Component;

    hal::TextArgument a{*this, "a", "sim:can0", "address of the first bus, as in sim:arm"};
    hal::TextArgument b{*this, "b", "udp:239.74.163.2:43113",
                        "address of the second bus, as in udp:239.74.163.2:43113 or can:can0"};

    hal::In<bool> enable{*this, "enable", "false: no frames are forwarded", {.initial = true}};
    hal::In<bool> read_only{*this, "read-only", "true: frames of b are not forwarded to a"};
    hal::Out<std::uint64_t> a_to_b{*this, "a-to-b",
                                   "frames forwarded from a to b, or waiting; decreases when the "
                                   "link discards frames that wait"};
    hal::Out<std::uint64_t> b_to_a{*this, "b-to-a",
                                   "frames forwarded from b to a, or waiting; decreases when the "
                                   "link discards frames that wait"};
    hal::Out<std::uint64_t> dropped{*this, "dropped",
                                    "frames not forwarded: queue full, bus down or off, no sync of "
                                    "the slots, CAN FD frame on a classic bus, or waiting for more "
                                    "than 0.1 s"};
    hal::Out<bool> a_up{*this, "a-up", "bus a is neither down nor bus off"};
    hal::Out<bool> b_up{*this, "b-up", "bus b is neither down nor bus off"};

    hal::Function run{*this, "update", &CanBridge::update,
                      "forwards the frames received since the last cycle"};

    void start() {
        if (a.get() == b.get()) {
            throw hal::ArgumentError(
                "a", "a= and b= are the same bus, " + a.get() + "; name two different ones");
        }
        open(ends_[0], a.get());
        open(ends_[1], b.get());
        setup_time_.start();
    }
    void stop() noexcept {
        std::int64_t closing_ns = 0;
        for (const End& end : ends_) {
            if (end.link) {
                closing_ns += end.link->closing_ns();
            }
        }
        setup_time_.expect(closing_ns, hal::can::closing_text);
        for (End& end : ends_) {
            end.link.reset();
        }
    }

    void update(hal::Cycle cycle) noexcept {
        carry(ends_[0], ends_[1], cycle, enable);
        carry(ends_[1], ends_[0], cycle, enable && !read_only);
        a_to_b = ends_[1].forwarded.sent();
        b_to_a = ends_[0].forwarded.sent();
        dropped = dropped_to(ends_[0]) + dropped_to(ends_[1]);
        a_up = is_up(ends_[0]);
        b_up = is_up(ends_[1]);
    }

private:
    static void open(End& end, const std::string& address) {
        auto opened = hal::can::open(address, {.stamps = true});
        if (!opened) throw std::runtime_error(opened.problem);
        end = {std::move(opened.link)};
    }
    static std::uint64_t dropped_to(const End& end) noexcept {
        return end.forwarded.dropped() + end.stale;
    }
    static bool is_up(const End& end) noexcept {
        const auto state = end.link->state();
        return state != hal::can::State::down && state != hal::can::State::bus_off;
    }
    /// Forwards at most one buffer of frames, so a babbling bus costs a bounded time; the rest
    /// stays queued until the next cycle.
    void carry(const End& from, End& to, hal::Cycle cycle, bool pass) noexcept {
        const std::int64_t now = cycle.start_ns();
        const auto count = from.link->receive(buffer_, now);
        for (std::size_t n = 0; n < count && pass; ++n) {
            const hal::can::Frame& frame = buffer_[n];
            if (hal::can::is_stale(frame, now, cycle.period_ns())) {
                ++to.stale;
            } else {
                to.forwarded.count(to.link->send(frame, now));
            }
        }
        to.link->flush(now);
        to.forwarded.update(to.link->statistics());
    }

    std::array<End, 2> ends_;
    hal::SetupTime setup_time_;
    std::array<hal::can::Frame, 64> buffer_;
};

}  // namespace

HAL_COMPONENT(CanBridge, "can_bridge", "Forwards CAN frames between two buses", R"(
Forwards every frame received on one bus to the other, in both directions; at most 64 frames per
direction and cycle, so put `update` into a thread as fast as the buses need. Frames keep
identifier, length and data; timing and arbitration are those of each bus.

A `sim:` bus lives in the memory of its machine. A bridge makes it reachable for `hal can`,
python-can and other programs while the machine runs; here over the UDP multicast group that those
tools use by default:

    loadrt canopen_io link=sim:arm id=5 start_by_itself=1
    loadrt can_bridge a=sim:arm b=udp:239.74.163.2:43113
    addf canopen-io.0.update servo
    addf can-bridge.0.update servo
    start

    hal can scan udp:239.74.163.2:43113

What arrives while the thread is stopped is not forwarded at the next `start`: frames that have
waited for more than 0.1 s (and two cycles) are dropped. Frames of a bus without time stamps are
forwarded.

With `read-only`, programs on bus b can watch bus a but not send to it. Two bridges between the same
two buses would forward each frame in an endless loop.
)")
