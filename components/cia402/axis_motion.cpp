// SPDX-License-Identifier: MIT
#include "axis_motion.hpp"

#include <cstdint>

namespace hal::cia402 {

namespace {
// a statusword in flight may date from before the set-point
constexpr unsigned settling_cycles = 3;
}  // namespace

bool SetPoints::push(const SetPoint& p) noexcept {
    SetPoint added = p;
    if (p.immediate) {
        if (p.relative && !combine(added)) return false;
        count_ = 0;
    }
    if (count_ == capacity) return false;
    queue_[(first_ + count_++) % capacity] = added;
    done_ = discarded_ = false;
    return true;
}

/// Adds a relative set-point to those that the drive has not taken yet, which it replaces: the sum
/// of the distances, from the last absolute one if there is one. Returns false when the sum is out
/// of range.
bool SetPoints::combine(SetPoint& p) const noexcept {
    std::int64_t sum = 0;
    for (std::size_t i = 0; i < count_; ++i) {
        const SetPoint& queued = queue_[(first_ + i) % capacity];
        sum = queued.relative ? sum + queued.target : queued.target;
        p.relative = p.relative && queued.relative;
    }
    sum += p.target;
    if (sum < INT32_MIN || sum > INT32_MAX) return false;
    p.target = static_cast<std::int32_t>(sum);
    return true;
}

void SetPoints::check(std::uint16_t statusword, Time now, Time limit) noexcept {
    if (now - since_ < limit || failure_) return;
    failure_.cause = Cause::set_point;
    failure_.request = Request::go;

    failure_.statusword = statusword;
    failure_.after = now - since_;
    failure_.state = state_of(statusword);
}

std::uint16_t SetPoints::step(std::uint16_t statusword, Time now, Time limit,
                              std::int32_t& target) noexcept {
    const bool acknowledged = (statusword & status::set_point_acknowledge) != 0;

    const bool reached = (statusword & status::target_reached) != 0;
    ++cycles_;
    switch (phase_) {
    case Phase::settling:
        if (cycles_ < settling_cycles) break;
        enter(Phase::idle, now);
        [[fallthrough]];
    case Phase::idle:
        if (count_ == 0) {
            since_ = now;
            done_ = reached && !acknowledged;
        } else if (!acknowledged) {
            now_ = queue_[first_];
            first_ = (first_ + 1) % capacity;
            --count_;
            enter(Phase::shown, now);
        } else if (reached) {
            check(statusword, now, limit);  // at standstill without space for the next
        } else {
            since_ = now;
        }
        break;
    // the target was sent a cycle before the edge
    case Phase::shown: enter(Phase::raised, now); break;
    case Phase::raised:
        if (acknowledged) {
            enter(Phase::settling, now);
        } else {
            check(statusword, now, limit);
        }
        break;
    }
    if (phase_ != Phase::shown && phase_ != Phase::raised) return 0;
    target = now_.target;
    std::uint16_t bits = phase_ == Phase::raised ? control::new_set_point : std::uint16_t{0};
    if (now_.immediate) {
        bits |= control::change_immediately;
    }
    if (now_.relative) {
        bits |= control::relative;
    }
    if (now_.blend) {
        bits |= control::change_on_set_point;
    }
    return bits;
}

HomingRun::Result HomingRun::fail(Cause cause, std::uint16_t statusword, Time waited) noexcept {
    failure_.cause = cause;
    failure_.request = Request::home;
    failure_.statusword = statusword;

    failure_.state = state_of(statusword);
    failure_.after = waited;
    return Result::failed;
}

HomingRun::Result HomingRun::step(std::uint16_t statusword, bool halted, Time now, Time settle,
                                  Time limit) noexcept {
    const Homing shown = homing_of(statusword);
    const bool error = shown == Homing::error_moving || shown == Homing::error_stopped;

    const bool attained = shown == Homing::done;
    if (phase_ == Phase::fresh) {  // bit 4 is about to rise
        since_ = last_ = now;
        error_seen_ = error;
        phase_ = error || attained || shown == Homing::attained_but_moving ? Phase::old_result
                                                                           : Phase::running;
        return Result::running;
    }
    if (halted) {
        since_ += now - last_;
    }
    last_ = now;
    if (phase_ == Phase::old_result) {
        const bool old = error_seen_ ? error : attained || shown == Homing::attained_but_moving;
        // unchanged: the drive was done, or failed, at once
        if (!old || now - since_ >= settle) {
            phase_ = Phase::running;
        } else {
            return Result::running;
        }
    }
    if (error) return fail(Cause::homing_error, statusword, now - since_);
    if (attained) return Result::attained;
    if (limit > 0 && now - since_ >= limit) {
        return fail(Cause::homing_timeout, statusword, now - since_);
    }
    return Result::running;
}

}  // namespace hal::cia402
