// SPDX-License-Identifier: MIT
#include "panel/recordings.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <fmt/core.h>
#include <nlohmann/json.hpp>

#include "text/typed_command.hpp"

namespace hal::tools {

namespace {

using Json = nlohmann::json;
using mcap::Table;

constexpr std::size_t max_bytes = 64 << 20;

/// The columns of a table that a page asked for.
struct Group {
    const Table* table;
    std::vector<std::size_t> columns;  // of the table
    std::vector<std::size_t> names;    // of the request
    std::size_t first = 0;             // row that is sent first

    std::size_t bytes() const { return rows() * words() * sizeof(std::uint64_t); }
    std::size_t rows() const { return table->rows() - first; }
    std::size_t words() const { return 2 + columns.size(); }
};

Json described(const mcap::Column& column) {
    return {
        {"name", column.name}, {"type", mcap::word_of_type(column.type)}, {"unit", column.unit}};
}

/// Returns the mean time between two rows, ns.
std::int64_t period_ns(const Table& table) {
    if (table.rows() < 2) return 0;
    return (table.times_ns.back() - table.times_ns.front()) /
           static_cast<std::int64_t>(table.rows() - 1);
}

std::vector<Group> groups_of(const mcap::Recording& recording,
                             const std::vector<std::string>& names) {
    std::vector<Group> groups;
    for (const Table& table : recording.tables) {
        Group group{&table, {}, {}};
        for (std::size_t name = 0; name < names.size(); ++name) {
            const auto at = std::find_if(
                table.columns.begin(), table.columns.end(),
                [&](const mcap::Column& column) { return column.name == names[name]; });
            if (at == table.columns.end()) continue;
            group.columns.push_back(static_cast<std::size_t>(at - table.columns.begin()));
            group.names.push_back(name);
        }
        if (!group.columns.empty() && table.rows() != 0) {
            groups.push_back(std::move(group));
        }
    }
    return groups;
}

/// Leaves out the oldest rows of all groups above max_bytes. Returns how many.
std::size_t limit(std::vector<Group>& groups) {
    std::size_t bytes = 0;
    for (const Group& group : groups) {
        bytes += group.bytes();
    }
    if (bytes <= max_bytes) return 0;
    const double share = static_cast<double>(max_bytes) / static_cast<double>(bytes);
    std::size_t left_out = 0;
    for (Group& group : groups) {
        const auto kept = static_cast<std::size_t>(static_cast<double>(group.rows()) * share);
        group.first = group.rows() - kept;
        left_out += group.first;
    }
    return left_out;
}

void append(std::string& to, std::uint64_t word) {
    std::array<char, sizeof word> bytes;
    for (std::size_t i = 0; i < bytes.size(); ++i) {
        bytes[i] = static_cast<char>(word >> (8 * i));
    }
    to.append(bytes.data(), bytes.size());
}

/// Appends the rows of a group; their cycles are unknown: 0.
void append_rows(std::string& to, const Group& group, std::int64_t begin_ns) {
    for (std::size_t row = group.first; row < group.table->rows(); ++row) {
        append(to, 0);
        append(to, static_cast<std::uint64_t>(group.table->times_ns[row] - begin_ns));
        for (const std::size_t column : group.columns) {
            append(to, group.table->word(row, column));
        }
    }
}

/// Returns the names of a request; none when they are invalid.
std::vector<std::string> names_of(const Json& request) {
    constexpr std::size_t max_names = 100;
    const auto at = request.find("names");
    if (at == request.end() || !at->is_array() || at->size() > max_names) return {};
    std::vector<std::string> names;
    for (const Json& name : *at) {
        if (!name.is_string()) return {};
        names.push_back(name.get<std::string>());
    }
    return names;
}

std::string text_of(const Json& json) {
    return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

/// Returns why a file that was loaded has no rows, and what to do.
std::string why_empty(const mcap::Recording& recording) {
    if (!recording.unread.empty()) return recording.unread;
    if (!recording.missing.empty()) return "all were cut off or damaged; choose another file";
    return as_typed("nothing was recorded; record values with: hal record FILE NAMES");
}

}  // namespace

bool Recordings::is_taken(const std::string& name) const {
    return std::any_of(all_.begin(), all_.end(),
                       [&](const Loaded& loaded) { return loaded.name == name; });
}

std::string Recordings::unique_name(const std::string& path) const {
    const std::string file_name = std::filesystem::path(path).filename().string();
    if (!is_taken(file_name)) return file_name;
    return is_taken(path) ? std::filesystem::absolute(path).string() : path;
}

std::string Recordings::same_file_as(const std::string& path) const {
    for (const Loaded& loaded : all_) {
        std::error_code ignored;
        if (std::filesystem::equivalent(loaded.path, path, ignored)) return loaded.path;
    }
    return "";
}

Recordings::Added Recordings::add(const std::string& path) {
    if (const std::string same = same_file_as(path); !same.empty()) {
        return {fmt::format("'{}' and '{}' are the same file; name it once", same, path), {}};
    }
    Loaded loaded{unique_name(path), path, {}};
    mcap::LoadOptions options;
    options.max_bytes = max_bytes_;
    options.too_large_help =
        "record fewer values or a shorter time; of a journal, choose values with: hal replay "
        "--exact JOURNAL --record FILE --names NAMES";
    std::string problem;
    if (!mcap::load(path, loaded.recording, problem, options)) return {problem, {}};
    Added added{"", loaded.recording.notes()};
    if (loaded.recording.tables.empty()) {
        added.problem = fmt::format("'{}' has no rows: {}", path, why_empty(loaded.recording));
        return added;
    }
    all_.push_back(std::move(loaded));
    return added;
}

std::vector<std::string> Recordings::names() const {
    std::vector<std::string> names;
    for (const Loaded& loaded : all_) {
        names.push_back(loaded.name);
    }
    return names;
}

Json Recordings::list() const {
    Json all = Json::array();
    for (const Loaded& loaded : all_) {
        const mcap::Recording& recording = loaded.recording;
        Json columns = Json::array();
        for (const Table& table : recording.tables) {
            for (const mcap::Column& column : table.columns) {
                columns.push_back(described(column));
            }
        }
        all.push_back(
            {{"name", loaded.name},
             {"notes", recording.notes()},
             {"columns", std::move(columns)},
             {"seconds", static_cast<double>(recording.end_ns() - recording.begin_ns()) * 1e-9}});
    }
    return all;
}

Recordings::Answer Recordings::answer(const Json& request, std::uint64_t number) const {
    const Json& index = request["recording"];
    if (!index.is_number_unsigned() || index.get<std::uint64_t>() >= all_.size()) {
        return {R"(unknown recording; "recording" must be an index of "recordings" in "welcome")",
                {},
                {},
                {}};
    }
    const std::vector<std::string> names = names_of(request);
    if (names.empty()) {
        return {R"("names" must be an array of 1 to 100 names, as ["speed"])", {}, {}, {}};
    }
    const mcap::Recording& recording = all_[index.get<std::size_t>()].recording;
    std::vector<Group> groups = groups_of(recording, names);
    const std::size_t left_out = limit(groups);
    const std::int64_t begin_ns = recording.begin_ns();

    Json columns = Json::array(), described_groups = Json::array(), parts = Json::array();
    for (const std::string& name : names) {
        columns.push_back({{"name", name}, {"type", "float"}, {"unit", ""}});
    }
    Answer answer;
    for (std::size_t i = 0; i < groups.size(); ++i) {
        const Group& group = groups[i];
        for (std::size_t k = 0; k < group.columns.size(); ++k) {
            columns[group.names[k]] = described(group.table->columns[group.columns[k]]);
        }
        described_groups.push_back({{"thread", group.table->thread},
                                    {"period_ns", period_ns(*group.table)},
                                    {"columns", group.names}});
        parts.push_back({{"group", i}, {"rows", group.rows()}, {"lost", 0}});
        append_rows(answer.rows, group, begin_ns);
    }
    Json events = Json::array();
    for (const mcap::Event& event : recording.events) {
        events.push_back(
            {{"time_ns", event.time_ns - begin_ns}, {"kind", event.kind}, {"text", event.text}});
    }
    const std::string probe = "recording:" + std::to_string(number);
    answer.reply = text_of({{"id", request.value("id", Json())},
                            {"ok", true},
                            {"probe", probe},
                            {"layout", 1},
                            {"time_ns", 0},
                            {"unix_ns", begin_ns},
                            {"columns", std::move(columns)},
                            {"groups", std::move(described_groups)},
                            {"events", std::move(events)},
                            {"left_out", left_out}});
    answer.event = text_of({{"event", "samples"},
                            {"probe", probe},
                            {"layout", 1},
                            {"until_ns", recording.end_ns() - begin_ns},
                            {"parts", std::move(parts)},
                            {"bytes", answer.rows.size()}});
    return answer;
}

}  // namespace hal::tools
