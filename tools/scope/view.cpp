// SPDX-License-Identifier: MIT
// Keys of the scope.
#include "scope/view.hpp"

#include <algorithm>
#include <cmath>

namespace hal::tools {

namespace {

constexpr double least_division_ns = 1e3;
constexpr double most_division_ns = 100e9;

/// Returns the smallest and the largest finite value; the first is larger than the second when no
/// value is finite.
std::pair<double, double> range_of(const Samples& samples) {
    double least = 1;
    double most = -1;
    for (const Sample& sample : samples) {
        if (!std::isfinite(sample.value)) continue;
        const bool first = least > most;
        least = first ? sample.value : std::min(least, sample.value);
        most = first ? sample.value : std::max(most, sample.value);
    }
    return {least, most};
}

}  // namespace

double next_step(double value, bool up) {
    const double decade = std::pow(10.0, std::floor(std::log10(value) + 1e-9));

    const double digit = value / decade;
    if (up) return decade * (digit < 1.5 ? 2 : digit < 4.5 ? 5 : 10);
    return decade * (digit > 4.5 ? 2 : digit > 1.5 ? 1 : 0.5);
}

ScopeView::ScopeView(Acquisition& acquisition, bool unicode, bool colour)
    : acquisition_(acquisition),
      unicode_(unicode),
      colour_(colour),
      traces_(acquisition.channels().size()) {}

Record ScopeView::shown() const {
    const bool rolling =
        acquisition_.mode() == Mode::roll && acquisition_.state() != State::stopped;
    return !rolling && acquisition_.record() ? *acquisition_.record() : acquisition_.newest();
}

void ScopeView::fit_lane(std::size_t channel, double lane_divisions, double above_centre) {
    const Record record = shown();
    auto [least, most] = range_of(record.samples[channel]);
    if (least > most) return;
    if (acquisition_.channels()[channel].bit) {
        least = 0;
        most = 1;
    }
    const double range = most > least ? most - least : std::max(std::abs(most), 1.0) * 0.1;

    const double fine = range / (lane_divisions * 0.9);
    double step = std::pow(10.0, std::floor(std::log10(fine)));
    while (step < fine * (1 - 1e-9)) {
        step = next_step(step, true);
    }
    traces_[channel].per_division = step;
    traces_[channel].centre = (least + most) / 2 - above_centre * step;
}

void ScopeView::fit(std::size_t channel) { fit_lane(channel, divisions_y, 0); }

void ScopeView::fit_all() {
    const auto count = static_cast<double>(std::count_if(
        traces_.begin(), traces_.end(), [](const ChannelView& trace) { return trace.shown; }));
    const double lane = divisions_y / std::max(count, 1.0);
    double above = divisions_y / 2.0 - lane / 2;
    for (std::size_t i = 0; i < traces_.size(); ++i) {
        if (traces_[i].shown) {
            fit_lane(i, lane, above);
            above -= lane;
        }
    }
}

void ScopeView::select(std::size_t channel) {
    if (channel < traces_.size()) {
        selected_ = channel;
    }
}

ScopeView::Action ScopeView::key(const Key& key) {
    message_.clear();
    if (help_) {
        help_ = false;
        return Action::none;
    }
    switch (key.code) {
    case Code::character: return letter(key.character);
    case Code::up:
    case Code::down:
    case Code::left:
    case Code::right: arrow(key); break;
    case Code::page_up: traces_[selected_].centre -= traces_[selected_].per_division / 2; break;
    case Code::page_down: traces_[selected_].centre += traces_[selected_].per_division / 2; break;
    case Code::tab: select((selected_ + 1) % traces_.size()); break;
    default: break;
    }
    return Action::none;
}

ScopeView::Action ScopeView::letter(char c) {
    const std::int64_t total = acquisition_.pre_ns() + acquisition_.post_ns();

    const std::int64_t pre = acquisition_.pre_ns();
    const bool running = acquisition_.state() != State::stopped;
    ChannelView& trace = traces_[selected_];
    switch (c) {
    case 'q': return Action::quit;
    case 'w': return Action::save;
    case '?': help_ = true; break;
    case ' ': running ? acquisition_.stop() : acquisition_.run(); break;
    case 's': acquisition_.set_mode(Mode::single); break;
    case 'n': acquisition_.set_mode(Mode::normal); break;
    case 'u': acquisition_.set_mode(Mode::automatic); break;
    case 'r': acquisition_.set_mode(Mode::roll); break;
    case 'f': acquisition_.force(); break;
    case 't': next_edge(); break;
    case 'o': {
        Trigger trigger = acquisition_.trigger().value_or(Trigger{});
        trigger.source = selected_;
        trigger.level = acquisition_.channels()[selected_].bit ? 0.5 : trace.centre;
        acquisition_.set_trigger(trigger);
        break;
    }
    case '+':
    case '=': trace.per_division = next_step(trace.per_division, false); break;
    case '-': trace.per_division = next_step(trace.per_division, true); break;
    case '[':
    case ']': {
        const double division = next_step(static_cast<double>(total) / divisions_x, c == ']');
        const auto longer = static_cast<std::int64_t>(
            std::clamp(division, least_division_ns, most_division_ns) * divisions_x);
        change_window(longer, static_cast<std::int64_t>(static_cast<double>(longer) *
                                                        static_cast<double>(pre) /
                                                        static_cast<double>(total)));
        break;
    }
    case '<': change_window(total, std::max<std::int64_t>(pre - total / divisions_x, 0)); break;
    case '>': change_window(total, std::min(pre + total / divisions_x, total - 1)); break;
    case 'a': fit(selected_); break;
    case 'A': fit_all(); break;
    case 'x': trace.shown = !trace.shown; break;
    case 'm': measures_ = !measures_; break;
    case 'c':
        if (!cursors_.on) {
            cursors_ = {true, 0, {0, acquisition_.post_ns() / 2}};
        } else if (cursors_.active == 0) {
            cursors_.active = 1;
        } else {
            cursors_.on = false;
        }
        break;
    default:
        if (c >= '1' && c <= '9') {
            select(static_cast<std::size_t>(c - '1'));
        }
    }
    return Action::none;
}

void ScopeView::change_window(std::int64_t total_ns, std::int64_t pre_ns) {
    acquisition_.set_window(pre_ns, total_ns - pre_ns);
}

void ScopeView::next_edge() {
    auto trigger = acquisition_.trigger();
    if (!trigger) return;
    trigger->edge = trigger->edge == Edge::below
                        ? Edge::rising
                        : static_cast<Edge>(static_cast<int>(trigger->edge) + 1);
    acquisition_.set_trigger(trigger);
}

void ScopeView::arrow(const Key& key) {
    const int steps = key.shift ? 10 : 1;
    switch (key.code) {
    case Code::up: move_level(0.1 * steps); break;
    case Code::down: move_level(-0.1 * steps); break;
    case Code::left: move_cursor(-steps); break;
    default: move_cursor(steps);
    }
}

void ScopeView::move_level(double divisions) {
    auto trigger = acquisition_.trigger();
    if (!trigger || acquisition_.channels()[trigger->source].bit) return;
    const double fine = traces_[trigger->source].per_division * 0.1;
    trigger->level = (std::round(trigger->level / fine) + divisions * 10) *
                     fine;  // on a grid, so that up and down return to the same level
    acquisition_.set_trigger(trigger);
}

/// The active cursor steps from sample to sample of the selected channel.
void ScopeView::move_cursor(int samples) {
    if (!cursors_.on) return;
    const Record record = shown();
    const Samples& all = record.samples[selected_];
    if (all.empty()) return;
    std::int64_t& at = cursors_.at_ns[cursors_.active];
    const auto later = [](std::int64_t t, const Sample& sample) { return t < sample.time_ns; };
    const auto next =
        std::upper_bound(all.begin(), all.end(), at + record.trigger_ns, later) - all.begin();
    // On a sample, the one before `next` is where the cursor is.
    const bool on_sample =
        next > 0 && all[static_cast<std::size_t>(next - 1)].time_ns == at + record.trigger_ns;
    const auto target = samples > 0 ? next + samples - 1 : next + samples - (on_sample ? 1 : 0);
    const auto index = static_cast<std::size_t>(
        std::clamp<std::ptrdiff_t>(target, 0, static_cast<std::ptrdiff_t>(all.size()) - 1));
    at = std::clamp(all[index].time_ns, record.begin_ns, record.end_ns) - record.trigger_ns;
}

}  // namespace hal::tools
