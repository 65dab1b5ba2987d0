// SPDX-License-Identifier: MIT
#include "cane_settings.hpp"

#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>

#include "cane.hpp"
#include "link/address.hpp"
#include "text/numbers.hpp"

namespace hal::can::cane {

namespace {

constexpr std::string_view segment_keys[] = {"mac",         "speed",   "policy", "spin",
                                             "promiscuous", "forward", "noise"};
constexpr std::string_view own_keys[] = {"format", "order",  "slot", "priority", "learn",
                                         "to",     "master", "also", "key"};

bool is_in(const auto& keys, std::string_view key) {
    return std::find(std::begin(keys), std::end(keys), key) != std::end(keys);
}

std::optional<unsigned> number(std::string_view text, unsigned min, unsigned max) {
    unsigned value = 0;
    const bool good = parse_whole(text, value) && value >= min && value <= max;
    return good ? std::optional(value) : std::nullopt;
}

std::string is(std::string_view key, std::string_view value, std::string_view write) {
    return "invalid " + std::string(key) + " '" + std::string(value) + "'; write " +
           std::string(write);
}

/// Reads the key of a segment: 32 hexadecimal digits in a file that only its owner may read.
std::string read_key(const std::string& file, std::optional<Key>& key) {
    struct stat about{};
    if (::stat(file.c_str(), &about) != 0) {
        return "cannot read key file '" + file + "': " + std::strerror(errno);
    }
    if ((about.st_mode & 077) != 0) {
        return "key file '" + file + "' is readable by others; type: chmod 600 " + file;
    }
    std::ifstream in(file);
    std::string text, more;
    if (!S_ISREG(about.st_mode) || !(in >> text)) {
        return "cannot read key file '" + file + "', or it is empty";
    }
    std::array<std::uint8_t, 16> bytes{};
    bool good = text.size() == 32 && !(in >> more);
    for (std::size_t n = 0; good && n < 16; ++n) {
        good = parse_whole(std::string_view(text).substr(2 * n, 2), bytes[n], 16);
    }
    if (!good) {
        return "invalid key file '" + file +
               "': expected 32 hexadecimal digits; to create one: (umask 077; openssl rand -hex 16 "
               "> " +
               file + ")";
    }
    key.emplace();
    for (unsigned n = 0; n < 16; ++n) {
        (*key)[n / 8] |= std::uint64_t{bytes[n]} << 8 * (n % 8);
    }
    return {};
}

std::string apply(std::string_view key, std::string_view value, Settings& s, bool reads_key) {
    const auto one_of = [&](std::string_view first, std::string_view second,
                            auto set) -> std::string {
        if (value != first && value != second) {
            return is(key, value, std::string(first) + " or " + std::string(second));
        }
        set(value == first);
        return {};
    };
    if (key == "format") {
        return one_of("single", "packed",
                      [&](bool first) { s.format = first ? Format::single : Format::packed; });
    }
    if (key == "order") {
        return one_of("big", "little",
                      [&](bool first) { s.order = first ? Order::big : Order::little; });
    }
    if (key == "to") {
        return one_of("all", "master", [&](bool first) { s.produced_to_master = !first; });
    }
    if (key == "learn") {
        return one_of("0", "1", [&](bool first) { s.learns = !first; });
    }
    if (key == "slot" || key == "priority") {
        const unsigned max = key == "slot" ? 255 : 30;
        const auto n = number(value, 0, max);
        if (!n) return is(key, value, "a whole number up to " + std::to_string(max));
        if (key == "slot") {
            s.slot = n;
        } else {
            s.priority = *n;
        }
        return {};
    }
    if (key == "key") {
        return reads_key ? read_key(std::string(value), s.key) : std::string{};
    }
    const auto address = ethernet::parse_address(value);
    if (key == "master" || key == "also") {
        if (!address || ((*address)[0] & 1) != 0) {
            return is(key, value, "the address of a station, as in 02:00:00:00:00:05");
        }
        if (key == "master") {
            s.master = address;
        } else {
            s.also.push_back(*address);
        }
        return {};
    }
    const auto id = number(key.substr(4), 1, 127);
    if (!id) return "invalid node '" + std::string(key) + "'; write node5=02:00:00:00:00:05";
    if (!address || ((*address)[0] & 1) != 0) {
        return is(key, value, "the address of a station, as in 02:00:00:00:00:05");
    }
    s.nodes.emplace_back(*id, *address);
    return {};
}

}  // namespace

std::string own_options() {
    std::string text;
    for (const auto key : own_keys) {
        text += std::string(key) + ", ";
    }
    for (const auto key : segment_keys) {
        text += std::string(key) + ", ";
    }
    return text + "node5";
}

bool is_own_option(std::string_view key) {
    return is_in(own_keys, key) || is_in(segment_keys, key) || key.starts_with("node");
}

std::string parse(std::string_view target, Settings& s, bool reads_key) {
    link::Target split(target);
    s.segment = split.place;
    if (s.segment.empty()) {
        return "missing interface; write cane:enp3s0, or cane:sim:bus0 for a segment in memory";
    }
    if (s.segment.find(':') == std::string::npos) {
        s.segment.insert(0, "eth:");
    }
    while (!split.options.empty()) {
        const auto option = link::AddressOption::pop(split.options);
        if (is_in(segment_keys, option.key)) {
            s.segment_options += (s.segment_options.empty() ? '?' : '&') + std::string(option.text);
            continue;
        }
        std::string problem = apply(option.key, option.value, s, reads_key);
        if (!problem.empty()) return problem;
    }
    if (s.key && s.format == Format::single) {
        return "key= signs packed frames only; remove format=single";
    }
    return {};
}

}  // namespace hal::can::cane
