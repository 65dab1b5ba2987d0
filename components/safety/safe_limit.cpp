// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "hal/component.hpp"
#include "hal/edge.hpp"
#include "hal/retained.hpp"

namespace {

/// Values of the public reaction pins: never renumber them.
enum Reaction : std::uint32_t { off = 0, warn = 1, limit = 2, stop_2 = 3, stop_1 = 4, stop_0 = 5 };

/// Values of pin `state`.
enum State : std::uint32_t {
    running = 0,
    braking_2 = 1,
    standing_2 = 2,
    braking_1 = 3,
    powerless = 4
};

/// Values of pin `reason`; the first cause of a stop is kept.
enum Reason : std::uint32_t {
    none = 0,
    position_below = 1,
    position_above = 2,
    speed = 3,
    slew = 4,
    no_number = 5,
    bad_parameter = 6,
    did_not_stop = 7,
    did_not_stand = 8,
    not_reset = 9,
    asked = 10,
};

struct SafeLimit : hal::Component {
    using Component::Component;

    hal::In<double> position{*this, "position", "measured position"};
    hal::In<double> velocity{*this,
                             "velocity",
                             "measured velocity; computed from position while unlinked",
                             {.unit = "1/s"}};
    hal::In<double> command{*this, "command", "requested speed", {.unit = "1/s"}};
    hal::In<bool> reset{*this, "reset", "a rising edge ends a stop if its cause no longer exists"};
    hal::In<bool> stop_in{*this, "stop-in", "TRUE requests a stop 1"};

    hal::In<double> min_position{*this, "min-position", "lowest position", {.initial = -1e15}};
    hal::In<double> max_position{*this, "max-position", "highest position", {.initial = 1e15}};
    hal::In<double> max_speed{
        *this, "max-speed", "maximum speed", {.initial = 1e15, .unit = "1/s"}};
    hal::In<double> max_slew{*this,
                             "max-slew",
                             "maximum rate of change of the speed",
                             {.initial = 1e15, .unit = "1/s^2"}};
    hal::Param<std::uint32_t> position_reaction{
        *this,
        "position-reaction",
        "0 none; 1 warn; 2 limit; 3 stop 2; 4 stop 1; 5 stop 0",
        {.initial = stop_1}};
    hal::Param<std::uint32_t> speed_reaction{
        *this,
        "speed-reaction",
        "0 none; 1 warn; 2 limit; 3 stop 2; 4 stop 1; 5 stop 0",
        {.initial = stop_1}};
    hal::Param<std::uint32_t> slew_reaction{*this,
                                            "slew-reaction",
                                            "0 none; 1 warn; 2 limit; 3 stop 2; 4 stop 1; 5 stop 0",
                                            {.initial = warn}};
    hal::Param<double> filter_time{
        *this,
        "filter-time",
        "time for which a limit may be exceeded; adds to the reaction time",
        {.unit = "s"}};
    hal::Param<double> speed_filter{*this,
                                    "speed-filter",
                                    "time constant of the speed computed from position, 0 to 60",
                                    {.unit = "s"}};
    hal::Param<double> stop_deceleration{*this,
                                         "stop-deceleration",
                                         "deceleration of the command in stops 1 and 2",
                                         {.initial = 1.0, .unit = "1/s^2"}};
    hal::Param<double> stop_time{*this,
                                 "stop-time",
                                 "a stop 1 or 2 that lasts longer becomes a stop 0",
                                 {.initial = 5.0, .unit = "s"}};
    hal::Param<double> standstill_speed{*this,
                                        "standstill-speed",
                                        "speed below which the axis counts as stopped",
                                        {.initial = 0.01, .unit = "1/s"}};
    hal::Param<double> standstill_time{*this,
                                       "standstill-time",
                                       "time for which the speed must be below standstill-speed, "
                                       "so that a reversal does not count",
                                       {.initial = 0.05, .unit = "s"}};
    hal::Param<double> standstill_window{*this, "standstill-window",
                                         "permitted motion during a stop 2; 0: not monitored"};

    hal::Out<double> command_out{*this,
                                 "command-out",
                                 "permitted speed command",
                                 {.unit = "1/s", .safe = 0.0, .finite = true}};
    hal::Out<bool> power{*this, "power", "TRUE enables the power of the drive", {.safe = false}};
    hal::Out<bool> ok{
        *this, "ok", "TRUE: no limit is exceeded and no stop is active", {.safe = false}};
    hal::Out<bool> warning{*this, "warning", "TRUE: a limit is exceeded"};
    hal::Out<bool> limiting{*this, "limiting", "TRUE: command-out is reduced"};
    hal::Out<bool> stopping{*this, "stop", "TRUE: a stop is active, until reset"};
    hal::Out<std::uint32_t> state{
        *this,
        "state",
        "0 running; 1 braking, 2 stopped in stop 2; 3 braking in stop 1; 4 power off",
        {.initial = powerless}};
    hal::Out<std::uint32_t> reason{*this,
                                   "reason",
                                   "cause of the stop, or limit that is exceeded; see the table",
                                   {.initial = not_reset}};
    hal::Out<double> speed_out{*this, "speed", "monitored speed", {.unit = "1/s", .finite = true}};
    hal::Out<double> slew_out{
        *this, "slew", "monitored rate of change of the speed", {.unit = "1/s^2", .finite = true}};

    hal::Function run{*this, "", &SafeLimit::update, "monitors the axis and passes the command"};

    void update(hal::Cycle cycle) noexcept {
        const double dt = cycle.seconds();
        const bool pressed = reset_edge_.rises(reset);
        // The host wrote the safe value (stop, a fault): a reset is required.
        if (state_ != powerless && !power && has_run_) {
            trip(powerless, not_reset);
        }
        has_run_ = true;

        const bool measured = measure(dt);
        const std::uint32_t found = check(measured, dt);
        const bool sound = parameters_sound();
        if (!sound) {
            trip(powerless, bad_parameter);
        } else if (!measured) {
            trip(powerless, no_number);
        } else if (pressed && may_be_released(found)) {
            release(found);
        } else {
            stop_for(found);
        }
        if (sound && measured) {
            follow_stop(dt);
        }
        pass(found, dt);
    }

private:
    static constexpr double max_speed_filter_s = 60.0;  // a longer one sees no speed in time

    static bool usable(double x) noexcept { return std::fabs(x) <= 1e15; }

    bool parameters_sound() const noexcept {
        const double amounts[] = {max_speed,        max_slew,        filter_time,      stop_time,
                                  standstill_speed, standstill_time, standstill_window};
        const std::uint32_t reactions[] = {position_reaction, speed_reaction, slew_reaction};
        return min_position <= max_position && stop_deceleration > 0.0 &&
               std::ranges::all_of(amounts, [](double amount) { return amount >= 0.0; }) &&
               speed_filter >= 0.0 && speed_filter <= max_speed_filter_s &&
               std::ranges::max(reactions) <= stop_0;
    }

    /// Updates position, speed and slew. Returns false if they are not usable numbers.
    bool measure(double dt) noexcept {
        const bool has_sensor = velocity.linked();
        if (!usable(position) || (has_sensor && !usable(velocity))) {
            known_ = 0;
            return false;
        }
        const double raw = has_sensor ? velocity.get() : speed_from_position(dt);
        const double before = speed_;
        speed_ = known_ > 0 ? speed_ + filter_share(dt) * (raw - speed_) : raw;
        const double slew = (speed_ - before) / dt;
        const bool has_slew = known_ > (has_sensor ? 0 : 1) && std::isfinite(slew);
        slew_ = has_slew ? slew : 0.0;
        position_ = position;
        known_ = std::min(known_ + 1, 2);
        return true;
    }
    double speed_from_position(double dt) const noexcept {
        return known_ > 0 ? (position - position_) / dt : 0.0;
    }
    /// Returns the share of a new speed in the filtered one.
    double filter_share(double dt) const noexcept {
        if (velocity.linked() || !(speed_filter > 0.0)) return 1.0;
        return dt / (speed_filter + dt);
    }

    std::uint32_t reaction(std::uint32_t what) const noexcept {
        if (what == returning_ && what != none) {
            return std::min<std::uint32_t>(position_reaction, warn);
        }
        switch (what) {
        case position_below:
        case position_above: return position_reaction;
        case speed: return speed_reaction;
        case slew: return slew_reaction;
        default: return off;
        }
    }
    bool stops(std::uint32_t what) const noexcept { return reaction(what) >= stop_2; }
    static std::uint32_t state_of(std::uint32_t of_reaction) noexcept {
        if (of_reaction == stop_2) return braking_2;
        if (of_reaction == stop_1) return braking_1;
        return powerless;
    }

    /// By reason: whether its limit is exceeded in this cycle.
    using Exceeded = std::array<bool, slew + 1>;

    /// Returns what has been exceeded for longer than the filter time; of several what has the
    /// strongest reaction.
    std::uint32_t check(bool measured, double dt) noexcept {
        Exceeded exceeded{};
        if (measured) {
            exceeded = {false, position<min_position, position> max_position,
                        std::fabs(speed_) > max_speed, std::fabs(slew_) > max_slew};
            follow_return(exceeded);
        }
        std::uint32_t worst = none;
        for (std::uint32_t what = position_below; what <= slew; ++what) {
            if (lasts(what, exceeded[what], dt) &&
                (worst == none || reaction(what) > reaction(worst))) {
                worst = what;
            }
        }
        may_return_ = (worst == position_below || worst == position_above) &&
                      std::fabs(speed_) <= standstill_speed;
        return worst;
    }

    /// Counts the time for which a limit with a reaction is exceeded. Returns whether it is longer
    /// than the filter time.
    bool lasts(std::uint32_t what, bool exceeded, double dt) noexcept {
        double& since = since_[what];
        if (!exceeded || reaction(what) == off) {
            since = 0.0;
            return false;
        }
        since += dt;
        return !(since <= filter_time + dt * 1e-6 && filter_time > 0.0);
    }

    /// Ends the return into the permitted range when the axis is back or moves outwards.
    void follow_return(const Exceeded& exceeded) noexcept {
        const double outwards = returning_ == position_above ? speed_ : -speed_;
        if (!exceeded[returning_] || outwards > standstill_speed) {
            returning_ = none;
        }
    }

    bool may_be_released(std::uint32_t found) const noexcept {
        return state_ != running && !stop_in && (may_return_ || !stops(found));
    }
    /// Begins the stops that are due. Limits remain monitored during a requested stop.
    void stop_for(std::uint32_t found) noexcept {
        if (stop_in) {
            trip(braking_1, asked);
        }
        if (stops(found)) {
            trip(state_of(reaction(found)), found);
        }
    }
    /// A stronger stop takes over from a weaker one; the first reason stays.
    void trip(std::uint32_t to, std::uint32_t why) noexcept {
        returning_ = none;
        if (reason_ == not_reset) {
            reason_ = why;  // what keeps the reset from helping
        }
        if (state_ == running) {
            reason_ = why;
            lasted_ = stood_for_ = 0.0;
            given_ = usable(command_out) ? command_out.get() : 0.0;
        }
        if (to == braking_2 && state_ == standing_2) return;
        if (to > state_) {
            state_ = to;
        }
    }
    void release(std::uint32_t found) noexcept {
        if (may_return_) {
            returning_ = found;  // until it is back within, or moves outwards
        }
        state_ = running;
        reason_ = none;
        given_ = 0.0;
    }

    void follow_stop(double dt) noexcept {
        if (state_ == running || state_ == powerless) return;
        lasted_ += dt;
        stood_for_ = std::fabs(speed_) <= standstill_speed && given_ == 0.0 ? stood_for_ + dt : 0.0;
        if (state_ == standing_2) {
            const double moved = std::fabs(position_ - stood_at_);
            if (standstill_window > 0.0 && moved > standstill_window) {
                remove_power(did_not_stand);
            }
        } else if (stood_for_ > standstill_time + dt * 1e-6) {
            stood_at_ = position_;
            state_ = state_ == braking_2 ? standing_2 : powerless;
        } else if (lasted_ > stop_time) {
            remove_power(did_not_stop);
        }
    }
    void remove_power(Reason why) noexcept {
        state_ = powerless;
        reason_ = why;
    }

    /// Returns the speed command that the state permits.
    double permitted(double wanted, double dt) const noexcept {
        const double less = stop_deceleration * dt;
        switch (state_) {
        case running: return limited(wanted, dt);
        case braking_1:
        case braking_2:
            return std::fabs(given_) <= less ? 0.0 : given_ - std::copysign(less, given_);
        default: return 0.0;
        }
    }

    /// Returns the command of a running axis within the limits whose reaction is to limit it, or to
    /// stop at a position.
    double limited(double wanted, double dt) const noexcept {
        double allowed = wanted;
        if (speed_reaction == limit) {
            allowed = std::clamp(allowed, -max_speed, +max_speed);
        }
        if (slew_reaction == limit) {
            allowed = std::clamp(allowed, given_ - max_slew * dt, given_ + max_slew * dt);
        }
        if (position_reaction < limit) return allowed;
        // Inwards is always free; also out of a place in which a reset was given.
        if (position_ >= max_position) {
            allowed = std::min(allowed, 0.0);
        }
        if (position_ <= min_position) {
            allowed = std::max(allowed, 0.0);
        }
        return allowed;
    }

    void pass(std::uint32_t found, double dt) noexcept {
        const bool runs = state_ == running;
        const double wanted = usable(command) ? command.get() : 0.0;
        given_ = permitted(wanted, dt);
        command_out = given_;
        power = state_ != powerless;
        warning = found != none;
        limiting = runs && given_ != wanted;
        stopping = !runs;
        ok = runs && found == none;
        state = state_;
        reason = runs ? found : reason_;
        speed_out = speed_;
        slew_out = slew_;
    }

    double position_ = 0.0;
    double speed_ = 0.0;
    double slew_ = 0.0;
    double given_ = 0.0;
    double lasted_ = 0.0;

    double stood_for_ = 0.0;
    double stood_at_ = 0.0;
    double since_[5] = {};
    std::uint32_t state_ = powerless;
    std::uint32_t reason_ = not_reset;
    std::uint32_t returning_ = none;
    int known_ = 0;  // measurements so far: speed needs two, slew three
    hal::RisingEdge reset_edge_{true};  // TRUE from the first cycle on: not a rising edge
    bool has_run_ = false;
    bool may_return_ = false;
    hal::Retained retained_{*this,
                            {{"position", position_},
                             {"speed", speed_},
                             {"slew", slew_},
                             {"given", given_},
                             {"lasted", lasted_},
                             {"stood-for", stood_for_},
                             {"stood-at", stood_at_},
                             {"since", since_},
                             {"state", state_},
                             {"reason", reason_},
                             {"returning", returning_},
                             {"known", known_},
                             {"was-reset", reset_edge_},
                             {"has-run", has_run_},
                             {"may-return", may_return_}}};
};

}  // namespace

HAL_COMPONENT(SafeLimit, "safe_limit",
              "Supervision of position, speed and slew, with warning, limiting and stops", R"(
Limits the speed command of an axis before it reaches the drive, and monitors the axis. Every limit
has a reaction as defined in IEC 60204-1 (9.2.2, stop categories) and IEC 61800-5-2 (SLP, SLS, SLA
with STO, SS1, SS2):

| reaction | |
| --- | --- |
| 0 | none |
| 1 | `warning` only |
| 2 | `command-out` is limited: to ±`max-speed`; by `max-slew`; to no outward motion at a position limit |
| 3 | stop 2: the command ramps to 0 with `stop-deceleration`, power remains on; motion beyond `standstill-window` then causes a stop 0 |
| 4 | stop 1: the same, followed by power off after `standstill-time` at standstill |
| 5 | stop 0: power off in the same cycle |

    speed = velocity, or (position - position before) / period through the filter speed-filter,   slew = change of speed / period

The reaction is in the same cycle (plus `filter-time`). A stop remains until a rising edge of
`reset` after its cause no longer exists. The initial state is a stop: the first reset enables the
power. Beyond a position limit a reset is accepted at standstill, and then the axis may move inwards
only. A stop that takes longer than `stop-time`, a NaN value and an invalid parameter cause a stop
0; a stop or a fault of the runtime requires a reset. `stop-in` requests a stop 1, during which all
limits remain monitored. Link `power` to the drive's enable. This is software on one computer, not a
certified safety function.

| reason | |
| --- | --- |
| 0 | nothing exceeded |
| 1, 2 | below `min-position`, above `max-position` |
| 3, 4 | speed, slew |
| 5 | a measured value is NaN or infinite |
| 6 | invalid parameter |
| 7, 8 | the axis did not stop within `stop-time`, it moved beyond `standstill-window` |
| 9 | waiting for the first reset, or for the reset after a stop of the runtime |
| 10 | `stop-in` |

    loadrt safe_limit names=x-guard
    addf x-guard servo
    setp x-guard.max-speed 120
    setp x-guard.min-position -50
    setp x-guard.max-position 50
    setp x-guard.stop-deceleration 500
    net x-position => x-guard.position
    net x-wanted   => x-guard.command
    net x-speed    <= x-guard.command-out
    net x-power    <= x-guard.power
)")
