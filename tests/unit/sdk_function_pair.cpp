// SPDX-License-Identifier: MIT
// Two functions that monitor each other, in the same and in different threads.
#include <gtest/gtest.h>

#include <cstdint>
#include <set>
#include <string>

#include "hal/function_pair.hpp"

namespace hal::test {
namespace {

/// The faults that last.
struct Record {
    hal_lasting_faults faults{};
    std::set<std::string> lasting;

    Record() {
        faults.faults.size = sizeof faults;
        faults.faults.raise = [](const hal_faults*, const void*, const char*, double) {};
        faults.lasts = [](const hal_faults*, const void* self, const char* reason, bool lasts) {
            auto& all = static_cast<Record*>(const_cast<void*>(self))->lasting;
            if (lasts) {
                all.insert(reason);
            } else {
                all.erase(reason);
            }
        };
    }
};

/// A thread of the machine, as its functions see it.
struct Thread {
    hal_cycle cycle{};
    explicit Thread(std::int64_t period_ns) { cycle.period_ns = period_ns; }
    Cycle now() const { return Cycle(&cycle); }
};

class FunctionPairTest : public testing::Test {
protected:
    FunctionPairTest() { pair.start(&record.faults.faults, &record); }

    Record record;
    FunctionPair pair{"x.receive", "x.transmit"};
    Thread fast{1'000'000}, other{1'000'000}, slow{1'000'000'000};
    const std::string no_transmit =
        "'x.receive' runs, but 'x.transmit' does not; nothing is sent; type: addf x.transmit "
        "THREAD";
    const std::string no_receive =
        "'x.transmit' runs, but 'x.receive' does not; nothing is sent; type: addf x.receive THREAD";
    const std::string apart =
        "'x.receive' and 'x.transmit' are in different threads; nothing is sent; type: delf "
        "x.transmit THREAD, and add it to the thread of the other";
    using Lasting = std::set<std::string>;
};

TEST_F(FunctionPairTest, both_functions_in_one_thread_exchange) {
    for (int i = 0; i < 1000; ++i) {
        EXPECT_TRUE(pair.receive(fast.now()));
        EXPECT_TRUE(pair.transmit(fast.now()));
    }
    EXPECT_EQ(record.lasting, Lasting{});
}

TEST_F(FunctionPairTest, a_missing_function_is_reported_after_a_hundred_cycles) {
    bool sends = true;
    for (int i = 0; i < 99; ++i) {
        sends = pair.receive(fast.now());
    }
    EXPECT_TRUE(sends);
    EXPECT_EQ(record.lasting, Lasting{});
    EXPECT_FALSE(pair.receive(fast.now()));
    EXPECT_EQ(record.lasting, Lasting{no_transmit});
    EXPECT_TRUE(pair.transmit(fast.now()));
    EXPECT_TRUE(pair.receive(fast.now()));
    EXPECT_EQ(record.lasting, Lasting{});
    EXPECT_TRUE(pair.transmit(fast.now()));
    EXPECT_FALSE(pair.transmit(fast.now()));
    EXPECT_FALSE(pair.receive_is_missing());
    for (int i = 0; i < 99; ++i) {
        pair.transmit(fast.now());
    }
    EXPECT_TRUE(pair.receive_is_missing());
    EXPECT_EQ(record.lasting, Lasting{no_receive});
}

TEST_F(FunctionPairTest, functions_in_two_threads_of_the_same_period_are_apart) {
    for (int i = 0; i < 100; ++i) {
        pair.receive(fast.now());
        EXPECT_EQ(pair.transmit(other.now()), i < 2);
    }
    EXPECT_EQ(record.lasting, Lasting{apart});
    EXPECT_FALSE(pair.receive_is_missing());
    EXPECT_FALSE(pair.transmit_is_missing());
    pair.receive(fast.now());
    EXPECT_TRUE(pair.transmit(fast.now())) << "moved";
    EXPECT_EQ(record.lasting, Lasting{});
}

TEST_F(FunctionPairTest, a_function_in_a_slow_thread_is_apart_and_not_missing) {
    for (int second = 0; second < 110; ++second) {
        pair.transmit(slow.now());
        for (int i = 0; i < 1000; ++i) {
            pair.receive(fast.now());
            EXPECT_FALSE(pair.transmit_is_missing());
        }
    }
    EXPECT_EQ(record.lasting, Lasting{apart});
}

}  // namespace
}  // namespace hal::test
