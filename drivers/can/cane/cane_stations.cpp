// SPDX-License-Identifier: MIT
#include "cane_stations.hpp"

#include <algorithm>

namespace hal::can::cane {

namespace {

constexpr std::uint64_t address_bits = (1ULL << 48) - 1;

std::uint64_t number(const Address& a) noexcept {
    std::uint64_t n = 0;
    for (const auto byte : a) {
        n = n << 8 | byte;
    }
    return n;
}
Address address(std::uint64_t n) noexcept {
    Address a;
    for (std::size_t i = 0; i < a.size(); ++i) {
        a[i] = static_cast<std::uint8_t>(n >> 8 * (5 - i));
    }
    return a;
}

/// Function codes of the predefined connection set, without the node ID.
enum : std::uint32_t {
    nmt = 0x000,
    emcy_or_sync = 0x080,
    time = 0x100,
    sdo_answer = 0x580,
    sdo_request = 0x600,
    heartbeat = 0x700
};
constexpr bool is_tpdo(std::uint32_t code) noexcept {
    return code == 0x180 || code == 0x280 || code == 0x380 || code == 0x480;
}
constexpr bool is_rpdo(std::uint32_t code) noexcept {
    return code == 0x200 || code == 0x300 || code == 0x400 || code == 0x500;
}

}  // namespace

void Nodes::fix(unsigned id, const Address& a) noexcept {
    if (id < places_.size()) {
        places_[id].is.store(number(a) | known | fixed, std::memory_order_relaxed);
    }
}

bool Nodes::learn(Place& node, const Address& from, std::int64_t now_ns) noexcept {
    const auto is = node.is.load(std::memory_order_relaxed);
    if ((is & fixed) != 0) return (is & address_bits) == number(from);
    const bool same = (is & known) != 0 && (is & address_bits) == number(from);
    const auto silent = [now_ns](std::int64_t since) { return now_ns - since >= moved_after_ns; };
    if (same) {
        node.last_received_ns = now_ns;
        if ((is & doubtful) != 0 && silent(node.other_ns)) {
            node.is.store(is & ~doubtful, std::memory_order_relaxed);
        }
        return (is & doubtful) == 0 || silent(node.other_ns);
    }
    if ((is & known) == 0 || silent(node.last_received_ns)) {
        node.last_received_ns = now_ns;
        node.is.store(number(from) | known, std::memory_order_relaxed);
        return true;
    }
    node.other_ns = now_ns;
    node.is.store(is | doubtful, std::memory_order_relaxed);
    return false;
}

bool Nodes::learn(std::uint32_t id, const Address& from, std::int64_t now_ns) noexcept {
    const std::uint32_t code = id & 0x780;
    const std::uint32_t node = id & 0x7f;
    if (id == nmt || id == emcy_or_sync) return learn(places_[master], from, now_ns);
    if (node == 0) return true;
    if (code == sdo_request) {
        asked_[node].store(number(from) | known, std::memory_order_relaxed);
    }
    if (is_tpdo(code) || code == emcy_or_sync || code == sdo_answer || code == heartbeat) {
        return learn(places_[node], from, now_ns);
    }
    return true;
}

std::optional<Address> Nodes::where(std::uint32_t id, bool produced_to_master) const noexcept {
    const std::uint32_t code = id & 0x780;
    const std::uint32_t node = id & 0x7f;
    if (node == 0 || id > 0x7ff) return std::nullopt;
    const auto of = [](const std::atomic<std::uint64_t>& entry) -> std::optional<Address> {
        const auto is = entry.load(std::memory_order_relaxed);
        if ((is & known) == 0 || (is & doubtful) != 0) return std::nullopt;
        return address(is & address_bits);
    };
    if (is_rpdo(code) || code == sdo_request) return of(places_[node].is);
    if (code == sdo_answer) return of(asked_[node]);
    if (produced_to_master && (is_tpdo(code) || code == emcy_or_sync || code == heartbeat)) {
        return of(places_[master].is);
    }
    return std::nullopt;
}

Streams::Verdict Streams::take(const Address& from, bool to_all, Stamp stamp,
                               std::int64_t now_ns) noexcept {
    const auto key = number(from) << 16 | stamp.session;
    Sender* s = nullptr;
    for (auto& candidate : senders_) {
        if (candidate.last_received_ns != INT64_MIN && candidate.key == key) {
            s = &candidate;
        }
    }
    if (s == nullptr) {
        s = &*std::min_element(senders_.begin(), senders_.end(), [](const auto& a, const auto& b) {
            return a.last_received_ns < b.last_received_ns;
        });
        *s = {};
        s->key = key;
    }
    s->last_received_ns = now_ns;
    auto& stream = s->stream[to_all ? 1 : 0];
    const auto ahead =
        static_cast<std::int16_t>(static_cast<std::uint16_t>(stamp.sequence - stream.last));
    if (stream.begun && ahead <= 0 && stream.stale < max_stale) {
        ++stream.stale;
        return Verdict{false, 0};
    }
    Verdict verdict{true, stream.begun && ahead > 1 ? static_cast<std::uint32_t>(ahead) - 1U : 0U};
    stream = {stamp.sequence, 0, true};
    return verdict;
}

std::atomic<std::uint16_t>& Sequences::of(const Address& to) noexcept {
    const auto key = number(to);
    for (auto& c : counters_) {
        auto is = c.key.load(std::memory_order_relaxed);
        if (is == nobody && c.key.compare_exchange_strong(is, key, std::memory_order_relaxed)) {
            return c.count;
        }
        if (is == key) return c.count;
    }
    return counters_.back().count;
}

std::uint16_t Sequences::next(const Address& to) noexcept {
    return of(to).fetch_add(1, std::memory_order_relaxed);
}
void Sequences::give_back(const Address& to) noexcept {
    of(to).fetch_sub(1, std::memory_order_relaxed);
}
void Sequences::clear() noexcept {
    for (auto& c : counters_) {
        c.key.store(nobody);
        c.count.store(0);
    }
}

}  // namespace hal::can::cane
