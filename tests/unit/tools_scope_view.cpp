// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <numbers>

#include "tools/scope/chart.hpp"
#include "tools/scope/view.hpp"

namespace hal::tools {
namespace {

constexpr std::int64_t ms = 1'000'000;

// A step of x at 100 ms and a bit that is set at the same time; 20 ms before, 80 ms after the
// trigger.
struct Bench {
    Acquisition acquisition{
        {{"x", "mm", false, false}, {"done", "", true, true}}, 20 * ms, 80 * ms};
    ScopeView view{acquisition, false, false};
    Bench() {
        acquisition.set_mode(Mode::normal);
        acquisition.set_trigger(read_trigger("x > 1").trigger);
        run(0, 200);
    }
    void run(int from, int until) {
        for (int i = from; i < until; ++i) {
            acquisition.feed(0, {i * ms, i < 100 ? 0.0 : 4.0});
            acquisition.feed(1, {i * ms, i < 100 ? 0.0 : 1.0});
            acquisition.progress(i * ms);
        }
    }
    void type(const char* letters) {
        for (; *letters; ++letters) {
            view.key({Code::character, *letters, false});
        }
    }
    std::string line(std::size_t i, std::size_t columns = 120) {
        return view.frame(columns, 20)[i];
    }
};

bool has(const std::string& text, const char* part) { return text.find(part) != std::string::npos; }

TEST(ScopeView, the_status_line_has_mode_state_trigger_and_record) {
    Bench bench;
    const std::string status = bench.line(0);
    for (const char* part : {"normal armed", "10 ms/div", "trigger x > 1", "record 1"}) {
        EXPECT_TRUE(has(status, part)) << part << ": " << status;
    }
    EXPECT_TRUE(has(bench.view.frame(120, 20, 7)[0], "LOST 7 samples"));
}

TEST(ScopeView, a_frame_fills_the_terminal_and_a_small_one_says_so) {
    Bench bench;
    const auto lines = bench.view.frame(80, 24);
    ASSERT_EQ(lines.size(), 24u);
    for (const std::string& line : lines) {
        EXPECT_EQ(line.size(), 80u);
    }
    EXPECT_TRUE(has(bench.view.frame(39, 24)[0], "too small"));
}

TEST(ScopeView, channels_are_fitted_into_lanes_with_the_step_drawn) {
    Bench bench;
    // two channels: 20 rows for the picture, 10 for each lane
    const auto lines = bench.view.frame(100, 24);
    EXPECT_EQ(bench.view.traces()[0].per_division, 2) << "4 mm within 3.6 divisions";
    EXPECT_EQ(bench.view.traces()[1].per_division, 0.5);
    // Before the trigger at one fifth of the width x is low in its lane, after it high.
    const auto dots = [&](std::size_t column) {
        std::vector<std::size_t> rows;
        for (std::size_t row = 1; row <= 10; ++row) {
            if (lines[row][column] != ' ') {
                rows.push_back(row);
            }
        }
        return rows;
    };
    EXPECT_GT(dots(5).back(), dots(95).front());
    EXPECT_EQ(dots(5).size(), 1u);
}

TEST(ScopeView, channel_lines_have_measurements) {
    Bench bench;
    const std::string line = bench.line(17);
    for (const char* part : {">1 x ", "2 mm/div", "min 0 mm", "max 4 mm", "overshoot 0 %"}) {
        EXPECT_TRUE(has(line, part)) << part << ": " << line;
    }
    bench.type("m");
    EXPECT_FALSE(has(bench.line(17), "min 0 mm"));
}

TEST(ScopeView, keys_change_scale_window_and_mode) {
    Bench bench;
    bench.line(0);  // fits the channels
    bench.type("+");
    EXPECT_EQ(bench.view.traces()[0].per_division, 1);
    bench.type("--");
    EXPECT_EQ(bench.view.traces()[0].per_division, 5);
    bench.type("]");
    EXPECT_EQ(bench.acquisition.pre_ns(), 40 * ms);
    EXPECT_EQ(bench.acquisition.post_ns(), 160 * ms);
    bench.type(">");
    EXPECT_EQ(bench.acquisition.pre_ns(), 60 * ms);
    bench.type("r");
    EXPECT_EQ(bench.acquisition.mode(), Mode::roll);
    bench.type(" ");
    EXPECT_EQ(bench.acquisition.state(), State::stopped);
    bench.type("2");
    EXPECT_EQ(bench.view.selected(), 1u);
    bench.type("9");
    EXPECT_EQ(bench.view.selected(), 1u) << "no ninth channel";
    EXPECT_EQ(bench.view.key({Code::character, 'q', false}), ScopeView::Action::quit);
    EXPECT_EQ(bench.view.key({Code::character, 'w', false}), ScopeView::Action::save);
}

TEST(ScopeView, keys_change_the_trigger) {
    Bench bench;
    bench.line(0);
    bench.view.key({Code::up, 0, false});
    EXPECT_NEAR(bench.acquisition.trigger()->level, 1.2, 1e-9) << "a tenth of 2 mm/div";
    bench.view.key({Code::down, 0, true});
    EXPECT_NEAR(bench.acquisition.trigger()->level, -0.8, 1e-9);
    bench.type("t");
    EXPECT_EQ(bench.acquisition.trigger()->edge, Edge::falling);
    bench.type("2o");
    EXPECT_EQ(bench.acquisition.trigger()->source, 1u);
    EXPECT_EQ(bench.acquisition.trigger()->level, 0.5);
}

TEST(ScopeView, cursors_step_from_sample_to_sample_and_measure_between_them) {
    Bench bench;
    bench.type("c");
    ASSERT_TRUE(bench.view.cursors().on);
    bench.view.key({Code::right, 0, false});
    const Record record = bench.view.shown();
    EXPECT_EQ(bench.view.cursors().at_ns[0] + record.trigger_ns, 100 * ms)
        << "the first sample after the interpolated trigger";
    bench.view.key({Code::left, 0, false});
    EXPECT_EQ(bench.view.cursors().at_ns[0] + record.trigger_ns, 99 * ms);
    bench.type("c");
    bench.view.key({Code::left, 0, true});
    EXPECT_EQ(bench.view.cursors().active, 1);
    const std::string line = bench.line(17, 160);
    for (const char* part : {"y1 0 mm", "y2 4 mm", "dy 4 mm", "min 0 mm"}) {
        EXPECT_TRUE(has(line, part)) << part << ": " << line;
    }
    EXPECT_TRUE(has(bench.line(19, 160), "cursors: t1")) << bench.line(19, 160);
    bench.type("c");
    EXPECT_FALSE(bench.view.cursors().on);
}

TEST(ScopeView, every_key_works_without_any_sample) {
    Acquisition acquisition({{"x", "", false, false}}, 20 * ms, 80 * ms);
    ScopeView view(acquisition, true, true);
    view.frame(80, 24);
    for (char c = ' '; c < 127; ++c) {
        view.key({Code::character, c, false});
        for (const Code code : {Code::up, Code::down, Code::left, Code::right, Code::page_up,
                                Code::page_down, Code::tab, Code::escape}) {
            view.key({code, 0, true});
        }
        EXPECT_EQ(view.frame(80, 24).size(), 24u) << c;
    }
}

// A sine of 0.1 Hz and amplitude 3, sampled every 10 ms.
struct SlowBench {
    Acquisition acquisition{{{"x", "mm", false, false}}, 20 * ms, 80 * ms};
    ScopeView view{acquisition, false, false};
    std::int64_t now_ms = 0;
    void run(int seconds) {
        for (const std::int64_t until = now_ms + seconds * 1000; now_ms < until; now_ms += 10) {
            const double x = 3 * std::sin(2 * std::numbers::pi * 0.1 * static_cast<double>(now_ms) / 1000);
            acquisition.feed(0, {now_ms * ms, x});
            acquisition.progress(now_ms * ms);
            if (now_ms % 100 == 0) {
                view.frame(80, 24);
            }
        }
    }
    void type(char letter) { view.key({Code::character, letter, false}); }
    /// The number of different heights of the trace in the picture.
    std::size_t drawn_rows() {
        const auto lines = view.frame(80, 24);
        return static_cast<std::size_t>(std::count_if(
            lines.begin() + 1, lines.begin() + 21,
            [](const std::string& line) { return std::count(line.begin(), line.end(), ':') > 0; }));
    }
    /// Whether the whole signal is within the picture.
    bool is_visible() const {
        const ChannelView& trace = view.traces()[0];
        const double half = divisions_y / 2.0 * trace.per_division;
        return trace.centre - half <= -3 + 1e-9 && trace.centre + half >= 3 - 1e-9;
    }
};

TEST(ScopeView, the_scale_grows_with_a_slow_signal) {
    SlowBench bench;
    bench.acquisition.set_mode(Mode::automatic);
    bench.run(1);  // fitted to a part of the rising edge
    EXPECT_FALSE(bench.is_visible());
    bench.run(10);
    EXPECT_TRUE(bench.is_visible());
    EXPECT_LE(bench.view.traces()[0].per_division, 2);
    const double scale = bench.view.traces()[0].per_division;
    bench.run(20);  // it is stable then
    EXPECT_EQ(bench.view.traces()[0].per_division, scale);
}

TEST(ScopeView, roll_shows_periods_of_a_slow_signal_and_another_mode_the_window_of_before) {
    SlowBench bench;
    bench.acquisition.set_mode(Mode::automatic);
    bench.run(1);
    bench.type('r');
    EXPECT_TRUE(bench.view.rolls());
    bench.run(25);
    EXPECT_TRUE(has(bench.view.frame(80, 24)[0], "2 s/div"));
    EXPECT_TRUE(bench.is_visible());
    EXPECT_GE(bench.drawn_rows(), 8u);
    bench.type('n');
    EXPECT_TRUE(has(bench.view.frame(80, 24)[0], "10 ms/div"));
    EXPECT_FALSE(bench.view.rolls());
}

TEST(ScopeView, automatic_mode_rolls_with_a_long_window_until_a_trigger_comes) {
    SlowBench bench;
    bench.acquisition.set_mode(Mode::automatic);
    bench.acquisition.set_trigger(read_trigger("x > 5").trigger);
    bench.acquisition.set_window(2000 * ms, 8000 * ms);
    bench.run(3);
    EXPECT_TRUE(bench.view.rolls());
    EXPECT_TRUE(has(bench.view.frame(80, 24)[0], "rolls"));
    EXPECT_EQ(bench.view.shown().end_ns, (bench.now_ms - 10) * ms);
    bench.acquisition.set_trigger(read_trigger("x > 1").trigger);
    bench.run(25);
    EXPECT_FALSE(bench.view.rolls());
    EXPECT_TRUE(bench.view.shown().triggered);
}

TEST(ScopeView, a_scale_that_a_key_has_set_stays) {
    SlowBench bench;
    bench.acquisition.set_mode(Mode::automatic);
    bench.run(1);
    bench.type('+');
    const double scale = bench.view.traces()[0].per_division;
    bench.run(10);
    EXPECT_EQ(bench.view.traces()[0].per_division, scale);
    bench.type('a');
    bench.run(10);
    EXPECT_TRUE(bench.is_visible());
}

TEST(ScopeView, arrows_point_to_what_is_off_the_screen) {
    Bench bench;
    const auto lines = bench.view.frame(80, 24);
    EXPECT_FALSE(has(lines[1], "1^"));
    for (int i = 0; i < 12; ++i) {
        bench.view.key({Code::page_up, 0, false});
    }
    const auto above = bench.view.frame(80, 24);
    EXPECT_EQ(above[1].substr(78), "1^");
    for (int i = 0; i < 24; ++i) {
        bench.view.key({Code::page_down, 0, false});
    }
    const auto below = bench.view.frame(80, 24);
    EXPECT_FALSE(has(below[1], "1^"));
    const auto last = std::find_if(below.rbegin(), below.rend(),
                                   [](const std::string& line) { return line.substr(78) == "1v"; });
    EXPECT_NE(last, below.rend());
}

TEST(ScopeView, steps_are_1_2_5) {
    double value = 0.001;
    for (const double next : {0.002, 0.005, 0.01, 0.02, 0.05, 0.1}) {
        EXPECT_NEAR(value = next_step(value, true), next, next * 1e-9);
    }
    for (const double next : {0.05, 0.02, 0.01, 0.005}) {
        EXPECT_NEAR(value = next_step(value, false), next, next * 1e-9);
    }
}

TEST(Chart, a_table_has_a_row_per_time_relative_to_the_trigger) {
    Record record;
    record.samples = {{{0, 1.5}, {10, 2.5}}, {{5, 1}}};
    record.trigger_ns = 5;
    record.end_ns = 10;
    const std::vector<Channel> channels{{"x", "mm", false, false}, {"a,b", "", true, true}};
    EXPECT_EQ(chart_csv(channels, record),
              "time_s,x [mm],\"a,b\"\n-0.000000005,1.5,\n0.000000000,1.5,1\n0.000000005,2.5,1\n");
}

TEST(Chart, a_picture_has_a_lane_per_channel_and_skips_invalid_values) {
    Record record;
    record.samples = {{{0, 1.5}, {10, std::nan("")}, {20, 2.5}, {30, 3}}, {{0, 1}}};
    record.end_ns = 30;
    record.triggered = true;
    const std::string svg =
        chart_svg({{"x<y", "mm", false, false}, {"on", "", true, true}}, record, "x<y > 1");
    EXPECT_TRUE(has(svg, "x&lt;y [mm]"));
    EXPECT_TRUE(has(svg, ">on<"));
    EXPECT_FALSE(has(svg, "nan"));
    EXPECT_EQ(svg.find("M84.00"), svg.rfind("M84.00", svg.find(">on<")))
        << "one line begins at the left";
}

}  // namespace
}  // namespace hal::tools
