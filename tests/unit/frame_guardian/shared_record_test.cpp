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
    int torn = 0;
    for (int n = 0; n < 200'000; ++n) {
        const StopRecord record = shared.read();
        const bool is_whole = record.elapsed_ns == std::int64_t{record.rounds} &&
                              record.status.stops == record.rounds % 65536;
        torn += is_whole ? 0 : 1;
    }
    ends.store(true);
    guardian.join();
    EXPECT_EQ(torn, 0);
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
