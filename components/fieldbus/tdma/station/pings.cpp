// SPDX-License-Identifier: MIT
#include "pings.hpp"

#include <algorithm>

namespace hal::tdma {

void Pings::ask(std::size_t n, std::uint32_t number) noexcept {
    if (n >= list_.size()) return;
    Entry& e = list_[n];
    e.asked.number = number, e.step = Step::wanted, e.began = 0;
}

std::size_t Pings::waiting() const noexcept {
    const auto e = std::find_if(list_.begin(), list_.end(), [](const Entry& x) { return x.step == Step::wanted; });
    return static_cast<std::size_t>(e - list_.begin());
}

void Pings::sent(std::size_t n, const Address& to, Time not_before) noexcept {
    Entry& e = list_[n];
    e.step = Step::sent, e.to = to, e.not_before = not_before;
}

bool Pings::take(std::size_t n, const Address& from, const Echo& echo, Time arrived) noexcept {
    if (n >= list_.size()) return false;
    Entry& e = list_[n];
    if (e.step != Step::sent || from != e.to || echo.number != e.asked.number) return false;
    // An invented one: the stamp is the driver's, made when the ping left.
    if (echo.ping_stamp < e.not_before - 1'000 || echo.ping_stamp >= arrived || arrived - echo.ping_stamp > 10 * patience) return false;
    const Time round_trip = arrived - echo.ping_stamp;
    const auto held = static_cast<std::uint64_t>(echo.stamp) - static_cast<std::uint64_t>(echo.received);
    if (echo.received > echo.stamp || held > static_cast<std::uint64_t>(10 * patience)) return false;
    e.asked.round_trip = round_trip;
    e.asked.held = std::min(static_cast<Time>(held), round_trip);
    end(e, Outcome::answered);
    return true;
}

void Pings::look(Time now, Time longest, bool running) noexcept {
    for (Entry& e : list_) {
        if (e.step == Step::idle) continue;
        if (e.began == 0) e.began = now;
        if (now - e.began <= longest) continue;
        end(e, e.step == Step::sent ? Outcome::unanswered : running ? Outcome::no_room : Outcome::not_running);
    }
}

void Pings::owe(const Owed& answer) noexcept {
    const auto last = owed_.begin() + static_cast<std::ptrdiff_t>(owing_);
    const auto same = std::find_if(owed_.begin(), last, [&](const Owed& o) { return o.to == answer.to; });
    if (same == last && owing_ == owed_.size()) return;
    if (same == last) ++owing_;
    *same = answer;
}

void Pings::paid() noexcept {
    if (owing_ == 0) return;
    std::move(owed_.begin() + 1, owed_.begin() + static_cast<std::ptrdiff_t>(owing_), owed_.begin());
    --owing_;
}

}  // namespace hal::tdma
