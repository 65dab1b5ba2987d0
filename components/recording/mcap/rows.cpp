// SPDX-License-Identifier: MIT
#include "recording/mcap/rows.hpp"

#include <algorithm>
#include <bit>
#include <numeric>
#include <set>
#include <utility>

#include "recording/mcap/bytes.hpp"

namespace hal::mcap {
namespace {

constexpr std::size_t most_columns = 100'000;

struct Kind {
    std::string_view word;
    std::size_t      bytes;
    bool             is_signed, is_float;
    hal_type         type;
};

constexpr Kind kinds[] = {
    {"float64", 8, true, true, HAL_TYPE_FLOAT}, {"int64", 8, true, false, HAL_TYPE_S64},   {"uint64", 8, false, false, HAL_TYPE_U64},
    {"int32", 4, true, false, HAL_TYPE_S32},    {"uint32", 4, false, false, HAL_TYPE_U32}, {"bool", 1, false, false, HAL_TYPE_BIT},
    {"float32", 4, true, true, HAL_TYPE_FLOAT}, {"int16", 2, true, false, HAL_TYPE_S32},   {"uint16", 2, false, false, HAL_TYPE_U32},
    {"int8", 1, true, false, HAL_TYPE_S32},     {"uint8", 1, false, false, HAL_TYPE_U32},
};

const Kind& kind_of(hal_type type) {
    return *std::find_if(std::begin(kinds), std::end(kinds),
                         [type](const Kind& kind) { return kind.type == type || kind.type == HAL_TYPE_BIT; });
}

// joint.0.pos-cmd: joint_0_pos_cmd, as ROS wants it: lower case, a letter first, no two underscores in a row.
std::string identifier(const std::string& name) {
    std::string field;
    for (const char c : name) {
        const bool plain = (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9');
        const char lower = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : plain ? c : '_';
        if (lower != '_' || (!field.empty() && field.back() != '_')) field += lower;
    }
    while (!field.empty() && field.back() == '_') field.pop_back();
    if (field.empty()) return "v";
    if (field.front() >= '0' && field.front() <= '9') field.insert(0, "v_");
    return field;
}

std::string_view next_line(std::string_view& text) {
    const std::size_t      end = std::min(text.find('\n'), text.size());
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    return line.substr(0, line.find('#'));
}

std::string_view next_word(std::string_view& line) {
    const std::size_t begin = std::min(line.find_first_not_of(" \t\r"), line.size());
    line.remove_prefix(begin);
    const std::string_view word = line.substr(0, line.find_first_of(" \t\r"));
    line.remove_prefix(word.size());
    return word;
}

}  // namespace

RowWriter::RowWriter(std::vector<Column> columns) : columns_(std::move(columns)), order_(columns_.size()) {
    std::set<std::string> taken;
    for (const Column& column : columns_) {
        const std::string base = identifier(column.name);
        std::string       field = base;
        for (int n = 2; !taken.insert(field).second; ++n) field = base + "_" + std::to_string(n);
        fields_.push_back(std::move(field));
    }
    std::iota(order_.begin(), order_.end(), std::size_t{0});
    std::stable_sort(order_.begin(), order_.end(),
                     [this](std::size_t a, std::size_t b) { return kind_of(columns_[a].type).bytes > kind_of(columns_[b].type).bytes; });
}

std::string RowWriter::schema() const {
    std::string text;
    for (const std::size_t i : order_) text += std::string(kind_of(columns_[i].type).word) + " " + fields_[i] + "\n";
    return text;
}

std::map<std::string, std::string> RowWriter::metadata() const {
    std::map<std::string, std::string> entries;
    for (std::size_t i = 0; i < columns_.size(); ++i) {
        entries["pin." + fields_[i]] = columns_[i].name;
        if (!columns_[i].unit.empty()) entries["unit." + fields_[i]] = columns_[i].unit;
    }
    return entries;
}

void RowWriter::write(const std::uint64_t* values, std::string& to) const {
    to.assign("\x00\x01\x00\x00", 4);  // CDR, little-endian
    for (const std::size_t i : order_) {
        const std::size_t bytes = kind_of(columns_[i].type).bytes;
        for (std::size_t k = 0; k < bytes; ++k) to += static_cast<char>(values[i] >> (8 * k));
    }
}

bool RowReader::open(const Schema& schema, const Channel& channel) {
    columns_.clear();
    fields_.clear();
    problem_.clear();
    const auto other = [this](std::string sentence) {
        problem_ = std::move(sentence);
        return false;
    };
    if (channel.encoding != "cdr") return other("its messages are '" + channel.encoding.substr(0, 40) + "'");
    if (schema.encoding != "ros2msg") return other("its schema is '" + schema.encoding.substr(0, 40) + "'");
    for (std::string_view text = schema.data; !text.empty();) {
        std::string_view       line = next_line(text);
        const std::string_view type = next_word(line), name = next_word(line);
        if (type.empty()) continue;
        if (type.starts_with("===")) return other("its schema has other messages in it");
        if (name.empty() || line.find('=') != line.npos || name.find('=') != name.npos) continue;  // a constant
        const auto kind = std::find_if(std::begin(kinds), std::end(kinds), [&](const Kind& one) { return one.word == type; });
        if (kind == std::end(kinds))
            return other("its field '" + std::string(name.substr(0, 60)) + "' is " + std::string(type.substr(0, 60)));
        if (columns_.size() >= most_columns) return other("it has more than " + std::to_string(most_columns) + " fields");
        const auto metadata = [&](const char* prefix, std::string_view otherwise) {
            const auto at = channel.metadata.find(prefix + std::string(name));
            return at == channel.metadata.end() ? std::string(otherwise) : at->second;
        };
        columns_.push_back({metadata("pin.", name), kind->type, metadata("unit.", "")});
        fields_.push_back({kind->bytes, kind->is_signed, kind->is_float});
    }
    return !columns_.empty() || other("its schema has no field");
}

bool RowReader::read(std::string_view payload, std::vector<std::uint64_t>& values) const {
    values.clear();
    if (payload.size() < 4 || payload[1] != 1) return false;  // little-endian CDR only
    const std::string_view bytes = payload.substr(4);
    std::size_t            at = 0;
    for (const Field& field : fields_) {
        at = (at + field.bytes - 1) / field.bytes * field.bytes;
        if (at + field.bytes > bytes.size()) return false;
        std::uint64_t value = 0;
        for (std::size_t i = 0; i < field.bytes; ++i) value |= std::uint64_t{static_cast<unsigned char>(bytes[at + i])} << (8 * i);
        at += field.bytes;
        if (field.is_float && field.bytes == 4)
            value = std::bit_cast<std::uint64_t>(static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(value))));
        else if (field.is_signed && !field.is_float && field.bytes < 8 && value >> (8 * field.bytes - 1))
            value |= ~std::uint64_t{0} << (8 * field.bytes);
        values.push_back(value);
    }
    return true;
}

}  // namespace hal::mcap
