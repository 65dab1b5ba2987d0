// SPDX-License-Identifier: MIT
#include "shared_link.hpp"

#include <algorithm>
#include <map>
#include <mutex>

#include "link/bus_key.hpp"
#include "link/call_journal.hpp"
#include "link/ordered_hold.hpp"

namespace hal::canopen {

using link::OrderedHold;

class SharedBus {
public:
    static constexpr std::size_t max = 64;

    explicit SharedBus(std::unique_ptr<can::Link> opened) : link(std::move(opened)) {}

    /// [setup]
    void change(SharedLink* from, SharedLink* to) {
        const OrderedHold hold(busy, OrderedHold::Wait::made);
        const auto place = std::find(users.begin(), users.end(), from);
        if (place != users.end()) {
            *place = to;
        }
        count = static_cast<std::size_t>(std::count_if(
            users.begin(), users.end(), [](const SharedLink* u) { return u != nullptr; }));
    }
    /// To all but `from`. By who holds the bus. [realtime]
    void deliver(const can::Frame& frame, const SharedLink* from) noexcept {
        for (SharedLink* user : users) {
            if (user != nullptr && user != from) {
                user->incoming_.push(frame);
            }
        }
    }

    const std::unique_ptr<can::Link> link;
    std::array<SharedLink*, max> users{};
    std::size_t count = 0;
    struct Leader {
        std::atomic<const SharedLink*> link{nullptr};
        std::atomic<std::int64_t> at{0};
    };
    std::array<Leader, 128> leaders{};  // by node-id
    std::atomic_flag busy;  // held while the link, the users and their queues are used
};

std::unique_ptr<SharedLink> SharedLink::open(const std::string& address,
                                             const can::Options& options, std::string& problem) {
    static std::mutex mutex;
    static std::map<std::string, std::weak_ptr<SharedBus>> all;
    const std::lock_guard lock(mutex);
    std::weak_ptr<SharedBus>& known = all[link::bus_key(address)];
    auto bus = known.lock();
    if (!bus) {
        auto opened = can::open(address, options);
        if (!opened) {
            problem = opened.problem;
            return nullptr;
        }
        known = bus = std::make_shared<SharedBus>(std::move(opened.link));
        std::erase_if(all, [](const auto& entry) { return entry.second.expired(); });
    }
    if (bus->count >= SharedBus::max) {
        problem = address + " has " + std::to_string(SharedBus::max) + " masters already";

        return nullptr;
    }
    return std::unique_ptr<SharedLink>(new SharedLink(std::move(bus)));
}

SharedLink::SharedLink(std::shared_ptr<SharedBus> bus) : bus_(std::move(bus)) {
    bus_->change(nullptr, this);
}

SharedLink::~SharedLink() {
    bus_->change(this, nullptr);
    for (auto& leader : bus_->leaders) {
        const SharedLink* self = this;
        leader.link.compare_exchange_strong(self, nullptr);
    }
}

bool SharedLink::leads(std::uint8_t node_id, std::int64_t now_ns, std::int64_t period_ns) noexcept {
    bool is_leader = claims_lead(node_id, now_ns, period_ns);
    link::JournaledCall call;  // threads that run at the same time decide it between them
    call.number(is_leader);
    return is_leader;
}

bool SharedLink::claims_lead(std::uint8_t node_id, std::int64_t now_ns,
                             std::int64_t period_ns) noexcept {
    auto& of_id = bus_->leaders[node_id & 0x7f];
    const SharedLink* leader = of_id.link.load(std::memory_order_relaxed);
    if (leader != this) {
        const bool silent =
            leader == nullptr || now_ns - of_id.at.load(std::memory_order_relaxed) > 4 * period_ns;
        if (!silent || !of_id.link.compare_exchange_strong(leader, this)) return false;
    }
    of_id.at.store(now_ns, std::memory_order_relaxed);
    return true;
}

can::Sent SharedLink::send(const can::Frame& frame, std::int64_t now_ns) noexcept {
    const OrderedHold hold(bus_->busy, OrderedHold::Wait::none);
    if (!hold.is_held()) return can::Sent::full;
    const can::Sent sent = bus_->link->send(frame, now_ns);
    if (sent == can::Sent::queued && bus_->count > 1) {
        can::Frame copy = frame;
        copy.time_ns = now_ns;
        copy.own = true;
        bus_->deliver(copy, this);
    }
    return sent;
}

void SharedLink::flush(std::int64_t now_ns) noexcept {
    const OrderedHold hold(bus_->busy, OrderedHold::Wait::none);
    if (!hold.is_held()) return;
    bus_->link->flush(now_ns);
}

std::size_t SharedLink::receive(std::span<can::Frame> buffer, std::int64_t now_ns) noexcept {
    const OrderedHold hold(bus_->busy, OrderedHold::Wait::none);
    if (!hold.is_held()) return 0;
    if (bus_->count == 1 && incoming_.front() == nullptr)
        return bus_->link->receive(buffer, now_ns);
    for (can::Frame frame; bus_->link->receive(std::span(&frame, 1), now_ns) == 1;) {
        bus_->deliver(frame, nullptr);
    }
    std::size_t taken = 0;
    for (const can::Frame* f; taken < buffer.size() && (f = incoming_.front()) != nullptr;
         incoming_.drop()) {
        buffer[taken++] = *f;
    }
    return taken;
}

can::Statistics SharedLink::statistics() const noexcept { return bus_->link->statistics(); }
can::State SharedLink::state() const noexcept { return bus_->link->state(); }
void SharedLink::restart() noexcept { bus_->link->restart(); }
const can::Description& SharedLink::description() const noexcept {
    return bus_->link->description();
}
std::vector<can::DeliveryTime> SharedLink::delivery_times() const {
    return bus_->link->delivery_times();
}
bool SharedLink::rejected(can::Rejected& what) noexcept {
    const OrderedHold hold(bus_->busy, OrderedHold::Wait::none);
    return hold.is_held() && bus_->link->rejected(what);
}
std::int64_t SharedLink::closing_ns() const noexcept { return bus_->link->closing_ns(); }
bool SharedLink::wait(std::int64_t at_most_ns) { return bus_->link->wait(at_most_ns); }

}  // namespace hal::canopen
