// SPDX-License-Identifier: MIT
#include "status_text.hpp"

#include <algorithm>

namespace hal::dds {

std::vector<std::uint8_t> status_bytes(std::string_view text) {
    text = text.substr(0, max_status_size);
    std::vector<std::uint8_t> bytes{0, 1, 0, 0};
    const auto length = static_cast<std::uint32_t>(text.size() + 1);
    for (unsigned shift = 0; shift < 32; shift += 8) {
        bytes.push_back(static_cast<std::uint8_t>(length >> shift));
    }
    bytes.insert(bytes.end(), text.begin(), text.end());
    bytes.push_back(0);
    return bytes;
}

std::string_view status_text(std::span<const std::uint8_t> bytes) noexcept {
    if (bytes.size() < 9 || bytes[0] != 0 || bytes[1] != 1) {
        return {};
    }
    std::uint32_t length = 0;
    for (unsigned i = 0; i < 4; ++i) {
        length |= static_cast<std::uint32_t>(bytes[4 + i]) << (8 * i);
    }
    if (length < 1 || length > bytes.size() - 8) {
        return {};
    }
    return {reinterpret_cast<const char*>(bytes.data() + 8), length - 1};
}

std::vector<std::string> values_of(std::string_view text, std::string_view key) {
    std::vector<std::string> values;
    while (!text.empty()) {
        const std::size_t end = std::min(text.find('\n'), text.size());
        const std::string_view line = text.substr(0, end);
        if (line.starts_with(key) && line.size() > key.size() && line[key.size()] == ' ') {
            values.emplace_back(line.substr(key.size() + 1));
        }
        text.remove_prefix(std::min(end + 1, text.size()));
    }
    return values;
}

std::vector<std::string> list_of(const std::string& text) {
    std::vector<std::string> all;
    for (std::size_t at = 0; at < text.size();) {
        const std::size_t end = std::min(text.find_first_of(",;", at), text.size());
        if (end > at) {
            all.push_back(text.substr(at, end - at));
        }
        at = end + 1;
    }
    return all;
}

std::map<std::string, std::string> topics_of(const std::string& text) {
    std::map<std::string, std::string> all;
    for (std::size_t at = 0; at < text.size();) {
        const std::size_t end = std::min(text.find(';', at), text.size());

        const std::size_t equals = text.find('=', at);
        if (equals < end) {
            all[text.substr(at, equals - at)] = text.substr(equals + 1, end - equals - 1);
        }
        at = end + 1;
    }
    return all;
}

namespace {

/// "x:float,y:bit" as signal to type.
std::map<std::string, std::string> signals_of(const std::string& layout) {
    std::map<std::string, std::string> all;
    for (const std::string& one : list_of(layout)) {
        const std::size_t colon = one.rfind(':');
        if (colon != one.npos) {
            all[one.substr(0, colon)] = one.substr(colon + 1);
        }
    }
    return all;
}

}  // namespace

std::string difference(const std::string& sent, const std::string& sender,
                       const std::string& expected, const std::string& receiver) {
    if (sent == expected) {
        return {};
    }
    const auto there = signals_of(sent);
    const auto here = signals_of(expected);
    const auto only = [](const std::string& signal, const std::string& node) {
        return "signal '" + signal + "' exists on node '" + node + "' only";
    };
    const auto types = [&](const std::string& signal, const std::string& theirs,
                           const std::string& ours) {
        return "signal '" + signal + "' is " + theirs + " on node '" + sender + "' and " + ours +
               " on node '" + receiver + "'";
    };
    for (const auto& [signal, type] : here) {
        const auto other = there.find(signal);
        if (other == there.end()) return only(signal, receiver);
        if (other->second != type) return types(signal, other->second, type);
    }
    for (const auto& [signal, type] : there) {
        if (!here.contains(signal)) return only(signal, sender);
    }
    return "the signals are in a different order";
}

std::string shown(std::string text) {
    text.resize(std::min<std::size_t>(text.size(), 600));
    unsigned char before = 0;
    for (char& c : text) {
        const auto byte = static_cast<unsigned char>(c);
        // control characters, U+0080 to U+009F too
        if (byte < 0x20 || byte == 0x7F || (before == 0xC2 && byte < 0xA0)) {
            c = '?';
        }
        before = byte;
    }
    return text;
}

}  // namespace hal::dds
