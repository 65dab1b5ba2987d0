// SPDX-License-Identifier: MIT
#include "discipline/slot_exchange.hpp"

#include <map>
#include <mutex>
#include <thread>

namespace hal::can {

namespace {

struct Registry {
    std::mutex mutex;
    std::map<std::string, std::shared_ptr<SlotExchange>, std::less<>> nodes;
};
Registry& registry() {
    static Registry one;
    return one;
}

}  // namespace

bool SlotExchange::add(SlotUser& user) {
    for (auto& one : users_) {
        SlotUser* none = nullptr;
        if (one.compare_exchange_strong(none, &user)) return true;
    }
    return false;
}

//   1. the node counts itself       2. the node reads a user            3. the node uses it, and counts itself out
//   4. remove() clears the user     5. remove() waits for a count of 0
// All are sequentially consistent: a user that is read in 2 is counted before 4, so 5 waits for 3.
void SlotExchange::remove(SlotUser& user) {
    for (auto& one : users_) {
        SlotUser* expected = &user;
        one.compare_exchange_strong(expected, nullptr);
    }
    while (busy_.load() != 0) {
        std::this_thread::yield();
    }
}

std::shared_ptr<SlotExchange> offer_slots(const std::string& node, const Description& description) {
    auto& all = registry();
    const std::lock_guard lock(all.mutex);
    auto& exchange = all.nodes[node];
    if (!exchange) {
        exchange = std::make_shared<SlotExchange>(node);
    }
    if (exchange->offered.exchange(true)) return nullptr;
    exchange->description = description;
    return exchange;
}

void withdraw_slots(SlotExchange& exchange) {
    exchange.state.store(State::down);
    exchange.offered.store(false);
}

std::shared_ptr<SlotExchange> slots_of(const std::string& node) {
    auto& all = registry();
    const std::lock_guard lock(all.mutex);
    const auto found = all.nodes.find(node);
    return found == all.nodes.end() || !found->second->offered.load() ? nullptr : found->second;
}

std::vector<std::string> offered_slots() {
    auto& all = registry();
    const std::lock_guard lock(all.mutex);
    std::vector<std::string> names;
    for (const auto& [name, exchange] : all.nodes) {
        if (exchange->offered.load()) {
            names.push_back(name);
        }
    }
    return names;
}

}  // namespace hal::can
