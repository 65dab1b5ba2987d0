// SPDX-License-Identifier: MIT
#include "ethercat/recorded/recorded_answers.hpp"

#include <algorithm>
#include <limits>

#include "ethercat/recorded/frame_directions.hpp"

namespace hal::ethercat {
namespace {

/// of equal writes that are compared, so that a cycle stays short
constexpr std::size_t max_compared = 256;

}  // namespace

/// Process data and the distribution of the clock are not writes: they repeat in each cycle.
bool RecordedAnswers::is_write(Command command) noexcept {
    switch (command) {
    case Command::apwr:
    case Command::aprw:
    case Command::fpwr:
    case Command::fprw:
    case Command::bwr:
    case Command::brw: return true;
    default: return false;
    }
}

/// Returns a number for the slaves that a datagram is for.
std::uint32_t RecordedAnswers::target_of(const DatagramView& d) noexcept {
    constexpr std::uint32_t by_position = 0x10000;
    constexpr std::uint32_t all = 0x20000;
    switch (d.command) {
    case Command::aprd:
    case Command::apwr:
    case Command::aprw:
    case Command::armw: return by_position | d.position();
    case Command::fprd:
    case Command::fpwr:
    case Command::fprw:
    case Command::frmw: return d.position();
    default: return all;
    }
}

RecordedAnswers::Key RecordedAnswers::key_of(const DatagramView& d) noexcept {
    return {d.command, d.length, d.address};
}

std::size_t RecordedAnswers::Target::next_write() const noexcept {
    const auto next = std::upper_bound(writes.begin(), writes.end(), reached);
    return next == writes.end() ? std::numeric_limits<std::size_t>::max() : *next;
}

RecordedAnswers::RecordedAnswers(const std::vector<hal::ethernet::Captured>& frames) {
    FrameDirections directions;
    std::vector<std::vector<std::uint8_t>> taken;  // EtherCAT frames
    for (const hal::ethernet::Captured& captured : frames) {
        taken.push_back(captured.bytes);
        if (!FrameReader(taken.back()).valid()) {
            taken.pop_back();
            continue;
        }
        const auto direction = directions.take(taken.back());
        if (!direction.returned || direction.sent == FrameDirections::Direction::npos) continue;
        FrameReader sent(taken[direction.sent]);
        FrameReader returned(taken.back());
        for (auto a = sent.next(), b = returned.next(); a && b;
             a = sent.next(), b = returned.next()) {
            add(*a, *b);
        }
    }
}

std::size_t RecordedAnswers::keep(const DatagramView& d) {
    const std::size_t index = bytes_.size();
    bytes_.insert(bytes_.end(), d.data, d.data + d.length);
    return index;
}

void RecordedAnswers::add(const DatagramView& sent, const DatagramView& returned) {
    Answer answer;
    answer.order = ++answers_;
    answer.sent = keep(sent);
    answer.returned = keep(returned);
    answer.position = returned.position();
    answer.wkc = returned.wkc();
    Series& series = series_[key_of(sent)];
    series.answers.push_back(answer);
    series.changed.resize(sent.length);
    for (std::size_t i = 0; i < sent.length; ++i) {
        if (sent.data[i] != returned.data[i]) {
            series.changed[i] = true;
        }
    }
    Target& target = targets_[target_of(sent)];
    if (is_write(sent.command)) {
        target.writes.push_back(answer.order);
    }
}

/// Returns the next write of the same bytes, or the next one of others.
const RecordedAnswers::Answer* RecordedAnswers::find_write(Series& series, Target& target,
                                                           const DatagramView& d) noexcept {
    const std::size_t end = std::min(series.answers.size(), series.next + max_compared);
    for (std::size_t i = series.next; i < end; ++i) {
        const Answer& one = series.answers[i];
        if (!std::equal(d.data, d.data + d.length, bytes_.data() + one.sent)) continue;
        series.next = i + 1;
        target.reached = std::max(target.reached, one.order);
        return &one;
    }
    const std::size_t at = std::min(series.next, series.answers.size() - 1);
    series.next = at + 1;
    return &series.answers[at];
}

/// Returns the next answer between the newest repeated write and the next one; without one there,
/// the last before, or else the first.
const RecordedAnswers::Answer* RecordedAnswers::find_read(Series& series,
                                                          const Target& target) noexcept {
    const auto& answers = series.answers;
    const std::size_t end = target.next_write();
    while (series.next < answers.size() && answers[series.next].order < target.reached) {
        ++series.next;
    }
    if (series.next < answers.size() && answers[series.next].order < end) {
        return &answers[series.next++];
    }
    return &answers[series.next == 0 ? 0 : series.next - 1];
}

bool RecordedAnswers::answer(const DatagramView& d) noexcept {
    const auto found = series_.find(key_of(d));
    const auto target = targets_.find(target_of(d));
    if (found == series_.end() || target == targets_.end()) return false;
    const bool writes = is_write(d.command);
    const Answer* const one = writes ? find_write(found->second, target->second, d)
                                     : find_read(found->second, target->second);
    const std::uint8_t* const returned = bytes_.data() + one->returned;
    for (std::size_t i = 0; i < d.length; ++i) {
        if (found->second.changed[i]) {
            d.data[i] = returned[i];
        }
    }
    if (!is_logical(d.command)) {
        put(d.header + 2, one->position);
    }
    d.set_wkc(one->wkc);
    return true;
}

std::size_t RecordedAnswers::answer(std::span<std::uint8_t> frame) noexcept {
    std::size_t unknown = 0;
    FrameReader reader(frame);
    while (const auto d = reader.next()) {
        if (!answer(*d)) {
            ++unknown;
        }
    }
    return unknown;
}

}  // namespace hal::ethercat
