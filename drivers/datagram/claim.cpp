// SPDX-License-Identifier: MIT
// Who commands a device. Two masters in one process would not see each other's sockets, and in
// memory there are none.
#include <map>
#include <mutex>

#include "link/bus_key.hpp"
#include "link/datagram.hpp"

namespace hal::datagram {

Claimed claim(std::string_view address, const std::string& user) {
    static std::mutex mutex;
    static std::map<std::string, std::weak_ptr<const std::string>> all;
    const std::lock_guard lock(mutex);
    std::erase_if(all, [](const auto& entry) { return entry.second.expired(); });
    std::weak_ptr<const std::string>& known = all[link::bus_key(describe(address).address)];
    std::shared_ptr<const std::string> holder = known.lock();
    if (holder && *holder != user) return {nullptr, *holder};
    if (!holder) {
        holder = std::make_shared<const std::string>(user);
        known = holder;
    }
    return {std::move(holder)};
}

}  // namespace hal::datagram
