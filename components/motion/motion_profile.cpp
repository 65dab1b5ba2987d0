// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>

#include "hal/component.hpp"
#include "hal/edge.hpp"
#include "hal/interruption.hpp"
#include "hal/retained.hpp"
#include "profile.hpp"

namespace {

enum Mode : std::uint32_t { follow = 0, set_points = 1, table = 2, velocity_mode = 3 };

struct SetPoint {
    double position = 0.0;
    double velocity = 0.0;  // velocity 0: max-velocity
    bool flying = false;                    // the previous set-point is passed without a stop
};

/// A ring of queued set-points, allocated once.
class Queue {
public:
    Queue(hal::Component& component, std::int64_t depth)
        : depth_(static_cast<std::size_t>(depth)),
          ring_(std::make_unique<SetPoint[]>(depth_)),
          retained_(component,
                    {{"first", first_}, {"size", size_}, {"ring", ring_.get(), depth_}}) {}
    std::size_t size() const noexcept { return size_; }
    bool full() const noexcept { return size_ == depth_; }
    const SetPoint& operator[](std::size_t i) const noexcept {
        return ring_[(first_ + i) % depth_];
    }
    void push(const SetPoint& point) noexcept {
        if (!full()) {
            ring_[(first_ + size_++) % depth_] = point;
        }
    }
    SetPoint pop() noexcept {
        const SetPoint point = ring_[first_];
        first_ = (first_ + 1) % depth_;
        --size_;
        return point;
    }
    void clear() noexcept { first_ = size_ = 0; }

private:
    std::size_t depth_, first_ = 0, size_ = 0;
    std::unique_ptr<SetPoint[]> ring_;
    hal::Retained retained_;
};

struct MotionProfile : hal::Component {
    using Component::Component;

    hal::Argument depth{
        *this, "queue", 8, "capacity of the set-point queue", {.min = 1, .max = 256}};
    hal::Argument rows{
        *this, "table", 0, "rows of the table of set-points", {.min = 0, .max = 256}};

    hal::In<std::uint32_t> mode{
        *this, "mode", "0 follow target; 1 set-points by handshake; 2 table; 3 target-velocity"};
    hal::In<double> target{*this, "target", "target position (modes 0 and 1)"};
    hal::In<double> target_velocity{
        *this, "target-velocity",
        "mode 3: target speed; mode 1: speed of this set-point, 0: max-velocity"};
    hal::In<double> max_velocity{
        *this, "max-velocity", "maximum speed", {.initial = 1.0, .unit = "1/s"}};
    hal::In<double> max_acceleration{
        *this, "max-acceleration", "maximum acceleration", {.initial = 1.0, .unit = "1/s^2"}};
    hal::In<double> max_deceleration{
        *this, "max-deceleration", "maximum deceleration; 0: max-acceleration", {.unit = "1/s^2"}};
    hal::In<double> max_jerk{
        *this, "max-jerk", "maximum jerk; 0: no limit (trapezoidal profile)", {.unit = "1/s^3"}};
    hal::In<bool> new_set_point{*this, "new-set-point",
                                "mode 1: a rising edge submits target and target-velocity"};
    hal::In<bool> change_immediately{
        *this, "change-immediately",
        "TRUE: the new set-point replaces the current one and the queue"};
    hal::In<bool> change_on_set_point{*this, "change-on-set-point",
                                      "TRUE: no stop at the previous set-point before the new one"};
    hal::In<bool> relative{*this, "relative",
                           "TRUE: the new set-point is relative to the previous one"};
    hal::In<bool> run_table{*this, "run-table",
                            "mode 2: a rising edge starts the table, FALSE stops"};
    hal::In<bool> repeat_table{*this, "repeat-table", "TRUE restarts the table after its last row"};
    hal::In<std::uint32_t> table_length{*this, "table-length", "rows in use; 0: all"};
    hal::In<bool> halt{*this, "halt", "TRUE brakes to a stop; FALSE resumes"};
    hal::In<bool> stop_in{*this, "stop", "TRUE brakes to a stop and discards all set-points"};
    hal::In<bool> quick_stop{*this, "quick-stop",
                             "like stop, with quick-deceleration and quick-jerk"};
    hal::In<double> quick_deceleration{*this,
                                       "quick-deceleration",
                                       "deceleration of a quick stop; 0: max-deceleration",
                                       {.unit = "1/s^2"}};
    hal::In<double> quick_jerk{
        *this, "quick-jerk", "jerk of a quick stop; 0: no limit", {.unit = "1/s^3"}};
    hal::In<bool> load{
        *this, "load",
        "TRUE sets the position to load-position and the velocity to 0 at once, also in motion, "
        "and discards all set-points"};
    hal::In<double> load_position{*this, "load-position", "position to load"};

    hal::Ins<double> row_position{*this, "row-##-position", rows,
                                  "position of row ## of the table"};
    hal::Ins<double> row_velocity{*this, "row-##-velocity", rows,
                                  "speed to row ##; 0: max-velocity"};
    hal::Ins<double> row_dwell{*this, "row-##-dwell", rows, "dwell at row ##", {.unit = "s"}};

    hal::Out<double> position{*this, "position", "position of the profile", {.finite = true}};
    hal::Out<double> velocity{
        *this, "velocity", "velocity of the profile", {.unit = "1/s", .safe = 0.0, .finite = true}};
    hal::Out<double> acceleration{*this,
                                  "acceleration",
                                  "acceleration of the profile",
                                  {.unit = "1/s^2", .safe = 0.0, .finite = true}};
    hal::Out<double> jerk{*this,
                          "jerk",
                          "jerk of the profile; 0 in trapezoidal profiles",
                          {.unit = "1/s^3", .safe = 0.0, .finite = true}};
    hal::Out<bool> done{*this, "done", "TRUE: target (mode 3: speed) reached and queue empty"};
    hal::Out<bool> moving{*this, "moving", "TRUE while the speed or the acceleration is not 0"};
    hal::Out<bool> acknowledge{*this, "set-point-acknowledge",
                               "TRUE: the set-point was accepted; FALSE: ready for the next one"};
    hal::Out<std::uint32_t> queue_length{*this, "queue-length",
                                         "number of queued set-points, without the current one"};
    hal::Out<bool> queue_full{
        *this, "queue-full", "TRUE: the next set-point is accepted only after the queue has space"};
    hal::Out<std::uint32_t> passed{*this, "set-points-done",
                                   "number of set-points or rows reached since load"};
    hal::Out<std::uint32_t> row{*this, "table-row", "current row of the table"};
    hal::Out<double> time_left{
        *this, "time-left", "time until the target is reached", {.unit = "s", .finite = true}};
    hal::Out<bool> bad_limit{
        *this, "limit-error",
        "TRUE: invalid limit or mode; the profile stops with the last valid limits"};

    hal::Function run{*this, "", &MotionProfile::update, "computes the next point of the profile"};

    void update(hal::Cycle cycle) noexcept {
        const double dt = cycle.seconds();
        const bool sound = apply_limits();
        apply_edges();
        if (mode != last_mode_) {
            forget();
        }
        last_mode_ = mode;
        if (interruption_.accept()) {
            forget();
            waiting_ = false;
            generator_.put(generator_.state().position);
        }

        const bool stopping = stop_in || quick_stop;
        if (load) {
            forget();
            passed = 0;
            generator_.put(std::isfinite(load_position) ? load_position.get()
                                                        : generator_.state().position);
        } else if (stopping || !sound) {
            forget();
            generator_.go_at(0.0, quick_stop ? quick_limits() : limits_);
        } else {
            want();
        }
        if (!load) {
            generator_.advance(dt);
        }
        const bool there = generator_.arrived() && !load && !stopping && sound && !halt;
        show(there && arrive(dt), sound);
    }

private:
    bool apply_limits() noexcept {
        motion::Limits taken;
        if (!motion::Limits::from(max_velocity, max_acceleration, max_deceleration, max_jerk,
                                  taken) ||
            mode > velocity_mode) {
            return false;
        }
        limits_ = taken;
        return true;
    }
    motion::Limits quick_limits() const noexcept {
        motion::Limits quick;
        const double by =
            quick_deceleration > 0.0 ? quick_deceleration.get() : limits_.deceleration;
        return motion::Limits::from(limits_.velocity, limits_.acceleration, by, quick_jerk, quick)
                   ? quick
                   : limits_;
    }
    void apply_edges() noexcept {
        waiting_ = mode == set_points && new_set_point && (waiting_ || !was_new_);
        was_new_ = new_set_point;
        start_table_ = run_edge_.rises(run_table);
    }
    /// Discards all set-points; the profile brakes to a stop unless a new target follows.
    void forget() noexcept {
        queue_.clear();
        has_goal_ = in_table_ = false;
        if (load || stop_in || quick_stop) {
            waiting_ = false;  // an edge meanwhile is discarded
        }
    }

    void want() noexcept {
        switch (mode) {
        case follow:
            if (std::isfinite(target)) {
                goal_ = {clamped(target), 0.0, false};
                has_goal_ = true;
            }
            break;
        case set_points: apply_set_point(); break;
        case table:
            if (start_table_ && row_count() > 0) {
                in_table_ = true;
                to_row(0);
            }
            if (!run_table) {
                in_table_ = has_goal_ = false;
            }
            break;
        default: {
            has_goal_ = false;
            if (std::isfinite(target_velocity)) {
                speed_ = target_velocity;
            }
            speed_ = std::clamp(speed_, -limits_.velocity, limits_.velocity);
            return generator_.go_at(halt ? 0.0 : speed_, limits_);
        }
        }
        if (mode == set_points) {
            fly();
        }
        if (!has_goal_ || halt) return generator_.go_at(0.0, limits_);
        motion::Limits limits = limits_;
        if (goal_.velocity > 0.0) {
            limits.velocity = std::min(limits.velocity, std::max(goal_.velocity, 1e-18));
        }
        generator_.go_to(last_of_flight(), limits);
    }

    void apply_set_point() noexcept {
        if (waiting_ && std::isfinite(target) &&
            (change_immediately || !has_goal_ || !queue_.full())) {
            const double last = has_goal_ ? goal_.position : generator_.end_position();
            const double before = queue_.size() > 0 ? queue_[queue_.size() - 1].position : last;
            const double speed = std::isfinite(target_velocity) ? std::fabs(target_velocity) : 0.0;
            const SetPoint point{clamped(relative ? before + target : target.get()), speed,
                                 change_on_set_point};
            if (change_immediately) {
                queue_.clear();
                has_goal_ = false;
            }
            if (has_goal_) {
                queue_.push(point);
            } else {
                begin(point);
            }
            waiting_ = false;
            acknowledge_ = true;
        }
        if (!new_set_point && !queue_.full()) {
            acknowledge_ = false;
        }
    }
    void begin(const SetPoint& point) noexcept {
        goal_ = point;
        has_goal_ = true;
        counted_ = false;
        side_ = goal_.position < generator_.state().position ? -1.0 : 1.0;
    }
    /// Advances to the next set-point when the current one is passed without a stop.
    void fly() noexcept {
        while (has_goal_ && flies_to(goal_.position, 0) &&
               side_ * (generator_.state().position - goal_.position) >= 0.0) {
            count();
            begin(queue_.pop());
        }
    }
    /// Called once when the current set-point is reached.
    void count() noexcept {
        if (!counted_) {
            passed = passed + 1;
        }
        counted_ = true;
    }
    /// Returns true if queued set-point `i` follows without a stop at `before`: it is further in
    /// the same direction.
    bool flies_to(double before, std::size_t i) const noexcept {
        return i < queue_.size() && queue_[i].flying && side_ * (queue_[i].position - before) > 0.0;
    }
    /// Returns the position of the next stop. Planning to it at the speed of the current set-point
    /// leaves the distance to stop.
    double last_of_flight() const noexcept {
        double last = goal_.position;
        if (mode == set_points) {
            for (std::size_t i = 0; flies_to(last, i); ++i) {
                last = queue_[i].position;
            }
        }
        return last;
    }

    std::size_t row_count() const noexcept {
        return table_length == 0 ? row_position.size()
                                 : std::min<std::size_t>(table_length, row_position.size());
    }
    void to_row(std::size_t i) noexcept {
        row_ = i;
        rested_ = 0.0;
        const double to = row_position[i];
        const double speed = row_velocity[i];
        begin({std::isfinite(to) ? clamped(to) : generator_.state().position,
               std::isfinite(speed) ? std::fabs(speed) : 0.0, false});
    }

    /// Advances at the end of a path; true if there is nothing to follow.
    bool arrive(double dt) noexcept {
        if (mode == velocity_mode) return true;
        if (!has_goal_) return mode != table || !in_table_;
        if (mode == set_points) {
            count();
            if (queue_.size() == 0) return !waiting_;
            begin(queue_.pop());
            return false;
        }
        if (mode == table) {
            count();
            if (!in_table_) return true;
            const double dwell = row_dwell[row_];
            if (rested_ + dt * 1e-6 < dwell) {
                rested_ += dt;
                return false;
            }
            if (row_ + 1 < row_count()) {
                to_row(row_ + 1);
            } else if (repeat_table) {
                to_row(0);
            } else {
                in_table_ = false;
            }
            return !in_table_;
        }
        return true;
    }

    void show(bool at_end, bool sound) noexcept {
        const motion::State& now = generator_.state();
        position = now.position;
        velocity = now.velocity;
        acceleration = now.acceleration;
        jerk = generator_.jerk();
        moving = generator_.moving();
        done = at_end;
        acknowledge = acknowledge_ && mode == set_points;
        queue_length = static_cast<std::uint32_t>(queue_.size());
        queue_full = queue_.full();
        row = static_cast<std::uint32_t>(row_);
        time_left = std::min(generator_.time_left(), 1e300);
        bad_limit = !sound;
    }

    static double clamped(double position) noexcept {
        return std::clamp(position, -motion::farthest, motion::farthest);
    }

    motion::Generator generator_;
    motion::Limits limits_;
    Queue queue_{*this, depth};
    SetPoint goal_;
    double side_ = 1.0;
    double speed_ = 0.0;
    double rested_ = 0.0;
    std::size_t row_ = 0;
    std::uint32_t last_mode_ = 0;
    bool has_goal_ = false;
    bool waiting_ = false;
    bool was_new_ = false;
    bool acknowledge_ = false;

    bool counted_ = false;
    bool in_table_ = false;
    bool start_table_ = false;
    hal::RisingEdge run_edge_;
    hal::Interruption interruption_{*this};
    hal::Retained retained_{*this,
                            {{"generator", generator_},
                             {"interruption", interruption_},
                             {"limits", limits_},
                             {"goal", goal_},
                             {"side", side_},
                             {"speed", speed_},
                             {"rested", rested_},
                             {"row", row_},
                             {"last-mode", last_mode_},
                             {"has-goal", has_goal_},
                             {"waiting", waiting_},
                             {"was-new", was_new_},
                             {"acknowledge", acknowledge_},
                             {"counted", counted_},
                             {"in-table", in_table_},
                             {"start-table", start_table_},
                             {"was-run", run_edge_}}};
};

}  // namespace

HAL_COMPONENT(MotionProfile, "motion_profile",
              "Motion to a target within limits of speed, acceleration, deceleration and jerk", R"(
`position` moves to its target as fast as the limits allow and stops there exactly. With `max-jerk`
0 the speed profile is trapezoidal, else an S-curve of up to seven segments. Target and limits may
change in any cycle and in any state of motion. The units are up to the user: mm gives mm/s, mm/s^2,
mm/s^3.

    settled speed  = v + a |a| / (2 jerk)                              what the speed comes to when the acceleration fades out
    peak^2         = jerk * dv + a^2 / 2,  at most the limit           the acceleration on the way to a change of speed dv
    trapezoid      : x = w^2 / (2 acc) + w T + w^2 / (2 dec)           w the cruising speed, T how long
    rest to rest   : w >= acc^2 / jerk: each ramp takes w / acc + acc / jerk,  else 2 sqrt(w / jerk)

After each change the path is planned again from the current state, by the decisions of T. Kroeger,
*On-Line Trajectory Generation in Robotic Systems* (Springer 2010, ch. 3 to 5), from the segments of
L. Biagiotti, C. Melchiorri, *Trajectory Planning for Automatic Machines and Robots* (Springer 2008,
3.2 and 3.4); the cruising speed is the root of distance(w) = x. The path is time-optimal for equal
acceleration and deceleration. If they differ and the speed changes its sign, the faster of two
paths is used: with the smaller limit throughout, or with a momentary stop. A state beyond a limit
(because the limit was lowered during the move) is brought within it first. Planning takes a few
microseconds; the cost of other cycles is negligible.

* **mode 0** follows `target` and stops at each. (For an input in continuous motion use `limit3`,
  which matches its speed.)
* **mode 1** takes set-points like the profile position mode of CiA 402. Set `target`,
  `target-velocity` (0: `max-velocity`) and `relative`; set `new-set-point`; wait for
  `set-point-acknowledge`; clear it; once acknowledge is FALSE the next one may follow. It is queued
  (argument `queue`, capacity 8), or replaces all others with `change-immediately`. With
  `change-on-set-point` the previous one, if it is in the same direction, is passed at its own speed
  without a stop; the speed of the new one applies from the next cycle. If the queue is full, a
  set-point is accepted as soon as the queue has space, provided `new-set-point` stays TRUE.
* **mode 2** runs a table (argument `table`: number of rows), each row with position, speed and
  dwell. `run-table` starts it and, when FALSE, stops.
* **mode 3** brings the speed to `target-velocity`.

`halt` brakes and keeps the set-points; `stop` and `quick-stop` brake and discard the set-point, the
queue and the table, as does a change of mode. In modes 0 and 3 the motion resumes when they end.
`load` sets the position, with velocity 0 at once (to the feedback, while the drive is off). After a
stop of the thread the position is at rest, and all set-points and the table are discarded; modes 0
and 3 follow their inputs again.

While `target` is NaN its last valid value applies (in mode 1 the set-point is rejected). A limit
that is negative or NaN, or 0 for speed or acceleration, sets `limit-error`, and the motion stops
with the last valid limits. Positions are limited to ±1e15.

    loadrt motion_profile names=x-profile
    addf x-profile servo
    setp x-profile.max-velocity 200
    setp x-profile.max-acceleration 1000
    setp x-profile.max-jerk 20000
    net x-target   => x-profile.target
    net x-command  <= x-profile.position
    net x-speed    <= x-profile.velocity
)")
