// SPDX-License-Identifier: MIT
#include "cia402/drive/homing_search.hpp"

#include <algorithm>
#include <cmath>

#include "cia402/drive/axis_values.hpp"

namespace hal::cia402 {

const HomingSearch::Rule HomingSearch::rules[15] = {
    {},
    {Switch::negative, Edge::right, 1, 0},  // 1, 17
    {Switch::positive, Edge::left, -1, 0},
    {Switch::home, Edge::left, -1, 0},      // 3, 4: active from its edge to the positive end
    {Switch::home, Edge::left, 1, 0},
    {Switch::home, Edge::right, 1, 0},      // 5, 6: active from the negative end to its edge
    {Switch::home, Edge::right, -1, 0},
    {Switch::home, Edge::left, -1, 1},      // 7–10: start in the positive direction
    {Switch::home, Edge::left, 1, 1},
    {Switch::home, Edge::right, -1, 1},
    {Switch::home, Edge::right, 1, 1},
    {Switch::home, Edge::right, 1, -1},     // 11–14: start in the negative direction
    {Switch::home, Edge::right, -1, -1},
    {Switch::home, Edge::left, 1, -1},
    {Switch::home, Edge::left, -1, -1},
};

bool HomingSearch::supports(int method) noexcept {
    return std::find(homing_methods.begin(), homing_methods.end(), method) != homing_methods.end();
}

Range HomingSearch::range(const Plant& plant, Switch which) noexcept {
    if (which == Switch::negative) return plant.negative_limit();
    if (which == Switch::positive) return plant.positive_limit();
    return plant.home();
}

HomingSearch::Region HomingSearch::before_edge() const noexcept {
    const bool forward = rule_.last > 0;
    if (rule_.edge == Edge::left) return forward ? left : inside;
    return forward ? inside : right;
}

bool HomingSearch::begin(int method, const Plant& plant) noexcept {
    *this = {};
    if (!supports(method)) return false;
    if (method >= 35) {
        found_ = true;
        home_ = plant.place();
        return true;
    }
    if (method >= 33) {
        searching_index_ = index_ = true;
        direction_ = method == 33 ? -1 : 1;
        edge_ = plant.place();
        return true;
    }
    index_ = method <= 14;
    rule_ = rules[index_ ? method : method - 16];
    const auto r = range(plant, rule_.which);
    if (r.holds(plant.place())) {
        region_ = inside;
    } else if (rule_.first == 0) {
        region_ = rule_.edge == Edge::left ? left : right;
    }
    return true;
}

void HomingSearch::pass(double position, Region to, bool wanted, double speed, double slow,
                        int direction) noexcept {
    // The last passage counts in the required direction and slow enough; any other only locates the
    // edge.
    if (wanted && direction == rule_.last && edge_found_ && std::abs(speed) <= slow * 1.001) {
        edge_ = position;
        if (index_) {
            searching_index_ = true;
            direction_ = direction;
        } else {
            found_ = true;
            home_ = position;
        }
    }
    if (wanted) {
        edge_found_ = true;
    }
    region_ = to;
}

void HomingSearch::track(const Plant& plant, double speed, double slow) noexcept {
    const auto r = range(plant, rule_.which);
    const int direction = plant.place() > plant.before() ? 1 : -1;
    // In the order in which they are passed: in at one edge, out at the other.
    const bool forward = direction > 0;
    const Edge entry = forward ? Edge::left : Edge::right;
    const Edge exit = forward ? Edge::right : Edge::left;
    const Region beyond = forward ? right : left;
    const auto pass_edge = [&](Edge edge, Region to) {
        const auto position = r.edge(plant.before(), plant.place(), edge == entry);
        if (!position || found_ || searching_index_) return;
        pass(*position, to, edge == rule_.edge, speed, slow, direction);
    };
    pass_edge(entry, inside);
    pass_edge(exit, beyond);
}

HomingSearch::Order HomingSearch::step(const Plant& plant, double speed, double slow) noexcept {
    if (!found_ && !searching_index_) {
        track(plant, speed, slow);
    }
    if (!found_ && searching_index_) {
        if (const auto pulse = plant.index_pulse(edge_, direction_)) {
            found_ = true;
            home_ = *pulse;
        }
    }
    return order(plant);
}

HomingSearch::Order HomingSearch::order(const Plant& plant) noexcept {
    if (found_) {
        return {Act::stop_at_home, 0};
    }
    if (searching_index_) return search_index(plant);
    if (region_ == unknown && blocked(plant, rule_.first)) {
        if (blocked(plant, -rule_.first)) {
            return {Act::failed, 0};
        }
        region_ = rule_.first > 0 ? right : left;
    }
    const int direction = next_direction();
    // A limit switch in the path is an error, unless it is the one searched for.
    const bool own = rule_.which == (direction < 0 ? Switch::negative : Switch::positive);
    if (blocked(plant, direction) && !own) {
        return {Act::failed, 0};
    }
    const bool near = region_ != unknown && std::abs(region_ - before_edge()) <= 1;
    return {edge_found_ && near ? Act::slow : Act::fast, direction};
}

HomingSearch::Order HomingSearch::search_index(const Plant& plant) const noexcept {
    // a full revolution without a pulse
    const bool gone = std::abs(plant.place() - edge_) > 1.05 * plant.motor().resolution;
    if (gone || blocked(plant, direction_)) {
        return {Act::failed, 0};
    }
    return {Act::slow, direction_};
}

/// Returns the direction to the region before the edge, then that of the last passage.
int HomingSearch::next_direction() const noexcept {
    const Region start = before_edge();
    if (region_ == unknown) return rule_.first;
    if (region_ == start) return rule_.last;
    return region_ < start ? 1 : -1;
}

bool HomingSearch::blocked(const Plant& plant, int direction) noexcept {
    const Range limit = direction < 0 ? plant.negative_limit() : plant.positive_limit();
    return limit.holds(plant.place());
}

}  // namespace hal::cia402
