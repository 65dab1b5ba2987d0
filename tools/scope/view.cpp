// SPDX-License-Identifier: MIT
#include "scope/view.hpp"

#include <algorithm>
#include <cmath>

#include "scope/picture.hpp"

namespace hal::tools {

namespace {

constexpr double min_division_ns = 1e3;
constexpr double max_division_ns = 100e9;
// automatic mode rolls with a window of at least this: a picture per window would be too rare
constexpr std::int64_t min_rolling_ns = 1'000'000'000;
// roll mode makes a shorter window this long: nothing is to be seen in one that passes in 100 ms
constexpr std::int64_t roll_window_ns = 20'000'000'000;

/// Returns the smallest and the largest finite value; the first is larger than the second when no
/// value is finite.
std::pair<double, double> range_of(const Samples& samples) {
    double min = 1;
    double max = -1;
    for (const Sample& sample : samples) {
        if (!std::isfinite(sample.value)) continue;
        const bool first = min > max;
        min = first ? sample.value : std::min(min, sample.value);
        max = first ? sample.value : std::max(max, sample.value);
    }
    return {min, max};
}

}  // namespace

double next_step(double value, bool up) {
    const double decade = std::pow(10.0, std::floor(std::log10(value) + 1e-9));
    const double digit = value / decade;
    if (up) {
        if (digit < 1.5) return decade * 2;
        if (digit < 4.5) return decade * 5;
        return decade * 10;
    }
    if (digit > 4.5) return decade * 2;
    if (digit > 1.5) return decade;
    return decade * 0.5;
}

ScopeView::ScopeView(Acquisition& acquisition, bool unicode, bool colour)
    : acquisition_(acquisition),
      unicode_(unicode),
      colour_(colour),
      traces_(acquisition.channels().size()) {}

bool ScopeView::rolls() const {
    if (acquisition_.state() == State::stopped) return false;
    if (acquisition_.mode() == Mode::roll) return true;
    const bool is_long = acquisition_.pre_ns() + acquisition_.post_ns() >= min_rolling_ns;
    const bool has_trigger = acquisition_.record() && acquisition_.record()->triggered;
    return acquisition_.mode() == Mode::automatic && is_long && !has_trigger;
}

Record ScopeView::shown() const {
    return !rolls() && acquisition_.record() ? *acquisition_.record() : acquisition_.newest();
}

/// Sets the scale of a channel so that what is shown of it fills its lane.
void ScopeView::fit_lane(std::size_t channel) {
    const Record record = shown();
    auto [min, max] = range_of(record.samples[channel]);
    if (min > max) return;
    if (acquisition_.channels()[channel].bit) {
        min = 0;
        max = 1;
    }
    ChannelView& trace = traces_[channel];
    const double range = max > min ? max - min : std::max(std::abs(max), 1.0) * 0.1;
    const double fine = range / (trace.lane_divisions * 0.9);
    double step = std::pow(10.0, std::floor(std::log10(fine)));
    while (step < fine * (1 - 1e-9)) {
        step = next_step(step, true);
    }
    trace.per_division = step;
    trace.centre = (min + max) / 2 - trace.lane_centre * step;
}

void ScopeView::set_lane(std::size_t channel, double divisions, double centre) {
    ChannelView& trace = traces_[channel];
    trace.automatic = true;
    trace.lane_divisions = divisions;
    trace.lane_centre = centre;
    fit_lane(channel);
}

void ScopeView::fit(std::size_t channel) { set_lane(channel, divisions_y, 0); }

void ScopeView::fit_all() {
    const auto count = static_cast<double>(std::count_if(
        traces_.begin(), traces_.end(), [](const ChannelView& trace) { return trace.shown; }));
    const double lane = divisions_y / std::max(count, 1.0);
    double above = divisions_y / 2.0 - lane / 2;
    for (std::size_t i = 0; i < traces_.size(); ++i) {
        if (traces_[i].shown) {
            set_lane(i, lane, above);
            above -= lane;
        }
    }
}

/// Extends the automatic scales of signals that have left their lanes. They never shrink: a slow
/// signal would fill its lane at any time, whatever its size.
void ScopeView::grow_scales() {
    const bool free = acquisition_.mode() == Mode::automatic || acquisition_.mode() == Mode::roll;
    if (!free || acquisition_.state() == State::stopped) return;
    const Record record = shown();
    for (std::size_t i = 0; i < traces_.size(); ++i) {
        ChannelView& trace = traces_[i];
        if (!trace.automatic) continue;
        const auto [min, max] = range_of(record.samples[i]);
        const double middle = trace.centre + trace.lane_centre * trace.per_division;
        const double half = trace.lane_divisions / 2 * trace.per_division;
        if (min > max || (min >= middle - half && max <= middle + half)) continue;
        const double low = std::min(min, middle - half);
        const double high = std::max(max, middle + half);
        while (trace.per_division * trace.lane_divisions < high - low) {
            trace.per_division = next_step(trace.per_division, true);
        }
        trace.centre = (low + high) / 2 - trace.lane_centre * trace.per_division;
    }
}

/// Moves the selected channel in the picture.
void ScopeView::move_by(double divisions) {
    ChannelView& trace = traces_[selected_];
    trace.centre -= trace.per_division * divisions;
    trace.automatic = false;
}

/// Rolls through a window in which slow signals are to be seen.
void ScopeView::roll() {
    const std::int64_t total = acquisition_.pre_ns() + acquisition_.post_ns();
    if (total < min_rolling_ns) {
        before_roll_ = {total, acquisition_.pre_ns()};
        change_window(roll_window_ns, roll_window_ns * acquisition_.pre_ns() / total);
    }
    acquisition_.set_mode(Mode::roll);
}

/// Sets another mode, with the window from before the roll.
void ScopeView::leave_roll(Mode mode) {
    if (before_roll_.total_ns != 0) {
        change_window(before_roll_.total_ns, before_roll_.pre_ns);
        before_roll_ = {};
    }
    acquisition_.set_mode(mode);
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
    case Code::page_up: move_by(0.5); break;
    case Code::page_down: move_by(-0.5); break;
    case Code::tab: select((selected_ + 1) % traces_.size()); break;
    default: break;
    }
    return Action::none;
}

ScopeView::Action ScopeView::letter(char c) {
    if (c == 'q') return Action::quit;
    if (c == 'w') return Action::save;
    if (c >= '1' && c <= '9') {
        select(static_cast<std::size_t>(c - '1'));
        return Action::none;
    }
    struct Row {
        char letter;
        void (*act)(ScopeView& view);
    };
    static constexpr Row rows[] = {
        {'?', [](ScopeView& v) { v.help_ = true; }},
        {' ', [](ScopeView& v) { v.toggle_run(); }},
        {'s', [](ScopeView& v) { v.leave_roll(Mode::single); }},
        {'n', [](ScopeView& v) { v.leave_roll(Mode::normal); }},
        {'u', [](ScopeView& v) { v.leave_roll(Mode::automatic); }},
        {'r', [](ScopeView& v) { v.roll(); }},
        {'f', [](ScopeView& v) { v.acquisition_.force(); }},
        {'t', [](ScopeView& v) { v.next_edge(); }},
        {'o', [](ScopeView& v) { v.trigger_on_selected(); }},
        {'+', [](ScopeView& v) { v.zoom(false); }},
        {'=', [](ScopeView& v) { v.zoom(false); }},
        {'-', [](ScopeView& v) { v.zoom(true); }},
        {'[', [](ScopeView& v) { v.change_time(false); }},
        {']', [](ScopeView& v) { v.change_time(true); }},
        {'<', [](ScopeView& v) { v.move_trigger(-1); }},
        {'>', [](ScopeView& v) { v.move_trigger(1); }},
        {'a', [](ScopeView& v) { v.fit(v.selected_); }},
        {'A', [](ScopeView& v) { v.fit_all(); }},
        {'x', [](ScopeView& v) { v.traces_[v.selected_].shown = !v.traces_[v.selected_].shown; }},
        {'m', [](ScopeView& v) { v.measures_ = !v.measures_; }},
        {'c', [](ScopeView& v) { v.next_cursor(); }},
    };
    const auto row = std::ranges::find(rows, c, &Row::letter);
    if (row != std::end(rows)) {
        row->act(*this);
    }
    return Action::none;
}

void ScopeView::toggle_run() {
    if (acquisition_.state() != State::stopped) {
        acquisition_.stop();
    } else {
        acquisition_.run();
    }
}

void ScopeView::trigger_on_selected() {
    Trigger trigger = acquisition_.trigger().value_or(Trigger{});
    trigger.source = selected_;
    trigger.level = acquisition_.channels()[selected_].bit ? 0.5 : traces_[selected_].centre;
    acquisition_.set_trigger(trigger);
}

void ScopeView::zoom(bool out) {
    ChannelView& trace = traces_[selected_];
    trace.per_division = next_step(trace.per_division, out);
    trace.automatic = false;
}

/// Takes the next time per division; the trigger stays at its share of the window.
void ScopeView::change_time(bool longer) {
    before_roll_ = {};
    const auto pre = static_cast<double>(acquisition_.pre_ns());
    const auto total = static_cast<double>(acquisition_.pre_ns() + acquisition_.post_ns());
    const double division =
        std::clamp(next_step(total / divisions_x, longer), min_division_ns, max_division_ns);
    const auto window = static_cast<std::int64_t>(division * divisions_x);
    change_window(window, static_cast<std::int64_t>(static_cast<double>(window) * pre / total));
}

/// Moves the trigger within the window.
void ScopeView::move_trigger(int divisions) {
    const std::int64_t pre = acquisition_.pre_ns();
    const std::int64_t total = pre + acquisition_.post_ns();
    const std::int64_t wanted = pre + divisions * (total / divisions_x);
    change_window(total, std::clamp<std::int64_t>(wanted, 0, total - 1));
}

/// Cursors on, then the second one is moved, then off.
void ScopeView::next_cursor() {
    if (!cursors_.on) {
        cursors_ = {true, 0, {0, acquisition_.post_ns() / 2}};
    } else if (cursors_.active == 0) {
        cursors_.active = 1;
    } else {
        cursors_.on = false;
    }
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
    const bool one_less = samples > 0 || on_sample;
    const auto target = next + samples - std::ptrdiff_t{one_less};
    const auto index = static_cast<std::size_t>(
        std::clamp<std::ptrdiff_t>(target, 0, static_cast<std::ptrdiff_t>(all.size()) - 1));
    at = std::clamp(all[index].time_ns, record.begin_ns, record.end_ns) - record.trigger_ns;
}

/// Fits all channels once, when there is something to see.
void ScopeView::fit_first_record() {
    if (fitted_) return;
    const Record record = shown();
    const bool has_trace = std::any_of(record.samples.begin(), record.samples.end(),
                                       [](const Samples& samples) { return samples.size() > 1; });
    const bool ready = acquisition_.record() || acquisition_.state() == State::armed;
    if (!has_trace || (!ready && !rolls())) return;
    fit_all();
    fitted_ = true;
}

std::vector<std::string> ScopeView::frame(std::size_t columns, std::size_t rows,
                                          std::uint64_t lost) {
    if (columns >= ScopePicture::min_columns && rows >= ScopePicture::min_rows) {
        fit_first_record();
        grow_scales();
    }
    return ScopePicture(*this, acquisition_, unicode_, colour_).lines(columns, rows, lost);
}

}  // namespace hal::tools
