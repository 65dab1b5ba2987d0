// SPDX-License-Identifier: MIT
#include "link/send_counter.hpp"

#include <gtest/gtest.h>

namespace hal::can {
namespace {

/// A counter and the statistics of its link.
struct SendCounting : testing::Test {
    void count(Sent result, int times) {
        for (int n = 0; n < times; ++n) {
            EXPECT_EQ(counter.count(result), result == Sent::queued);
        }
    }
    /// Ends a cycle in which the link has dropped frames, of those that it rejected as well.
    void update(std::uint64_t dropped) {
        link.dropped += dropped;
        counter.update(link);
    }
    void expect(std::uint64_t sent, std::uint64_t dropped) const {
        EXPECT_EQ(counter.sent(), sent);
        EXPECT_EQ(counter.dropped(), dropped);
    }
    SendCounter counter;
    Statistics link{};
};

TEST_F(SendCounting, Begins_with_nothing) {
    update(0);
    expect(0, 0);
}

TEST_F(SendCounting, Counts_a_frame_as_sent_or_dropped) {
    count(Sent::queued, 3);
    count(Sent::full, 2);
    update(2);
    expect(3, 2);
}

TEST_F(SendCounting, Counts_a_frame_as_dropped_that_the_link_discards_in_the_cycle_of_a_rejection) {
    count(Sent::queued, 3);
    count(Sent::rejected, 2);
    update(3);
    expect(2, 3);
}

TEST_F(SendCounting, Moves_frames_that_the_link_discards_later_from_sent_to_dropped) {
    count(Sent::queued, 3);
    update(0);
    expect(3, 0);
    update(2);
    expect(1, 2);
    update(0);
    expect(1, 2);
}

TEST_F(SendCounting, Counts_a_rejected_frame_once_whether_the_link_counts_it_or_not) {
    count(Sent::queued, 1);
    count(Sent::down, 2);
    update(0);
    expect(1, 2);
}

TEST_F(SendCounting, Goes_on_with_a_new_link) {
    count(Sent::queued, 3);
    count(Sent::full, 1);
    update(1);
    counter.open();
    link = {};
    count(Sent::queued, 2);
    update(1);
    expect(4, 2);
}

TEST_F(SendCounting, Is_not_negative_when_the_link_discards_more_than_was_sent) {
    count(Sent::queued, 1);
    update(3);
    expect(0, 3);
}

}  // namespace
}  // namespace hal::can
