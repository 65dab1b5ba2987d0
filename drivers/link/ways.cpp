// SPDX-License-Identifier: MIT
#include "link/ways.hpp"

#include <map>
#include <mutex>

namespace hal::can {

namespace {

struct Registry {
    std::mutex                                           mutex;
    std::map<std::string, std::vector<Way>, std::less<>> ways;
};
Registry& registry() {
    static Registry one;
    return one;
}

}  // namespace

void offer_ways(std::string_view link, std::vector<Way> ways) {
    const std::lock_guard lock(registry().mutex);
    registry().ways.insert_or_assign(std::string(link), std::move(ways));
}

void withdraw_ways(std::string_view link) {
    const std::lock_guard lock(registry().mutex);
    if (const auto at = registry().ways.find(link); at != registry().ways.end()) registry().ways.erase(at);
}

std::vector<Way> ways_of(std::string_view link) {
    const std::lock_guard lock(registry().mutex);
    const auto            at = registry().ways.find(link);
    return at == registry().ways.end() ? std::vector<Way>{} : at->second;
}

}  // namespace hal::can
