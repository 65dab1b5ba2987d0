// SPDX-License-Identifier: MIT
#include "config_keys.hpp"

#include <algorithm>

namespace hal::canopen::config {

namespace {

std::string time_text(Time t) {
    if (t % second == 0) return std::to_string(t / second) + "s";
    if (t % millisecond == 0) return std::to_string(t / millisecond) + "ms";
    return std::to_string(t / microsecond) + "us";
}

}  // namespace

void Keys::take(Section& section) {
    std::map<std::string, const Line*> own;
    for (Line& line : section.lines) {
        const auto [before, fresh] = own.emplace(line.key.text, &line);
        if (!fresh) {
            report_.error(Topic::line, line.key.at,
                          "duplicate key '" + line.key.text + "' in this section",
                          "first in line " + std::to_string(before->second->key.at.line) +
                              "; delete one of them",
                          "duplicate");
            continue;
        }
        lines_[line.key.text] = &line;
    }
}

const Line* Keys::find(const std::string& key) {
    const auto at = lines_.find(key);
    if (at == lines_.end()) return nullptr;
    at->second->used = true;
    return at->second;
}

std::vector<Line*> Keys::all_of(std::string_view beginning) const {
    std::vector<Line*> out;
    for (const auto& [key, line] : lines_) {
        if (key.starts_with(beginning)) {
            out.push_back(line);
        }
    }
    std::sort(out.begin(), out.end(),
              [](const Line* a, const Line* b) { return a->key.at.offset < b->key.at.offset; });
    return out;
}

std::vector<Line*> Keys::rest() const {
    auto out = all_of("");
    std::erase_if(out, [](const Line* line) { return line->used; });
    return out;
}

void Keys::reject(const Line& line, const std::string& instead) {
    report_.error(Topic::value, line.value.at,
                  "invalid " + line.key.text + " '" + line.value.text + "'", "write " + instead);
}

void Keys::take_text(const char* key, std::string& to) {
    if (const Line* line = find(key)) {
        to = line->value.text;
    }
}

void Keys::take_flag(const char* key, bool& to) {
    const Line* line = find(key);
    if (line == nullptr) return;
    if (const auto value = yes_or_no(line->value.text)) {
        to = *value;
    } else {
        reject(*line, "yes or no");
    }
}

bool Keys::take_time(const char* key, Time& to, Time least, Time most, bool none) {
    const Line* line = find(key);
    if (line == nullptr) return false;
    const std::string word = lower(line->value.text);
    if (none && (word == "no" || word == "none" || word == "0")) {
        to = 0;
        return true;
    }
    const auto value = duration(line->value.text);
    if (!value || *value < least || *value > most) {
        reject(*line, std::string(none ? "none, or " : "") + "a time of " + time_text(least) +
                          ".." + time_text(most) + ", as in 10ms or 0.5s");
        return false;
    }
    to = *value;
    return true;
}

bool Keys::take_number(const char* key, std::uint64_t& to, std::uint64_t least,
                       std::uint64_t most) {
    const Line* line = find(key);
    if (line == nullptr) return false;
    const auto value = parse_natural(line->value.text);
    if (!value || *value < least || *value > most) {
        reject(*line, "a number of " + std::to_string(least) + ".." + std::to_string(most) +
                          ", decimal or with 0x");
        return false;
    }
    to = *value;
    return true;
}

}  // namespace hal::canopen::config
