// SPDX-License-Identifier: MIT
#include "control/trace_feed.hpp"

#include <ctime>
#include <limits>

#include "commands/json_text.hpp"
#include "hal/clock.hpp"

namespace hal {

namespace {

constexpr std::int64_t trace_every_ns = 20'000'000;

std::int64_t realtime_ns() {
    timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    return now.tv_sec * 1'000'000'000 + now.tv_nsec;
}

}  // namespace

TraceFeed::~TraceFeed() {
    std::string ignored;
    set(false, ignored);
}

std::string TraceFeed::set(bool on, std::string& reply) {
    const std::scoped_lock own(mutex_);
    if (on == on_) return on ? "this connection traces the instance already" : "";
    const auto lock = session_.lock();
    if (on) {
        if (std::string problem = session_.traces().begin(); !problem.empty()) return problem;
    }
    if (!on) {
        session_.traces().end();
    }
    on_ = on;
    due_ns_ = monotonic_ns();
    if (on) {
        reply += ",\"time_ns\":" + std::to_string(due_ns_) +
                 ",\"unix_ns\":" + std::to_string(realtime_ns());
    }
    return "";
}

bool TraceFeed::on() const {
    const std::scoped_lock own(mutex_);
    return on_;
}

std::int64_t TraceFeed::next_due_ns() const {
    const std::scoped_lock own(mutex_);
    return on_ ? due_ns_ : std::numeric_limits<std::int64_t>::max();
}

void TraceFeed::publish(std::int64_t now_ns, bool congested, std::string& events) {
    const std::scoped_lock own(mutex_);
    if (!on_ || due_ns_ > now_ns) return;
    due_ns_ = now_ns + trace_every_ns;
    if (congested) return;
    TraceBatch batch;
    {
        const auto lock = session_.lock();
        batch = session_.traces().take();
    }
    if (batch.parts.empty()) return;
    events += "{\"event\":\"trace\",\"parts\":[";
    std::size_t bytes = 0;
    for (const TraceBatch::Part& part : batch.parts) {
        if (&part != batch.parts.data()) {
            events += ',';
        }
        json_quote(events += "{\"thread\":", part.thread.name);
        events += ",\"period_ns\":" + std::to_string(part.thread.period_ns) +
                  ",\"tid\":" + std::to_string(part.thread.tid) +
                  ",\"cpu\":" + std::to_string(part.thread.cpu) +
                  ",\"count\":" + std::to_string(part.events.size()) +
                  ",\"lost\":" + std::to_string(part.lost) + "}";
        bytes += part.events.size() * sizeof(TraceEvent);
    }
    events += "],\"names\":{";
    bool first = true;
    for (const auto& [id, name] : batch.names) {
        events += std::string(first ? "\"" : ",\"") + std::to_string(id) + "\":";
        json_quote(events, name);
        first = false;
    }
    events += "},\"bytes\":" + std::to_string(bytes) + "}\n";
    for (const TraceBatch::Part& part : batch.parts) {
        events.append(reinterpret_cast<const char*>(part.events.data()),
                      part.events.size() * sizeof(TraceEvent));
    }
}

}  // namespace hal
