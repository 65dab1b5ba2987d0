// SPDX-License-Identifier: MIT
// An Ethernet segment in memory: stations, each with a full-duplex line to one store-and-forward
// switch. Its time is the newest
// `now_ns` its users passed in; everything up to that time is processed, in order of time, by
// whichever of them calls first ("the pump"). What starts strictly before now is done, so that the
// order in which functions run at one instant does not matter; simultaneous events are ordered by
// station, then user, then the order of sending.
//
// Threads: a user has a pool of buffers for its frames. Their numbers circulate: sender ->
// `outgoing` -> pump -> `unused` -> sender; each queue has one writer and one reader. Arrived
// frames are copied to `incoming`, which the receiving thread reads. All else belongs to the thread
// that holds `pumping_`. A cycle only tries to take it: if another thread is working, that one does
// the work and the cycle proceeds.
//   1. thread A takes pumping_, works up to its now       2. thread B queues a frame, fails to take pumping_, proceeds
//   3. A releases pumping_                                4. the next call of any thread finds B's frame: it is late, not lost
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "hal/queue.hpp"
#include "link/disturbances.hpp"
#include "link/segment.hpp"

namespace hal::ethernet::simbus {

using Bytes = std::array<std::uint8_t, max_frame>;

/// A frame of a user, from send() until the last line has sent it.
struct Outgoing {
    Bytes bytes;
    std::size_t length = 0;
    Launch launch;
    std::int64_t at_ns = 0;  ///< not before
    unsigned references = 0;  ///< events that still need it; used by the pump
};

/// A frame in flight to a receiver, which may take it from `time_ns` on; its stamp may differ.
struct Incoming {
    Bytes bytes;
    std::size_t length = 0;
    std::int64_t time_ns = 0;
    std::int64_t stamp_ns = 0;
};

struct Station;

/// One port. Fields without a comment belong to the pump.
struct User {
    explicit User(const Options&);

    std::vector<Outgoing> places;
    hal::Queue<std::uint32_t> unused;  ///< writer: the pump, reader: the sending thread
    hal::Queue<std::uint32_t> outgoing;  ///< writer: the sending thread, reader: the pump
    hal::Queue<Incoming> incoming;  ///< writer: the pump, reader: the receiving thread
    struct Waiting {
        std::int64_t at_ns;
        std::uint64_t sequence;
        std::uint32_t slot;
        bool operator<(const Waiting& o) const noexcept {
            return at_ns != o.at_ns ? at_ns > o.at_ns : sequence > o.sequence;
        }
    };
    std::vector<Waiting> waiting;  ///< a heap, the next to leave first
    std::uint64_t sequence = 0;
    std::vector<std::uint16_t> types;
    bool promiscuous = false;
    bool leaving = false;  ///< its port is closed
    Responder* responder = nullptr;  ///< takes its frames instead of the receiving thread
    const std::int64_t noise_ns;
    Station* station = nullptr;  ///< never changes

    std::atomic<std::uint64_t> sent{0};
    std::atomic<std::uint64_t> sent_bytes{0};
    std::atomic<std::uint64_t> received{0};
    std::atomic<std::uint64_t> received_bytes{0};
    std::atomic<std::uint64_t> lost{0};

    std::atomic<std::uint64_t> thrown_away{0};
    std::atomic<std::uint64_t> late{0};
    std::atomic<std::uint64_t> runts{0};
    std::atomic<std::int64_t> launch_error_ns{0};
    std::atomic<std::uint64_t> dropped{0};
    std::atomic<std::uint64_t> rejected{0};  ///< written by the sending thread
};

/// A line with its two directions. Fields without a comment belong to the pump.
struct Station {
    std::string name;  ///< empty: of a single user
    int number = 0;
    Address address{};
    std::vector<User*> users;
    std::int64_t to_switch_free = INT64_MIN;
    std::int64_t from_switch_free = INT64_MIN;
    std::unique_ptr<User> babbler;  ///< its buffers hold the babbled frames
    Bytes babble{};
    std::size_t babble_length = 0;
    std::int64_t babble_period = 0;
    std::int64_t babble_at = 0;
    std::atomic<bool> cut{false};  ///< written in setup, read by all
    std::atomic<std::uint64_t> downs{0};
};

class Switch {
public:
    Switch(std::string name, const Options&);

    /// Returns the segment of that name, created if necessary. It lives as long as one of its
    /// ports. [setup]
    static std::shared_ptr<Switch> find(const std::string& name, const Options&,
                                        std::string& problem);

    /// Adds a user. Returns false and sets `problem` when the station exists with another address.
    /// [setup]
    bool add(User&, const std::string& station, const Options&, std::string& problem);
    /// Removes a user; frames due by now are still sent, as by a controller whose program ended.
    /// [setup]
    void remove(std::unique_ptr<User>);

    /// Processes the segment up to `now_ns`, unless another thread is doing so. [realtime]
    void pump(std::int64_t now_ns) noexcept;
    /// Returns `now_ns`, or for `unclocked` the newest time known to the segment. [any]
    std::int64_t time(std::int64_t now_ns) const noexcept {
        return now_ns == unclocked ? latest_.load(std::memory_order_relaxed) : now_ns;
    }

    /// Calls `change` while no thread pumps. [setup]
    template <class Change>
    auto exclusively(Change&& change) {
        const Hold hold(*this);
        return change();
    }
    Station* station(int number) noexcept;  ///< only within exclusively(), as all below

    using Disturbances = link::Disturbances<Disturbance>;
    Disturbances disturbances;
    std::vector<std::unique_ptr<Station>> stations;  ///< in order of their numbers
    /// the user with a responder; then the segment is a cable
    User* responding = nullptr;

    const std::string name;
    const std::uint32_t speed;  ///< Mbit/s
    const std::int64_t forward_ns;

private:
    struct Hold {
        explicit Hold(Switch&) noexcept;
        ~Hold();
        Switch& held;
    };
    /// A frame completely received by the switch, to be forwarded.
    struct Event {
        std::int64_t time_ns = 0;
        std::uint64_t sequence = 0;
        User* from = nullptr;
        std::uint32_t slot = 0;
        std::int32_t to = -1;  ///< to this station only; -1: all
        std::uint32_t length = 0;
        std::int32_t garbled = -1;  ///< index of a garbled byte,
        std::uint8_t mask = 0;  ///< and its flipped bits
        bool operator<(const Event& o) const noexcept {
            return time_ns != o.time_ns ? time_ns > o.time_ns : sequence > o.sequence;
        }
    };

    void work(std::int64_t now) noexcept;
    void collect(std::int64_t now) noexcept;
    void launch(Station&, std::int64_t start) noexcept;
    void pass_on(const Event&) noexcept;
    void deliver(const Event&, Station& to) noexcept;
    bool add_event(const Event&) noexcept;
    static bool is_meant(const Disturbance&, const Event&, bool only_one) noexcept;
    Disturbances::Active* find_disturbance(const Event&, bool only_one) noexcept;
    bool disturbed(Event&, bool only_one) noexcept;
    void release(const Event&) noexcept;
    void give_back(User&, std::uint32_t slot) noexcept;
    std::int64_t wire_ns(std::size_t length) const noexcept {
        return static_cast<std::int64_t>(wire_bytes(length) * 8000 / speed);
    }
    double noise() noexcept;
    void sweep(std::vector<std::unique_ptr<User>>& gone,
               std::vector<std::unique_ptr<Station>>& empty);

    std::vector<Event> events_;  ///< a heap, the next first
    std::uint64_t sequence_ = 0;
    std::vector<std::unique_ptr<User>> leaving_;  ///< [setup]
    std::atomic_flag pumping_;
    std::atomic<std::int64_t> latest_{INT64_MIN};
    std::atomic<std::int64_t> worked_until_{INT64_MIN};
};

}  // namespace hal::ethernet::simbus
