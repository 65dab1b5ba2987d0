// SPDX-License-Identifier: MIT
#include "ethernet_switch.hpp"

#include <algorithm>
#include <cstring>
#include <map>
#include <mutex>
#include <thread>

#include "link/bus_key.hpp"

namespace hal::ethernet::simbus {

namespace {

constexpr std::size_t max_events = 8192;
constexpr std::size_t max_stations = 256;
// memory of a small switch per line; frames beyond it are lost
constexpr std::size_t egress_bytes = 65536;

struct Registry {
    std::mutex mutex;
    std::map<std::string, std::weak_ptr<Switch>> segments;
};
Registry& registry() {
    static Registry all;
    return all;
}

unsigned type_of(const Bytes& b) { return static_cast<unsigned>(b[12] << 8U | b[13]); }

}  // namespace

User::User(const Options& o)
    : places(hal::Queue<std::uint32_t>(o.send_capacity).capacity()),
      unused(o.send_capacity),
      outgoing(o.send_capacity),
      incoming(o.receive_capacity),
      types(o.types),
      promiscuous(o.promiscuous),
      noise_ns(o.noise_ns) {
    for (std::uint32_t i = 0; i < places.size(); ++i) {
        unused.push(i);
    }
    waiting.reserve(places.size());
}

Switch::Switch(std::string its_name, const Options& o)
    : name(std::move(its_name)),
      speed(o.speed != 0 ? o.speed : 100),
      forward_ns(o.forward_ns >= 0 ? o.forward_ns : 2000) {
    events_.reserve(max_events);
    stations.reserve(max_stations);
}

std::shared_ptr<Switch> Switch::find(const std::string& name, const Options& options,
                                     std::string& problem) {
    Registry& all = registry();
    const std::lock_guard lock(all.mutex);
    auto& known = all.segments[link::bus_key(name)];
    if (auto segment = known.lock()) {
        if (options.speed != 0 && options.speed != segment->speed) {
            problem = "the segment already runs at " + std::to_string(segment->speed) +
                      " Mbit/s; use the same speed everywhere, or give it in one place only";
        } else if (options.forward_ns >= 0 && options.forward_ns != segment->forward_ns) {
            problem = "the switch already has a delay of " + std::to_string(segment->forward_ns) +
                      " ns; use the same forward everywhere, or give it in the first place only";
        }
        return problem.empty() ? segment : nullptr;
    }
    auto segment = std::make_shared<Switch>(name, options);
    known = segment;
    std::erase_if(all.segments, [](const auto& entry) { return entry.second.expired(); });
    return segment;
}

Switch::Hold::Hold(Switch& its) noexcept : held(its) {
    while (held.pumping_.test_and_set(std::memory_order_acquire)) {
        std::this_thread::yield();
    }
}
Switch::Hold::~Hold() { held.pumping_.clear(std::memory_order_release); }

Station* Switch::station(int number) noexcept {
    for (auto& s : stations) {
        if (s->number == number) return s.get();
    }
    return nullptr;
}

bool Switch::add(User& user, const std::string& wanted, const Options& options,
                 std::string& problem) {
    std::vector<std::unique_ptr<User>> gone;  // freed after the segment is released
    std::vector<std::unique_ptr<Station>> empty;
    const Hold hold(*this);
    sweep(gone, empty);
    const auto same = [&](const auto& s) { return !wanted.empty() && s->name == wanted; };
    auto found = std::find_if(stations.begin(), stations.end(), same);
    if (found == stations.end()) {
        if (stations.size() == max_stations) {
            problem = "too many stations: the segment already has " + std::to_string(max_stations);

            return false;
        }
        int number = 0;  // the lowest free number: a program always gets the same numbers
        while (station(number) != nullptr) {
            ++number;
        }
        auto made = std::make_unique<Station>();
        made->name = wanted;
        made->number = number;
        made->address = options.address;
        if (options.address == Address{}) {
            made->address = {2, 'H', 'A', 'L', 0, static_cast<std::uint8_t>(number + 1)};
        }
        made->users.reserve(64);
        const auto after = [](int n, const auto& s) { return n < s->number; };
        found = stations.insert(std::upper_bound(stations.begin(), stations.end(), number, after),
                                std::move(made));
    } else if (options.address != Address{} && options.address != (*found)->address) {
        problem = "station " + wanted + " already has the address " + to_string((*found)->address) +
                  "; give mac= in one place only";
        return false;
    }
    user.station = found->get();
    user.station->users.push_back(&user);
    return true;
}

void Switch::remove(std::unique_ptr<User> user) {
    std::vector<std::unique_ptr<User>> gone;
    std::vector<std::unique_ptr<Station>> empty;
    const Hold hold(*this);
    const auto now = latest_.load(std::memory_order_relaxed);
    collect(now);
    auto& waiting = user->waiting;
    for (auto& w : waiting) {
        if (w.at_ns > now) {
            give_back(*user, w.slot);
        }
    }
    std::erase_if(waiting, [&](const auto& w) { return w.at_ns > now; });
    std::make_heap(waiting.begin(), waiting.end());
    user->leaving = true;
    user->responder = nullptr;
    if (responding == user.get()) {
        responding = nullptr;
    }
    leaving_.push_back(std::move(user));
    sweep(gone, empty);
}

/// Removes closed users without pending frames, and stations without users.
void Switch::sweep(std::vector<std::unique_ptr<User>>& gone,
                   std::vector<std::unique_ptr<Station>>& empty) {
    const auto busy = [&](const User* u) {
        return std::any_of(events_.begin(), events_.end(),
                           [&](const Event& e) { return e.from == u; });
    };
    std::erase_if(leaving_, [&](std::unique_ptr<User>& u) {
        if (!u->waiting.empty() || u->outgoing.front() != nullptr || busy(u.get())) return false;
        std::erase(u->station->users, u.get());
        gone.push_back(std::move(u));
        return true;
    });
    std::erase_if(stations, [&](std::unique_ptr<Station>& s) {
        if (!s->users.empty() || busy(s->babbler.get())) return false;
        empty.push_back(std::move(s));
        return true;
    });
}

void Switch::pump(std::int64_t now) noexcept {
    auto latest = latest_.load(std::memory_order_relaxed);
    while (now > latest && !latest_.compare_exchange_weak(latest, now, std::memory_order_relaxed)) {
    }
    if (now == unclocked) {
        now = latest;
    }
    if (now == unclocked || now <= worked_until_.load(std::memory_order_relaxed)) return;
    if (pumping_.test_and_set(std::memory_order_acquire)) return;
    work(now);
    pumping_.clear(std::memory_order_release);
}

/// Moves sent frames to the heaps, once a time is known.
void Switch::collect(std::int64_t now) noexcept {
    if (now == unclocked) return;
    for (auto& s : stations) {
        for (User* u : s->users) {
            for (const std::uint32_t* slot = nullptr; (slot = u->outgoing.front()) != nullptr;
                 u->outgoing.drop()) {
                auto& at = u->places[*slot].at_ns;
                if (at == unclocked) {
                    at = now - 1;  // sent before a time was known
                }
                u->waiting.push_back({at, u->sequence++, *slot});
                std::push_heap(u->waiting.begin(), u->waiting.end());
            }
        }
    }
}

void Switch::work(std::int64_t now) noexcept {
    collect(now);
    for (;;) {
        std::int64_t first = INT64_MAX;
        Station* next = nullptr;
        for (auto& s : stations) {
            std::int64_t at = s->babble_period > 0 ? s->babble_at : INT64_MAX;
            for (const User* u : s->users) {
                if (!u->waiting.empty()) {
                    at = std::min(at, u->waiting.front().at_ns);
                }
            }
            if (at == INT64_MAX) continue;
            at = std::max(at, s->to_switch_free);
            if (at < first) {
                first = at;
                next = s.get();
            }
        }
        const auto passing = events_.empty() ? INT64_MAX : events_.front().time_ns;
        if (std::min(first, passing) >= now) break;
        if (passing <= first) {
            const Event event = events_.front();
            std::pop_heap(events_.begin(), events_.end());
            events_.pop_back();
            pass_on(event);
            release(event);
            if (responding != nullptr) {
                collect(now);  // its replies
            }
        } else {
            launch(*next, first);
        }
    }
    worked_until_.store(now, std::memory_order_relaxed);
}

/// Sends the first frame in turn from its station.
void Switch::launch(Station& s, std::int64_t start) noexcept {
    User* from = nullptr;
    for (User* u : s.users) {
        if (!u->waiting.empty() &&
            (from == nullptr || u->waiting.front().at_ns < from->waiting.front().at_ns)) {
            from = u;
        }
    }
    std::uint32_t slot = 0;
    const bool babbled =
        s.babble_period > 0 && (from == nullptr || s.babble_at <= from->waiting.front().at_ns);
    if (babbled) {
        s.babble_at = std::max(s.babble_at + s.babble_period, start + 1);
        from = s.babbler.get();
        const std::uint32_t* unused = from->unused.front();
        if (unused == nullptr) return;
        slot = *unused;
        from->unused.drop();
        Outgoing& f = from->places[slot];
        std::memcpy(f.bytes.data(), s.babble.data(), f.length = s.babble_length);
        f.launch = {};
        f.at_ns = start;
    } else {
        if (from == nullptr) return;
        slot = from->waiting.front().slot;
        std::pop_heap(from->waiting.begin(), from->waiting.end());
        from->waiting.pop_back();
    }
    Outgoing& f = from->places[slot];
    const auto count = [](auto& counter, std::uint64_t by = 1) {
        counter.fetch_add(by, std::memory_order_relaxed);
    };
    if (s.cut.load(std::memory_order_relaxed)) {
        count(from->thrown_away);
        return give_back(*from, slot);
    }
    if (f.launch.is_late(start)) {
        count(from->late);
        return give_back(*from, slot);
    }
    if (f.launch.at_ns != 0) {
        from->launch_error_ns.store(start - f.launch.at_ns, std::memory_order_relaxed);
    }
    if (f.launch.stamp_at != 0) {
        auto stamp = static_cast<std::uint64_t>(start + f.launch.stamp_add_ns);
        for (std::size_t i = 8; i-- > 0; stamp >>= 8) {
            f.bytes[f.launch.stamp_at + i] = static_cast<std::uint8_t>(stamp);
        }
    }
    count(from->sent);
    count(from->sent_bytes, f.length);
    s.to_switch_free = start + wire_ns(f.length);
    f.references = 1;  // until all its events are created
    Event e{s.to_switch_free + (responding != nullptr ? 0 : forward_ns),
            0,
            from,
            slot,
            -1,
            static_cast<std::uint32_t>(f.length),
            -1,
            0};
    if (!disturbed(e, false)) {
        add_event(e);
    }
    release(e);
}

/// Forwards a frame from the switch to the lines of its receivers.
void Switch::pass_on(const Event& e) noexcept {
    const Bytes& bytes = e.from->places[e.slot].bytes;
    if (e.to >= 0) {
        if (Station* s = station(e.to)) {
            deliver(e, *s);
        }
        return;
    }
    Address to;
    std::memcpy(to.data(), bytes.data(), to.size());
    const bool to_group = (to[0] & 1) != 0;
    const bool known = !to_group && std::any_of(stations.begin(), stations.end(),
                                                [&](auto& s) { return s->address == to; });
    for (auto& s : stations) {
        if (s.get() == e.from->station) continue;
        const auto listens = [](const User* u) { return u->promiscuous && !u->leaving; };
        if (known && s->address != to && std::none_of(s->users.begin(), s->users.end(), listens)) {
            continue;
        }
        Event one = e;
        one.to = s->number;
        if (!disturbed(one, true)) {
            deliver(one, *s);
        }
    }
}

/// Sends a frame on the line of one station, and delivers it to its users at the end.
void Switch::deliver(const Event& e, Station& s) noexcept {
    const auto count = [](auto& counter, std::uint64_t by = 1) {
        counter.fetch_add(by, std::memory_order_relaxed);
    };
    if (s.cut.load(std::memory_order_relaxed)) return;
    const bool cable = responding != nullptr;
    const auto start = cable ? e.time_ns : std::max(e.time_ns, s.from_switch_free);
    const bool crowded = start - e.time_ns > static_cast<std::int64_t>(egress_bytes * 8000 / speed);
    if (!crowded) {
        s.from_switch_free = cable ? start : start + wire_ns(e.length);
    }
    const Outgoing& f = e.from->places[e.slot];
    Address to;
    std::memcpy(to.data(), f.bytes.data(), to.size());
    for (User* u : s.users) {
        if (u->leaving || (!u->promiscuous && (to[0] & 1) == 0 && to != s.address)) continue;
        if (!u->types.empty() &&
            std::find(u->types.begin(), u->types.end(), type_of(f.bytes)) == u->types.end()) {
            continue;
        }
        if (e.length < header_bytes) {
            count(u->runts);
            continue;
        }
        if (u->responder != nullptr) {
            Bytes bytes = f.bytes;
            if (e.garbled >= 0) {
                bytes[static_cast<std::size_t>(e.garbled)] ^= e.mask;
            }
            count(u->received);
            count(u->received_bytes, e.length);
            u->responder->arrived({bytes.data(), e.length}, e.time_ns - wire_ns(e.length));
            continue;
        }
        Incoming* in = crowded ? nullptr : u->incoming.place();
        if (in == nullptr) {
            count(u->lost);
            continue;
        }
        std::memcpy(in->bytes.data(), f.bytes.data(), in->length = e.length);
        if (e.garbled >= 0) {
            in->bytes[static_cast<std::size_t>(e.garbled)] ^= e.mask;
        }
        in->stamp_ns = s.from_switch_free;
        if (u->noise_ns > 0) {
            in->stamp_ns += static_cast<std::int64_t>(noise() * static_cast<double>(u->noise_ns));
        }
        in->time_ns = std::max(s.from_switch_free, in->stamp_ns);
        u->incoming.commit();
        count(u->received);
        count(u->received_bytes, e.length);
    }
}

/// Returns true when the disturbance is for frames like this one, whenever it is active.
bool Switch::is_meant(const Disturbance& w, const Event& e, bool only_one) noexcept {
    const Bytes& bytes = e.from->places[e.slot].bytes;
    if ((w.to >= 0) != only_one || (only_one && w.to != e.to)) return false;
    if (w.type != 0 && w.type != type_of(bytes)) return false;
    if (w.from >= 0 && w.from != e.from->station->number) return false;
    if (w.at == 0) return true;
    const bool has_word = w.at + std::size_t{2} <= e.length;
    return has_word && (bytes[w.at] << 8 | bytes[w.at + 1U]) == w.is;
}

/// Counts the frame in all disturbances that it matches. Returns the first that hits it; nullptr:
/// none does.
Switch::Disturbances::Active* Switch::find_disturbance(const Event& e, bool only_one) noexcept {
    Disturbances::Active* found = nullptr;
    for (auto& d : disturbances) {
        if (!is_meant(d.what, e, only_one) || !d.is_active(e.time_ns)) continue;
        if (!disturbances.match(d) || found != nullptr) continue;
        ++d.hits;
        found = &d;
    }
    return found;
}

/// Applies disturbances to the frame. Returns true when nothing of it proceeds unchanged. Those of
/// one receiver apply at its line, all others where the frame leaves.
bool Switch::disturbed(Event& e, bool only_one) noexcept {
    const Disturbances::Active* const found = find_disturbance(e, only_one);
    if (found == nullptr) return false;
    const Disturbance& w = found->what;
    switch (w.fault) {
    case Fault::loss: return true;
    case Fault::duplicate: add_event(e); return false;
    case Fault::delay:
        e.time_ns += w.delay_ns;
        add_event(e);
        return true;
    case Fault::cut:
        e.length = static_cast<std::uint32_t>(std::min<std::size_t>(e.length, w.length));
        return false;
    case Fault::garble:
        if (e.length == 0) return false;
        e.garbled = static_cast<std::int32_t>(disturbances.random.draw() % e.length);
        e.mask = static_cast<std::uint8_t>(1U + disturbances.random.draw() % 255U);
        return false;
    }
    return false;
}

bool Switch::add_event(const Event& e) noexcept {
    if (events_.size() == max_events) return false;
    events_.push_back(e);
    events_.back().sequence = sequence_++;
    ++e.from->places[e.slot].references;
    std::push_heap(events_.begin(), events_.end());
    return true;
}

void Switch::release(const Event& e) noexcept {
    if (--e.from->places[e.slot].references == 0) {
        give_back(*e.from, e.slot);
    }
}

void Switch::give_back(User& user, std::uint32_t slot) noexcept { user.unused.push(slot); }

/// Returns a normal random number with sigma 1, as the sum of twelve uniform ones.
double Switch::noise() noexcept {
    double sum = -6.0;
    for (int i = 0; i < 3; ++i) {
        for (auto [bits, k] = std::pair{disturbances.random.draw(), 0}; k < 4; ++k, bits >>= 16) {
            sum += (static_cast<double>(bits & 0xffff) + 0.5) / 65536.0;
        }
    }
    return sum;
}

}  // namespace hal::ethernet::simbus
