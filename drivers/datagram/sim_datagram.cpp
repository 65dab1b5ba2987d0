// SPDX-License-Identifier: MIT
// A server in the memory of this process. A request is served in the call that sends it, and its
// answers wait in the queue of the sender until they are due.
#include "sim_datagram.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cstring>
#include <map>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "link/bus_key.hpp"
#include "link/call_order.hpp"
#include "link/system.hpp"

namespace hal::datagram::sim {

namespace {

using link::CallOrder;
using link::OrderedCall;

/// The users of one name.
struct Place {
    explicit Place(const std::string& name) : order(CallOrder::of("datagram", name)) {}

    const std::shared_ptr<CallOrder> order;
    std::atomic_flag busy;     ///< set while the server is used
    Server* server = nullptr;  ///< guarded by `busy`
};

/// Holds the server of a place. In a cycle is_held() may be false.
class Hold {
public:
    Hold(Place& place, bool may_wait) noexcept
        : place_(place),
          call_(*place.order, may_wait ? OrderedCall::Wait::made : OrderedCall::Wait::bounded) {
        constexpr unsigned max_spins = 1000;  // some 20 us
        for (unsigned spins = 0; call_.is_made() && !held_; ++spins) {
            held_ = !place_.busy.test_and_set(std::memory_order_acquire);
            if (held_ || (!may_wait && spins >= max_spins)) break;
            if (may_wait) {
                sched_yield();
            }
        }
    }
    ~Hold() {
        if (held_) {
            place_.busy.clear(std::memory_order_release);
        }
    }
    Hold(const Hold&) = delete;
    bool is_held() const noexcept { return held_; }

private:
    Place& place_;
    const OrderedCall call_;
    bool held_ = false;
};

/// Answers that have not been received. Used by the thread of its port only.
class ReplyQueue final : public Replies {
public:
    ReplyQueue() : waiting_(capacity) {}

    void send(std::span<const std::uint8_t> bytes, std::int64_t at_ns) noexcept override {
        if (bytes.empty() || bytes.size() > max_size) return;
        const auto unused = std::ranges::find(waiting_, std::size_t{0}, &Datagram::size);
        if (unused == waiting_.end()) return;
        std::memcpy(unused->bytes.data(), bytes.data(), bytes.size());
        unused->size = bytes.size();
        unused->arrives_ns = at_ns;
        unused->number = ++sent_;
    }
    /// Copies the datagram that has arrived first. Returns its size; 0: none has arrived.
    std::size_t pop(std::span<std::uint8_t> to, std::int64_t now_ns) noexcept {
        Datagram* const datagram = first_due(now_ns);
        if (datagram == nullptr) return 0;
        const std::size_t size = std::min(to.size(), std::exchange(datagram->size, 0));
        std::memcpy(to.data(), datagram->bytes.data(), size);
        return size;
    }

private:
    struct Datagram {
        std::array<std::uint8_t, max_size> bytes{};
        std::size_t size = 0;  ///< 0: unused
        std::int64_t arrives_ns = 0;
        std::uint64_t number = 0;
    };
    static constexpr std::size_t capacity = 16;

    Datagram* first_due(std::int64_t now_ns) noexcept {
        Datagram* first = nullptr;
        for (Datagram& datagram : waiting_) {
            if (datagram.size == 0) continue;
            if (now_ns != unclocked && datagram.arrives_ns > now_ns) continue;
            if (first == nullptr || comes_before(datagram, *first)) {
                first = &datagram;
            }
        }
        return first;
    }
    static bool comes_before(const Datagram& a, const Datagram& b) noexcept {
        if (a.arrives_ns != b.arrives_ns) return a.arrives_ns < b.arrives_ns;
        return a.number < b.number;
    }

    std::vector<Datagram> waiting_;
    std::uint64_t sent_ = 0;
};

class SimPort final : public Port {
public:
    SimPort(std::shared_ptr<Place> place, Description description)
        : place_(std::move(place)), description_(std::move(description)) {}

    bool send(std::span<const std::uint8_t> bytes, std::int64_t now_ns) noexcept override {
        if (bytes.empty() || bytes.size() > max_size) return false;
        return now_ns == unclocked ? send_patiently(bytes) : try_send(bytes, now_ns) == Sent::yes;
    }
    std::size_t receive(std::span<std::uint8_t> to, std::int64_t now_ns) noexcept override {
        return replies_.pop(to, now_ns);
    }
    bool wait(std::int64_t) noexcept override { return false; }
    const Description& description() const noexcept override { return description_; }

private:
    enum class Sent : std::uint8_t { no, yes, busy };

    Sent try_send(std::span<const std::uint8_t> bytes, std::int64_t now_ns) noexcept {
        const Hold hold(*place_, false);
        if (!hold.is_held()) return Sent::busy;
        if (place_->server == nullptr) return Sent::no;
        place_->server->serve(bytes, now_ns, replies_);
        return Sent::yes;
    }
    /// Outside of a cycle it tries longer, but not for ever: that may be in a crash handler, in the
    /// thread that has the server. In a re-execution it gets the outcome of each try, and nobody
    /// gives the server back by its waiting.
    bool send_patiently(std::span<const std::uint8_t> bytes) noexcept {
        constexpr int max_tries = 1000;
        constexpr std::int64_t max_wait_ns = 50'000'000;
        const bool may_wait = link::journal_mode() != link::JournalMode::executes_again;
        const link::HiddenReadings hidden;
        const std::int64_t limit_ns = link::monotonic_ns() + max_wait_ns;
        Sent sent = try_send(bytes, unclocked);
        for (int n = 1; n < max_tries && sent == Sent::busy; ++n) {
            if (may_wait && link::monotonic_ns() > limit_ns) break;
            if (may_wait) {
                sched_yield();
            }
            sent = try_send(bytes, unclocked);
        }
        return sent == Sent::yes;
    }

    const std::shared_ptr<Place> place_;
    const Description description_;
    ReplyQueue replies_;
};

class SimAttachment final : public Attachment {
public:
    explicit SimAttachment(std::shared_ptr<Place> place) : place_(std::move(place)) {}
    ~SimAttachment() override {
        const Hold hold(*place_, true);
        place_->server = nullptr;
    }
    bool exclusively(void (*work)(void* self), void* self) noexcept override {
        const Hold hold(*place_, false);
        if (!hold.is_held()) return false;
        work(self);
        return true;
    }

private:
    const std::shared_ptr<Place> place_;
};

std::shared_ptr<Place> place_named(const std::string& name) {
    static std::mutex mutex;
    static std::map<std::string, std::weak_ptr<Place>> all;
    const std::lock_guard lock(mutex);
    std::weak_ptr<Place>& known = all[link::bus_key(name)];
    std::shared_ptr<Place> place = known.lock();
    if (!place) {
        place = std::make_shared<Place>(name);
        known = place;
        std::erase_if(all, [](const auto& entry) { return entry.second.expired(); });
    }
    return place;
}

}  // namespace

Opened open(const std::string& target, const Options&) {
    if (target.empty()) return {nullptr, "missing name; write sim:NAME"};
    return {std::make_unique<SimPort>(place_named(target), describe(target)), {}};
}

Description describe(const std::string& target) {
    return {.address = "sim:" + target, .transport = "card in memory", .in_memory = true};
}

Attached attach(const std::string& target, Server& server) {
    if (target.empty()) return {nullptr, "missing name; write sim:NAME"};
    std::shared_ptr<Place> place = place_named(target);
    {
        const Hold hold(*place, true);
        if (place->server != nullptr) {
            return {nullptr, "two cards have this name; each needs one of its own"};
        }
        place->server = &server;
    }
    return {std::make_unique<SimAttachment>(std::move(place)), {}};
}

}  // namespace hal::datagram::sim
