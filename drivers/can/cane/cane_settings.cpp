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
bool is_in(const auto& keys, std::string_view key) {
    return std::find(std::begin(keys), std::end(keys), key) != std::end(keys);
}

std::optional<unsigned> number(std::string_view text, unsigned min, unsigned max) {
    unsigned value = 0;
    const bool good = parse_whole(text, value) && value >= min && value <= max;
    return good ? std::optional(value) : std::nullopt;
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

/// Parses one of two words. Sets `is_second`, and returns the problem, or "".
std::string choose(const link::AddressOption& option, const char* first, const char* second,
                   bool& is_second) {
    is_second = option.value == second;
    if (is_second || option.value == first) return {};
    return link::invalid_value(option, std::string(first) + " or " + second);
}

std::string set_format(const link::AddressOption& option, Settings& s) {
    bool is_packed = true;
    std::string problem = choose(option, "single", "packed", is_packed);
    s.format = is_packed ? Format::packed : Format::single;
    return problem;
}
std::string set_order(const link::AddressOption& option, Settings& s) {
    bool is_little = false;
    std::string problem = choose(option, "big", "little", is_little);
    s.order = is_little ? Order::little : Order::big;
    return problem;
}
std::string set_learning(const link::AddressOption& option, Settings& s) {
    return choose(option, "0", "1", s.learns);
}
std::string set_receiver(const link::AddressOption& option, Settings& s) {
    return choose(option, "all", "master", s.produced_to_master);
}

template <auto member, unsigned max>
std::string set_up_to(const link::AddressOption& option, Settings& s) {
    const auto n = number(option.value, 0, max);
    if (!n) {
        return link::invalid_value(option, "a whole number up to " + std::to_string(max));
    }
    s.*member = *n;
    return {};
}

/// Parses the address of a station. Returns the problem, or "".
std::string station_of(const link::AddressOption& option, ethernet::Address& address) {
    const auto parsed = ethernet::parse_address(option.value);
    if (!parsed || ((*parsed)[0] & 1) != 0) {
        return link::invalid_value(option, "the address of a station, as in 02:00:00:00:00:05");
    }
    address = *parsed;
    return {};
}

std::string set_master(const link::AddressOption& option, Settings& s) {
    ethernet::Address address{};
    std::string problem = station_of(option, address);
    if (problem.empty()) {
        s.master = address;
    }
    return problem;
}
std::string add_master(const link::AddressOption& option, Settings& s) {
    ethernet::Address address{};
    std::string problem = station_of(option, address);
    if (problem.empty()) {
        s.also.push_back(address);
    }
    return problem;
}
std::string set_key(const link::AddressOption& option, Settings& s) {
    return read_key(std::string(option.value), s.key);
}

/// The options besides those of the segment and of the nodes. The last one reads a file.
constexpr link::OptionRow<Settings> own_rows[] = {
    {"format", set_format},
    {"order", set_order},
    {"slot", set_up_to<&Settings::slot, 255>},
    {"priority", set_up_to<&Settings::priority, 30>},
    {"learn", set_learning},
    {"to", set_receiver},
    {"master", set_master},
    {"also", add_master},
    {"key", set_key},
};

/// Applies `node5=02:00:00:00:00:05`.
std::string apply_node(const link::AddressOption& option, Settings& s) {
    const auto id = number(option.key.substr(4), 1, 127);
    if (!id) {
        return "invalid node '" + std::string(option.key) + "'; write node5=02:00:00:00:00:05";
    }
    ethernet::Address address{};
    std::string problem = station_of(option, address);
    if (problem.empty()) {
        s.nodes.emplace_back(*id, address);
    }
    return problem;
}

}  // namespace

std::string own_options() {
    std::string text;
    for (const auto& row : own_rows) {
        text += std::string(row.name) + ", ";
    }
    for (const auto key : segment_keys) {
        text += std::string(key) + ", ";
    }
    return text + "node5";
}

bool is_own_option(std::string_view key) {
    const bool is_listed =
        std::ranges::any_of(own_rows, [&](const auto& row) { return row.name == key; });
    return is_listed || is_in(segment_keys, key) || key.starts_with("node");
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
        if (option.key == "key" && !reads_key) continue;
        std::string problem = option.key.starts_with("node")
                                  ? apply_node(option, s)
                                  : link::apply_option<Settings>(own_rows, option, s);
        if (!problem.empty()) return problem;
    }
    if (s.key && s.format == Format::single) {
        return "key= signs packed frames only; remove format=single";
    }
    return {};
}

}  // namespace hal::can::cane
