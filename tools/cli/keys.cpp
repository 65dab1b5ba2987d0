// SPDX-License-Identifier: MIT
#include "cli/keys.hpp"

#include <optional>

namespace hal::tools {

namespace {

struct Sequence {
    std::size_t length = 0;  ///< 0: more bytes are needed
    std::optional<Key> key;
};

/// Reads ESC [ parameters final, or ESC O final.
Sequence read_sequence(std::string_view bytes) {
    if (bytes.size() < 2) {
        return {};
    }
    if (bytes[1] != '[' && bytes[1] != 'O') {
        return {1, Key{Code::escape, 0, false}};
    }
    std::size_t end = 2;
    while (end < bytes.size() && (bytes[end] < '@' || bytes[end] > '~')) {
        ++end;
    }
    if (end == bytes.size()) {
        return {};
    }
    const std::string_view parameters = bytes.substr(2, end - 2);
    const bool shift = parameters.ends_with(";2");
    Sequence sequence{end + 1, std::nullopt};
    switch (bytes[end]) {
    case 'A': sequence.key = {Code::up, 0, shift}; break;
    case 'B': sequence.key = {Code::down, 0, shift}; break;
    case 'C': sequence.key = {Code::right, 0, shift}; break;
    case 'D': sequence.key = {Code::left, 0, shift}; break;
    case '~':
        if (parameters == "5") {
            sequence.key = {Code::page_up, 0, false};
        }
        if (parameters == "6") {
            sequence.key = {Code::page_down, 0, false};
        }
        break;
    default: break;
    }
    return sequence;
}

}  // namespace

std::vector<Key> pop_keys(std::string& bytes, bool complete) {
    std::vector<Key> keys;
    std::size_t at = 0;
    while (at < bytes.size()) {
        const char c = bytes[at];
        if (c == '\033') {
            const Sequence sequence = read_sequence(std::string_view(bytes).substr(at));
            if (sequence.length == 0) {
                if (!complete) break;
                if (at + 1 == bytes.size()) {
                    keys.push_back({Code::escape, 0, false});
                }
                at = bytes.size();
                break;
            }
            if (sequence.key) {
                keys.push_back(*sequence.key);
            }
            at += sequence.length;
            continue;
        }
        ++at;
        if (c == '\t') {
            keys.push_back({Code::tab, 0, false});
        } else if (c == '\r' || c == '\n') {
            keys.push_back({Code::enter, 0, false});
        } else if (c == 0x7f || c == '\b') {
            keys.push_back({Code::backspace, 0, false});
        } else if (c >= ' ' && c < 0x7f) {
            keys.push_back({Code::character, c, false});
        }
    }
    bytes.erase(0, at);
    return keys;
}

}  // namespace hal::tools
