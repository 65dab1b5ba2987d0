// SPDX-License-Identifier: MIT
#include "control/subscriptions.hpp"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <limits>
#include <utility>

#include "commands/describe.hpp"
#include "hal/clock.hpp"

namespace hal {
namespace {

bool same(const std::vector<std::optional<Reading>>& a,
          const std::vector<std::optional<Reading>>& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const auto& x, const auto& y) {
        if (!x || !y) return !x && !y;
        return x->type == y->type && visit(x->type, x->value, [&](const auto& member) {
            return visit(y->type, y->value, [&](const auto& other) {
                if constexpr (std::is_same_v<decltype(member), decltype(other)>) {
                    return std::memcmp(&member, &other, sizeof member) == 0;
                } else {
                    return false;
                }
            });
        });
    });
}

}  // namespace

std::uint64_t Subscriptions::add(std::vector<std::string> names, std::int64_t every_ns,
                                 bool changes_only) {
    const std::scoped_lock lock(mutex_);
    if (all_.size() >= max) return 0;
    all_.push_back({next_++, std::move(names), every_ns, monotonic_ns(), changes_only});
    return all_.back().id;
}

bool Subscriptions::remove(std::uint64_t id) {
    const std::scoped_lock lock(mutex_);
    return std::erase_if(all_, [&](const Subscription& one) { return one.id == id; }) != 0;
}

bool Subscriptions::empty() const {
    const std::scoped_lock lock(mutex_);
    return all_.empty();
}

std::int64_t Subscriptions::next_due_ns() const {
    const std::scoped_lock lock(mutex_);
    std::int64_t due = std::numeric_limits<std::int64_t>::max();
    for (const Subscription& one : all_) {
        due = std::min(due, one.due_ns);
    }
    return due;
}

void Subscriptions::publish(Session& session, std::int64_t now_ns, bool congested,
                            std::string& events) {
    const std::scoped_lock own(mutex_);
    for (Subscription& one : all_) {
        if (one.due_ns > now_ns) continue;
        const std::int64_t periods = (now_ns - one.due_ns) / one.every_ns + 1;  // the grid stays
        one.due_ns += periods * one.every_ns;
        if (congested) {
            ++one.skipped;
            continue;
        }
        std::vector<std::optional<Reading>> readings;
        std::int64_t time_ns = 0;
        {
            const auto lock = session.lock();
            readings = session.values().read(one.names);
            time_ns = session.threads().now_ns();
        }
        if (one.changes_only && same(readings, one.last)) continue;
        events += "{\"event\":\"values\",\"subscription\":" + std::to_string(one.id) +
                  ",\"time_ns\":" + std::to_string(time_ns) + ",\"values\":";
        append_values(events, readings);
        if (one.skipped > 0) {
            events += ",\"skipped\":" + std::to_string(std::exchange(one.skipped, 0));
        }
        events += "}\n";
        one.last = std::move(readings);
    }
}

void append_values(std::string& to, const std::vector<std::optional<Reading>>& readings) {
    to += '[';
    for (const auto& reading : readings) {
        if (to.back() != '[') {
            to += ',';
        }
        if (reading) {
            json_value(to, reading->type, reading->value);
        } else {
            to += "null";
        }
    }
    to += ']';
}

}  // namespace hal
