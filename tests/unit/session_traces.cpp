// SPDX-License-Identifier: MIT
// The trace of a session: what is recorded of each cycle. Under ThreadSanitizer, too.
#include <map>

#include "machine.hpp"
#include "machine/report/traces.hpp"

namespace hal::test {
namespace {

struct Traced : testing::Test {
    Traced() {
        machine.must(
            "loadrt threads name1=servo period1=1000000\nloadrt test-counter names=a,b\naddf a "
            "servo\naddf b servo");
        machine.start();
    }
    /// Takes events until there are `cycles` more cycles.
    void collect(std::size_t cycles) {
        const auto count = [&] {
            return std::count_if(events.begin(), events.end(), [](const TraceEvent& event) {
                return event.kind == TraceEvent::cycle;
            });
        };
        const auto until = count() + static_cast<std::ptrdiff_t>(cycles);
        EXPECT_TRUE(eventually([&] {
            TraceBatch batch = machine.session.traces().take();
            names.merge(batch.names);
            for (const TraceBatch::Part& part : batch.parts) {
                EXPECT_EQ(part.lost, 0u);
                EXPECT_GT(part.thread.tid, 0);
                events.insert(events.end(), part.events.begin(), part.events.end());
            }
            return count() >= until;
        }));
    }
    Machine machine{Clock::real};
    std::vector<TraceEvent> events;
    std::map<std::uint32_t, std::string> names;
};

TEST_F(Traced, Each_cycle_has_its_functions_in_order_and_within_it) {
    ASSERT_EQ(machine.session.traces().begin(), "");
    collect(20);
    std::vector<TraceEvent> inner;
    std::size_t whole = 0;
    for (const TraceEvent& event : events) {
        if (event.kind == TraceEvent::function) {
            inner.push_back(event);
        }
        if (event.kind != TraceEvent::cycle) continue;
        if (inner.size() == 2) {  // the first cycle may have begun before the trace
            ++whole;
            EXPECT_EQ(names[inner[0].id], "a");
            EXPECT_EQ(names[inner[1].id], "b");
            EXPECT_LE(event.begin_ns, inner[0].begin_ns);
            EXPECT_LE(inner[0].end_ns, inner[1].begin_ns);
            EXPECT_LE(inner[1].end_ns, event.end_ns);
            EXPECT_EQ(inner[1].cycle_number, event.cycle_number);
        }
        inner.clear();
    }
    EXPECT_GE(whole, 19u);
}

TEST_F(Traced, An_edit_is_recorded_and_a_thread_that_is_added_too) {
    ASSERT_EQ(machine.session.traces().begin(), "");
    collect(3);
    machine.must("delf b servo");
    collect(3);
    EXPECT_TRUE(std::any_of(events.begin(), events.end(), [](const TraceEvent& event) {
        return event.kind == TraceEvent::plan;
    }));
    events.clear();
    machine.must("newthread second 2000000\naddf b second");
    EXPECT_TRUE(eventually([&] {
        const TraceBatch batch = machine.session.traces().take();
        return std::any_of(
            batch.parts.begin(), batch.parts.end(),
            [](const TraceBatch::Part& part) { return part.thread.name == "second"; });
    }));
}

TEST_F(Traced, Nothing_is_recorded_after_the_end_and_names_come_again) {
    Traces& traces = machine.session.traces();
    EXPECT_TRUE(traces.take().parts.empty());
    ASSERT_EQ(traces.begin(), "");
    EXPECT_EQ(traces.begin(), "another client traces this instance; wait for its end");
    collect(3);
    traces.end();
    EXPECT_TRUE(traces.take().parts.empty());
    events.clear();
    names.clear();
    ASSERT_EQ(traces.begin(), "");
    collect(3);
    EXPECT_EQ(names.size(), 2u);
}

TEST(Traces, are_rejected_on_the_virtual_clock) {
    Machine machine;
    EXPECT_EQ(machine.session.traces().begin(),
              "this instance runs on a virtual clock, whose cycles take no time; trace an instance "
              "of: hal run");
}

TEST(TraceRing, counts_what_does_not_fit) {
    TraceRing ring;
    for (std::size_t i = 0; i < TraceRing::capacity + 3; ++i) {
        ring.put(TraceEvent::function, 1, 2, i, 7);
    }
    EXPECT_EQ(ring.lost(), 3u);
    TraceEvent event;
    ASSERT_TRUE(ring.take(event));
    EXPECT_EQ(event.cycle_number, 0u);
    ring.put(TraceEvent::function, 1, 2, 99, 7);
    EXPECT_EQ(ring.lost(), 3u);
}

}  // namespace
}  // namespace hal::test
