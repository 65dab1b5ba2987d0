// SPDX-License-Identifier: MIT
// What all guardians have: requests, the start, the lock of a report, capabilities.
#include <gtest/gtest.h>

#include <linux/capability.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <thread>

#include "components/bus/guardian/ambient_capabilities.hpp"
#include "components/bus/guardian/parent_watch.hpp"
#include "components/bus/guardian/report_lock.hpp"
#include "components/bus/guardian/start_state.hpp"
#include "components/bus/guardian/stop_requests.hpp"

namespace hal::bus {
namespace {

namespace fs = std::filesystem;

TEST(StopRequests, Have_the_reason_of_their_count) {
    StopRequests requests;
    constexpr std::uint32_t count = 200'000;
    std::thread cycle([&] {
        for (std::uint32_t n = 1; n <= count; ++n) {
            requests.request(n % 2 == 0 ? StopReason::estop : StopReason::fault);
        }
    });
    StopRequests::Request newest;
    while (newest.count != count) {
        newest = requests.newest();
        const auto expected = newest.count % 2 == 0 ? StopReason::estop : StopReason::fault;
        if (newest.count != 0) {
            ASSERT_EQ(newest.reason, expected) << newest.count;
        }
    }
    cycle.join();
}

TEST(StopRequests, Of_several_threads_are_all_counted) {
    StopRequests requests;
    const auto request = [&] {
        for (int n = 0; n < 10'000; ++n) {
            requests.request(StopReason::estop);
        }
    };
    std::thread other(request);
    request();
    other.join();
    EXPECT_EQ(requests.newest().count, 20'000U);
}

TEST(StopRequests, That_are_over_at_once_are_still_seen) {
    StopRequests requests;
    EXPECT_TRUE(requests.hold(StopReason::estop));
    requests.request(StopReason::estop);
    requests.release(StopReason::estop);
    EXPECT_FALSE(requests.holds_any());
    EXPECT_EQ(requests.newest().count, 1U);
    EXPECT_EQ(requests.newest().reason, StopReason::estop);
}

TEST(StopRequests, For_the_end_keep_the_guardian_from_watching_again) {
    StopRequests requests;
    requests.end();
    EXPECT_TRUE(requests.is_ending());
    EXPECT_TRUE(requests.holds_any());
    EXPECT_EQ(requests.newest().reason, StopReason::unload);
}

TEST(StartState, Cuts_a_problem_that_is_too_long) {
    StartState state;
    EXPECT_EQ(state.reject(std::string(2000, 'x')), 1);
    EXPECT_EQ(state.phase(), StartState::Phase::rejected);
    EXPECT_EQ(std::string(state.problem()), std::string(511, 'x'));
    state.begin();
    EXPECT_EQ(state.phase(), StartState::Phase::starting);
}

TEST(ParentWatch, Finds_a_process_that_has_ended_before) {
    ParentWatch watch{link::Descriptor()};
    EXPECT_EQ(watch.look(1, 1'000'000, true, 1), ParentWatch::Change::died);
    EXPECT_TRUE(watch.is_dead());
    EXPECT_EQ(watch.look(1, 1'000'000, true, 2), ParentWatch::Change::none);
}

TEST(ReportLock, Rejects_a_second_program) {
    std::string name = (fs::temp_directory_path() / "lock-XXXXXX").string();
    const fs::path folder = ::mkdtemp(name.data());
    const std::string report = (folder / "guardian-frames").string();
    ReportLock first;
    ReportLock second;
    EXPECT_EQ(first.acquire(report, "can:can0"), "");
    EXPECT_EQ(second.acquire(report, "can:can0", 0),
              "another program uses 'can:can0' with a guardian of this name, or such a guardian "
              "still sends its stop; end that program, or load this one under another name");
    EXPECT_EQ(second.descriptor(), -1);
    {
        const link::Descriptor inherited(::dup(first.descriptor()));  // as by a guardian
        first.release();
        EXPECT_NE(second.acquire(report, "can:can0", 0), "");
    }
    EXPECT_EQ(second.acquire(report, "can:can0", 0), "");
    EXPECT_EQ(first.acquire("", "can:can0"), "") << "no folder for reports";
    EXPECT_EQ(first.acquire((folder / "none/report").string(), "can:can0"), "") << "not writable";
    fs::remove_all(folder);
}

/// The sets of the calling thread.
struct Capabilities {
    Capabilities() {
        __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
        std::array<__user_cap_data_struct, _LINUX_CAPABILITY_U32S_3> sets{};
        syscall(SYS_capget, &header, sets.data());
        permitted = sets[0].permitted;
        inheritable = sets[0].inheritable;
        for (unsigned long n = 0; n < 32; ++n) {
            if (prctl(PR_CAP_AMBIENT, PR_CAP_AMBIENT_IS_SET, n, 0UL, 0UL) == 1) {
                ambient |= std::uint32_t{1} << n;
            }
        }
    }
    void make_inheritable(std::uint32_t bits) const {
        __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
        std::array<__user_cap_data_struct, _LINUX_CAPABILITY_U32S_3> sets{};
        syscall(SYS_capget, &header, sets.data());
        sets[0].inheritable = bits;
        syscall(SYS_capset, &header, sets.data());
    }
    std::uint32_t permitted = 0, inheritable = 0, ambient = 0;
};

/// Runs in a thread, whose capabilities are its own.
template <class Body>
void in_thread(Body&& body) {
    std::thread(std::forward<Body>(body)).join();
}

constexpr std::uint32_t net_raw = 1U << 13;
constexpr std::uint32_t sys_nice = 1U << 23;

TEST(AmbientCapabilities, Are_lowered_again_whatever_was_raised_before) {
    if ((Capabilities().permitted & net_raw) == 0) GTEST_SKIP() << "CAP_NET_RAW is not permitted";
    for (const std::uint32_t inheritable : {0U, net_raw}) {
        for (const bool is_ambient : {false, true}) {
            if (is_ambient && inheritable == 0) continue;
            in_thread([&] {
                Capabilities().make_inheritable(inheritable);
                if (is_ambient) {
                    prctl(PR_CAP_AMBIENT, PR_CAP_AMBIENT_RAISE, 13UL, 0UL, 0UL);
                }
                const Capabilities before;
                {
                    const AmbientCapabilities raised;
                    EXPECT_NE(Capabilities().ambient & net_raw, 0U);
                }
                const Capabilities behind;
                EXPECT_EQ(behind.ambient, before.ambient);
                EXPECT_EQ(behind.inheritable, before.inheritable);
                EXPECT_EQ(behind.permitted, before.permitted);
            });
        }
    }
}

TEST(AmbientCapabilities, Are_lowered_when_raising_some_has_failed) {
    if ((Capabilities().permitted & net_raw) == 0) GTEST_SKIP() << "CAP_NET_RAW is not permitted";
    in_thread([&] {
        // SECBIT_NO_CAP_AMBIENT_RAISE: inheriting succeeds, raising fails
        if (prctl(PR_SET_SECUREBITS, 1UL << 6) != 0) GTEST_SKIP() << "no CAP_SETPCAP";
        const Capabilities before;
        {
            const AmbientCapabilities raised;
            EXPECT_EQ(Capabilities().ambient, before.ambient);
        }
        EXPECT_EQ(Capabilities().ambient, before.ambient);
        EXPECT_EQ(Capabilities().inheritable, before.inheritable);
    });
}

TEST(AmbientCapabilities, Do_not_reach_other_threads) {
    if ((Capabilities().permitted & sys_nice) == 0) GTEST_SKIP() << "CAP_SYS_NICE is not permitted";
    const Capabilities before;
    in_thread([&] {
        const AmbientCapabilities raised;
        EXPECT_NE(Capabilities().ambient & sys_nice, 0U);
    });
    EXPECT_EQ(Capabilities().ambient, before.ambient);
}

}  // namespace
}  // namespace hal::bus
