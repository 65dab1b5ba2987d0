// SPDX-License-Identifier: MIT
#include "control/probe_feeds.hpp"

#include <algorithm>
#include <ctime>
#include <limits>

#include "base/types.hpp"
#include "commands/json_text.hpp"
#include "hal/clock.hpp"

namespace hal {
namespace {

constexpr std::int64_t journal_every_ns = 50'000'000;
constexpr std::int64_t progress_ns = 200'000'000;  // without a row, until_ns is sent this often

std::int64_t unix_now_ns() {
    timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    return now.tv_sec * 1'000'000'000 + now.tv_nsec;
}

std::string number(std::uint64_t value) { return std::to_string(value); }

template <class Items, class Append>
void list(std::string& to, const Items& items, Append append) {
    to += '[';
    bool first = true;
    for (const auto& item : items) {
        if (!first) {
            to += ',';
        }
        first = false;
        append(item);
    }
    to += ']';
}

void append_groups(std::string& to, const ProbeLayout& layout) {
    to += ",\"groups\":";
    list(to, layout.groups, [&](const ProbeGroup& group) {
        json_quote(to += "{\"thread\":", group.thread);
        to += ",\"period_ns\":" + std::to_string(group.period_ns) + ",\"columns\":";
        list(to, group.columns, [&](std::size_t column) { to += number(column); });
        to += '}';
    });
}

}  // namespace

ProbeFeeds::~ProbeFeeds() {
    const std::scoped_lock own(mutex_);
    const auto lock = session_.lock();
    for (const Feed& feed : all_) {
        session_.probes().detach(feed.probe);
    }
    if (event_position_) {
        session_.event_log().end();
    }
}

std::string ProbeFeeds::add(const ProbeRequest& request, std::int64_t batch_ns,
                            std::string& reply) {
    const std::scoped_lock own(mutex_);
    if (all_.size() >= max) return "a client has at most " + number(max) + " probes";
    const auto lock = session_.lock();
    std::string problem;
    const auto probe = session_.probes().attach(request, problem);
    if (!probe) return problem;
    const std::int64_t now = monotonic_ns();
    all_.push_back({next_++, probe, batch_ns, now + batch_ns, now});
    const ProbeLayout& layout = Probes::layout(*probe);
    reply += ",\"probe\":" + number(all_.back().id) + ",\"layout\":" + number(layout.number) +
             ",\"time_ns\":" + std::to_string(session_.threads().now_ns()) +
             ",\"unix_ns\":" + std::to_string(unix_now_ns()) + ",\"columns\":";
    list(reply, Probes::columns(*probe), [&](const ProbeColumn& column) {
        json_quote(reply += "{\"name\":", column.name);
        reply += std::string(",\"type\":\"") + name(column.type) + "\",\"unit\":";
        json_quote(reply, column.unit);
        reply += '}';
    });
    append_groups(reply, layout);
    return "";
}

std::optional<std::uint64_t> ProbeFeeds::remove(std::uint64_t id) {
    const std::scoped_lock own(mutex_);
    const auto at =
        std::find_if(all_.begin(), all_.end(), [&](const Feed& feed) { return feed.id == id; });
    if (at == all_.end()) return std::nullopt;
    const auto lock = session_.lock();
    session_.probes().detach(at->probe);
    const std::uint64_t lost = Probes::lost(*at->probe);
    all_.erase(at);
    return lost;
}

void ProbeFeeds::journal(bool on) {
    const std::scoped_lock own(mutex_);
    if (on == event_position_.has_value()) return;
    const auto lock = session_.lock();
    if (on) {
        event_position_ = session_.event_log().begin();
    } else {
        session_.event_log().end();
        event_position_.reset();
    }
    journal_due_ns_ = monotonic_ns();
}

bool ProbeFeeds::empty() const {
    const std::scoped_lock own(mutex_);
    return all_.empty() && !event_position_;
}

std::int64_t ProbeFeeds::next_due_ns() const {
    const std::scoped_lock own(mutex_);
    std::int64_t due = event_position_ ? journal_due_ns_ : std::numeric_limits<std::int64_t>::max();
    for (const Feed& feed : all_) {
        due = std::min(due, feed.due_ns);
    }
    return due;
}

void ProbeFeeds::publish(std::int64_t now_ns, bool congested, std::string& events) {
    const std::scoped_lock own(mutex_);
    for (Feed& feed : all_) {
        if (feed.due_ns > now_ns) continue;
        feed.due_ns += ((now_ns - feed.due_ns) / feed.every_ns + 1) * feed.every_ns;
        if (!congested) {
            publish(feed, now_ns, events);
        }
    }
    if (!event_position_ || journal_due_ns_ > now_ns) return;
    journal_due_ns_ = now_ns + journal_every_ns;
    if (congested) return;
    const auto lock = session_.lock();
    for (const LoggedEvent& entry : session_.event_log().after(*event_position_)) {
        json_quote(events += "{\"event\":\"journal\",\"time_ns\":" + std::to_string(entry.time_ns) +
                             ",\"kind\":",
                   entry.kind);
        json_quote(events += ",\"text\":", entry.text);
        events += "}\n";
    }
}

void ProbeFeeds::publish(Feed& feed, std::int64_t now_ns, std::string& events) {
    std::vector<ProbeRows> results;
    {
        const auto lock = session_.lock();
        results = session_.probes().take(*feed.probe);
    }
    // more is waiting
    if (!results.empty() && results.back().bytes.size() >= Probes::max_at_once) {
        feed.due_ns = now_ns;
    }
    const std::string probe = "\"probe\":" + number(feed.id);
    for (const ProbeRows& rows : results) {
        if (rows.layout) {
            events +=
                "{\"event\":\"layout\"," + probe + ",\"layout\":" + number(rows.layout->number);
            append_groups(events, *rows.layout);
            events += "}\n";
        }
        if (rows.parts.empty() && now_ns - feed.sent_ns < progress_ns) continue;
        feed.sent_ns = now_ns;
        events += "{\"event\":\"samples\"," + probe + ",\"layout\":" + number(rows.layout_number) +
                  ",\"until_ns\":" + std::to_string(rows.until_ns) + ",\"parts\":";
        list(events, rows.parts, [&](const ProbeRows::Part& part) {
            events += "{\"group\":" + number(part.group) + ",\"rows\":" + number(part.rows) +
                      ",\"lost\":" + number(part.lost) + "}";
        });
        events += ",\"bytes\":" + number(rows.bytes.size()) + "}\n" + rows.bytes;
    }
}

}  // namespace hal
