// SPDX-License-Identifier: MIT
#include "can_bus.hpp"

#include <algorithm>
#include <map>
#include <mutex>
#include <thread>

#include "link/bus_key.hpp"

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
}

std::shared_ptr<Bus> Bus::find(const std::string& name, const Options& options,
                               std::string& problem) {
    Registry& all = registry();
    const std::lock_guard lock(all.mutex);
    auto& known = all.buses[link::bus_key(name)];
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
            const Disturbances::Active* fault = struck(c, time);
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

bool Bus::is_ready(Node& n, std::int64_t start) noexcept {
    const Frame* const f = n.outgoing.front();
    return n.hold_until <= start && f != nullptr && f->time_ns <= start;
}

/// A node that is cut off the bus gets no acknowledgement. Once passive, it stays passive and
/// repeats for ever.
void Bus::send_alone(Node& n, std::int64_t start, std::int64_t now) noexcept {
    if (!is_ready(n, start)) return;
    if (n.tec < 128) {
        n.tec += 8;
    }
    const auto length = frame_bits(*n.outgoing.front());
    const auto repeats = start + duration_ns(length, bit_rate, data_rate) + bits(error_frame_bits);
    n.hold_until = n.tec < 128 ? repeats : now;
    count(n.errors);
    publish(n);
    event(n, error_no_acknowledge, start);
}

/// Arbitrates between all frames ready at `start`.
Bus::Arbitration Bus::arbitrate(std::int64_t start, std::int64_t now) noexcept {
    Arbitration result;
    const auto compete = [&](Node& n, const Frame& f, bool babbling) {
        const auto rank = arbitration_rank(f);
        if (result.winner.node != nullptr && rank >= result.rank) return;
        result.rank = rank;
        result.winner = {&n, &f, babbling};
    };
    for (Node* n : nodes) {
        if (hears(*n) && !n->listen_only) {
            ++result.acknowledging;
        }
        if (n->off || n->hold_until > start) continue;
        if (n->cut.load(std::memory_order_relaxed)) {
            send_alone(*n, start, now);
            continue;
        }
        if (n->babble_period > 0 && n->babble_at <= start) {
            compete(*n, n->babble, true);
        }
        if (is_ready(*n, start)) {
            compete(*n, *n->outgoing.front(), false);
        }
    }
    return result;
}

/// True when a node other than the winner sends a frame of the same rank at the same time.
bool Bus::also_sends(Node& n, const Arbitration& a, std::int64_t start) const noexcept {
    return &n != a.winner.node && hears(n) && is_ready(n, start) &&
           arbitration_rank(*n.outgoing.front()) == a.rank;
}

/// Nodes with the same identifier do not detect lost arbitration. Equal frames merge; different
/// ones destroy each other.
bool Bus::collides(const Arbitration& a, std::int64_t start) const noexcept {
    return std::any_of(nodes.begin(), nodes.end(), [&](Node* n) {
        return also_sends(*n, a, start) && !n->outgoing.front()->same(*a.winner.frame);
    });
}

/// Gives up the frame of a node that sends it once only.
void Bus::discard_single_shot(const Candidate& c) noexcept {
    if (!c.babbling && c.node->outgoing.front()->single_shot) {
        discard(*c.node);
    }
}

/// Handles a frame that nobody acknowledges.
void Bus::fail_to_acknowledge(const Candidate& c, std::int64_t start, std::int64_t now) noexcept {
    Node& sender = *c.node;
    const Bits length = frame_bits(*c.frame);
    const auto end =
        start + duration_ns({length.nominal - intermission_bits, length.data}, bit_rate, data_rate);
    const auto idle = start + duration_ns(length, bit_rate, data_rate);
    if (sender.tec < 128) {
        sender.tec += 8;
    }
    occupy(start, sender.tec < 128 ? idle + bits(error_frame_bits) : std::max(now, idle));
    discard_single_shot(c);
    if (c.babbling) {
        sender.babble_at = free_at_ + sender.babble_period;
    }
    count(sender.errors);
    publish(sender);
    event(sender, error_no_acknowledge, end);
}

/// Counts a destroyed frame at one node: senders by 8, receivers by 1.
void Bus::count_protocol_error(const Candidate& c, bool sending, std::int64_t noticed) noexcept {
    Node& n = *c.node;
    if (sending) {
        n.tec += 8;
        discard_single_shot(c);
    } else if (n.rec < 255) {
        ++n.rec;
    }
    count(n.errors);
    if (sending && n.tec > 255) {
        failed(n, noticed);
    } else if (sending && n.tec >= 128) {  // passive nodes suspend transmission
        n.hold_until = free_at_ + bits(8);
    }
    publish(n);
    event(n, error_protocol, noticed);
}

/// Destroys the winner's frame, by a collision or by a disturbance.
void Bus::destroy(const Arbitration& a, bool collision, std::int64_t start) noexcept {
    const Bits length = frame_bits(*a.winner.frame);
    const unsigned body = length.total() - intermission_bits;
    const unsigned broken = collision
                                ? std::min(body, 40U)
                                : 1 + static_cast<unsigned>(disturbances.random.draw() % body);
    const unsigned slow = std::min(broken, length.nominal);
    const auto noticed = start + duration_ns({slow, broken - slow}, bit_rate, data_rate);
    occupy(start, noticed + bits(error_frame_bits));
    for (Node* n : nodes) {
        if (!hears(*n)) continue;
        const bool is_winner = n == a.winner.node;
        const bool sending = is_winner || (collision && also_sends(*n, a, start));
        count_protocol_error({n, nullptr, is_winner && a.winner.babbling}, sending, noticed);
    }
    if (a.winner.babbling) {
        a.winner.node->babble_at = free_at_ + a.winner.node->babble_period;
    }
}

/// Receivers of a good frame forget an error.
void Bus::credit_receivers(const Node& sender) noexcept {
    for (Node* n : nodes) {
        if (n == &sender || !hears(*n) || n->rec == 0) continue;
        n->rec = n->rec > 127 ? 127 : n->rec - 1;
        publish(*n);
    }
}

/// Handles a frame that the receivers take and the sender repeats: its last bit was disturbed.
void Bus::duplicate(const Candidate& c, std::int64_t end) noexcept {
    Node& sender = *c.node;
    sender.tec += 8;
    sender.doubled = true;
    discard_single_shot(c);
    if (sender.tec > 255) {
        failed(sender, end);
    }
    publish(sender);
}

/// Ends a good frame of the winner, and the equal frames that were merged with it.
void Bus::complete(const Arbitration& a, std::int64_t start, std::int64_t end) noexcept {
    const Frame frame = *a.winner.frame;
    for (Node* n : nodes) {
        if (also_sends(*n, a, start) && n->outgoing.front()->same(frame)) {
            done({n, n->outgoing.front(), false}, end);
        }
    }
    done(a.winner, end);
}

/// Sends the frame that wins the arbitration at `start`, disturbed or not.
void Bus::transmit(std::int64_t start, std::int64_t now) noexcept {
    const Arbitration a = arbitrate(start, now);
    if (a.winner.node == nullptr) return;
    Node& sender = *a.winner.node;
    if (a.acknowledging < 2) return fail_to_acknowledge(a.winner, start, now);  // only the sender

    const bool collision = collides(a, start);
    const Disturbances::Active* const active = struck(a.winner, start);
    const auto has_fault = [&](Fault fault) {
        return active != nullptr && active->what.fault == fault;
    };
    if (has_fault(Fault::delay)) {
        sender.hold_until = start + std::max<std::int64_t>(1, active->what.delay_ns);
        if (a.winner.babbling) {
            sender.babble_at = sender.hold_until;
        }
        return;
    }
    if (collision || has_fault(Fault::error)) return destroy(a, collision, start);

    const Bits length = frame_bits(*a.winner.frame);
    const auto end =
        start + duration_ns({length.nominal - intermission_bits, length.data}, bit_rate, data_rate);
    occupy(start, start + duration_ns(length, bit_rate, data_rate));
    if (active == nullptr || has_fault(Fault::duplicate)) {
        deliver(sender, Frame(*a.winner.frame), end);
    }
    credit_receivers(sender);
    if (has_fault(Fault::duplicate)) return duplicate(a.winner, end);
    complete(a, start, end);
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

/// Returns the error state of a node that is not off the bus, by its larger error counter.
static State state_of(unsigned errors) noexcept {
    if (errors >= 128) return State::passive;
    return errors >= 96 ? State::warning : State::active;
}

void Bus::publish(Node& n) noexcept {
    n.state.store(n.off ? State::bus_off : state_of(std::max(n.tec, n.rec)),
                  std::memory_order_relaxed);
    n.counters.store(std::min(n.tec, 255U) << 16 | std::min(n.rec, 255U),
                     std::memory_order_relaxed);
}

/// Returns the first disturbance that hits this frame. Except for errors it is asked once, however
/// often the frame is repeated.
Bus::Disturbances::Active* Bus::struck(const Candidate& c, std::int64_t start) noexcept {
    Node& n = *c.node;
    Disturbances::Active* found = nullptr;
    for (auto& d : disturbances) {
        const Disturbance& w = d.what;
        const bool is_meant =
            ((c.frame->id ^ w.id) & w.mask) == 0 && (w.node < 0 || w.node == n.number);
        if (!is_meant || !d.is_active(start)) continue;
        const bool was_delayed = w.fault == Fault::delay && n.delayed;
        const bool was_doubled = w.fault == Fault::duplicate && n.doubled;
        const bool was_counted = w.every != 0 && n.counted && w.fault != Fault::error;
        if (was_delayed || was_doubled || was_counted) continue;
        if (!disturbances.match(d) || found != nullptr) continue;
        ++d.hits;
        found = &d;
        n.delayed = n.delayed || w.fault == Fault::delay;
    }
    n.counted = true;
    return found;
}

// Transmit windows: frames that may start at certain times only.

/// Discards the frames whose window does not allow a start any more. Returns true when there was
/// one.
bool Bus::discard_expired(std::int64_t start) noexcept {
    bool any = false;
    for (Node* n : nodes) {
        const Outgoing* f = n->outgoing.front();
        if (f == nullptr || f->time_ns > start) continue;
        if (std::max(start, n->hold_until) <= f->last_start &&
            was_idle(f->idle_from, f->idle_until)) {
            continue;
        }
        discard(*n);
        any = true;
    }
    return any;
}

/// Returns true when no frame started in [from, until).
bool Bus::was_idle(std::int64_t from, std::int64_t until) const noexcept {
    if (from == until) return true;
    for (std::size_t i = 0; i < std::min(started_, starts_.size()); ++i) {
        const auto start = starts_[(started_ - 1 - i) % starts_.size()];
        if (start < from) return true;
        if (start < until) return false;
    }
    return true;
}

void Bus::discard(Node& n) noexcept {
    n.delayed = false;
    n.doubled = false;
    n.counted = false;
    n.thrown_away.fetch_add(1, std::memory_order_relaxed);
    n.outgoing.drop();
}

}  // namespace hal::can::simbus
