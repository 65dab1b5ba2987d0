// SPDX-License-Identifier: MIT
#include "scope/acquisition.hpp"

#include <algorithm>

namespace hal::tools {

namespace {

// automatic mode: without a trigger for a record or this, it runs freely
constexpr std::int64_t min_timeout_ns = 50'000'000;

auto first_at_or_after(const std::deque<Sample>& samples, std::int64_t time_ns) {
    return std::lower_bound(
        samples.begin(), samples.end(), time_ns,
        [](const Sample& sample, std::int64_t t) { return sample.time_ns < t; });
}

}  // namespace

Acquisition::Acquisition(std::vector<Channel> channels, std::int64_t pre_ns, std::int64_t post_ns)
    : channels_(std::move(channels)),
      recent_(channels_.size()),
      pre_ns_(pre_ns),
      post_ns_(post_ns) {}

void Acquisition::set_trigger(const std::optional<Trigger>& trigger) {
    trigger_ = trigger;
    search_.reset();
    if (trigger && trigger->source < channels_.size()) {
        search_.emplace(*trigger, channels_[trigger->source].bit);
    }
    if (state_ != State::stopped) {
        arm();
    }
}

void Acquisition::set_mode(Mode mode) {
    mode_ = mode;
    run();
}

void Acquisition::set_window(std::int64_t pre_ns, std::int64_t post_ns) {
    pre_ns_ = pre_ns;
    post_ns_ = post_ns;
    if (state_ != State::stopped) {
        arm();
    }
}

void Acquisition::run() { arm(); }

void Acquisition::stop() {
    if (state_ == State::filling || state_ == State::armed || state_ == State::triggered) {
        state_ = State::stopped;
    }
    if (mode_ == Mode::roll || !record_) {
        record_ = newest();
    }
}

void Acquisition::force() {
    if (state_ == State::stopped || state_ == State::triggered || mode_ == Mode::roll) return;
    trigger_ns_ = until_ns_;
    forced_ = true;
    state_ = State::triggered;
}

void Acquisition::arm() {
    state_ = State::filling;
    armed_ns_ = until_ns_;
    forced_ = false;
    if (search_) {
        search_->rearm();
    }
}

void Acquisition::gap() {
    if (search_) {
        search_->rearm();
    }
}

void Acquisition::feed(std::size_t channel, Sample sample) {
    if (!any_) {
        first_ns_ = armed_ns_ = until_ns_ = sample.time_ns;
        any_ = true;
    }
    recent_[channel].push_back(sample);
    if (state_ != State::filling && state_ != State::armed) return;
    if (state_ == State::filling && sample.time_ns - first_ns_ >= pre_ns_) {
        state_ = State::armed;
        armed_ns_ = sample.time_ns;
    }
    if (mode_ == Mode::roll || !search_ || channel != trigger_->source) return;
    const auto fired = search_->feed(sample);
    if (!fired || state_ != State::armed) {
        return;  // a trigger while filling does not count
    }
    trigger_ns_ = *fired;
    state_ = State::triggered;
}

void Acquisition::progress(std::int64_t until_ns) {
    if (!any_) return;
    until_ns_ = std::max(until_ns_, until_ns);
    if (state_ == State::triggered && until_ns_ > trigger_ns_ + post_ns_) {
        finish(!forced_);
    }
    const bool free = !search_ || mode_ == Mode::automatic;
    if (state_ == State::armed && mode_ != Mode::roll && free &&
        until_ns_ - armed_ns_ >=
            (search_ ? std::max(pre_ns_ + post_ns_, min_timeout_ns) : post_ns_)) {
        trigger_ns_ = until_ns_ - post_ns_;
        finish(false);
    }
    trim();
}

void Acquisition::finish(bool triggered) {
    record_ = cut(trigger_ns_ - pre_ns_, trigger_ns_ + post_ns_);
    record_->trigger_ns = trigger_ns_;
    record_->triggered = triggered;
    ++finished_;
    if (mode_ == Mode::single) {
        state_ = State::stopped;
        return;
    }
    state_ = State::armed;  // the time before the next trigger is in memory already
    armed_ns_ = until_ns_;
    forced_ = false;
    if (search_) {
        search_->rearm();
    }
}

Record Acquisition::newest() const {
    Record record = cut(until_ns_ - pre_ns_ - post_ns_, until_ns_);
    record.trigger_ns = record.begin_ns + pre_ns_;
    return record;
}

Record Acquisition::cut(std::int64_t begin_ns, std::int64_t end_ns) const {
    Record record;
    record.begin_ns = begin_ns;
    record.end_ns = end_ns;
    for (const auto& all : recent_) {
        auto from = first_at_or_after(all, begin_ns);
        if (from != all.begin() && (from == all.end() || from->time_ns > begin_ns)) {
            --from;
        }
        record.samples.emplace_back(from, first_at_or_after(all, end_ns + 1));
    }
    return record;
}

// Keeps the length of a record and one sample before it, so that a value that changes rarely is
// known.
void Acquisition::trim() {
    const std::int64_t keep_ns =
        (state_ == State::triggered ? std::min(trigger_ns_, until_ns_) - pre_ns_
                                    : until_ns_ - pre_ns_ - post_ns_);
    for (auto& all : recent_) {
        auto from = first_at_or_after(all, keep_ns);
        if (from != all.begin()) {
            --from;
        }
        all.erase(all.begin(), from);
    }
}

}  // namespace hal::tools
