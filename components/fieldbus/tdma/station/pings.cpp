// SPDX-License-Identifier: MIT
#include "pings.hpp"

#include <algorithm>

namespace hal::tdma {

void Pings::ask(std::size_t n, std::uint32_t number) noexcept {
    if (n >= list_.size()) return;
    Entry& e = list_[n];
    e.asked.number = number;
    e.step = Step::wanted;
    e.began = 0;
}

std::size_t Pings::waiting() const noexcept {
    const auto e = std::find_if(list_.begin(), list_.end(),
                                [](const Entry& x) { return x.step == Step::wanted; });
    return static_cast<std::size_t>(e - list_.begin());
}

void Pings::sent(std::size_t n, const Address& to, Time not_before) noexcept {
    Entry& e = list_[n];
    e.step = Step::sent;
    e.to = to;
    e.not_before = not_before;
}

bool Pings::accept(std::size_t n, const Address& from, const Echo& echo, Time arrived) noexcept {
    if (n >= list_.size()) return false;
    Entry& e = list_[n];
    if (e.step != Step::sent || from != e.to || echo.number != e.asked.number) return false;
    // The driver stamps the ping when it leaves; any other stamp is forged.
    if (echo.ping_stamp < e.not_before - 1'000 || echo.ping_stamp >= arrived ||
        arrived - echo.ping_stamp > 10 * timeout) {
        return false;
    }
    const Time round_trip = arrived - echo.ping_stamp;
    const auto held =
        static_cast<std::uint64_t>(echo.stamp) - static_cast<std::uint64_t>(echo.received);
    if (echo.received > echo.stamp || held > static_cast<std::uint64_t>(10 * timeout)) return false;
    e.asked.round_trip = round_trip;
    e.asked.held = std::min(static_cast<Time>(held), round_trip);
    end(e, Outcome::answered);
    return true;
}

void Pings::expire(Time now, Time timeout_ns, bool running) noexcept {
    const Outcome unsent = running ? Outcome::no_room : Outcome::not_running;
    for (Entry& e : list_) {
        if (e.step == Step::idle) continue;
        if (e.began == 0) {
            e.began = now;
        }
        if (now - e.began <= timeout_ns) continue;
        end(e, e.step == Step::sent ? Outcome::unanswered : unsent);
    }
}

void Pings::queue_answer(const Owed& answer) noexcept {
    const auto last = queue_.begin() + static_cast<std::ptrdiff_t>(answers_);
    const auto same =
        std::find_if(queue_.begin(), last, [&](const Owed& o) { return o.to == answer.to; });
    if (same == last && answers_ == queue_.size()) return;
    if (same == last) {
        ++answers_;
    }
    *same = answer;
}

void Pings::pop_answer() noexcept {
    if (answers_ == 0) return;
    std::move(queue_.begin() + 1, queue_.begin() + static_cast<std::ptrdiff_t>(answers_),
              queue_.begin());
    --answers_;
}

}  // namespace hal::tdma
