// SPDX-License-Identifier: MIT
// The smaller components: NaN values and rejected load arguments, which netlist tests cannot
// express.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "unit/components/component_host.hpp"

namespace {

using hal::test::Arguments;
using hal::test::Instance;
constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double infinity = std::numeric_limits<double>::infinity();

void expect_refused(const std::string& component, const char* argument, const char* value,
                    const char* reason) {
    try {
        Instance refused(component, {{argument, value}});
        ADD_FAILURE() << component << " " << argument << "=" << value << " is taken";
    } catch (const std::runtime_error& e) {
        EXPECT_NE(std::string(e.what()).find(reason), std::string::npos) << e.what();
    }
}

TEST(Catalogue, Refuses_load_arguments_that_make_no_sense) {
    expect_refused("logic", "personality", "0x100", "inputs in its low byte; expected 1 to 16");
    expect_refused("logic", "personality", "0x111", "inputs in its low byte; expected 1 to 16");
    expect_refused("bitslice", "personality", "33", "outside 1..32");
    expect_refused("lincurve", "personality", "0", "outside 1..16");
    for (const char* config : {"", "f", "ff", "8", "fx8", "ffb8", "ff0", "ff1025", "ff99999"}) {
        expect_refused("mux_generic", "config", config, "config=");
    }
    for (const char* enums : {"", "D", "X;a", "D;", "D;;;"}) {
        expect_refused("enum", "enums", enums, "enums=");
    }
}

TEST(Catalogue, Names_ways_and_labels_as_the_arguments_say) {
    Instance mux("mux_generic", {{"config", "U3S"}});
    EXPECT_TRUE(mux.has_pin("in-u32-02"));
    EXPECT_FALSE(mux.has_pin("in-u32-03"));
    EXPECT_TRUE(mux.has_pin("out-s32"));
    EXPECT_TRUE(mux.has_pin("sel-bit-00"));  // a power of two plus one
    EXPECT_FALSE(mux.has_pin("sel-bit-01"));
    EXPECT_FALSE(Instance("mux_generic", {{"config", "U6S"}}).has_pin("sel-bit-00"));
    Instance code("enum", {{"enums", "E;a;;c"}});
    EXPECT_EQ(code.get<std::uint32_t>("c-val"), 2u);
    EXPECT_TRUE(code.has_pin("a-in"));
    EXPECT_TRUE(code.has_pin("output"));
}

TEST(Catalogue, Filters_survive_what_is_not_a_number) {
    struct Filter {
        const char *name, *in, *out;
    };
    for (const Filter f : {Filter{"ilowpass", "", "out"}, Filter{"biquad", "in", "out"},
                           Filter{"filter_kalman", "zk", "xk-out"}, Filter{"lincurve", "in", "out"},
                           Filter{"joyhandle", "in", "out"}}) {
        Instance filter(f.name);
        if (std::string(f.name) == "biquad") {
            filter.set("type", 1);
            filter.set("f0", 100.0);
            filter.set("enable", true);
        }
        if (*f.in == '\0') {
            filter.set("in", 3);
            filter.set("gain", nan);
            filter.run(5);
            filter.set("gain", 1.0);
            filter.run();
            EXPECT_EQ(filter.get<std::int32_t>(f.out), 3 * 1024);
            continue;
        }
        for (const double bad : {nan, infinity, -infinity, 1e308, -1e308}) {
            filter.set(f.in, bad);
            filter.run(3);
        }
        filter.set(f.in, 0.5);
        filter.run(2000);
        EXPECT_TRUE(std::isfinite(filter.get<double>(f.out))) << f.name;
    }
}

TEST(Catalogue, A_timer_without_a_sensible_time_does_not_wait) {
    for (const double pt : {nan, -1.0, 0.0}) {
        Instance ton("ton");
        ton.set("pt", pt);
        ton.set("in", true);
        ton.run();
        EXPECT_TRUE(ton.get<bool>("q"));
        EXPECT_EQ(ton.get<double>("et"), 0.0);
        Instance tp("tp");
        tp.set("pt", pt);
        tp.set("in", true);
        tp.run();
        EXPECT_FALSE(tp.get<bool>("q"));
    }
}

TEST(Catalogue, Integers_stay_in_their_range) {
    Instance updown("updown");
    updown.set("min", INT32_MAX);
    updown.set("max", INT32_MIN);
    updown.set("wrap", true);
    updown.run(3);
    Instance way("modmath");
    way.set("min-num", INT32_MIN);
    way.set("max-num", INT32_MAX);
    way.set("actual", INT32_MIN);
    way.set("desired", INT32_MAX);
    way.run();
    EXPECT_TRUE(way.get<bool>("down"));  // one step round the corner
    Instance sums("scaled_s32_sums");
    sums.set("in0", 1);
    sums.set("scale0", nan);
    sums.run();
    EXPECT_EQ(sums.get<std::int32_t>("out-s"), 0);
    Instance latch("safety_latch");
    latch.set("harm", INT32_MIN);
    latch.set("heal", INT32_MIN);
    latch.set("min", INT32_MIN);
    latch.set("max", INT32_MAX);
    latch.run(10);
    EXPECT_EQ(latch.get<std::int32_t>("count"), INT32_MAX);
}

}  // namespace
