// SPDX-License-Identifier: MIT
#include "cia402/drive/trajectory.hpp"

#include <algorithm>
#include <cmath>

namespace hal::cia402 {

namespace {
void move(Motion& m, double acceleration, double dt) noexcept {
    m.position += (m.velocity + 0.5 * acceleration * dt) * dt;
    m.velocity += acceleration * dt;
    m.acceleration = acceleration;
}
}  // namespace

void ramp(Motion& m, double target, double acceleration, double deceleration, double dt) noexcept {
    m.acceleration = 0;
    // At most three parts: down to 0, up on the other side, constant.
    for (int part = 0; part < 3 && dt > 0; ++part) {
        if (m.velocity == target) {
            m.position += m.velocity * dt;
            return;
        }
        const bool through_zero = m.velocity * target < 0;
        const double goal = through_zero ? 0 : target;
        const double rate = std::abs(goal) > std::abs(m.velocity) ? acceleration : deceleration;
        if (!(rate > 0)) {
            m.position += m.velocity * dt;
            return;
        }
        const double needed = std::abs(goal - m.velocity) / rate;
        const double time = std::min(dt, needed);
        move(m, goal > m.velocity ? rate : -rate, time);
        if (time == needed) {
            m.velocity = goal;
        }
        dt -= time;
    }
}

void Profile::add(double time, double acceleration) noexcept {
    if (time > 0 && count_ < segments_.size()) {
        segments_[count_++] = {time, acceleration};
    }
}

void Profile::plan(const Motion& from, double target, const Limits& limits) noexcept {
    clear();
    elapsed_ = 0;
    target_ = target;
    const double highest = std::max(limits.velocity, 1e-6);

    const double up = std::max(limits.acceleration, 1e-6);

    const double down = std::max(limits.deceleration, 1e-6);
    double end = std::min(std::abs(limits.end_velocity), highest);
    double way = target - from.position;
    double v = from.velocity;
    const auto ahead = [&] { return v * way > 0; };
    // Moving away from the target, or too fast to reach it at the end velocity: stop first.
    if (v != 0 && (!ahead() || v * v - end * end > 2 * down * std::abs(way) * (1 + 1e-12))) {
        const double time = std::abs(v) / down;
        add(time, v > 0 ? -down : down);
        way -= 0.5 * v * time;
        v = 0;
    }
    const double sign = way < 0 ? -1 : 1;
    double u = std::abs(v);
    way = std::abs(way);
    if (way == 0 && u == 0) {
        end = 0;
    }
    if (u > highest) {
        const double time = (u - highest) / down;
        add(time, -sign * down);
        way -= 0.5 * (u + highest) * time;
        u = highest;
    }
    // The highest velocity between u and end when nothing limits it.
    const double peak_squared = (2 * way + u * u / up + end * end / down) / (1 / up + 1 / down);
    double peak = std::sqrt(std::max(peak_squared, u * u));
    if (peak < end) {
        end = peak = std::sqrt(u * u + 2 * up * way);
    }
    peak = std::min(peak, highest);
    const double rise = (peak - u) / up;
    const double fall = (peak - end) / down;
    const double cruise = way - 0.5 * (u + peak) * rise - 0.5 * (peak + end) * fall;
    add(rise, sign * up);
    if (peak > 0) {
        add(cruise / peak, 0);
    }
    add(fall, -sign * down);
    end_velocity_ = sign * end;
}

double Profile::step(Motion& m, double dt) noexcept {
    while (dt > 0 && !done()) {
        const auto& s = segments_[next_];
        const double time = std::min(dt, s.time - elapsed_);
        move(m, s.acceleration, time);
        dt -= time;
        elapsed_ += time;
        if (elapsed_ < s.time) return 0;
        elapsed_ = 0;
        if (++next_ == count_) {
            m = {target_, end_velocity_, 0};
        }
    }
    if (done()) {
        m.acceleration = 0;
    }
    return dt;
}

void Smoother::begin(const Motion& now, double time) noexcept {
    time_ = std::clamp(time, 0.0, max_time);
    raw_ = {now.position + now.velocity * time_ / 2, now.velocity, 0};
    before_ = raw_;
    given_ = now;
    origin_ = raw_.position;
    const double from = -now.velocity * time_;
    segments_[0] = {time_, from, 0, now.velocity, now.velocity, from / 2 * time_};
    head_ = 0;
    count_ = 1;
    held_ = time_;
    area_ = segments_[0].area;
    steady_ = time_;
}

Motion Smoother::step(double dt) noexcept {
    steady_ = raw_.velocity == before_.velocity ? steady_ + dt : 0;
    if (time_ <= 0 || (settled() && raw_.velocity == 0)) {
        if (time_ > 0 && raw_.position != given_.position) {
            begin(raw_, time_);
        }
        before_ = raw_;
        return given_ = raw_;
    }
    const double from = before_.position - origin_;
    const double to = raw_.position - origin_;

    const double area = (from + to) / 2 * dt;
    auto& last = segments_[(head_ + count_ - 1) % capacity];
    if ((count_ > 1 && last.time + dt <= min_segment) || count_ == capacity) {
        last.time += dt;
        last.to = to;
        last.velocity_to = raw_.velocity;
        last.area += area;
    } else {
        segments_[(head_ + count_++) % capacity] = {dt,  from, to, before_.velocity, raw_.velocity,
                                                    area};
    }
    held_ += dt;
    area_ += area;
    while (count_ > 1 && held_ - segments_[head_].time >= time_) {
        held_ -= segments_[head_].time;
        area_ -= segments_[head_].area;
        head_ = (head_ + 1) % capacity;
        --count_;
    }
    // Only the end of the oldest segment belongs to the last `time_`.
    const Segment& oldest = segments_[head_];
    const double out = std::max(held_ - time_, 0.0),
                 share = oldest.time > 0 ? out / oldest.time : 0;
    const double position = oldest.from + (oldest.to - oldest.from) * share;
    const double velocity =
        oldest.velocity_from + (oldest.velocity_to - oldest.velocity_from) * share;
    given_.position = origin_ + (area_ - (oldest.from + position) / 2 * out) / time_;
    given_.velocity = (to - position) / time_;
    given_.acceleration = (raw_.velocity - velocity) / time_;
    before_ = raw_;
    return given_;
}

double Interpolator::step(Motion& m, double dt) noexcept {
    const double before = m.position;
    const double time = std::min(dt, left_);
    left_ -= time;
    m.position = left_ > 0 && period_ > 0 ? to_ - (to_ - from_) * left_ / period_ : to_;
    m.velocity = dt > 0 ? (m.position - before) / dt : 0;
    m.acceleration = 0;
    return dt - time;
}

}  // namespace hal::cia402
