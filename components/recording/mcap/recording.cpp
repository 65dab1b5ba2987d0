// SPDX-License-Identifier: MIT
#include "recording/mcap/recording.hpp"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <numeric>
#include <set>
#include <sstream>
#include <type_traits>
#include <utility>

#include "hal/pin_type.hpp"
#include "recording/mcap/bytes.hpp"
#include "recording/mcap/reader.hpp"

namespace hal::mcap {
namespace {

/// The value of a text member of a flat JSON object, as our events have them.
std::string json_text(std::string_view object, std::string_view key) {
    std::string quoted = "\"";
    quoted += key;
    quoted += "\":\"";
    std::size_t at = object.find(quoted);
    std::string text;
    if (at == object.npos) return text;
    for (at += quoted.size(); at < object.size() && object[at] != '"'; ++at) {
        if (object[at] != '\\' || at + 1 >= object.size()) {
            text += object[at];
            continue;
        }
        const char c = object[++at];
        if (c == 'n') {
            text += '\n';
        } else if (c == 't') {
            text += '\t';
        } else {
            text += c;
        }
    }
    return text;
}

// Rows of several threads may come in batches: a channel's own are in order but for those of a
// thread that hung.
void sort(Table& table) {
    if (std::is_sorted(table.times_ns.begin(), table.times_ns.end())) return;
    std::vector<std::size_t> order(table.rows());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
        return table.times_ns[a] < table.times_ns[b];
    });
    Table sorted{table.topic, table.columns, {}, {}, table.thread};
    for (const std::size_t row : order) {
        sorted.times_ns.push_back(table.times_ns[row]);
        for (std::size_t c = 0; c < table.columns.size(); ++c) {
            sorted.words.push_back(table.word(row, c));
        }
    }
    table = std::move(sorted);
}

/// Our own files have these values in their rows too.
bool is_joint_state(const Reader& reader, const Channel& channel) {
    const auto schema = reader.schemas().find(channel.schema);
    return channel.topic.starts_with("/hal/") && schema != reader.schemas().end() &&
           schema->second.name == "sensor_msgs/msg/JointState";
}

constexpr const char* supported = "; CDR messages with a 'ros2msg' schema are";

/// Adds a sentence to those about what is not read, or counts it when there are many.
class Skipped {
public:
    explicit Skipped(std::vector<std::string>& sentences) : sentences_(sentences) {}
    void add(std::string sentence) {
        constexpr std::size_t max_sentences = 8;
        if (sentences_.size() < max_sentences) {
            sentences_.push_back(std::move(sentence));
        } else {
            ++more_;
        }
    }
    void finish() {
        if (more_ == 1) {
            sentences_.push_back("of 1 more topic not everything is read");
        }
        if (more_ > 1) {
            sentences_.push_back("of " + std::to_string(more_) +
                                 " more topics not everything is read");
        }
    }

private:
    std::vector<std::string>& sentences_;
    std::size_t more_ = 0;
};

std::string topic_text(const Channel& channel) {
    return "topic '" + channel.topic.substr(0, 60) + "'";
}

/// Returns "header.frame_id (string), name (string[]) and 2 more".
std::string listed(const std::vector<std::string>& fields) {
    constexpr std::size_t max_fields = 4;
    std::string text;
    for (std::size_t i = 0; i < fields.size() && i < max_fields; ++i) {
        text += (i == 0 ? "" : ", ") + fields[i];
    }
    if (fields.size() > max_fields) {
        text += " and " + std::to_string(fields.size() - max_fields) + " more";
    }
    return text;
}

/// The event in a message of rcl_interfaces/msg/Log: stamp, level, name, msg. Returns false when it
/// is too short.
bool read_log(std::string_view payload, std::string& kind, std::string& text) {
    // after the CDR header, the time, the level and its padding
    constexpr std::size_t name_at = 4 + 12;
    if (payload.size() < name_at || payload[1] != 1) return false;
    Fields fields(payload.substr(name_at));
    kind = fields.text();
    fields.take((4 - kind.size() % 4) % 4);
    text = fields.text();
    for (std::string* one : {&kind, &text}) {
        if (!one->empty()) {
            one->pop_back();  // the zero at its end
        }
    }
    return fields.good();
}

/// Fills a Recording from the channels and the messages of an MCAP file.
class McapLoader {
public:
    McapLoader(Reader& reader, Recording& to, std::size_t max_bytes)
        : reader_(reader), to_(to), max_bytes_(max_bytes), skipped_(to.skipped) {}

    /// Makes the tables, one per channel that can be read.
    void add_channels() {
        for (const auto& [id, channel] : reader_.channels()) {
            if (channel.topic == "/hal/events") {
                event_encodings_[id] = channel.encoding;
            } else if (!is_joint_state(reader_, channel)) {
                add_channel(id, channel);
            }
        }
    }

    /// Returns false when the recording has become too large.
    bool add(const Message& message) {
        bytes_ += 8;
        if (const auto row = rows_.find(message.channel); row != rows_.end()) {
            if (!add_row(row->second, message)) return true;
        } else if (event_encodings_.contains(message.channel)) {
            if (!add_event(message)) return true;
        }
        return !too_large();
    }

    bool too_large() const { return bytes_ > max_bytes_; }

    /// Sets the reasons why the recording is empty, and what of it was not read.
    void finish() {
        skipped_.finish();
        if (!reader_.problem().empty()) {
            to_.unread = reader_.problem();
        } else if (!to_.unread.empty()) {
            return;
        } else if (!unreadable_.empty()) {
            to_.unread = to_.skipped.back();
        } else {
            to_.unread = rows_.empty() ? "it has no topics" : "none of its topics has a message";
        }
    }

private:
    struct Row {
        RowReader reader;
        std::size_t table = 0;
    };

    void add_channel(std::uint16_t id, const Channel& channel) {
        const auto schema = reader_.schemas().find(channel.schema);
        if (schema == reader_.schemas().end()) return skip(channel, "it has no schema");
        RowReader row;
        if (!row.open(schema->second, channel)) return skip(channel, row.problem());
        if (!row.skipped().empty()) {
            skipped_.add(topic_text(channel) + ": not read: " + listed(row.skipped()));
        }
        const auto thread = channel.metadata.find("thread");
        to_.tables.push_back({channel.topic,
                              row.columns(),
                              {},
                              {},
                              thread == channel.metadata.end() ? "" : thread->second});
        rows_.emplace(id, Row{std::move(row), to_.tables.size() - 1});
    }

    void skip(const Channel& channel, const std::string& why) {
        const std::string sentence = topic_text(channel) + " is not read: " + why;
        if (to_.unread.empty()) {
            to_.unread = sentence + supported;
        }
        skipped_.add(sentence);
    }

    bool add_row(Row& row, const Message& message) {
        Table& table = to_.tables[row.table];
        if (!row.reader.read(message.payload, values_)) {
            if (unreadable_.insert(message.channel).second) {
                skipped_.add("a message of topic '" + table.topic.substr(0, 60) +
                             "' is shorter than its schema, or not plain CDR");
            }
            return false;
        }
        table.times_ns.push_back(static_cast<std::int64_t>(message.log_time));
        table.words.insert(table.words.end(), values_.begin(), values_.end());
        bytes_ += values_.size() * 8;
        return true;
    }

    bool add_event(const Message& message) {
        std::string kind;
        std::string text;
        if (event_encodings_[message.channel] == "json") {
            kind = json_text(message.payload, "kind");
            text = json_text(message.payload, "text");
        } else if (!read_log(message.payload, kind, text)) {
            return false;
        }
        to_.events.push_back(
            {static_cast<std::int64_t>(message.log_time), std::move(kind), std::move(text)});
        bytes_ += message.payload.size();
        return true;
    }

    Reader& reader_;
    Recording& to_;
    const std::size_t max_bytes_;
    Skipped skipped_;
    std::map<std::uint16_t, Row> rows_;  // by channel
    std::map<std::uint16_t, std::string> event_encodings_;  // by channel
    std::set<std::uint16_t> unreadable_;  // channels
    std::vector<std::uint64_t> values_;
    std::size_t bytes_ = 0;
};

/// Returns "0.25 s" for a time since the first row.
std::string seconds(std::int64_t ns) {
    char text[40];
    std::snprintf(text, sizeof text, "%.9g s", static_cast<double>(ns) * 1e-9);
    return text;
}

std::vector<std::string> names_of(const Table& table) {
    std::vector<std::string> names;
    for (const Column& column : table.columns) {
        names.push_back(column.name);
    }
    return names;
}

/// Returns ", of '/hal/servo' (x, y)": the tables of a recording.
std::string of_tables(const Recording& recording) {
    std::vector<std::string> tables;
    for (const Table& table : recording.tables) {
        const std::string values = listed(names_of(table));
        tables.push_back(
            table.topic.empty() ? values : "'" + table.topic.substr(0, 60) + "' (" + values + ")");
    }
    return tables.empty() ? "" : ", of " + listed(tables);
}

bool has_rows(const Recording& recording) {
    return std::any_of(recording.tables.begin(), recording.tables.end(),
                       [](const Table& table) { return table.rows() != 0; });
}

/// Returns "rows after 0.25 s are missing, of '/hal/servo' (x, y)": what a file does not have that
/// is not read to its end.
std::string missing_rows(const Recording& recording) {
    const std::string end = seconds(recording.end_ns() - recording.begin_ns());
    const std::string rows = has_rows(recording) ? "rows after " + end : "all rows";
    return rows + " are missing" + of_tables(recording);
}

/// Returns "rows from 0.25 s to 0.5 s are missing, ...": those of the damaged chunks of a file.
std::string rows_of(const std::vector<ChunkIndex>& damaged, const Recording& recording) {
    constexpr std::size_t max_named = 3;
    const auto since_begin = [&](std::uint64_t ns) {
        return seconds(static_cast<std::int64_t>(ns) - recording.begin_ns());
    };
    std::vector<std::string> spans;
    for (std::size_t i = 0; i < damaged.size() && i < max_named; ++i) {
        spans.push_back("from " + since_begin(damaged[i].begin_time) + " to " +
                        since_begin(damaged[i].end_time));
    }
    if (damaged.size() > max_named) {
        const std::size_t others = damaged.size() - max_named;
        spans.push_back("in " + std::to_string(others) +
                        (others == 1 ? " further chunk" : " further chunks"));
    }
    return "rows " + listed(spans) + " are missing" + of_tables(recording);
}

bool load_mcap(const std::string& path, Recording& to, std::string& problem,
               const LoadOptions& options) {
    Reader reader;
    auto source = open_file(path, problem);
    if (!source) return false;
    if (!reader.open(std::move(source))) {
        problem = "'" + path + "': " + reader.problem();
        return false;
    }
    McapLoader loader(reader, to, options.most_bytes);
    loader.add_channels();
    const auto begin = static_cast<std::uint64_t>(std::max<std::int64_t>(options.begin_ns, 0));
    const auto end =
        options.end_ns == INT64_MAX ? UINT64_MAX : static_cast<std::uint64_t>(options.end_ns);
    const auto visit = [&](const Message& message) { return loader.add(message); };
    const bool is_whole = reader.each(visit, begin, end);
    for (Table& table : to.tables) {
        sort(table);
    }
    if (!is_whole) {
        const bool is_empty = !has_rows(to);
        to.missing = "'" + path + "': " + reader.problem() + "; " +
                     (is_empty ? missing_rows(to) : rows_of(reader.damaged(), to));
    } else if (reader.unfinished()) {
        to.missing = "'" + path + "' ends without a summary; " + missing_rows(to);
    }
    loader.finish();
    if (loader.too_large()) {
        problem = "'" + path + "' has more than " + std::to_string(options.most_bytes >> 20) +
                  " MiB of values; choose a part of it";
        return false;
    }
    return true;
}

std::vector<std::string> csv_words(const std::string& line) {
    std::vector<std::string> words(1);
    bool quoted = false;
    for (std::size_t i = 0; i < line.size(); ++i) {
        if (line[i] == '"') {
            if (quoted && i + 1 < line.size() && line[i + 1] == '"') {
                words.back() += line[i++];
            } else {
                quoted = !quoted;
            }
        } else if (line[i] == ',' && !quoted) {
            words.emplace_back();
        } else if (line[i] != '\r') {
            words.back() += line[i];
        }
    }
    return words;
}

bool number_of(const std::string& text, double& value) {
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    return error == std::errc() && end == text.data() + text.size();
}

template <class Int>
bool whole_number(const std::string& text, std::uint64_t& word) {
    Int value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error == std::errc() && end == text.data() + text.size()) {
        word = static_cast<std::uint64_t>(
            static_cast<std::conditional_t<std::is_signed_v<Int>, std::int64_t, std::uint64_t>>(
                value));
        return true;
    }
    double real = 0;  // "1.0", "1e3": of another program
    if (!number_of(text, real) || real != std::floor(real) || std::abs(real) > 0x1p53) return false;
    if (real < static_cast<double>(std::numeric_limits<Int>::min()) ||
        real > static_cast<double>(std::numeric_limits<Int>::max())) {
        return false;
    }
    word = static_cast<std::uint64_t>(static_cast<std::int64_t>(real));
    return true;
}

/// Reads a value of that type into `word`. Returns false, and keeps `word`, when the text is
/// invalid.
bool word_of(const std::string& text, hal_type type, std::uint64_t& word) {
    return visit_type(type, [&]<class T>(std::type_identity<T>) {
        if constexpr (std::is_same_v<T, bool>) {
            std::uint64_t bit = 0;
            if (!whole_number<std::uint8_t>(text, bit) || bit > 1) return false;
            word = bit;
        } else if constexpr (std::is_same_v<T, double>) {
            double real = 0;
            if (!number_of(text, real)) return false;
            word = std::bit_cast<std::uint64_t>(real);
        } else {
            return whole_number<T>(text, word);
        }
        return true;
    });
}

constexpr std::pair<std::string_view, hal_type> type_words[] = {
    {"bit", HAL_TYPE_BIT}, {"float", HAL_TYPE_FLOAT}, {"s32", HAL_TYPE_S32},
    {"u32", HAL_TYPE_U32}, {"s64", HAL_TYPE_S64},     {"u64", HAL_TYPE_U64}};

/// What a reader of a table must know, though it was read; empty: nothing.
std::string note_of_csv(std::size_t equal) {
    if (equal == 0) return "";
    return std::to_string(equal) + (equal == 1 ? " row has" : " rows have") +
           " the time of the row before";
}

/// Columns of which a row has values together: those of one thread. Columns that share a row, or are
/// connected by such columns, are a group.
class ColumnGroups {
public:
    explicit ColumnGroups(std::size_t columns) : parents_(columns) {
        std::iota(parents_.begin(), parents_.end(), std::size_t{0});
    }
    void join(std::size_t a, std::size_t b) { parents_[group(b)] = group(a); }
    /// Returns the group of a column: one of its columns.
    std::size_t group(std::size_t column) {
        while (parents_[column] != column) {
            parents_[column] = parents_[parents_[column]];
            column = parents_[column];
        }
        return column;
    }

private:
    std::vector<std::size_t> parents_;
};

/// Returns a table per group. `first_filled` has, for each row, a column that it has a value of; a
/// row without any is in the first table.
std::vector<Table> split(const Table& whole, const std::vector<std::size_t>& first_filled,
                         ColumnGroups& groups) {
    std::vector<Table> tables;
    std::vector<std::vector<std::size_t>> columns;  // of each table, in the whole
    std::map<std::size_t, std::size_t> table_of;  // group to table
    std::set<std::size_t> filled;  // groups
    for (const std::size_t column : first_filled) {
        filled.insert(groups.group(column));
    }
    for (std::size_t c = 0; c < whole.columns.size(); ++c) {
        std::size_t group = groups.group(c);
        if (!filled.empty() && !filled.contains(group)) {
            group = *filled.begin();  // a column without any value keeps its initial one
        }
        const auto [at, added] = table_of.try_emplace(group, tables.size());
        if (added) {
            tables.push_back({whole.topic, {}, {}, {}});
            columns.emplace_back();
        }
        tables[at->second].columns.push_back(whole.columns[c]);
        columns[at->second].push_back(c);
    }
    for (std::size_t row = 0; row < whole.rows(); ++row) {
        const std::size_t t = table_of.at(groups.group(first_filled[row]));
        tables[t].times_ns.push_back(whole.times_ns[row]);
        for (const std::size_t c : columns[t]) {
            tables[t].words.push_back(whole.word(row, c));
        }
    }
    return tables;
}

/// Returns the number of rows with the time of the row before.
std::size_t equal_times(const std::vector<Table>& tables) {
    std::size_t count = 0;
    for (const Table& table : tables) {
        for (std::size_t row = 1; row < table.rows(); ++row) {
            count += table.times_ns[row] == table.times_ns[row - 1];
        }
    }
    return count;
}

bool load_csv(const std::string& path, Recording& to, std::string& problem,
              const LoadOptions& options) {
    const auto source = open_file(path, problem);
    std::string text, line;
    if (!source) return false;
    constexpr std::uint64_t addressable =
        std::numeric_limits<std::size_t>::max() / 2;  // on 32 bit less than the limit
    if (source->size() > std::min(4 * options.most_bytes, addressable) ||
        !source->read(0, static_cast<std::size_t>(source->size()), text)) {
        problem = "'" + path + "' is too large, or cannot be read";
        return false;
    }
    std::istringstream file(text);
    std::getline(file, line);
    const std::vector<std::string> names = csv_words(line);
    if (names.size() < 2 || names[0] != "time_s") {
        problem = "'" + path + "' is not a recording: its first column must be time_s";
        return false;
    }
    Table table{"", {}, {}, {}};
    for (std::size_t i = 1; i < names.size(); ++i) {
        const auto earlier = names.begin() + static_cast<std::ptrdiff_t>(i);
        if (std::find(names.begin(), earlier, names[i]) != earlier) {
            problem = "'" + path + "', line 1: column '" + names[i] + "' occurs twice";
            return false;
        }
        const auto type = options.types.find(names[i]);
        table.columns.push_back(
            {names[i], type == options.types.end() ? HAL_TYPE_FLOAT : type->second, ""});
    }
    std::vector<std::uint64_t> held(table.columns.size());
    ColumnGroups groups(table.columns.size());
    std::vector<std::size_t> first_filled;
    bool cut = false;
    for (std::size_t number = 2; std::getline(file, line); ++number) {
        const std::vector<std::string> words = csv_words(line);
        const std::string location = "'" + path + "', line " + std::to_string(number) + ": ";
        double time_s = 0;
        cut = file.eof();  // the line has no line end
        if (cut && words.size() < names.size()) {
            to.missing = location + "the line is cut off; ";
            break;
        }
        if (words.size() != names.size() || !number_of(words[0], time_s) ||
            !(std::abs(time_s) < 9e9)) {
            problem = location + "not a row of " + std::to_string(names.size()) + " numbers";
            return false;
        }
        std::size_t filled = 0;  // the first one; 0: none
        for (std::size_t i = 1; i < words.size(); ++i) {
            const hal_type type = table.columns[i - 1].type;
            if (words[i].empty()) continue;  // as before
            filled = filled == 0 ? i : filled;
            if (word_of(words[i], type, held[i - 1])) {
                groups.join(filled - 1, i - 1);
                continue;
            }
            if (cut && i + 1 == words.size()) {
                to.missing = location + "the line is cut off; ";
                break;
            }
            const auto word = std::find_if(std::begin(type_words), std::end(type_words),
                                           [type](const auto& one) { return one.second == type; });
            if (type == HAL_TYPE_FLOAT) {
                problem = location + "not a row of " + std::to_string(names.size()) + " numbers";
            } else {
                problem = location + "'" + words[i].substr(0, 40) + "' of '" + names[i] +
                          "' is not a value of type " + std::string(word->first);
            }
            return false;
        }
        if (!to.missing.empty()) break;
        const auto time_ns = static_cast<std::int64_t>(std::llround(time_s * 1e9));
        if (time_ns < options.begin_ns || time_ns >= options.end_ns) continue;
        first_filled.push_back(filled == 0 ? 0 : filled - 1);
        table.times_ns.push_back(time_ns);
        table.words.insert(table.words.end(), held.begin(), held.end());
        if (table.words.size() * 8 <= options.most_bytes) continue;
        problem = "'" + path + "' has more than " + std::to_string(options.most_bytes >> 20) +
                  " MiB of values; choose a part of it";
        return false;
    }
    to.tables = split(table, first_filled, groups);
    if (!to.missing.empty()) {
        to.missing += missing_rows(to);
    } else if (cut) {
        to.missing = "'" + path + "': the last line has no line end; its value of '" +
                     names.back() + "' may be cut, and rows after it may be missing";
    }
    if (const std::string note = note_of_csv(equal_times(to.tables)); !note.empty()) {
        to.note = "'" + path + "': " + note;
    }
    return true;
}

}  // namespace

std::optional<hal_type> type_of_word(std::string_view word) {
    for (const auto& [own, type] : type_words) {
        if (own == word) return type;
    }
    return std::nullopt;
}

double Table::real(std::size_t row, std::size_t column) const {
    const std::uint64_t value = word(row, column);
    return visit_type(columns[column].type, [value]<class T>(std::type_identity<T>) {
        if constexpr (std::is_same_v<T, double>) return std::bit_cast<double>(value);
        return static_cast<double>(static_cast<T>(value));
    });
}

std::int64_t Recording::begin_ns() const {
    std::int64_t time = INT64_MAX;
    for (const Table& table : tables) {
        if (table.rows() != 0) {
            time = std::min(time, table.times_ns.front());
        }
    }
    return time == INT64_MAX ? 0 : time;
}

std::int64_t Recording::end_ns() const {
    std::int64_t time = INT64_MIN;
    for (const Table& table : tables) {
        if (table.rows() != 0) {
            time = std::max(time, table.times_ns.back());
        }
    }
    return time == INT64_MIN ? 0 : time;
}

std::vector<std::string> Recording::notes() const {
    std::vector<std::string> all;
    for (const std::string& sentence : {missing, note}) {
        if (!sentence.empty()) {
            all.push_back(sentence);
        }
    }
    all.insert(all.end(), skipped.begin(), skipped.end());
    return all;
}

bool load(const std::string& path, Recording& to, std::string& problem,
          const LoadOptions& options) {
    if (!(path.ends_with(".csv") ? load_csv : load_mcap)(path, to, problem, options)) return false;
    for (Table& table : to.tables) {
        sort(table);
    }
    std::erase_if(to.tables, [](const Table& table) { return table.rows() == 0; });
    if (!to.tables.empty()) {
        to.unread.clear();
    } else {
        to.skipped.clear();
    }
    return true;
}

}  // namespace hal::mcap
