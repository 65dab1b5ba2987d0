// SPDX-License-Identifier: MIT
#include <cmath>
#include <gtest/gtest.h>
#include <limits>

#include "tools/scope/acquisition.hpp"

namespace hal::tools {
namespace {

std::vector<std::int64_t> fired(const char* text, const std::vector<double>& values,
                                bool bit = false) {
    const TriggerText read = read_trigger(text);
    EXPECT_EQ(read.problem, "");
    TriggerSearch search(read.trigger, bit);
    std::vector<std::int64_t> times;
    for (std::size_t i = 0; i < values.size(); ++i) {
        if (const auto time = search.feed({static_cast<std::int64_t>(i) * 100, values[i]})) {
            times.push_back(*time);
        }
    }
    return times;
}

using Times = std::vector<std::int64_t>;

TEST(Trigger, texts_name_source_edge_and_level) {
    const auto rising = read_trigger("x-error > 0.1");
    EXPECT_EQ(rising.name, "x-error");
    EXPECT_EQ(rising.trigger.edge, Edge::rising);
    EXPECT_EQ(rising.trigger.level, 0.1);
    EXPECT_TRUE(rising.has_level);
    EXPECT_EQ(read_trigger("x<=-2e-3").trigger.edge, Edge::falling);
    EXPECT_EQ(read_trigger("x<=-2e-3").trigger.level, -2e-3);
    EXPECT_EQ(read_trigger("x <> 0").trigger.edge, Edge::either);
    EXPECT_EQ(read_trigger("level x < 3").trigger.edge, Edge::below);
    EXPECT_EQ(read_trigger("level !estop").trigger.edge, Edge::below);
    EXPECT_TRUE(read_trigger("|a.b| > 1").trigger.magnitude);
    EXPECT_EQ(read_trigger("|a.b| > 1").name, "a.b");
    EXPECT_EQ(read_trigger("!estop").trigger.edge, Edge::falling);
    EXPECT_FALSE(read_trigger("estop").has_level);
}

TEST(Trigger, invalid_texts_are_rejected_with_an_example) {
    EXPECT_EQ(read_trigger("x > much").problem,
              "invalid trigger 'x > much': 'much' is not a number; type for example: --trigger "
              "'x-error > 0.1', "
              "'x-error < 0', '|x-error| > 0.1' or 'estop'");
    for (const char* bad : {"", "> 1", "a b > 1", "x >", "level x <> 1", "||", "x > nan", "!"}) {
        EXPECT_NE(read_trigger(bad).problem, "") << bad;
    }
}

TEST(Trigger, a_formatted_trigger_reads_back) {
    const std::vector<Channel> channels{{"x", "", false, false}, {"stop", "", true, true}};
    for (const char* text : {"x > 0.1", "x < -3", "x <> 0", "level x > 2", "|x| > 1"}) {
        EXPECT_EQ(format_trigger(read_trigger(text).trigger, channels), text);
    }
    for (const char* text : {"stop", "!stop", "level !stop"}) {
        auto trigger = read_trigger(text).trigger;
        trigger.source = 1;
        EXPECT_EQ(format_trigger(trigger, channels), text);
    }
}

TEST(Trigger, an_edge_is_interpolated_between_two_samples) {
    EXPECT_EQ(fired("x > 1", {0, 0, 4, 4}), Times{125});
    EXPECT_EQ(fired("x < 1", {0, 4, 0}), Times{175});
    EXPECT_EQ(fired("x <> 1", {0, 2, 0}), (Times{50, 150}));
}

TEST(Trigger, a_signal_that_begins_above_the_level_has_no_edge) {
    EXPECT_EQ(fired("x > 1", {5, 5, 5}), Times{});
}

TEST(Trigger, noise_below_the_hysteresis_does_not_fire_again) {
    EXPECT_EQ(fired("x > 1", {0, 2, 0.99, 1.01, 0.99, 1.01}).size(), 1u) << "1 % of the range of 2";
    EXPECT_EQ(fired("x > 1", {0, 2, 0.97, 1.01}).size(), 2u);
}

TEST(Trigger, a_bit_has_no_hysteresis_and_fires_at_its_sample) {
    EXPECT_EQ(fired("b", {0, 1, 0, 1}, true), (Times{100, 300}));
    EXPECT_EQ(fired("!b", {0, 1, 0, 1}, true), Times{200});
}

TEST(Trigger, a_level_fires_at_every_sample_of_the_state) {
    EXPECT_EQ(fired("level x > 1", {5, 0, 5, 5}), (Times{0, 200, 300}));
}

TEST(Trigger, not_a_number_neither_arms_nor_fires) {
    const double nan = std::nan("");
    EXPECT_EQ(fired("x > 1", {0, nan, 2, 2}), Times{})
        << "an edge across an invalid value is not one";
    EXPECT_EQ(fired("level x > 1", {nan, nan}), Times{});
    EXPECT_EQ(fired("x > 1", {nan, 0, 2}), Times{150});
}

TEST(Trigger, infinity_fires_at_its_sample) {
    EXPECT_EQ(fired("x > 1", {0, std::numeric_limits<double>::infinity()}).size(), 1u);
}

TEST(Trigger, a_magnitude_fires_on_both_sides) {
    EXPECT_EQ(fired("|x| > 1", {0, -2, 0, 2}).size(), 2u);
}

// One channel, a sample each 10 ns, in batches of one.
struct Scope {
    Acquisition acquisition{{{"x", "", false, false}}, 50, 100};
    std::int64_t now = 0;
    explicit Scope(Mode mode) {
        acquisition.set_mode(mode);
        acquisition.set_trigger(read_trigger("x > 1").trigger);
    }
    void feed(double value, int times = 1) {
        for (; times > 0; --times, now += 10) {
            acquisition.feed(0, {now, value});
            acquisition.progress(now + 10);
        }
    }
};

TEST(Acquisition, a_record_has_the_time_before_and_after_the_trigger) {
    Scope scope(Mode::normal);
    scope.feed(0, 10);
    EXPECT_EQ(scope.acquisition.state(), State::armed);
    scope.feed(2, 9);
    EXPECT_EQ(scope.acquisition.state(), State::triggered);
    EXPECT_EQ(scope.acquisition.record(), nullptr);
    scope.feed(2, 2);
    const Record* record = scope.acquisition.record();
    ASSERT_NE(record, nullptr);
    EXPECT_TRUE(record->triggered);
    EXPECT_EQ(record->trigger_ns, 95);
    EXPECT_EQ(record->begin_ns, 45);
    EXPECT_EQ(record->end_ns, 195);
    EXPECT_EQ(record->samples[0].front().time_ns, 40) << "the value that holds at the beginning";
    EXPECT_EQ(record->samples[0].back().time_ns, 190);
}

TEST(Acquisition, a_trigger_before_the_pre_trigger_time_is_full_does_not_count) {
    Scope scope(Mode::normal);
    scope.feed(0, 2);
    scope.feed(2, 30);
    EXPECT_EQ(scope.acquisition.finished(), 0u);
    scope.feed(0);
    scope.feed(2, 12);
    EXPECT_EQ(scope.acquisition.finished(), 1u);
}

TEST(Acquisition, normal_keeps_its_record_and_single_stops) {
    Scope normal(Mode::normal), single(Mode::single);
    for (Scope* scope : {&normal, &single}) {
        for (int i = 0; i < 3; ++i) {
            scope->feed(0, 10);
            scope->feed(2, 20);
        }
        scope->feed(0, 500);
    }
    EXPECT_EQ(normal.acquisition.finished(), 3u);
    EXPECT_EQ(normal.acquisition.record()->trigger_ns, 695);
    EXPECT_EQ(normal.acquisition.state(), State::armed);
    EXPECT_EQ(single.acquisition.finished(), 1u);
    EXPECT_EQ(single.acquisition.state(), State::stopped);
    single.acquisition.run();
    single.feed(0, 2);
    single.feed(2, 20);
    EXPECT_EQ(single.acquisition.finished(), 2u);
}

TEST(Acquisition, automatic_runs_freely_after_50_ms_without_a_trigger) {
    constexpr std::int64_t ms = 1'000'000;
    Acquisition acquisition({{"x", "", false, false}}, 2 * ms, 8 * ms);
    acquisition.set_mode(Mode::automatic);
    acquisition.set_trigger(read_trigger("x > 1").trigger);
    const auto feed = [&](int from, int until) {
        for (int i = from; i < until; ++i) {
            acquisition.feed(0, {i * ms, 0});
            acquisition.progress(i * ms);
        }
    };
    feed(0, 50);
    EXPECT_EQ(acquisition.finished(), 0u);
    feed(50, 60);
    ASSERT_EQ(acquisition.finished(), 1u);
    EXPECT_FALSE(acquisition.record()->triggered);
}

TEST(Acquisition, force_and_stop_act_in_every_state) {
    Scope scope(Mode::normal);
    scope.acquisition.force();  // nothing has come yet
    scope.acquisition.stop();
    scope.acquisition.run();
    scope.feed(0, 10);
    scope.acquisition.force();
    scope.feed(0, 12);
    ASSERT_NE(scope.acquisition.record(), nullptr);
    EXPECT_FALSE(scope.acquisition.record()->triggered);
    scope.acquisition.stop();
    scope.feed(2, 40);
    EXPECT_EQ(scope.acquisition.finished(), 1u);
}

TEST(Acquisition, without_a_trigger_the_first_full_window_is_the_record) {
    Scope scope(Mode::single);
    scope.acquisition.set_trigger(std::nullopt);
    scope.feed(3, 20);
    ASSERT_EQ(scope.acquisition.finished(), 1u);
    EXPECT_GE(scope.acquisition.record()->samples[0].size(), 15u);
}

TEST(Acquisition, channels_of_several_threads_are_cut_by_time) {
    Acquisition acquisition({{"fast", "", false, false}, {"slow", "", false, false}}, 100, 100);
    acquisition.set_mode(Mode::single);
    acquisition.set_trigger(read_trigger("fast > 1").trigger);
    for (std::int64_t t = 0; t < 1000; t += 10) {
        acquisition.feed(0, {t, t >= 500 ? 2.0 : 0.0});
        if (t % 100 == 0) {
            acquisition.feed(1, {t, static_cast<double>(t)});
        }
        acquisition.progress(t);
    }
    ASSERT_EQ(acquisition.finished(), 1u);
    const Record& record = *acquisition.record();
    EXPECT_EQ(record.trigger_ns, 495);
    EXPECT_EQ(record.samples[1].front().time_ns, 300);
    EXPECT_EQ(record.samples[1].back().time_ns, 500);
}

}  // namespace
}  // namespace hal::tools
