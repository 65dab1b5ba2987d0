// SPDX-License-Identifier: MIT
#include "journal/setup_record.hpp"

#include <utility>

#include "recording/mcap/bytes.hpp"

namespace hal {

std::string to_cdr(const SetupRecord& record) {
    std::string payload("\0\1\0\0", 4);  // CDR, little-endian
    const auto pad = [&payload] { payload.resize((payload.size() + 3) / 4 * 4); };
    mcap::put(payload, static_cast<std::uint32_t>(record.kind));
    mcap::put(payload, record.error);
    for (const std::string* const part :
         {&record.name, &record.hash, &record.results, &record.readings}) {
        pad();
        mcap::put_text(payload, *part);
    }
    return payload;
}

std::optional<SetupRecord> setup_record(std::string_view payload) {
    mcap::Fields fields(payload);
    fields.take(4);  // the representation
    const auto kind = fields.get<std::uint32_t>();
    SetupRecord record{.kind = static_cast<SetupRecord::Kind>(kind)};
    record.error = fields.get<std::uint32_t>();
    for (std::string* const part :
         {&record.name, &record.hash, &record.results, &record.readings}) {
        fields.take((4 - (payload.size() - fields.left()) % 4) % 4);
        *part = fields.text();
    }
    if (!fields.good() || kind > SetupRecord::file) return std::nullopt;
    return record;
}

void JournaledSetup::add(SetupRecord record) {
    if (record.kind == SetupRecord::call) {
        calls_[record.name].push_back(
            {record.name, std::move(record.results), std::move(record.readings)});
        return;
    }
    if (!record.results.empty()) {
        contents_.emplace(record.hash, std::move(record.results));
    }
    files_[record.name].push_back({record.error, std::move(record.hash)});
}

std::optional<SetupResults> JournaledSetup::next_call(const std::string& call) {
    const auto found = calls_.find(call);
    if (found == calls_.end() || found->second.empty()) return std::nullopt;
    SetupResults results = std::move(found->second.front());
    found->second.pop_front();
    return results;
}

std::deque<JournaledSetup::Reading>* JournaledSetup::readings_of(const std::string& path) {
    if (const auto found = files_.find(path); found != files_.end()) return &found->second;
    for (auto& [name, readings] : files_) {
        if (readings.front().error == 0 && name.ends_with("/" + path)) return &readings;
    }
    return nullptr;
}

const SetupFile* JournaledSetup::next_file(const std::string& path) {
    std::deque<Reading>* const readings = readings_of(path);
    if (!readings) return nullptr;
    const Reading reading = readings->front();
    if (readings->size() > 1) {
        readings->pop_front();
    }
    given_ = {path, static_cast<int>(reading.error)};
    if (reading.error != 0) return &given_;
    const auto content = contents_.find(reading.hash);
    if (content != contents_.end()) {
        given_.bytes = content->second;
    }
    return &given_;
}

}  // namespace hal
