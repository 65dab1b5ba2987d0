// SPDX-License-Identifier: MIT
#include <atomic>
#include <thread>

#include "fieldbus/guardian/shared_record.hpp"

namespace hal::guardian {
namespace {

TEST(SharedRecord, Has_parts_of_the_same_moment) {
    SharedRecord shared;
    std::atomic<bool> ends{false};
    std::thread guardian([&] {
        for (std::uint32_t n = 0; !ends.load(); ++n) {
            shared.write({.status = {.stops = n % 65536}, .rounds = n, .elapsed_ns = n});
            for (int pause = 0; pause < 100 && !ends.load(); ++pause) {
            }
        }
    });
    int whole = 0;
    while (whole < 100'000) {
        StopRecord record;
        if (!shared.read(record)) continue;  // the thread is preempted while it writes
        ++whole;
        const bool is_of_a_moment = record.elapsed_ns == std::int64_t{record.rounds} &&
                                    record.status.stops == record.rounds % 65536;
        if (is_of_a_moment) continue;
        ADD_FAILURE() << record.elapsed_ns << " and " << record.rounds;
        break;
    }
    ends.store(true);
    guardian.join();
}

TEST(SharedRecord, Keeps_the_reasons_of_stops_that_others_have_followed) {
    StopRecord record;
    record.begin(StopReason::heartbeat);
    record.begin(StopReason::estop);
    record.begin(StopReason::fault);
    SharedRecord shared;
    shared.write(record);
    StopRecord read;
    ASSERT_TRUE(shared.read(read));
    EXPECT_EQ(read.reason, StopReason::fault);
    EXPECT_EQ(read.before(1).reason, StopReason::estop);
    EXPECT_EQ(read.before(2).reason, StopReason::heartbeat);
    for (unsigned n = 0; n < StopRecord::max_earlier; ++n) {
        record.begin(StopReason::unload);
    }
    shared.write(record);
    ASSERT_TRUE(shared.read(read));
    EXPECT_EQ(read.before(StopRecord::max_earlier).reason, StopReason::fault);
}

TEST(Status, Is_one_word) {
    const Status status{.phase = Phase::ended,
                        .outcome = Outcome::delayed,
                        .failure = Failure::unacknowledged,
                        .is_ready = false,
                        .sees_bus = true,
                        .stops = 65535};
    const Status read = Status::of(status.word());
    EXPECT_EQ(read.phase, Phase::ended);
    EXPECT_EQ(read.outcome, Outcome::delayed);
    EXPECT_EQ(read.failure, Failure::unacknowledged);
    EXPECT_FALSE(read.is_ready);
    EXPECT_TRUE(read.sees_bus);
    EXPECT_EQ(read.stops, 65535U);
}

}  // namespace
}  // namespace hal::guardian
