// SPDX-License-Identifier: MIT
#include "run/replay_timeline.hpp"

#include <algorithm>
#include <filesystem>
#include <limits>

namespace hal::tools {

using Json = nlohmann::ordered_json;

ReplayTimeline::ReplayTimeline(JournalFile& file) {
    std::int64_t begin_ns = std::numeric_limits<std::int64_t>::max();
    std::int64_t end_ns = std::numeric_limits<std::int64_t>::min();
    Json threads = Json::array();
    for (const auto& [number, thread] : file.threads()) {
        threads.push_back({{"name", thread.name}, {"period_ns", thread.period_ns}});
        const auto extent = thread.remaining();
        if (!extent) continue;
        begin_ns = std::min(begin_ns, extent->first_ns);
        end_ns = std::max(end_ns, extent->last_ns);
    }
    if (begin_ns <= end_ns) {
        end_ns_ = end_ns - begin_ns;
        begin_unix_ns_ = begin_ns + file.unix_offset_ns();
    }
    head_ = {{"file", std::filesystem::path(file.paths().front()).filename().string()},
             {"end_ns", end_ns_},
             {"unix_ns", begin_unix_ns_},
             {"complete", file.complete()},
             {"notes", file.notes()},
             {"threads", std::move(threads)}};
}

bool ReplayTimeline::add(std::string_view text) {
    Json json = Json::parse(text, nullptr, false);
    if (!json.is_object()) return false;
    const auto cycles = json.value("cycles", std::uint64_t{0});
    if (is_known(cycles, json)) return false;
    const bool is_fault = json.value("kind", "") == "fault";
    Count& count = is_fault ? faults_ : others_;
    if (count.kept == max_marks) {
        ++count.left_out;
        return false;
    }
    ++count.kept;
    marks_.push_back({cycles, is_fault, std::move(json)});
    return true;
}

bool ReplayTimeline::is_known(std::uint64_t cycles, const Json& json) const {
    for (auto mark = marks_.rbegin(); mark != marks_.rend() && mark->cycles >= cycles; ++mark) {
        if (mark->json == json) return true;
    }
    return false;
}

std::uint64_t ReplayTimeline::fault_after(std::uint64_t cycles) const {
    std::uint64_t found = 0;
    for (const Mark& mark : marks_) {
        const bool is_nearer = found == 0 || mark.cycles < found;
        if (mark.is_fault && mark.cycles > cycles && is_nearer) {
            found = mark.cycles;
        }
    }
    return found;
}

std::uint64_t ReplayTimeline::fault_before(std::uint64_t cycles) const {
    std::uint64_t found = 0;
    for (const Mark& mark : marks_) {
        if (mark.is_fault && mark.cycles < cycles) {
            found = std::max(found, mark.cycles);
        }
    }
    return found;
}

Json ReplayTimeline::json() const {
    Json all = head_;
    Json& marks = all["marks"] = Json::array();
    for (const Mark& mark : marks_) {
        marks.push_back(mark.json);
    }
    return all;
}

}  // namespace hal::tools
