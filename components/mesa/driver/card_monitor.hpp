// SPDX-License-Identifier: MIT
// The state of a card, as its answers show it.
//
//             writes confirmed                    a missing answer more than tolerated
//   configuring ------------> online ----------------------------------------------> lost
//     ^   ^  ^                 |  |                                                    |
//     |   |  |   acknowledged  |  | other write count                     answers again |
//     |   |  +------ bitten <--+  +--> contended                                       |
//     |   +-------------------------------+ (1 s without a change of it)               |
//     +--------------------------------------------------------------------------------+
//
// A bite that nobody has acknowledged outlasts a loss, a reset and a restart: they lead to `bitten`
// in place of `configuring`.
//
// Outputs follow their pins in `online` only. Values are read in all states with an answer.
#pragma once

#include <cstdint>

namespace hal::mesa {

enum class CardState : std::uint8_t {
    configuring,  ///< all settings are written, outputs are off
    online,
    lost,       ///< no answers; only requests are sent
    bitten,     ///< its watchdog has bitten: outputs are off until the bite is acknowledged
    contended,  ///< another master writes: nothing is written
};

/// What an answer shows about the card.
struct CardReport {
    bool is_fresh = false;
    bool writes_arrived = false;
    bool has_foreign_writes = false;
    bool is_reset = false;  ///< its registers are those of a start: it has lost its power
    bool has_bitten = false;
};

/// What happens in a step. At most one each; the first of them counts.
enum class CardEvent : std::uint8_t {
    none,
    online,       ///< configured, and running
    lost,
    returned,     ///< answers again after it was lost
    was_reset,    ///< has lost its power
    bitten,
    contended,
};

/// Used by one thread. All functions are [realtime].
class CardMonitor {
public:
    CardState state() const noexcept { return state_; }
    bool drives_outputs() const noexcept { return state_ == CardState::online; }
    /// Returns the number of cycles without an answer, one after the other.
    unsigned missing() const noexcept { return missing_; }
    /// Returns whether the card was reset, or has bitten, since it was online: its outputs were off.
    bool was_off() const noexcept { return was_off_; }
    /// Returns whether outputs stay off until a bite is acknowledged, in whatever state.
    bool awaits_acknowledgment() const noexcept { return awaits_acknowledgment_; }

    /// Begins anew: after a start, or a stop of the thread.
    void restart() noexcept {
        missing_ = 0;
        foreign_ns_ = 0;
        begin();
    }
    /// A bite was acknowledged.
    void acknowledge() noexcept {
        awaits_acknowledgment_ = false;
        if (state_ == CardState::bitten) {
            begin();
        }
    }
    /// Follows the answers of a cycle. `tolerated` is the number of missing answers in a row that
    /// change nothing.
    CardEvent step(const CardReport& report, unsigned tolerated, std::int64_t period_ns) noexcept {
        if (!report.is_fresh) return miss(tolerated);
        missing_ = 0;
        switch (state_) {
        case CardState::lost: return come_back(report);
        case CardState::contended: return contend(report, period_ns);
        case CardState::configuring: return confirm(report);
        case CardState::online: return supervise(report);
        case CardState::bitten: return watch_power(report);
        }
        return CardEvent::none;
    }

private:
    static constexpr std::int64_t quiet_ns = 1'000'000'000;

    /// Everything is written to the card, and its outputs go on unless a bite keeps them off.
    void begin() noexcept {
        state_ = awaits_acknowledgment_ ? CardState::bitten : CardState::configuring;
        has_written_ = false;
    }
    CardEvent miss(unsigned tolerated) noexcept {
        if (missing_ < UINT32_MAX) {
            ++missing_;
        }
        if (state_ == CardState::lost || missing_ <= tolerated) return CardEvent::none;
        state_ = CardState::lost;
        return CardEvent::lost;
    }
    CardEvent come_back(const CardReport& report) noexcept {
        was_off_ = report.is_reset || report.has_bitten;
        is_marked_ = !report.is_reset;
        begin();
        return report.is_reset ? CardEvent::was_reset : CardEvent::returned;
    }
    CardEvent lose_power() noexcept {
        was_off_ = true;
        is_marked_ = false;
        begin();
        return CardEvent::was_reset;
    }
    CardEvent watch_power(const CardReport& report) noexcept {
        if (report.is_reset && is_marked_) return lose_power();
        is_marked_ = !report.is_reset;
        return CardEvent::none;
    }
    CardEvent contend(const CardReport& report, std::int64_t period_ns) noexcept {
        if (report.is_reset && is_marked_) return lose_power();
        foreign_ns_ = report.has_foreign_writes ? 0 : foreign_ns_ + period_ns;
        if (foreign_ns_ >= quiet_ns) {
            begin();
        }
        return CardEvent::none;
    }
    /// The settings are in the card when the writes before the newest request have arrived, and the
    /// card shows neither an old bite nor the registers of a start.
    CardEvent confirm(const CardReport& report) noexcept {
        if (watch_power(report) == CardEvent::was_reset) return CardEvent::was_reset;
        const bool is_confirmed =
            has_written_ && report.writes_arrived && !report.is_reset && !report.has_bitten;
        if (is_confirmed) {
            state_ = CardState::online;
            return CardEvent::online;
        }
        has_written_ = true;
        return CardEvent::none;
    }
    CardEvent supervise(const CardReport& report) noexcept {
        was_off_ = false;
        if (report.has_foreign_writes) {
            state_ = CardState::contended;
            foreign_ns_ = 0;
            return CardEvent::contended;
        }
        if (report.is_reset) return lose_power();
        if (report.has_bitten) {
            was_off_ = true;
            awaits_acknowledgment_ = true;
            state_ = CardState::bitten;
            return CardEvent::bitten;
        }
        return CardEvent::none;
    }

    CardState state_ = CardState::configuring;
    unsigned missing_ = 0;
    std::int64_t foreign_ns_ = 0;
    bool has_written_ = false;  // in this configuration
    bool is_marked_ = false;  // the card has shown that it is not in the state of a start
    bool was_off_ = false;
    bool awaits_acknowledgment_ = false;
};

}  // namespace hal::mesa
