// SPDX-License-Identifier: MIT
// The parts a cycle is made of: queue, histogram, wait.
#include <algorithm>
#include <cmath>
#include <random>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "execute/core.hpp"
#include "execute/histogram.hpp"
#include "execute/wait.hpp"
#include "hal/queue.hpp"

namespace hal::test {
namespace {

TEST(Core, is_not_late_before_its_first_cycle_is_due) {
    constexpr std::int64_t now = 6'008'000'000'000;  // the uptime of the host
    constexpr std::int64_t period = 1'000'000;
    FaultBoard board;
    Timeline timeline;
    const std::atomic<bool> running{false};
    Core core(1, period, {}, board, timeline, running, true);
    EXPECT_GT(core.monitor.overdue_since_ns(), now);
    core.monitor.expect(now);
    EXPECT_EQ(core.monitor.overdue_since_ns(), now + period);
    EXPECT_EQ(core.monitor.finished_ns(), now);
    core.monitor.begin(now + 10, now + 700'000);
    EXPECT_EQ(core.monitor.overdue_since_ns(), now + 700'000);
    core.monitor.expect(now + 20);
    EXPECT_EQ(core.monitor.overdue_since_ns(), now + 700'000) << "it has begun";
}

TEST(Core, shows_a_long_latency_as_the_longest_that_its_pin_holds) {
    EXPECT_EQ(Core::pin_ns(740'000), 740'000);
    EXPECT_EQ(Core::pin_ns(-12), -12);
    EXPECT_EQ(Core::pin_ns(3'600'000'000), INT32_MAX);
}

TEST(Core, has_the_missed_periods_before_a_turn_that_is_executed_again) {
    constexpr std::int64_t period = 1'000'000;
    FaultBoard board;
    Timeline timeline;
    const std::atomic<bool> running{false};
    hal_pin missed{};
    hal_value value{};
    missed.slot = &value;
    ThreadPins pins{};
    pins.missed = &missed;
    CycleInputs inputs;
    CycleRecord record;
    record.kind = CycleRecord::service;
    record.number = 5;
    record.missed = 3;
    inputs.load(record, {});
    Core core(1, period, pins, board, timeline, running, true, nullptr, &inputs);
    core.replay();
    EXPECT_EQ(core.monitor.missed(), 3u);
    EXPECT_EQ(value.u32, 3u);
    EXPECT_EQ(core.cycle_number(), 5u);
}

TEST(FaultBoard, keeps_one_fault_for_each_condition_that_lasts) {
    FaultBoard board;
    const auto open = [&] { return board.shared.faults.count - board.shared.faults.cleared; };
    const int owner = 0;
    const int keys[2]{};
    board.begin(&owner, &keys[0]);
    board.begin(&owner, &keys[0]);
    for (int i = 0; i < 3; ++i) {
        board.count({HAL_FAULT_COMPONENT}, 1);
    }
    board.clear();
    EXPECT_EQ(open(), 1u);
    board.begin(&owner, &keys[1]);
    board.count({HAL_FAULT_COMPONENT}, 1);
    board.end(&owner, &keys[0]);
    EXPECT_EQ(open(), 2u);
    board.clear();
    EXPECT_EQ(open(), 1u);
    EXPECT_TRUE(board.lasts(&owner, &keys[1]));
    board.end_all(&owner, &owner + 1);
    EXPECT_FALSE(board.lasts(&owner, &keys[1]));
    board.clear();
    EXPECT_EQ(open(), 0u);
    EXPECT_EQ(board.shared.lasting, 0u);
}

TEST(FaultBoard, has_room_for_a_limited_number_of_conditions) {
    FaultBoard board;
    std::vector<int> keys(FaultBoard::max_lasting + 10);
    for (const int& key : keys) {
        board.begin(&board, &key);
    }
    EXPECT_EQ(board.shared.lasting, FaultBoard::max_lasting);
    for (const int& key : keys) {
        board.end(&board, &key);
    }
    EXPECT_EQ(board.shared.lasting, 0u);
}

TEST(Queue, gives_items_back_in_order_and_refuses_when_full) {
    Queue<int> queue(4);
    int out = 0;
    EXPECT_FALSE(queue.pop(out));
    for (int turn = 0; turn < 10; ++turn) {  // over the wrap
        for (int i = 0; i < 4; ++i) {
            EXPECT_TRUE(queue.push(turn * 10 + i));
        }
        EXPECT_FALSE(queue.push(99));
        EXPECT_EQ(queue.size(), 4u);
        for (int i = 0; i < 4; ++i) {
            EXPECT_TRUE(queue.pop(out));
            EXPECT_EQ(out, turn * 10 + i);
        }
        EXPECT_FALSE(queue.pop(out));
    }
}

TEST(Queue, takes_a_row_whole_or_not_at_all) {
    Queue<int> queue(8);
    const int row[] = {1, 2, 3, 4, 5};
    int out = 0;
    EXPECT_TRUE(queue.push(row, 5));
    EXPECT_FALSE(queue.push(row, 4));
    EXPECT_TRUE(queue.push(row, 3));
    EXPECT_FALSE(queue.push(row, 1));
    EXPECT_TRUE(queue.push(row, 0));
    for (const int wanted : {1, 2, 3, 4, 5, 1, 2, 3}) {
        ASSERT_TRUE(queue.pop(out));
        EXPECT_EQ(out, wanted);
    }
    EXPECT_FALSE(queue.push(row, 9 * 1000));
}

TEST(Queue, shows_its_reader_whole_rows_only) {
    Queue<int> queue(64);
    constexpr int rows = 20'000;
    std::thread writer([&] {
        for (int i = 0; i < rows; ++i) {
            const int row[] = {i, i, i};
            while (!queue.push(row, 3)) {
                std::this_thread::yield();
            }
        }
    });
    for (int i = 0; i < rows; ++i) {
        int first = -1;
        int next = -1;
        while (!queue.pop(first)) {
            std::this_thread::yield();
        }
        ASSERT_EQ(first, i);
        for (int k = 0; k < 2; ++k) {
            ASSERT_TRUE(queue.pop(next)) << "a part of a row";
            ASSERT_EQ(next, i);
        }
    }
    writer.join();
}

TEST(Mailbox, gives_the_newest_value_and_never_a_torn_one) {
    struct Pair {
        std::uint64_t a, b;
    };
    Mailbox<Pair> mailbox(Pair{0, 0});
    constexpr std::uint64_t last = 50'000;
    std::thread writer([&] {
        for (std::uint64_t i = 1; i <= last; ++i) {
            mailbox.put({i, i});
        }
    });
    std::uint64_t before = 0;
    while (before < last) {
        bool changed = false;
        const Pair seen = mailbox.get(&changed);
        ASSERT_EQ(seen.a, seen.b);
        ASSERT_GE(seen.a, before);
        ASSERT_EQ(changed, seen.a != before);
        before = seen.a;
    }
    writer.join();
}

TEST(Histogram, finds_quantiles_within_its_resolution) {
    Histogram histogram;
    EXPECT_EQ(histogram.quantile(0.5), 0.0);
    for (int ns = 1; ns <= 100'000; ++ns) {
        histogram.add(ns);
    }
    for (const double share : {0.01, 0.5, 0.9, 0.99}) {
        EXPECT_NEAR(histogram.quantile(share), share * 100'000, share * 100'000 * 0.125) << share;
    }
    EXPECT_EQ(histogram.max_ns(), 100'000u);
    EXPECT_EQ(histogram.quantile(1.0), 100'000.0);
}

TEST(Histogram, counts_every_value_in_the_bucket_of_its_size) {
    Histogram histogram;
    std::mt19937_64 random(7);
    std::vector<std::int64_t> values{-5, 0, 1, 7, 8, 9, 15, 16, 1'000'000'000'000, INT64_MAX};
    for (int i = 0; i < 1000; ++i) {
        values.push_back(static_cast<std::int64_t>(random() >> (1 + random() % 60)));
    }
    for (const std::int64_t value : values) {
        histogram.add(value);
    }
    std::uint64_t all = 0;
    for (std::size_t i = 0; i < Histogram::buckets; ++i) {
        all += histogram.count(i);
        if (i > 0) {
            EXPECT_GT(Histogram::edge(i), Histogram::edge(i - 1));
        }
        const auto inside = static_cast<std::uint64_t>(
            std::count_if(values.begin(), values.end(), [&](std::int64_t value) {
            const auto size = static_cast<std::uint64_t>(value < 0 ? 0 : value);
            return size >= Histogram::edge(i) &&
                   (i + 1 == Histogram::buckets || size < Histogram::edge(i + 1));
        }));
        EXPECT_EQ(histogram.count(i), inside) << "bucket from " << Histogram::edge(i);
    }
    EXPECT_EQ(all, values.size());
}

TEST(Wait, ends_at_its_deadline_and_not_before) {
    for (const std::int64_t spin : {0, 20'000, 1'000'000}) {
        Wait wait;
        wait.spin_ns = spin;
        const std::int64_t deadline = monotonic_ns() + 2'000'000;
        wait.sleep(deadline);
        EXPECT_GE(monotonic_ns(), deadline - spin);
        EXPECT_GE(Wait::spin(deadline), deadline);
        wait.sleep(deadline - 3'600'000'000'000);  // one that has passed is not waited for
    }
}

TEST(Wait, ends_early_when_the_bell_has_been_rung) {
    const Wait wait;
    std::atomic<std::uint32_t> bell{0};
    const std::int64_t deadline = monotonic_ns() + 3'600'000'000'000;
    std::thread ringer([&] { Wait::ring(bell); });
    EXPECT_FALSE(wait.sleep(deadline, bell, 0));
    ringer.join();
    EXPECT_FALSE(wait.sleep(deadline, bell, 0)) << "a ring before the wait counts, too";
    EXPECT_TRUE(wait.sleep(monotonic_ns(), bell, 1)) << "nobody rang, and the time has come";
}

}  // namespace
}  // namespace hal::test
