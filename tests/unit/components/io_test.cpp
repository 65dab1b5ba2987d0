// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <limits>
#include <string>
#include <thread>

#include "hal/stream_times.h"
#include "unit/components/component_host.hpp"

namespace {

using hal::test::Arguments;
using hal::test::Instance;

hal_stream* published = nullptr;  // by the newest instance that started
std::string published_as;
const hal_stream_host stream_host{sizeof stream_host,
                                  [](const hal_host*, const char* name, hal_stream* stream) {
    published = stream;
    published_as = name;
    return true;
}};

struct Streaming : Instance {
    Streaming(const char* component, Arguments arguments)
        : Instance(component, std::move(arguments), {{"hal.stream/1", &stream_host}}),
          fifo(*published) {}
    hal_stream& fifo;
    hal_value& value(std::uint64_t record, std::uint32_t column) {
        return fifo.data[record % fifo.depth * (fifo.columns + 1) + column];
    }
};

TEST(Sampler, Records_every_type_with_its_number) {
    Streaming s("sampler", {{"cfg", "bfsulK"}, {"depth", "4"}});
    EXPECT_EQ(published_as, "");  // the instance's own name
    EXPECT_STREQ(s.fifo.types, "bfsulk");
    EXPECT_EQ(s.fifo.columns, 6u);
    EXPECT_EQ(s.fifo.depth, 3u);  // records of a FIFO of 4 slots
    EXPECT_EQ(s.fifo.to_machine, 0u);
    s.set("pin.0", true);
    s.set("pin.1", -1.5);
    s.set("pin.2", std::numeric_limits<std::int32_t>::min());
    s.set("pin.3", std::numeric_limits<std::uint32_t>::max());
    s.set("pin.4", std::numeric_limits<std::int64_t>::min());
    s.set("pin.5", std::numeric_limits<std::uint64_t>::max());
    s.set("sample-num", 41);
    s.run(1);
    ASSERT_EQ(s.fifo.head, 1u);
    EXPECT_EQ(s.value(0, 0).raw, 1u);  // nothing but the bit
    EXPECT_EQ(s.value(0, 1).real, -1.5);
    EXPECT_EQ(s.value(0, 2).s32, std::numeric_limits<std::int32_t>::min());
    EXPECT_EQ(s.value(0, 3).u32, std::numeric_limits<std::uint32_t>::max());
    EXPECT_EQ(s.value(0, 4).s64, std::numeric_limits<std::int64_t>::min());
    EXPECT_EQ(s.value(0, 5).u64, std::numeric_limits<std::uint64_t>::max());
    EXPECT_EQ(s.value(0, 6).s64, 41);
    EXPECT_EQ(s.get<std::int32_t>("sample-num"), 42);
    EXPECT_EQ(s.get<std::int32_t>("curr-depth"), 1);
}

TEST(Sampler, A_full_fifo_loses_the_new_record_and_counts_it) {
    Streaming s("sampler", {{"cfg", "f"}, {"depth", "3"}});
    for (int i = 0; i < 5; ++i) {
        s.set("pin.0", i);
        s.run(1);
        EXPECT_EQ(s.get<bool>("full"), i >= 2);
        EXPECT_EQ(s.get<std::int32_t>("curr-depth"), std::min(i + 1, 3));
    }
    EXPECT_EQ(s.get<std::int32_t>("overruns"), 3);
    EXPECT_EQ(s.fifo.lost, 3u);
    EXPECT_EQ(s.value(0, 0).real, 0.0);
    s.fifo.tail = 1;  // the reader takes one: its place is used again
    s.set("pin.0", 9);
    s.run(1);
    EXPECT_EQ(s.fifo.head, 3u);
    EXPECT_EQ(s.value(2, 0).real, 9.0);
    EXPECT_EQ(s.value(2, 1).s64, 2);  // the numbers have no gap; the losses show it
    const auto& timed = reinterpret_cast<const hal_timed_stream&>(s.fifo);
    EXPECT_EQ(timed.losses[1], 0u);
    EXPECT_EQ(timed.losses[0], 3u);  // of record 2
    s.set("overruns", 0);
    s.fifo.tail = 3;
    s.run(1);
    EXPECT_EQ(s.get<std::int32_t>("overruns"), 0);
    EXPECT_FALSE(s.get<bool>("full"));
}

TEST(Sampler, Disabled_records_nothing) {
    Streaming s("sampler", {});
    s.set("enable", false);
    s.run(3);
    EXPECT_EQ(s.fifo.head, 0u);
    EXPECT_EQ(s.get<std::int32_t>("sample-num"), 0);
}

TEST(Sampler, Takes_many_pins_and_refuses_bad_arguments) {
    Streaming many("sampler", {{"cfg", std::string(300, 'u')}, {"depth", "2"}});
    many.set("pin.299", 7);
    many.run(1);
    EXPECT_EQ(many.value(0, 299).u32, 7u);
    EXPECT_THROW(Instance("sampler", {{"cfg", "fx"}}), std::runtime_error);
    EXPECT_THROW(Instance("sampler", {{"cfg", ""}}), std::runtime_error);
    EXPECT_THROW(Instance("sampler", {{"depth", "0"}}), std::runtime_error);
    EXPECT_THROW(Instance("sampler", {{"cfg", "ffffffff"}, {"depth", "60000000"}}),
                 std::runtime_error);
    Instance without("sampler");  // a host without streams
    without.run(1);
    EXPECT_EQ(without.get<std::int32_t>("curr-depth"), 1);
}

TEST(Sampler, A_reader_on_another_processor_sees_whole_records_in_order) {
    Streaming s("sampler", {{"cfg", "ss"}, {"depth", "64"}});
    constexpr std::uint64_t wanted = 50'000;
    std::atomic<bool> done{false};
    std::thread machine([&] {
        for (std::int32_t i = 0; !done; ++i) {
            s.set("pin.0", i);
            s.set("pin.1", i);
            s.run(1);
            if (s.get<bool>("full")) {
                std::this_thread::yield();
            }
        }
    });
    std::int64_t last = -1;
    bool whole = true;
    for (std::uint64_t tail = 0; tail < wanted;) {
        if (__atomic_load_n(&s.fifo.head, __ATOMIC_ACQUIRE) == tail) {
            std::this_thread::yield();
            continue;
        }
        whole = whole && s.value(tail, 0).s32 == s.value(tail, 1).s32 &&
                s.value(tail, 0).s32 > last && s.value(tail, 2).u64 == tail;
        last = s.value(tail, 0).s32;
        __atomic_store_n(&s.fifo.tail, ++tail, __ATOMIC_RELEASE);
    }
    done = true;
    machine.join();
    EXPECT_TRUE(whole);
    EXPECT_GE(last + 1, static_cast<std::int64_t>(wanted));
}

struct Player : Streaming {
    Player() : Streaming("streamer", {{"cfg", "fb"}, {"depth", "5"}}) {}
    void feed(double real, bool bit) {
        value(fifo.head, 0).real = real;
        value(fifo.head, 1).raw = bit ? 1 : 0;
        ++fifo.head;
    }
};

TEST(Streamer, Plays_a_record_per_cycle_then_keeps_the_last) {
    Player p;
    EXPECT_EQ(p.fifo.to_machine, 1u);
    for (int i = 1; i <= 3; ++i) {
        p.feed(i, i == 2);
    }
    for (int i = 1; i <= 3; ++i) {
        p.run(1);
        EXPECT_EQ(p.get<double>("pin.0"), i);
        EXPECT_EQ(p.get<bool>("pin.1"), i == 2);
        EXPECT_EQ(p.get<std::int32_t>("curr-depth"), 4 - i);
        EXPECT_FALSE(p.get<bool>("empty"));
    }
    p.run(2);
    EXPECT_EQ(p.get<double>("pin.0"), 3.0);
    EXPECT_TRUE(p.get<bool>("empty"));
    EXPECT_EQ(p.get<std::int32_t>("underruns"), 2);
    EXPECT_EQ(p.fifo.lost, 2u);
    EXPECT_EQ(p.fifo.tail, 3u);
}

TEST(Streamer, Clock_mode_chooses_the_edges) {
    struct Case {
        int mode;
        double after_rise, after_fall;
    };
    for (const Case c :
         {Case{0, 2, 3}, Case{1, 0, 1}, Case{2, 1, 1}, Case{3, 1, 2}, Case{7, 2, 3}}) {
        Player p;
        for (int i = 1; i <= 4; ++i) {
            p.feed(i, false);
        }
        p.set("clock-mode", c.mode);
        p.run(1);  // low, no edge
        p.set("clock", true);
        p.run(1);
        EXPECT_EQ(p.get<double>("pin.0"), c.after_rise) << c.mode;
        p.set("clock", false);
        p.run(1);
        EXPECT_EQ(p.get<double>("pin.0"), c.after_fall) << c.mode;
        EXPECT_EQ(p.get<std::int32_t>("underruns"), 0);
    }
}

TEST(Streamer, Disabled_takes_nothing_and_misses_nothing) {
    Player p;
    p.feed(1, false);
    p.set("enable", false);
    p.run(3);
    EXPECT_EQ(p.get<std::int32_t>("curr-depth"), 1);
    EXPECT_EQ(p.get<std::int32_t>("underruns"), 0);
    EXPECT_EQ(p.get<double>("pin.0"), 0.0);
}

TEST(Time, Runs_while_started_holds_in_a_pause_and_begins_anew) {
    Instance t("time");
    t.set("start", true);
    t.run("", 1'000'000'000, 3600 * 2 + 60 * 3 + 4);  // the first cycle counts, as in LinuxCNC
    EXPECT_EQ(t.get<std::uint32_t>("hours"), 2u);
    EXPECT_EQ(t.get<std::uint32_t>("minutes"), 3u);
    EXPECT_EQ(t.get<std::uint32_t>("seconds"), 4u);
    t.set("pause", true);
    t.run("", 1'000'000'000, 10);
    EXPECT_EQ(t.get<std::uint32_t>("seconds"), 4u);
    t.set("pause", false);
    t.run("", 500'000'000, 3);
    EXPECT_EQ(t.get<std::uint32_t>("seconds"), 5u);
    t.set("start", false);
    t.run("", 1'000'000'000, 10);
    EXPECT_EQ(t.get<std::uint32_t>("seconds"), 5u);
    t.set("start", true);
    t.run("", 1'000'000'000, 2);
    EXPECT_EQ(t.get<std::uint32_t>("seconds"), 2u);
    EXPECT_EQ(t.get<std::uint32_t>("hours"), 0u);
}

TEST(Supply, Copies_its_parameters) {
    Instance s("supply");
    s.set("value", 2.5);
    s.set("d", true);
    s.run("update");
    EXPECT_EQ(s.get<double>("variable"), 2.5);
    EXPECT_EQ(s.get<double>("_variable"), -2.5);
    EXPECT_TRUE(s.get<bool>("q"));
    EXPECT_FALSE(s.get<bool>("_q"));
}

}  // namespace
