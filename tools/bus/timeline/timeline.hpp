// SPDX-License-Identifier: MIT
// The timing of a bus as data: what a plan fills and timeline_svg() draws. Times are in
// nanoseconds from the start of the cycle.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace hal::tools {

/// What a colour stands for is stated in the key of each picture.
enum class Colour { clock, leader, follower, idle, compared };

/// A time during which a lane is occupied.
struct Bar {
    enum class Shape { solid, pale, dashed };
    std::int64_t from_ns = 0;
    std::int64_t until_ns = 0;
    Colour colour = Colour::leader;
    Shape shape = Shape::solid;
};

/// A text behind a time, or in the middle of a bar.
struct Label {
    std::int64_t at_ns = 0;
    std::string text;
    bool centred = false;
};

/// A moment: a thread begins its cycle, or the clock of a device ticks.
struct Moment {
    enum class Kind { thread, tick };
    std::int64_t at_ns = 0;
    Kind kind = Kind::thread;
};

struct Lane {
    std::string name;
    std::vector<Bar> bars;
    std::vector<Label> labels;
    std::vector<Moment> moments;
};

/// The way of a value through the cycles, drawn below the lanes.
struct Journey {
    std::int64_t from_ns = 0;
    std::int64_t until_ns = 0;
    std::string from;  ///< what happens at its beginning
    std::string until;
};

/// How long a message takes in the worst case; below 0: without a bound.
struct ResponseTime {
    std::string name;
    std::int64_t worst_ns = 0;
    Colour colour = Colour::leader;
    std::optional<std::int64_t> compared_ns;  ///< the same message in another way
    std::optional<std::int64_t> deadline_ns;
};

struct KeyEntry {
    enum class Sample { bar, pale, dashed, thread, tick };
    Sample sample = Sample::bar;
    Colour colour = Colour::leader;
    std::string text;
};

struct Timeline {
    std::string command;  ///< "hal tdma plan": who made the picture
    std::string title;
    std::int64_t cycle_ns = 0;
    std::int64_t shown_ns = 0;  ///< the time from 0 that is drawn
    std::vector<Lane> lanes;    ///< may be empty: response times alone
    std::vector<KeyEntry> key;
    std::vector<Journey> journeys;
    std::string response_title;
    std::vector<ResponseTime> responses;
    std::vector<std::string> summary;  ///< a line each
};

/// Returns the picture. The same timeline gives the same text. [setup]
std::string timeline_svg(const Timeline&);

}  // namespace hal::tools
