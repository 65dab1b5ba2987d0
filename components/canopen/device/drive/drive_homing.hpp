// SPDX-License-Identifier: MIT
// Homing methods 1–37: which way to go next, until the home position is found.
//
// A method is a last passage: over one edge of one switch, in one direction, slowly; then, for methods 1–14, on to the next index
// pulse. Before that the edge is searched fast. A home switch in the middle of the travel has places left of it, inside, and right of
// it; a switch at an end has inside and one other. Which of them one is in follows from its level and the direction of each passage;
// outside a home switch at the start it is unknown: then the method's first direction is taken until the switch, or the limit switch.
#pragma once

#include <cstdint>
#include <optional>

#include "drive_plant.hpp"

namespace hal::canopen::cia402 {

class HomingSearch {
public:
    /// What the axis should do now.
    enum class Act : std::uint8_t { fast, slow, stop_at_home, failed };
    struct Order {
        Act act = Act::failed;
        int direction = 0;  ///< of fast and slow
    };
    /// [any]
    static bool supports(int method) noexcept;

    /// False: that method does not exist here. [realtime]
    bool begin(int method, const Plant&) noexcept;
    /// Looks at what the last step of the plant passed. `speed` is the present demand, `slow` the speed of the search for zero. [realtime]
    Order step(const Plant&, double speed, double slow) noexcept;
    /// Along the travel, once the order is stop_at_home.
    double home() const noexcept { return home_; }

private:
    enum class Switch : std::uint8_t { none, negative, positive, home };
    enum class Edge : std::uint8_t { left, right };
    enum Region : std::int8_t { unknown = -1, left = 0, inside = 1, right = 2 };
    struct Rule {
        Switch which;
        Edge edge;
        std::int8_t last;   // direction of the last passage
        std::int8_t first;  // direction while the region is unknown; 0: the level tells
    };
    static const Rule rules[15];
    static Range range(const Plant&, Switch) noexcept;
    Region before_edge() const noexcept;  // where the last passage starts
    void track(const Plant&, double speed, double slow) noexcept;
    void pass(double place, Region to, bool wanted, double speed, double slow, int direction) noexcept;
    Order order(const Plant&) noexcept;

    Rule rule_{};
    Region region_ = unknown;
    bool index_ = false, edge_found_ = false, searching_index_ = false, found_ = false, turned_ = false;
    int direction_ = 0;         // of the search for the index pulse
    double edge_ = 0, home_ = 0;
};

}  // namespace hal::canopen::cia402
