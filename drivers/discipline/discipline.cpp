// SPDX-License-Identifier: MIT
#include "discipline/discipline.hpp"

#include <string>
#include <thread>
#include <utility>

namespace hal::ethernet {

namespace {

/// The handles of this process by the address of their line, as written by the driver of the port.
struct Registry {
    std::mutex mutex;
    std::map<std::string, std::shared_ptr<DisciplineHandle>, std::less<>> handles;
};
Registry& registry() {
    static Registry one;
    return one;
}

}  // namespace

std::vector<can::DeliveryTime> DisciplineHandle::delivery_times(unsigned slot) const {
    const std::lock_guard lock(times_mutex_);
    const auto found = times_.find(slot);
    return found == times_.end() ? std::vector<can::DeliveryTime>{} : found->second;
}

//   1. user counts itself           2. user reads the discipline        3. user uses it, and counts itself out
//   4. set() stores the new one     5. set() waits for a count of 0
// All are sequentially consistent: a user that reads the old one in 2 is counted before 4, so 5
// waits for its 3.
void DisciplineHandle::set(Discipline* discipline, SlotTimes times) {
    {
        const std::lock_guard lock(times_mutex_);
        times_ = std::move(times);
    }
    discipline_.store(discipline);
    while (users_.load() != 0) {
        std::this_thread::yield();
    }
}

bool offer_discipline(const Port& port, Discipline* discipline, SlotTimes times) {
    auto& all = registry();
    const std::lock_guard lock(all.mutex);
    auto& handle = all.handles[port.description().address];
    if (!handle) {
        handle = std::make_shared<DisciplineHandle>();
    }
    if (discipline == nullptr || !handle->holds(nullptr)) return false;
    handle->set(discipline, std::move(times));
    return true;
}

void withdraw_discipline(Discipline* discipline) {
    auto& all = registry();
    const std::lock_guard lock(all.mutex);
    for (auto& [address, handle] : all.handles) {
        if (handle->holds(discipline)) {
            handle->set(nullptr);
        }
    }
}

std::shared_ptr<DisciplineHandle> discipline_of(const Port& port) {
    auto& all = registry();
    const std::lock_guard lock(all.mutex);
    const auto found = all.handles.find(port.description().address);
    return found == all.handles.end() || found->second->holds(nullptr) ? nullptr : found->second;
}

}  // namespace hal::ethernet
