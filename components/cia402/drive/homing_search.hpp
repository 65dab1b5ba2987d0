// SPDX-License-Identifier: MIT
// Homing methods 1 to 37 (CiA 402): the direction of the next motion, until the home position is
// found.
//
// A method ends with a last passage: over one edge of one switch, in one direction, slowly; then,
// for methods 1 to 14, on to the next index pulse. Before that the edge is searched at high speed.
// A home switch in the middle of the travel divides it into regions left of it, inside, and right
// of it; a switch at an end into inside and one other. The region follows from the level of the
// switch and the direction of each passage. Outside a home switch it is unknown at the start: then
// the axis moves in the method's first direction until it meets the switch or a limit switch.
#pragma once

#include <cstdint>
#include <optional>

#include "cia402/drive/plant.hpp"

namespace hal::cia402 {

class HomingSearch {
public:
    /// What the axis must do now.
    enum class Act : std::uint8_t { fast, slow, stop_at_home, failed };
    struct Order {
        Act act = Act::failed;
        int direction = 0;  ///< of fast and slow
    };
    /// Returns true for methods this search implements. [any]
    static bool supports(int method) noexcept;

    /// Starts a search. Returns false for an unsupported method. [realtime]
    bool begin(int method, const Plant&) noexcept;
    /// Evaluates the last step of the plant. `speed` is the present demand, `slow` the speed of the
    /// search for zero, increments/s. [realtime]
    Order step(const Plant&, double speed, double slow) noexcept;
    /// Returns the home position along the travel, valid once the order is stop_at_home.
    double home() const noexcept { return home_; }

private:
    enum class Switch : std::uint8_t { none, negative, positive, home };
    enum class Edge : std::uint8_t { left, right };
    enum Region : std::int8_t { unknown = -1, left = 0, inside = 1, right = 2 };
    struct Rule {
        Switch which;
        Edge edge;
        std::int8_t last;  // direction of the last passage
        std::int8_t first;  // direction while the region is unknown; 0: known by the level
    };
    static const Rule rules[15];
    static Range range(const Plant&, Switch) noexcept;
    Region before_edge() const noexcept;  // where the last passage starts
    void track(const Plant&, double speed, double slow) noexcept;
    void pass(double position, Region to, bool wanted, double speed, double slow,
              int direction) noexcept;
    Order order(const Plant&) noexcept;
    Order search_index(const Plant&) const noexcept;
    int next_direction() const noexcept;
    static bool blocked(const Plant&, int direction) noexcept;

    Rule rule_{};
    Region region_ = unknown;
    bool index_ = false;
    bool edge_found_ = false;
    bool searching_index_ = false;
    bool found_ = false;

    bool turned_ = false;
    int direction_ = 0;  // of the search for the index pulse
    double edge_ = 0;
    double home_ = 0;
};

}  // namespace hal::cia402
