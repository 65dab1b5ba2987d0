// SPDX-License-Identifier: MIT
#include "recording/mcap/rows.hpp"

#include <algorithm>
#include <numeric>
#include <set>
#include <utility>

#include "recording/mcap/bytes.hpp"
#include "text/characters.hpp"

namespace hal::mcap {
namespace {

struct Kind {
    std::string_view word;
    std::size_t bytes;
    hal_type type;
};

constexpr Kind kinds[] = {
    {"float64", 8, HAL_TYPE_FLOAT}, {"int64", 8, HAL_TYPE_S64},  {"uint64", 8, HAL_TYPE_U64},
    {"int32", 4, HAL_TYPE_S32},     {"uint32", 4, HAL_TYPE_U32}, {"bool", 1, HAL_TYPE_BIT},
};

const Kind& kind_of(hal_type type) {
    return *std::find_if(std::begin(kinds), std::end(kinds), [type](const Kind& kind) {
        return kind.type == type || kind.type == HAL_TYPE_BIT;
    });
}

}  // namespace

// Lower case, a letter first, no two underscores in a row.
std::string ros_name(const std::string& name) {
    std::string field;
    for (const char c : name) {
        const char plain = is_alphanumeric(c) ? lower(c) : '_';
        if (plain != '_' || (!field.empty() && field.back() != '_')) {
            field += plain;
        }
    }
    while (!field.empty() && field.back() == '_') {
        field.pop_back();
    }
    if (field.empty()) return "v";
    if (is_digit(field.front())) {
        field.insert(0, "v_");
    }
    return field;
}

RowWriter::RowWriter(std::vector<Column> columns)
    : columns_(std::move(columns)), order_(columns_.size()) {
    std::set<std::string> taken;
    for (const Column& column : columns_) {
        const std::string base = ros_name(column.name);
        std::string field = base;
        for (int n = 2; !taken.insert(field).second; ++n) {
            field = base + "_" + std::to_string(n);
        }
        fields_.push_back(std::move(field));
    }
    std::iota(order_.begin(), order_.end(), std::size_t{0});
    std::stable_sort(order_.begin(), order_.end(), [this](std::size_t a, std::size_t b) {
        return kind_of(columns_[a].type).bytes > kind_of(columns_[b].type).bytes;
    });
}

std::string RowWriter::schema() const {
    std::string text;
    for (const std::size_t i : order_) {
        text += std::string(kind_of(columns_[i].type).word) + " " + fields_[i] + "\n";
    }
    return text;
}

std::map<std::string, std::string> RowWriter::metadata() const {
    std::map<std::string, std::string> entries;
    for (std::size_t i = 0; i < columns_.size(); ++i) {
        entries["pin." + fields_[i]] = columns_[i].name;
        if (!columns_[i].unit.empty()) {
            entries["unit." + fields_[i]] = columns_[i].unit;
        }
    }
    return entries;
}

void RowWriter::write(const std::uint64_t* values, std::string& to) const {
    to.assign("\x00\x01\x00\x00", 4);  // CDR, little-endian
    for (const std::size_t i : order_) {
        const std::size_t bytes = kind_of(columns_[i].type).bytes;
        for (std::size_t k = 0; k < bytes; ++k) {
            to += static_cast<char>(values[i] >> (8 * k));
        }
    }
}

bool RowReader::open(const Schema& schema, const Channel& channel) {
    columns_.clear();
    problem_.clear();
    if (channel.encoding != "cdr") {
        problem_ = "its messages are '" + channel.encoding.substr(0, 40) + "'";
    } else if (schema.encoding != "ros2msg") {
        problem_ = "its schema is '" + schema.encoding.substr(0, 40) + "'";
    } else if (!message_.open(schema.name, schema.data)) {
        problem_ = message_.problem();
    }
    if (!problem_.empty()) return false;
    const auto metadata = [&](const std::string& key, const std::string& otherwise) {
        const auto at = channel.metadata.find(key);
        return at == channel.metadata.end() ? otherwise : at->second;
    };
    for (const RosMessage::Number& number : message_.numbers()) {
        columns_.push_back({metadata("pin." + number.name, number.name), number.type,
                            metadata("unit." + number.name, "")});
    }
    return true;
}

}  // namespace hal::mcap
