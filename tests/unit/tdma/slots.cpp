// SPDX-License-Identifier: MIT
// The queue of a slot: order, space, and frames of several threads.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <thread>
#include <vector>

#include "components/fieldbus/tdma/station/transmitter.hpp"

namespace tdma_tests {
namespace {

using hal::tdma::Slot;
using hal::tdma::SlotSetup;

constexpr std::size_t header = hal::ethernet::header_bytes;

/// A frame of `length` bytes, each `mark`.
std::vector<std::uint8_t> frame_of(std::size_t length, std::uint8_t mark) {
    return std::vector<std::uint8_t>(length, mark);
}

std::uint8_t popped(Slot& slot) {
    const std::uint8_t mark = slot.front().empty() ? 0 : slot.front()[0];
    slot.pop();
    return mark;
}

TEST(TdmaSlot, frames_leave_by_priority_and_then_in_order) {
    Slot slot(SlotSetup{.id = 1, .size = 1000}, 8);
    EXPECT_TRUE(slot.push(frame_of(header + 46, 1), 8, nullptr, 0));
    EXPECT_TRUE(slot.push(frame_of(header + 46, 2), 4, nullptr, 0));
    EXPECT_TRUE(slot.push(frame_of(header + 46, 3), 8, nullptr, 0));
    EXPECT_TRUE(slot.push(frame_of(header + 46, 4), 4, nullptr, 0));
    EXPECT_EQ(slot.waiting(), 4U);
    EXPECT_EQ(popped(slot), 2);
    EXPECT_EQ(popped(slot), 4);
    EXPECT_EQ(popped(slot), 1);
    EXPECT_EQ(popped(slot), 3);
    EXPECT_TRUE(slot.front().empty());
    EXPECT_EQ(slot.waiting(), 0U);
}

TEST(TdmaSlot, a_turn_that_is_full_rejects_frames_of_the_same_priority_only) {
    Slot slot(SlotSetup{.id = 1, .size = 200}, 8);
    EXPECT_TRUE(slot.push(frame_of(header + 200, 1), 8, nullptr, 0));
    EXPECT_FALSE(slot.push(frame_of(header + 46, 2), 8, nullptr, 0));
    EXPECT_TRUE(slot.push(frame_of(header + 46, 3), 4, nullptr, 0));
    EXPECT_FALSE(slot.push(frame_of(header + 201, 4), 0, nullptr, 0)) << "longer than the slot";
    EXPECT_EQ(popped(slot), 3);
    slot.clear(0);
    EXPECT_TRUE(slot.push(frame_of(header + 46, 2), 8, nullptr, 0));
}

TEST(TdmaSlot, frames_of_several_threads_arrive_whole) {
    constexpr unsigned senders = 3;
    constexpr unsigned each = 2'000;
    Slot slot(SlotSetup{.id = 1, .size = 1000}, 8);
    std::vector<std::thread> threads;
    for (unsigned n = 1; n <= senders; ++n) {
        threads.emplace_back([&slot, n] {
            for (unsigned sent = 0; sent < each;) {
                const std::size_t length = header + 46 + (sent % 50) * n;
                if (slot.push(frame_of(length, static_cast<std::uint8_t>(n)), n % 2, nullptr, 0)) {
                    ++sent;
                } else {
                    std::this_thread::yield();
                }
            }
        });
    }
    unsigned arrived[senders + 1] = {};
    for (unsigned count = 0; count < senders * each;) {
        const auto frame = slot.front();
        if (frame.empty()) {
            std::this_thread::yield();
            continue;
        }
        const std::uint8_t mark = frame[0];
        ASSERT_TRUE(mark >= 1 && mark <= senders);
        const std::size_t length = header + 46 + (arrived[mark] % 50) * mark;
        ASSERT_EQ(frame.size(), length) << "in the order in which its thread sent it";
        ASSERT_TRUE(std::all_of(frame.begin(), frame.end(),
                                [mark](std::uint8_t byte) { return byte == mark; }));
        ++arrived[mark];
        ++count;
        slot.pop();
    }
    for (std::thread& thread : threads) {
        thread.join();
    }
    EXPECT_TRUE(slot.front().empty());
}

TEST(TdmaSlot, returns_a_frame_while_another_thread_queues_a_more_urgent_one) {
    constexpr unsigned rounds = 20'000;
    constexpr std::uint8_t ordinary = 1;
    constexpr std::uint8_t urgent = 2;
    Slot slot(SlotSetup{.id = 1, .size = 1000}, 8);
    std::atomic<unsigned> round{0};
    std::thread other([&] {
        for (unsigned n = 1; n <= rounds; ++n) {
            while (round.load(std::memory_order_acquire) < n) {
                std::this_thread::yield();
            }
            EXPECT_TRUE(slot.push(frame_of(header + 46, urgent), 4, nullptr, 0));
        }
    });
    unsigned missed = 0;
    for (unsigned n = 1; n <= rounds; ++n) {
        ASSERT_TRUE(slot.push(frame_of(header + 46, ordinary), 8, nullptr, 0));
        round.store(n, std::memory_order_release);
        while (slot.front()[0] != urgent) {
            std::this_thread::yield();
        }
        slot.pop();
        if (slot.front().empty()) {
            ++missed;
        }
        while (slot.front().empty()) {
            std::this_thread::yield();
        }
        EXPECT_EQ(popped(slot), ordinary);
    }
    other.join();
    EXPECT_EQ(missed, 0U);
    EXPECT_EQ(slot.waiting(), 0U);
}

/// What transmits the slots of a station, without the station.
struct Sender {
    hal::tdma::StationCore core;
    hal::tdma::Calibration calibration;
    hal::tdma::Pings pings;
    hal::tdma::Roster roster;
    hal::tdma::Transmitter transmitter{core, calibration, pings, roster};

    Sender() {
        hal::tdma::SlotSetup slot;
        slot.id = 3;
        slot.size = 1000;
        core.setup.slots = {slot};
        transmitter.set_up();
    }
    /// Queues what a thread sends that found its target before, and returns what leaves.
    std::uint8_t sent(const hal::tdma::Transmitter::Target& to, std::uint8_t mark) {
        EXPECT_TRUE(to.slot->push(frame_of(header + 46, mark), 8, nullptr, to.epoch));
        return popped(*to.slot);
    }
};

TEST(TdmaSlot, drops_a_frame_that_another_thread_queues_after_the_queues_were_emptied) {
    Sender sender;
    const auto before = sender.transmitter.target(3);
    EXPECT_EQ(sender.sent(before, 1), 1);
    const auto preempted = sender.transmitter.target(3);
    sender.transmitter.clear_slots();
    EXPECT_EQ(sender.sent(preempted, 2), 0);
    EXPECT_EQ(preempted.slot->waiting(), 0U);
    EXPECT_EQ(sender.sent(sender.transmitter.target(3), 3), 3);
}

TEST(TdmaSlot, drops_a_frame_for_a_slot_that_has_another_number_meanwhile) {
    Sender sender;
    const auto preempted = sender.transmitter.target(3);
    const SlotSetup other[] = {{.id = 4, .size = 1000}};
    ASSERT_TRUE(sender.transmitter.change(other));
    EXPECT_EQ(sender.transmitter.target(3).slot, nullptr);
    EXPECT_EQ(sender.sent(preempted, 2), 0);
    EXPECT_EQ(sender.sent(sender.transmitter.target(4), 3), 3);
}

TEST(TdmaSlot, frames_of_an_earlier_epoch_leave_the_next_turn_to_those_of_this_one) {
    Slot slot(SlotSetup{.id = 1, .size = 200}, 8);
    slot.clear(1);
    EXPECT_TRUE(slot.push(frame_of(header + 200, 1), 8, nullptr, 0));
    EXPECT_TRUE(slot.push(frame_of(header + 200, 2), 8, nullptr, 1));
    EXPECT_EQ(popped(slot), 2);
    EXPECT_EQ(slot.waiting(), 0U);
    EXPECT_EQ(slot.take_dropped(), 1U);
    EXPECT_EQ(slot.take_dropped(), 0U);
}

TEST(TdmaSlot, counts_the_frames_that_were_queued_when_the_station_stopped_sending) {
    Sender sender;
    const auto to = sender.transmitter.target(3);
    for (int i = 0; i < 2; ++i) {
        ASSERT_TRUE(to.slot->push(frame_of(header + 46, 1), 8, nullptr, to.epoch));
    }
    sender.transmitter.clear_slots();
    EXPECT_EQ(sender.core.status.count.cleared, 2U);
}

}  // namespace
}  // namespace tdma_tests
