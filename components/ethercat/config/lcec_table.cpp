// SPDX-License-Identifier: MIT
#include "ethercat/config/lcec_table.hpp"

#include <algorithm>
#include <cstdlib>
#include <stdexcept>

namespace hal::ethercat::config {

namespace {

bool continues(std::string_view line) { return line.starts_with("    "); }

std::string joined(const TableWords& words, const char* separator) {
    std::string text;
    for (const std::string& word : words) {
        text += text.empty() ? word : separator + word;
    }
    return text;
}

/// Replaces each `%` of a text.
std::string with_text(std::string_view text, const std::string& replacement) {
    std::string out;
    for (const char c : text) {
        out += c == '%' ? replacement : std::string(1, c);
    }
    return out;
}

}  // namespace

TableWords split(std::string_view text, char separator) {
    TableWords words;
    std::size_t begin = 0;
    while (begin <= text.size()) {
        const std::size_t end = std::min(text.find(separator, begin), text.size());
        if (end > begin) {
            words.emplace_back(text.substr(begin, end - begin));
        }
        begin = end + 1;
    }
    return words;
}

std::uint32_t hexadecimal(const std::string& text) {
    return static_cast<std::uint32_t>(std::strtoul(text.c_str(), nullptr, 16));
}

unsigned count_of(const LcecDevice& device, const std::string& text) {
    if (text == "N") return device.count;
    return text == "M" ? device.second_count : static_cast<unsigned>(std::atoi(text.c_str()));
}

std::string with_step(const std::string& text, unsigned step) {
    constexpr std::string_view digits = "0123456789";
    std::string out;
    for (std::size_t i = 0; i < text.size(); ++i) {
        if (text[i] != '#') {
            out += text[i];
            continue;
        }
        const std::string_view rest = std::string_view(text).substr(i + 1);
        unsigned first = 0;
        if (rest.starts_with('#')) {
            first = 1;
            ++i;
        } else if (rest.starts_with('+')) {
            const std::size_t end = std::min(rest.find_first_not_of(digits, 1), rest.size());
            first = static_cast<unsigned>(std::atoi(std::string(rest.substr(1, end - 1)).c_str()));
            i += end;
        }
        out += std::to_string(step + first);
    }
    return out;
}

LcecTable::LcecTable(std::string_view text) {
    TableWords words;
    for (const std::string& line : split(text, '\n')) {
        if (!continues(line)) {
            read(words);
            words.clear();
        }
        const TableWords more = split(line, ' ');
        words.insert(words.end(), more.begin(), more.end());
    }
    read(words);
}

/// Reads a line with its continuations.
void LcecTable::read(const TableWords& words) {
    if (words.empty()) return;
    const std::string& keyword = words[0];
    if (keyword == "values") {
        values_[words.at(1)] = with_values({words.begin() + 2, words.end()});
    } else if (keyword == "shape") {
        section_ = {words.at(1), 0, false};
        shapes_[section_.shape];
    } else if (keyword == "devices") {
        section_ = {words.at(1), hexadecimal(words.at(2)), true};
    } else if (keyword == "unsupported") {
        unsupported_.insert(unsupported_.end(), words.begin() + 1, words.end());
    } else if (section_.has_devices) {
        read_row(words);
    } else {
        shapes_[section_.shape].push_back(with_values(words));
    }
}

/// Reads `NAME[,NAME...] PRODUCT [N [M]] [OPTION=VALUE]...`.
void LcecTable::read_row(const TableWords& words) {
    LcecDevice device;
    device.vendor = section_.vendor;
    device.product = hexadecimal(words.at(1));
    device.shape = section_.shape;
    for (std::size_t i = 2; i < words.size(); ++i) {
        const std::size_t equals = words[i].find('=');
        if (equals == std::string::npos) {
            device.second_count = count_of(device, words[i]);
            device.count = device.count == 0 ? device.second_count : device.count;
        } else {
            device.options.emplace_back(words[i].substr(0, equals), words[i].substr(equals + 1));
        }
    }
    for (const std::string& name : split(words[0], ',')) {
        device.name = name;
        devices_.push_back(device);
    }
}

/// Replaces the word `$NAME` with the values of this name, and `{$NAME}` in a word with a list.
TableWords LcecTable::with_values(const TableWords& words) const {
    TableWords out;
    for (const std::string& word : words) {
        if (word.starts_with('$')) {
            const TableWords& named = values(word.substr(1));
            out.insert(out.end(), named.begin(), named.end());
            continue;
        }
        const std::size_t begin = word.find("{$");
        if (begin == std::string::npos) {
            out.push_back(word);
            continue;
        }
        const std::size_t end = word.find('}', begin);
        out.push_back(word.substr(0, begin + 1) +
                      joined(values(word.substr(begin + 2, end - begin - 2)), ",") +
                      word.substr(end));
    }
    return out;
}

const TableWords& LcecTable::values(const std::string& name) const {
    const auto found = values_.find(name);
    if (found == values_.end()) throw std::logic_error("no values '" + name + "' in the table");
    return found->second;
}

std::vector<TableLine> LcecTable::lines_of(const LcecDevice& device) const {
    std::vector<TableLine> lines;
    add_lines(device, device.shape, "", {}, lines);
    return lines;
}

/// Adds the lines of a shape: `[OPTION=VALUE] COUNT* KEYWORD ...`, of which the first two may be
/// missing. Lines without a count have the step of the parent.
void LcecTable::add_lines(const LcecDevice& device, const std::string& shape,
                          const std::string& text, const TableLine& parent,
                          std::vector<TableLine>& to) const {
    const auto found = shapes_.find(shape);
    if (found == shapes_.end()) throw std::logic_error("no shape '" + shape + "' in the table");
    for (const TableWords& words : found->second) {
        TableLine line{parent.conditions, {}, parent.step};
        std::size_t at = 0;
        for (; words[at].starts_with('['); ++at) {
            line.conditions.push_back(words[at].substr(1, words[at].size() - 2));
        }
        unsigned end = parent.step + 1;
        if (words[at].ends_with('*')) {
            line.step = 0;
            end = count_of(device, words[at].substr(0, words[at].size() - 1));
            ++at;
        }
        for (; at < words.size(); ++at) {
            line.words.push_back(with_text(words[at], text));
        }
        for (; line.step < end; ++line.step) {
            if (line.words[0] != "like") {
                to.push_back(line);
                continue;
            }
            const std::string inserted = line.words.size() > 2 ? line.words[2] : "";
            add_lines(device, line.words[1], with_step(inserted, line.step), line, to);
        }
    }
}

}  // namespace hal::ethercat::config
