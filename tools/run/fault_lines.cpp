// SPDX-License-Identifier: MIT
#include "run/fault_lines.hpp"

#include <chrono>

#include "execute/core.hpp"
#include "execute/process_setup.hpp"

namespace hal::tools {

namespace {

constexpr std::chrono::milliseconds interval{50};
constexpr std::int64_t storm_ns = 3'000'000'000;

/// The detail is the sentence up to its cycle; a cycle that took too long has only measured values,
/// and no detail.
MessageSubject subject_of(const FaultRecord& record) {
    const bool measured = record.code == "overrun" || record.code == "budget" ||
                          record.code == "hung-thread" || record.code == "starved-thread";
    if (measured) {
        return {record.code + " " + record.thread};
    }
    return {record.kind, record.subject()};
}

std::string text_of(const FaultRecord& record) {
    return record.sentence + (record.varied ? "; with different codes [" : " [") + record.code +
           "]";
}

}  // namespace

FaultLines::FaultLines(Session& session, MessageLog::Sink sink)
    : session_(session), log_("fault", std::move(sink)) {
    thread_ = std::thread([this] { work(); });
}

FaultLines::~FaultLines() {
    {
        const std::lock_guard lock(mutex_);
        ending_ = true;
    }
    wake_.notify_all();
    thread_.join();
    raised_ns_ = monotonic_ns();
    look(raised_ns_);
}

void FaultLines::work() {
    release_unused_stack();
    for (std::unique_lock lock(mutex_);
         !wake_.wait_for(lock, interval, [this] { return ending_; });) {
        look(monotonic_ns());
    }
}

void FaultLines::look(std::int64_t now_ns) {
    if (const std::uint64_t raised = session_.reports().fault_count(); raised != raised_) {
        raised_ = raised;
        raised_ns_ = now_ns;
    }
    if (raised_ns_ != 0 && now_ns - raised_ns_ < storm_ns) {
        std::vector<FaultRecord> records;
        {
            const auto lock = session_.lock();
            records = session_.reports().faults();
        }
        seen_.erase(seen_.begin(),
                    records.empty() ? seen_.end() : seen_.lower_bound(records.front().number));
        for (const FaultRecord& record : records) {
            std::uint64_t& seen = seen_[record.number];
            for (; seen < record.count; ++seen) {
                log_.print(subject_of(record), text_of(record), now_ns);
            }
        }
    }
    log_.flush(now_ns);
}

}  // namespace hal::tools
