// SPDX-License-Identifier: MIT
#include "recording/mcap/ros_message.hpp"

#include <algorithm>
#include <bit>
#include <map>

#include "text/numbers.hpp"

namespace hal::mcap {
namespace {

using Field = RosMessage::Field;

struct Kind {
    std::string_view word;
    std::size_t bytes;
    bool is_signed, is_float;
    hal_type type;
};

constexpr Kind kinds[] = {
    {"float64", 8, true, true, HAL_TYPE_FLOAT}, {"int64", 8, true, false, HAL_TYPE_S64},
    {"uint64", 8, false, false, HAL_TYPE_U64},  {"int32", 4, true, false, HAL_TYPE_S32},
    {"uint32", 4, false, false, HAL_TYPE_U32},  {"bool", 1, false, false, HAL_TYPE_BIT},
    {"float32", 4, true, true, HAL_TYPE_FLOAT}, {"int16", 2, true, false, HAL_TYPE_S32},
    {"uint16", 2, false, false, HAL_TYPE_U32},  {"int8", 1, true, false, HAL_TYPE_S32},
    {"uint8", 1, false, false, HAL_TYPE_U32},   {"byte", 1, false, false, HAL_TYPE_U32},
    {"char", 1, false, false, HAL_TYPE_U32},
};

constexpr std::string_view blanks = " \t\r";

// Messages that a definition may use without having them.
constexpr std::string_view well_known =
    "MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
    "===\nMSG: builtin_interfaces/Duration\nint32 sec\nuint32 nanosec\n"
    "===\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n";

std::string_view next_line(std::string_view& text) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    return line.substr(0, line.find('#'));
}

std::string_view next_word(std::string_view& line) {
    line.remove_prefix(std::min(line.find_first_not_of(blanks), line.size()));
    const std::string_view word = line.substr(0, line.find_first_of(blanks));
    line.remove_prefix(word.size());
    return word;
}

/// Returns `sensor_msgs/Imu` of `sensor_msgs/msg/Imu`.
std::string short_name(std::string_view name) {
    const std::size_t at = name.find("/msg/");
    return at == name.npos ? std::string(name)
                           : std::string(name.substr(0, at)) + std::string(name.substr(at + 4));
}

struct Line {
    std::string_view type, name;
};

/// The fields of each message of a definition, by its short name.
using Definitions = std::map<std::string, std::vector<Line>>;

void add_definitions(Definitions& definitions, std::string name, std::string_view text) {
    bool begins = name.empty();  // the line after the separator names the message
    std::vector<Line>* fields = begins ? nullptr : &definitions[name];
    while (!text.empty()) {
        std::string_view line = next_line(text);
        const std::string_view type = next_word(line);
        if (type.empty()) continue;
        if (type.starts_with("===")) {
            begins = true;
            fields = nullptr;
            continue;
        }
        if (begins) {
            const std::string_view message = type == "MSG:" ? next_word(line) : "";
            begins = false;
            if (message.empty()) continue;
            const auto [at, added] = definitions.try_emplace(short_name(message));
            fields = added ? &at->second : nullptr;  // the first definition counts
            continue;
        }
        if (fields == nullptr) continue;
        const std::string_view field = next_word(line);
        const std::size_t rest = line.find_first_not_of(blanks);
        const bool constant =
            field.find('=') != field.npos || (rest != line.npos && line[rest] == '=');
        if (!field.empty() && !constant) {
            fields->push_back({type, field});
        }
    }
}

/// Splits `float64[9]` into the type of an element and the number of elements. Returns false for an
/// invalid array.
bool split_array(std::string_view type, Field& field, std::string_view& element) {
    element = type;
    if (!type.ends_with(']')) return true;
    const std::size_t open = type.rfind('[');
    if (open == type.npos) return false;
    element = type.substr(0, open);
    const std::string_view length = type.substr(open + 1, type.size() - open - 2);
    field.count = Field::Count::any;
    if (length.empty() || length.starts_with("<=")) return true;
    field.count = Field::Count::fixed;
    return parse_whole(length, field.length) && field.length != 0;
}

/// Builds the tree of fields of a message.
class Builder {
public:
    explicit Builder(const Definitions& definitions) : definitions_(definitions) {}

    /// Appends the fields of a message. Returns false at the first whose size is unknown: that and
    /// what comes after it cannot be read.
    bool add(const std::string& message, unsigned depth, std::vector<Field>& to) {
        const auto definition = definitions_.find(message);
        if (definition == definitions_.end() || depth > max_depth) return false;
        // a message in itself
        if (std::find(open_.begin(), open_.end(), message) != open_.end()) return false;
        open_.push_back(message);
        const bool whole = add_lines(message, definition->second, depth, to);
        open_.pop_back();
        return whole;
    }
    bool too_large() const { return count_ > RosMessage::max_fields; }
    const std::string& rest() const { return rest_; }

private:
    static constexpr unsigned max_depth = 32;
    static constexpr std::size_t max_name = 60;

    bool add_lines(const std::string& message, const std::vector<Line>& lines, unsigned depth,
                   std::vector<Field>& to) {
        const std::string package = message.substr(0, message.find('/'));
        for (const Line& line : lines) {
            if (++count_ > RosMessage::max_fields) return false;
            Field field;
            field.name = line.name.substr(0, max_name);
            field.type = line.type.substr(0, max_name);
            const bool whole = complete(line.type, package, depth, field);
            if (!whole && !usable_part(field)) {
                rest_ = rest_.empty() ? field.name + " (" + field.type + ") and what comes after it"
                                      : rest_;
                return false;
            }
            to.push_back(std::move(field));
            if (!whole) return false;
        }
        if (!lines.empty()) return true;
        Field filler;  // an empty message has a byte
        filler.kind = Field::Kind::text;
        filler.bytes = 0;
        to.push_back(std::move(filler));
        return true;
    }

    static bool usable_part(const Field& field) {
        return field.kind == Field::Kind::message && field.count == Field::Count::one &&
               !field.fields.empty();
    }

    bool complete(std::string_view type, const std::string& package, unsigned depth, Field& field) {
        std::string_view element;
        if (!split_array(type, field, element)) return false;
        const auto kind = std::find_if(std::begin(kinds), std::end(kinds),
                                       [&](const Kind& one) { return one.word == element; });
        if (kind != std::end(kinds)) {
            field.bytes = kind->bytes;
            field.is_signed = kind->is_signed;
            field.is_float = kind->is_float;
            field.word = kind->type;
            return true;
        }
        if (element == "string" || element.starts_with("string<=")) {
            field.kind = Field::Kind::text;
            return true;
        }
        field.kind = Field::Kind::message;
        std::string message = short_name(element);
        if (message == "time" || message == "Time") {
            message = resolve("builtin_interfaces/Time", package + "/" + message);
        } else if (message == "duration" || message == "Duration") {
            message = resolve("builtin_interfaces/Duration", package + "/" + message);
        } else if (message == "Header") {
            message = resolve("std_msgs/Header", package + "/Header");
        } else if (message.find('/') == message.npos) {
            message.insert(0, package + "/");
        }
        return add(message, depth + 1, field.fields);
    }
    std::string resolve(const char* usual, const std::string& own) const {
        return definitions_.contains(own) ? own : usual;
    }

    const Definitions& definitions_;
    std::size_t count_ = 0;
    std::vector<std::string> open_;  // the messages that are being added
    std::string rest_;
};

/// Walks over plain CDR, which aligns values to their size. After the end good() is false.
class Cursor {
public:
    explicit Cursor(std::string_view payload) {
        constexpr std::size_t head = 4;
        if (payload.size() < head || payload[0] != 0) return;
        const unsigned encoding = static_cast<unsigned char>(payload[1]);
        constexpr unsigned cdr2 = 6;  // of XCDR2, which aligns to 4 bytes at most
        if (encoding > 1 && encoding != cdr2 && encoding != cdr2 + 1) return;
        big_endian_ = (encoding & 1) == 0;
        max_align_ = encoding >= cdr2 ? 4 : 8;
        bytes_ = payload.substr(head);
        good_ = true;
    }
    bool good() const { return good_; }
    std::uint64_t number(std::size_t bytes) {
        align(bytes);
        if (!skip(bytes)) return 0;
        std::uint64_t value = 0;
        for (std::size_t i = 0; i < bytes; ++i) {
            const std::size_t shift = 8 * (big_endian_ ? bytes - 1 - i : i);
            value |= std::uint64_t{static_cast<unsigned char>(bytes_[at_ - bytes + i])} << shift;
        }
        return value;
    }
    std::uint32_t count() { return static_cast<std::uint32_t>(number(4)); }
    void numbers(std::uint64_t count, std::size_t bytes) {
        if (count == 0) return;
        align(bytes);
        if (count > (bytes_.size() - std::min(at_, bytes_.size())) / bytes) {
            good_ = false;
        }
        skip(static_cast<std::size_t>(count) * bytes);
    }
    bool skip(std::size_t bytes) {
        if (!good_ || at_ > bytes_.size() || bytes > bytes_.size() - at_) return good_ = false;
        at_ += bytes;
        return true;
    }

private:
    void align(std::size_t bytes) {
        const std::size_t to = std::min(bytes, max_align_);
        at_ = (at_ + to - 1) / to * to;
    }
    std::string_view bytes_;
    std::size_t at_ = 0;
    std::size_t max_align_ = 8;
    bool big_endian_ = false;
    bool good_ = false;
};

std::uint64_t word_of(const Field& field, std::uint64_t value) {
    if (field.is_float && field.bytes == 4) {
        return std::bit_cast<std::uint64_t>(
            static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(value))));
    }
    const bool extend = field.is_signed && !field.is_float && field.bytes < 8;
    if (extend && value >> (8 * field.bytes - 1) != 0) {
        return value | ~std::uint64_t{0} << (8 * field.bytes);
    }
    return value;
}

void walk(const std::vector<Field>& fields, bool take, Cursor& cursor,
          std::vector<std::uint64_t>& values);

void walk_one(const Field& field, bool take, Cursor& cursor, std::vector<std::uint64_t>& values) {
    switch (field.kind) {
    case Field::Kind::number: {
        const std::uint64_t value = cursor.number(field.bytes);
        if (take && cursor.good()) {
            values.push_back(word_of(field, value));
        }
        return;
    }
    case Field::Kind::text: cursor.skip(field.bytes == 0 ? 1 : cursor.count()); return;
    case Field::Kind::message: walk(field.fields, take, cursor, values); return;
    }
}

void walk(const std::vector<Field>& fields, bool take, Cursor& cursor,
          std::vector<std::uint64_t>& values) {
    for (const Field& field : fields) {
        const bool used = take && field.has_values;
        const std::uint64_t length =
            field.count == Field::Count::any ? cursor.count() : field.length;
        if (field.kind == Field::Kind::number && !used) {
            cursor.numbers(length, field.bytes);
        } else {
            for (std::uint64_t i = 0; i < length && cursor.good(); ++i) {
                walk_one(field, used, cursor, values);
            }
        }
        if (!cursor.good()) return;
    }
}

}  // namespace

bool RosMessage::open(std::string_view name, std::string_view definition) {
    fields_.clear();
    numbers_.clear();
    skipped_.clear();
    problem_.clear();
    Definitions definitions;
    const std::string own = name.empty() ? "message" : short_name(name);
    add_definitions(definitions, own, definition);
    add_definitions(definitions, "", well_known);
    if (definitions[own].empty()) {
        problem_ = "its schema has no field";
    }
    if (!problem_.empty()) return false;
    Builder builder(definitions);
    builder.add(own, 0, fields_);
    bool fits = !builder.too_large() && list(fields_, "");
    if (!fits) {
        problem_ = "it has more than " + std::to_string(max_fields) + " fields";
    }
    if (!fits) return false;
    if (!builder.rest().empty()) {
        skipped_.push_back(builder.rest());
    }
    if (numbers_.empty()) {
        problem_ = "its schema has no number: " +
                   (skipped_.empty() ? "its messages are empty" : skipped_.front() + " is skipped");
    }
    return problem_.empty();
}

// Lists the numbers in the order of read(). Returns false when there are too many.
bool RosMessage::list(std::vector<Field>& fields, const std::string& prefix) {
    for (Field& field : fields) {
        if (field.name.empty()) {
            continue;  // the byte of an empty message
        }
        const std::string path = prefix + field.name;
        const bool long_array = field.count == Field::Count::any ||
                                (field.count == Field::Count::fixed && field.length > max_array);
        if (field.kind == Field::Kind::text || long_array) {
            skipped_.push_back(path + " (" + field.type + ")");
            continue;
        }
        field.has_values = true;
        if (!list_array(field, path)) return false;
    }
    return true;
}

bool RosMessage::list_array(Field& field, const std::string& path) {
    for (std::size_t i = 0; i < field.length; ++i) {
        const std::string name =
            field.count == Field::Count::one ? path : path + "." + std::to_string(i);
        if (field.kind == Field::Kind::number) {
            numbers_.push_back({name, field.word});
        } else if (!list(field.fields, name + ".")) {
            return false;
        }
        if (numbers_.size() + skipped_.size() > max_fields) return false;
    }
    return true;
}

bool RosMessage::read(std::string_view payload, std::vector<std::uint64_t>& values) const {
    values.clear();
    Cursor cursor(payload);
    if (!cursor.good()) return false;
    walk(fields_, true, cursor, values);
    return cursor.good() && values.size() == numbers_.size();
}

}  // namespace hal::mcap
