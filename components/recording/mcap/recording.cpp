// SPDX-License-Identifier: MIT
#include "recording/mcap/recording.hpp"

#include <algorithm>
#include <bit>
#include <map>
#include <numeric>
#include <set>
#include <type_traits>
#include <utility>

#include "hal/pin_type.hpp"
#include "recording/mcap/bytes.hpp"
#include "recording/mcap/csv_loader.hpp"
#include "recording/mcap/missing_rows.hpp"
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

/// What a journal has for its own execution, beside the values.
bool is_of_journal(const Channel& channel) { return channel.topic.starts_with("/hal/journal/"); }

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
        if (!row.skipped().empty() && !is_of_journal(channel)) {
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
        if (!is_of_journal(channel)) {
            skipped_.add(sentence);
        }
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

bool load_mcap(const std::string& path, Recording& to, std::string& problem,
               const LoadOptions& options) {
    Reader reader;
    auto source = open_file(path, problem);
    if (!source) return false;
    if (!reader.open(std::move(source))) {
        problem = "'" + path + "': " + reader.problem();
        return false;
    }
    McapLoader loader(reader, to, options.max_bytes);
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
        to.missing =
            "'" + path + "': " + reader.problem() + "; " + missing_rows(to, reader.damaged());
    } else if (reader.unfinished()) {
        to.missing = "'" + path + "' ends without a summary; " + missing_rows(to);
    }
    loader.finish();
    if (loader.too_large()) {
        problem = "'" + path + "' has more than " + std::to_string(options.max_bytes >> 20) +
                  " MiB of values; " + options.too_large_help;
        return false;
    }
    return true;
}

constexpr std::pair<std::string_view, hal_type> type_words[] = {
    {"bit", HAL_TYPE_BIT}, {"float", HAL_TYPE_FLOAT}, {"s32", HAL_TYPE_S32},
    {"u32", HAL_TYPE_U32}, {"s64", HAL_TYPE_S64},     {"u64", HAL_TYPE_U64}};

}  // namespace

std::optional<hal_type> type_of_word(std::string_view word) {
    for (const auto& [own, type] : type_words) {
        if (own == word) return type;
    }
    return std::nullopt;
}

std::string_view word_of_type(hal_type type) {
    for (const auto& [word, own] : type_words) {
        if (own == type) return word;
    }
    return "";
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
