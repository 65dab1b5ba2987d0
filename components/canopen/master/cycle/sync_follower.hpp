// SPDX-License-Identifier: MIT
// `sync = follow`: disciplines the threads of this machine by the SYNC of another node.
#pragma once

#include <utility>

#include "canopen/master/config/master_config.hpp"
#include "hal/discipline.hpp"
#include "runner.hpp"

namespace hal::canopen {

/// Keeps the cycles of the thread at a constant delay after the SYNC, and reports the error.
class SyncFollower {
public:
    enum class Notice : std::uint8_t {
        nothing,
        lost,      ///< five SYNCs in a row missing: the threads run by their own clock
        in_vain,   ///< feedback loop: the SYNC follows these threads
        unequal,   ///< its period and that of the thread do not match
        unlocked,  ///< it is received, but the cycles have not been synchronised to it for 5 s
    };

    SyncFollower(Component& component, const Function& shows, const config::MasterConfig& config)
        : config_(config),
          locked_(component, shows, "sync-locked", "the cycles are synchronised to the SYNC",
                  {.safe = false}),
          error_(component, shows, "sync-error-us", "lateness of the newest SYNC", {.unit = "us"}),
          rate_(component, shows, "sync-rate-ppm",
                "drift of the clock of the SYNC producer; positive: slower than this host",
                {.unit = "ppm"}) {}

    /// Throws if the threads already follow another reference. [setup]
    void start() {
        beat_.lose();
        seen_ = 0;
        following_ = false;
        clock_.claim();
    }

    /// Awaits the next SYNC after a time without cycles, which is not a loss. [realtime]
    void restart() noexcept {
        beat_.lose();
        following_ = false;
        missed_ = 0;
        unlocked_reported_ = false;
    }

    /// Once a cycle, after Runner::receive(). [realtime]
    Notice cycle(const Runner& runner, Time start, Time period) noexcept {
        const Time every = config_.sync_period > 0 ? config_.sync_period : period;
        if (every % period != 0) {
            const bool told = std::exchange(unequal_, true);
            return told ? Notice::nothing : Notice::unequal;
        }
        Notice notice = Notice::nothing;
        if (runner.syncs_heard() != seen_) {
            seen_ = runner.syncs_heard();
            ours_ = runner.sync_is_ours();
            if (ours_) {
                following_ = false;
            } else {
                notice = take(runner.sync_came(), every, start, period);
            }
        } else if (following_) {
            notice = miss(every, start);
        }
        if (notice == Notice::nothing && lacks_lock(start)) {
            notice = Notice::unlocked;
        }
        locked_ = ours_ || beat_.locked();
        rate_ = beat_.rate() * 1e6;
        return notice;
    }
    /// Returns true while the threads follow the SYNC of another device. [realtime]
    bool locked() const noexcept { return beat_.locked(); }
    /// Returns the time since the newest SYNC in s. [realtime]
    Time silence(Time now) const noexcept { return now - came_; }
    /// Returns how long the cycles have not been synchronised to a SYNC that is received.
    /// [realtime]
    Time unlocked_for(Time now) const noexcept { return now - unlocked_since_; }

private:
    static constexpr unsigned max_missed = 5;

    Notice take(Time came, Time every, Time start, Time period) noexcept {
        const Time phase = config_.sync_phase >= 0 ? config_.sync_phase : period / 2;
        // cycles follow each other, so it counts within half of one
        Time error = (came + phase - start) % period;
        if (error >= (period + 1) / 2) {
            error -= period;
        }
        if (error < -period / 2) {
            error += period;
        }
        came_ = came;
        following_ = true;
        missed_ = 0;
        const bool was_in_vain = beat_.in_vain();
        clock_.step(beat_.follow(error, every, clock_.limit_ns()));
        error_ = static_cast<double>(error) * 1e-3;
        return beat_.in_vain() && !was_in_vain ? Notice::in_vain : Notice::nothing;
    }

    Notice miss(Time every, Time start) noexcept {
        if (start - came_ <= static_cast<Time>(missed_ + 2) * every) return Notice::nothing;
        if (++missed_ < max_missed) {
            clock_.step(beat_.coast(every, clock_.limit_ns()));
            return Notice::nothing;
        }
        beat_.lose();
        following_ = false;
        return Notice::lost;
    }

    /// Returns true once when the SYNC has been received for 5 s without a lock. [realtime]
    bool lacks_lock(Time now) noexcept {
        constexpr Time limit = 5'000'000'000;
        if (!following_ || beat_.locked() || beat_.in_vain()) {
            unlocked_since_ = now;
            unlocked_reported_ = false;
            return false;
        }
        return unlocked_for(now) >= limit && !std::exchange(unlocked_reported_, true);
    }

    const config::MasterConfig& config_;
    DisciplinedClock clock_;
    Discipline beat_;
    Time came_ = 0;
    std::uint64_t seen_ = 0;
    Time unlocked_since_ = 0;  // set while there is a lock, or no SYNC
    unsigned missed_ = 0;
    bool unlocked_reported_ = false;
    bool following_ = false;
    bool ours_ = false;
    bool unequal_ = false;
    Out<bool> locked_;
    Out<double> error_, rate_;
};

}  // namespace hal::canopen
