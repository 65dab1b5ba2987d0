// SPDX-License-Identifier: MIT
#include "can_bus.hpp"

#include <algorithm>
#include <map>
#include <mutex>
#include <thread>

namespace hal::can::simbus {

namespace {

constexpr unsigned error_frame_bits = 12 + 8 + intermission_bits;  // both flags, delimiter
constexpr std::int64_t load_window_ns = 100'000'000;

struct Registry {
    std::mutex mutex;
    std::map<std::string, std::weak_ptr<Bus>> buses;
};
Registry& registry() {
    static Registry all;
    return all;
}

/// Adds to a counter that only the pump writes: a locked addition would cost more than the rest of
/// a delivery.
void count(std::atomic<std::uint64_t>& counter, std::uint64_t more = 1) noexcept {
    counter.store(counter.load(std::memory_order_relaxed) + more, std::memory_order_relaxed);
}

}  // namespace

Bus::Bus(std::string its_name, std::uint32_t rate, std::uint32_t fast, bool has_fd)
    : name(std::move(its_name)),
      bit_rate(rate == unlimited ? 0 : rate),
      data_rate(fast),
      fd(has_fd) {
    nodes.reserve(64);
    disturbances.reserve(64);
}

std::shared_ptr<Bus> Bus::find(const std::string& name, const Options& options,
                               std::string& problem) {
    Registry& all = registry();
    const std::lock_guard lock(all.mutex);
    auto& known = all.buses[name];
    if (auto bus = known.lock()) {
        const auto wanted = options.bit_rate == unlimited ? 0 : options.bit_rate;
        if (options.bit_rate != 0 && wanted != bus->bit_rate) {
            problem =
                "the bus already runs at " +
                (bus->bit_rate == 0 ? "no bit rate" : std::to_string(bus->bit_rate) + " bit/s") +
                "; use the same bitrate everywhere, or give it in one place only";
        } else if (options.fd && !bus->fd) {
            problem = "the bus was opened without CAN FD; write sim:" + name + "?fd everywhere";
        }
        return problem.empty() ? bus : nullptr;
    }
    const auto rate = options.bit_rate != 0 ? options.bit_rate : 1'000'000U;
    auto bus = std::make_shared<Bus>(name, rate, options.data_rate, options.fd);
    known = bus;
    std::erase_if(all.buses, [](const auto& entry) { return entry.second.expired(); });
    return bus;
}

Bus::Hold::Hold(Bus& held) noexcept : bus(held) {
    while (bus.pumping_.test_and_set(std::memory_order_acquire)) {
        std::this_thread::yield();
    }
}
Bus::Hold::~Hold() { bus.pumping_.clear(std::memory_order_release); }

void Bus::add(Node& node) {
    const Hold hold(*this);
    int number = 0;  // the lowest free number: a program always gets the same numbers
    while (std::any_of(nodes.begin(), nodes.end(),
                       [&](const Node* n) { return n->number == number; })) {
        ++number;
    }
    node.number = number;
    nodes.insert(std::upper_bound(nodes.begin(), nodes.end(), &node,
                                  [](auto* a, auto* b) { return a->number < b->number; }),
                 &node);
}

void Bus::remove(std::unique_ptr<Node> node) {
    std::vector<std::unique_ptr<Node>> gone;  // freed after the bus is released
    const Hold hold(*this);
    node->leaving = true;
    node->babble_period = 0;
    leaving_.push_back(std::move(node));
    std::erase_if(leaving_, [&](std::unique_ptr<Node>& n) {
        if (n->outgoing.front() != nullptr && bit_rate != 0 && hears(*n)) return false;
        std::erase(nodes, n.get());
        gone.push_back(std::move(n));
        return true;
    });
}

void Bus::pump(std::int64_t now) noexcept {
    auto latest = latest_.load(std::memory_order_relaxed);
    while (now > latest && !latest_.compare_exchange_weak(latest, now, std::memory_order_relaxed)) {
    }
    if (now == unclocked) {
        now = latest;
    }
    if (bit_rate != 0 && now <= worked_until_.load(std::memory_order_relaxed)) return;
    if (now == INT64_MIN || pumping_.test_and_set(std::memory_order_acquire)) return;
    if (bit_rate != 0) {
        work(now);
    } else {
        recover(now);
    }
    pumping_.clear(std::memory_order_release);
}

void Bus::sent(std::int64_t now) noexcept {
    if (bit_rate != 0) return;
    calls_.fetch_add(1, std::memory_order_seq_cst);
    for (;;) {
        const auto seen = calls_.load(std::memory_order_seq_cst);
        // the thread that works now checks again afterwards
        if (pumping_.test_and_set(std::memory_order_seq_cst)) return;
        work_untimed(now);
        pumping_.clear(std::memory_order_seq_cst);
        if (calls_.load(std::memory_order_seq_cst) == seen) return;
    }
}

void Bus::recover(std::int64_t now) noexcept {
    for (Node* n : nodes) {
        if (!n->off) continue;
        if (n->wants_restart.exchange(false)) {
            n->back_at = std::min(n->back_at, now + bits(128 * 11));
        }
        if (n->back_at > now) continue;
        n->off = false;
        n->tec = n->rec = 0;
        n->hold_until = n->back_at;
        n->back_at = INT64_MAX;
        count(n->restarts);
        publish(*n);
        event(*n, error_restarted, now);
    }
}

/// Returns when the next queued frame can start; INT64_MAX: none.
std::int64_t Bus::earliest() noexcept {
    std::int64_t first = INT64_MAX;
    for (Node* n : nodes) {
        if (n->off) {
            while (n->outgoing.front() != nullptr) {
                n->outgoing.drop();
                count(n->thrown_away);
            }
            continue;
        }
        if (const Frame* f = n->outgoing.front()) {
            first = std::min(first, std::max(f->time_ns, n->hold_until));
        } else if (n->leaving) {
            n->cut.store(true, std::memory_order_relaxed);
        }
        if (n->babble_period > 0 && !n->cut.load(std::memory_order_relaxed)) {
            first = std::min(first, std::max(n->babble_at, n->hold_until));
        }
    }
    return first;
}

void Bus::work(std::int64_t now) noexcept {
    if (window_start_ == INT64_MIN) {
        window_start_ = now;
        if (earliest() == INT64_MIN) {
            free_at_ = now - 1;  // sent before the bus knew a time
        }
    }
    for (;;) {
        recover(now);
        const auto first = earliest();
        if (first == INT64_MAX) break;
        const auto start = std::max(free_at_, first);
        if (start >= now) break;
        if (discard_expired(start)) continue;
        transmit(start, now);
    }
    worked_until_.store(now, std::memory_order_relaxed);
    if (now - window_start_ >= load_window_ns) {
        load_.store(
            std::min(1.0, static_cast<double>(busy_ns_) / static_cast<double>(now - window_start_)),
            std::memory_order_relaxed);
        window_start_ = now;
        busy_ns_ = 0;
    }
}

void Bus::work_untimed(std::int64_t now) noexcept {
    recover(now);
    for (Node* n : nodes) {
        // Only frames queued now, so that one node cannot occupy the pump.
        for (auto left = n->outgoing.size(); left > 0; --left) {
            const Candidate c{n, n->outgoing.front(), false};
            auto time = std::max(c.frame->time_ns, now);
            if (n->off || n->cut.load(std::memory_order_relaxed)) {
                count(n->thrown_away);
                n->outgoing.drop();
                continue;
            }
            const Active* fault = struck(c, time);
            if (fault != nullptr && fault->what.fault == Fault::delay) {
                time += fault->what.delay_ns;
            }
            if (fault != nullptr && fault->what.fault == Fault::duplicate) {
                deliver(*n, *c.frame, time);
            }
            if (fault == nullptr || fault->what.fault != Fault::loss) {
                deliver(*n, *c.frame, time);
            }
            done(c, time);
        }
    }
}

bool Bus::hears(const Node& n) const noexcept {
    return !n.off && !n.cut.load(std::memory_order_relaxed);
}

/// Arbitrates between all frames ready at `start`; the winner is sent, disturbed or not.
void Bus::transmit(std::int64_t start, std::int64_t now) noexcept {
    Candidate winner;
    std::uint32_t best = UINT32_MAX;
    unsigned acknowledging = 0;
    for (Node* n : nodes) {
        if (hears(*n) && !n->listen_only) {
            ++acknowledging;
        }
        if (n->off || n->hold_until > start) continue;
        const auto compete = [&](const Frame& f, bool babbling) {
            const auto rank = arbitration_rank(f);
            if (winner.node != nullptr && rank >= best) return;
            best = rank;
            winner = {n, &f, babbling};
        };
        if (n->cut.load(std::memory_order_relaxed)) {
            const Frame* f = n->outgoing.front();
            if (f == nullptr || f->time_ns > start) continue;
            // Alone on the bus: no acknowledgement. Once passive it stays passive and repeats for
            // ever.
            if (n->tec < 128) {
                n->tec += 8;
            }
            n->hold_until = n->tec < 128
                                ? start + duration_ns(frame_bits(*f), bit_rate, data_rate) +
                                      bits(error_frame_bits)
                                : now;
            count(n->errors);
            publish(*n);
            event(*n, error_no_acknowledge, start);
            continue;
        }
        if (n->babble_period > 0 && n->babble_at <= start) {
            compete(n->babble, true);
        }
        if (const Frame* f = n->outgoing.front(); f != nullptr && f->time_ns <= start) {
            compete(*f, false);
        }
    }
    if (winner.node == nullptr) return;
    Node& sender = *winner.node;
    const Frame frame = *winner.frame;

    const Bits length = frame_bits(frame);
    const auto end =
        start + duration_ns({length.nominal - intermission_bits, length.data}, bit_rate, data_rate);
    const auto idle = start + duration_ns(length, bit_rate, data_rate);
    if (acknowledging < 2) {  // only the sender
        if (sender.tec < 128) {
            sender.tec += 8;
        }
        occupy(start, sender.tec < 128 ? idle + bits(error_frame_bits) : std::max(now, idle));
        if (winner.babbling) {
            sender.babble_at = free_at_ + sender.babble_period;
        } else if (sender.outgoing.front()->single_shot) {
            discard(sender);
        }
        count(sender.errors);
        publish(sender);
        return event(sender, error_no_acknowledge, end);
    }

    // Nodes with the same identifier do not detect lost arbitration. Equal frames merge; different
    // ones destroy each other.
    bool collision = false;
    for (Node* n : nodes) {
        if (n == &sender || !hears(*n) || n->hold_until > start) continue;
        const Frame* f = n->outgoing.front();
        collision = collision || (f != nullptr && f->time_ns <= start &&
                                  arbitration_rank(*f) == best && !f->same(frame));
    }
    Active* const fault = struck(winner, start);
    if (fault != nullptr && fault->what.fault == Fault::delay) {
        sender.hold_until = start + std::max<std::int64_t>(1, fault->what.delay_ns);
        if (winner.babbling) {
            sender.babble_at = sender.hold_until;
        }
        return;
    }
    if (collision || (fault != nullptr && fault->what.fault == Fault::error)) {
        const unsigned body = length.total() - intermission_bits;
        const unsigned broken =
            collision ? std::min(body, 40U) : 1 + static_cast<unsigned>(draw() % body);
        const unsigned slow = std::min(broken, length.nominal);
        const auto noticed = start + duration_ns({slow, broken - slow}, bit_rate, data_rate);
        const auto also_sends = [&](Node& n) {
            const Frame* f = n.outgoing.front();
            return collision && n.hold_until <= start && f != nullptr && f->time_ns <= start &&
                   arbitration_rank(*f) == best;
        };
        occupy(start, noticed + bits(error_frame_bits));
        for (Node* n : nodes) {
            if (!hears(*n)) continue;
            const bool sending = n == &sender || also_sends(*n);
            if (sending) {
                n->tec += 8;
            } else if (n->rec < 255) {
                ++n->rec;
            }
            if (sending && !(n == &sender && winner.babbling) && n->outgoing.front()->single_shot) {
                discard(*n);
            }
            count(n->errors);
            if (sending && n->tec > 255) {
                failed(*n, noticed);
            }
            // passive nodes suspend transmission
            else if (n->tec >= 128 && sending) {
                n->hold_until = free_at_ + bits(8);
            }
            publish(*n);
            event(*n, error_protocol, noticed);
        }
        if (winner.babbling) {
            sender.babble_at = free_at_ + sender.babble_period;
        }
        return;
    }
    occupy(start, idle);
    if (fault == nullptr || fault->what.fault == Fault::duplicate) {
        deliver(sender, frame, end);
    }
    for (Node* n : nodes) {
        if (n != &sender && hears(*n) && n->rec > 0) {
            n->rec = n->rec > 127 ? 127 : n->rec - 1;
            publish(*n);
        }
    }
    if (fault != nullptr && fault->what.fault == Fault::duplicate) {
        sender.tec += 8;
        sender.doubled = true;
        if (!winner.babbling && sender.outgoing.front()->single_shot) {
            discard(sender);
        }
        if (sender.tec > 255) {
            failed(sender, end);
        }
        return publish(sender);
    }
    for (Node* n : nodes) {  // those whose equal frame was merged with this one
        const Frame* f = n->outgoing.front();
        if (n != &sender && hears(*n) && n->hold_until <= start && f != nullptr &&
            f->time_ns <= start && f->same(frame)) {
            done({n, f, false}, end);
        }
    }
    done(winner, end);
}

/// Handles a frame that was sent and acknowledged.
void Bus::done(const Candidate& c, std::int64_t time) noexcept {
    Node& n = *c.node;
    count(n.sent);
    count(n.sent_bytes, c.frame->bytes().size());
    if (n.own_frames) {
        Frame echo = *c.frame;
        echo.own = true;
        echo.time_ns = time;
        if (!n.incoming.push(echo)) {
            count(n.lost);
        }
    }
    if (n.tec > 0) {
        --n.tec;
        publish(n);
    }
    if (n.tec >= 128) {
        n.hold_until = free_at_ + bits(8);
    }
    n.delayed = n.doubled = n.counted = false;
    if (!c.babbling) return n.outgoing.drop();
    n.babble_at = std::max(n.babble_at + n.babble_period, time);
}

void Bus::failed(Node& n, std::int64_t time) noexcept {
    n.off = true;
    count(n.bus_offs);
    n.back_at = n.restart_ms == 0 ? INT64_MAX
                                  : time + std::int64_t{n.restart_ms} * 1'000'000 + bits(128 * 11);
    n.wants_restart.store(false);
    n.delayed = n.doubled = n.counted = false;
    for (; n.outgoing.front() != nullptr; n.outgoing.drop()) {
        count(n.thrown_away);
    }
    publish(n);
    event(n, error_bus_off, time);
}

void Bus::deliver(Node& from, const Frame& frame, std::int64_t time) noexcept {
    for (Node* n : nodes) {
        if (n == &from || !hears(*n) || n->leaving) continue;
        if (frame.fd && !n->fd) continue;
        const auto matches = [&](const Filter& f) { return f.matches(frame); };
        if (!n->filters.empty() && std::none_of(n->filters.begin(), n->filters.end(), matches)) {
            continue;
        }
        Frame* const copy = n->incoming.place();
        if (copy == nullptr) {
            count(n->lost);
            continue;
        }
        *copy = frame;
        copy->time_ns = time;
        copy->error_state = frame.fd && from.tec >= 128;
        n->incoming.commit();
        count(n->received);
        count(n->received_bytes, frame.bytes().size());
    }
}

void Bus::event(Node& n, std::uint32_t error_class, std::int64_t time) noexcept {
    if (!n.error_frames) return;
    Frame f;
    f.error = true;
    f.id = error_class;
    f.length = 8;
    f.time_ns = time;
    f.data[6] = static_cast<std::uint8_t>(std::min(n.tec, 255U));
    f.data[7] = static_cast<std::uint8_t>(std::min(n.rec, 255U));
    if (!n.incoming.push(f)) {
        count(n.lost);
    }
}

void Bus::occupy(std::int64_t start, std::int64_t end) noexcept {
    starts_[started_++ % starts_.size()] = start;
    free_at_ = end;
    busy_ns_ += end - start;
}

void Bus::publish(Node& n) noexcept {
    const auto worst = std::max(n.tec, n.rec);
    const auto state = n.off          ? State::bus_off
                       : worst >= 128 ? State::passive
                       : worst >= 96  ? State::warning
                                      : State::active;
    n.state.store(state, std::memory_order_relaxed);
    n.counters.store(std::min(n.tec, 255U) << 16 | std::min(n.rec, 255U),
                     std::memory_order_relaxed);
}

/// Returns the first disturbance that hits this frame. Except for errors it is asked once, however
/// often the frame is repeated.
Bus::Active* Bus::struck(const Candidate& c, std::int64_t start) noexcept {
    Node& n = *c.node;
    Active* found = nullptr;
    for (auto& d : disturbances) {
        const Disturbance& w = d.what;
        if (((c.frame->id ^ w.id) & w.mask) != 0 || (w.node >= 0 && w.node != n.number)) continue;
        if (start < w.from_ns || start >= w.until_ns) continue;
        if (d.hits >= w.count || (w.fault == Fault::delay && n.delayed) ||
            (w.fault == Fault::duplicate && n.doubled)) {
            continue;
        }
        if (w.every != 0 && n.counted && w.fault != Fault::error) continue;
        ++d.matched;
        const bool hit = w.every != 0 ? d.matched % w.every == 0
                                      : static_cast<double>(draw() >> 11) * 0x1p-53 < w.probability;
        if (!hit || found != nullptr) continue;
        ++d.hits;
        found = &d;
        if (w.fault == Fault::delay) {
            n.delayed = true;
        }
    }
    n.counted = true;
    return found;
}

std::uint64_t Bus::draw() noexcept {  // splitmix64
    random += 0x9e3779b97f4a7c15U;
    auto z = random;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9U;
    z = (z ^ z >> 27) * 0x94d049bb133111ebU;
    return z ^ z >> 31;
}

}  // namespace hal::can::simbus
