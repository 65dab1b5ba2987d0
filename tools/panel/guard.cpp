// SPDX-License-Identifier: MIT
#include "panel/guard.hpp"

#include <algorithm>
#include <arpa/inet.h>
#include <cctype>
#include <cstdint>
#include <fmt/core.h>
#include <random>

#include "text/characters.hpp"

namespace hal::tools {

namespace {

std::string lower(std::string_view text) {
    std::string result(text);
    std::transform(result.begin(), result.end(), result.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return result;
}

/// Removes ":PORT". Returns an empty text when what follows the name is not a port.
std::string without_port(std::string_view host) {
    const std::size_t bracket = host.starts_with('[') ? host.find(']') : 0;
    if (bracket == host.npos) return "";
    const std::size_t colon = host.find(':', bracket);
    if (colon == host.npos) return lower(host);
    const std::string_view port = host.substr(colon + 1);
    const bool digits = !port.empty() && port.size() <= 5 && std::ranges::all_of(port, is_digit);
    return digits ? lower(host.substr(0, colon)) : "";
}

bool numeric_address(std::string name) {
    in6_addr address;
    if (name.starts_with('[') && name.ends_with(']')) {
        return ::inet_pton(AF_INET6, name.substr(1, name.size() - 2).c_str(), &address) == 1;
    }
    return ::inet_pton(AF_INET, name.c_str(), &address) == 1;
}

}  // namespace

bool host_allowed(const Access& access, std::string_view host) {
    const std::string name = without_port(host);
    if (name.empty()) return false;
    if (std::find(access.hosts.begin(), access.hosts.end(), name) != access.hosts.end()) {
        return true;
    }
    return access.any_address && numeric_address(name);
}

bool own_origin(std::string_view origin, std::string_view host) {
    return !host.empty() && lower(origin) == "http://" + lower(host);
}

bool is_token(const Access& access, std::string_view typed) {
    unsigned difference = access.token.empty() || typed.size() != access.token.size() ? 1 : 0;
    for (std::size_t i = 0; i < access.token.size(); ++i) {
        difference |= static_cast<unsigned char>(access.token[i]) ^
                      static_cast<unsigned char>(i < typed.size() ? typed[i] : 0);
    }
    return difference == 0;
}

std::string random_token() {
    std::random_device source;
    std::string token;
    for (int i = 0; i < 4; ++i) {
        token += fmt::format("{:08x}", static_cast<std::uint32_t>(source()));
    }
    return token;
}

}  // namespace hal::tools
