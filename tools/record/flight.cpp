// SPDX-License-Identifier: MIT
#include "record/flight.hpp"

#include <algorithm>
#include <ctime>
#include <fmt/core.h>
#include <sys/statvfs.h>
#include <utility>

#include "text/characters.hpp"
#include "text/quoting.hpp"

namespace hal::tools {

void FlightMemory::layout(std::vector<ProbeGroup> groups) { layouts_.push_back(std::move(groups)); }

void FlightMemory::add(ProbeBatch&& batch) {
    bytes_ += batch.bytes.size();
    batches_.push_back({layouts_.size() - 1, std::move(batch)});
}

void FlightMemory::note_last(const Held& held) {
    for (const ProbeBatch::Part& part : held.batch.parts) {
        if (part.rows == 0 || part.group >= layouts_[held.layout].size() ||
            layouts_[held.layout][part.group].period_ns != 0) {
            continue;
        }
        auto at = std::find_if(last_.begin(), last_.end(), [&](const Last& one) {
            return one.layout == held.layout && one.group == part.group;
        });
        if (at == last_.end()) {
            at = last_.insert(at, {held.layout, part.group, {}});
        }
        at->words.clear();
        for (std::size_t c = 0; c < part.columns; ++c) {
            at->words.push_back(held.batch.raw(part, part.rows - 1, c));
        }
    }
}

void FlightMemory::prune(std::int64_t now_ns, std::int64_t but_from_ns) {
    const std::int64_t from = std::min(now_ns - last_ns_, but_from_ns);
    while (!batches_.empty() && (batches_.front().batch.until_ns < from || bytes_ > max_bytes)) {
        note_last(batches_.front());
        bytes_ -= batches_.front().batch.bytes.size();
        forgotten_until_ns_ = batches_.front().batch.until_ns;
        batches_.pop_front();
    }
    while (!entries_.empty() && entries_.front().time_ns < from) {
        entries_.pop_front();
    }
}

bool FlightMemory::write(Sink& sink, std::int64_t begin_ns, std::int64_t end_ns,
                         std::uint64_t& rows) const {
    for (const auto& entry : entries_) {
        if (entry.time_ns >= begin_ns && entry.time_ns < end_ns && !sink.event(entry)) return false;
    }
    std::optional<std::size_t> layout;
    for (const Held& held : batches_) {
        if (held.batch.until_ns < begin_ns) continue;
        if (layout != held.layout) {
            layout = held.layout;
            if (!sink.layout(layouts_[*layout])) return false;
            for (const Last& last : last_) {
                if (last.layout == *layout &&
                    !sink.row(last.group, 0, begin_ns, last.words.data())) {
                    return false;
                }
            }
        }
        if (!add_batch(sink, held.batch, begin_ns, end_ns, rows)) return false;
    }
    return true;
}

void FlightTrigger::event(std::int64_t time_ns, const std::string& cause) {
    if (!since_) {
        since_ = time_ns;
        end_ = time_ns + after_ns_;
        cause_ = cause;
    } else {
        end_ = std::max(end_, std::min(time_ns + after_ns_, *since_ + 3 * after_ns_));
    }
}

void FlightBacklog::add(FlightEvent event) {
    if (events_.size() >= max_events) {
        ++lost_;
    } else {
        events_.push_back(std::move(event));
    }
}

void FlightBacklog::forget(std::int64_t until_ns) {
    while (!events_.empty() && events_.front().end_ns <= until_ns) {
        events_.pop_front();
        ++lost_;
    }
}

void FlightBacklog::written() {
    events_.pop_front();
    if (failing_) {
        ++late_;
    }
}

bool FlightBacklog::failed(std::int64_t now_ns) {
    failed_ns_ = looked_ns_ = now_ns;
    free_at_failure_ = free_bytes();
    return !std::exchange(failing_, true);
}

bool FlightBacklog::may_write(std::int64_t now_ns) {
    constexpr std::int64_t look_ns = 500'000'000;
    constexpr std::int64_t anyway_ns = 30'000'000'000;
    if (!failing_ || now_ns - failed_ns_ >= anyway_ns) return true;
    if (now_ns - looked_ns_ < look_ns) return false;
    looked_ns_ = now_ns;
    return free_bytes() > free_at_failure_;
}

std::string FlightBacklog::recovered() {
    if (!failing_ || !events_.empty()) return "";
    failing_ = false;
    return fmt::format("writing again: {} written late, {} lost\n",
                       counted(std::exchange(late_, 0), "event"), std::exchange(lost_, 0));
}

std::uint64_t FlightBacklog::free_bytes() const {
    struct statvfs disk{};
    return ::statvfs(folder_.c_str(), &disk) == 0 ? std::uint64_t{disk.f_bavail} * disk.f_frsize
                                                  : 0;
}

std::string flight_name(const std::string& file, std::int64_t unix_ns, const std::string& cause,
                        unsigned number) {
    const std::time_t seconds = static_cast<std::time_t>(unix_ns / 1'000'000'000);
    std::tm utc{};
    gmtime_r(&seconds, &utc);
    char time[32];
    std::strftime(time, sizeof time, "%Y%m%dT%H%M%SZ", &utc);
    std::string word;
    for (const char c : cause) {
        word += is_alphanumeric(c) ? c : '-';
    }
    const std::size_t dot = file.rfind('.');
    return fmt::format("{}-{}-{}-{:03}{}", file.substr(0, dot), time, word, number,
                       file.substr(dot));
}

}  // namespace hal::tools
