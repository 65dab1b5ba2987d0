// SPDX-License-Identifier: MIT
// A CAN bus in memory. Its time is the newest `now_ns` its users passed in; everything up to that
// time is processed by whichever of them calls first ("the pump"). Frames that start strictly
// before now are sent, so that all nodes that send at the same time take part in the same
// arbitration, whatever the order of their functions.
//
// Threads: every node has a queue to the bus and one from it, each with one writer and one reader.
// The bus itself belongs to the thread that holds `pumping_`. A cycle only tries to take it: if
// another thread is working, that thread does the work and the cycle proceeds.
//   1. thread A takes pumping_, works up to its now      2. thread B queues a frame, fails to take pumping_, proceeds
//   3. A releases pumping_                               4. the next call of any thread finds B's frame: it is late, not lost
// On a bus without a bit rate (`unlimited`) A checks again after 3, so that B's frame does not wait
// for a later call.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "hal/queue.hpp"
#include "link/can.hpp"
#include "link/disturbances.hpp"
#include "link/simulation.hpp"
#include "link/timing.hpp"

namespace hal::can::simbus {

/// A frame to be sent; `time_ns` is when it was queued or, with a window, when that begins.
struct Outgoing : Frame {
    std::int64_t last_start = INT64_MAX;
    std::int64_t idle_from = 0;
    std::int64_t idle_until = 0;
    bool single_shot = false;
};

/// One end of the bus. Fields without a comment belong to the pump.
struct Node {
    Node(const Options& options)
        : outgoing(options.send_capacity), incoming(options.receive_capacity) {}

    hal::Queue<Outgoing> outgoing;  ///< writer: the sending thread
    hal::Queue<Frame> incoming;  ///< reader: the receiving thread; `time_ns` is when it is complete
    std::vector<Filter> filters;
    int number = 0;
    bool fd = false;
    bool own_frames = false;
    bool error_frames = false;
    bool listen_only = false;
    std::uint32_t restart_ms = 0;

    unsigned tec = 0;
    unsigned rec = 0;
    bool off = false;  ///< bus off
    bool leaving = false;  ///< its link is closed
    std::int64_t back_at = INT64_MAX;  ///< when bus off ends
    std::int64_t hold_until = INT64_MIN;  ///< does not start a frame before
    /// of the frame at the front of `outgoing`
    bool delayed = false;
    bool doubled = false;
    bool counted = false;
    Frame babble;
    std::int64_t babble_period = 0;
    std::int64_t babble_at = 0;

    std::atomic<bool> cut{false};  ///< written by anyone
    std::atomic<bool> wants_restart{false};  ///< written by the sending thread
    std::atomic<State> state{State::active};
    std::atomic<std::uint32_t> counters{0};  ///< tec << 16 | rec, for readers in other threads
    std::atomic<std::uint64_t> sent{0};
    std::atomic<std::uint64_t> sent_bytes{0};
    std::atomic<std::uint64_t> received{0};
    std::atomic<std::uint64_t> received_bytes{0};
    std::atomic<std::uint64_t> lost{0};

    std::atomic<std::uint64_t> thrown_away{0};
    std::atomic<std::uint64_t> errors{0};
    std::atomic<std::uint64_t> bus_offs{0};
    std::atomic<std::uint64_t> restarts{0};
    std::atomic<std::uint64_t> dropped{0};  ///< written by the sending thread
};

class Bus {
public:
    Bus(std::string name, std::uint32_t bit_rate, std::uint32_t data_rate, bool fd);

    /// Returns the bus of that name, created if necessary. It lives as long as one of its links.
    /// [setup]
    static std::shared_ptr<Bus> find(const std::string& name, const Options&, std::string& problem);

    void add(Node&);  ///< [setup]
    /// Removes a node; its queued frames are still sent, as by a controller whose program ended.
    /// [setup]
    void remove(std::unique_ptr<Node>);

    /// Processes the bus up to `now_ns`, unless another thread is doing so. [realtime]
    void pump(std::int64_t now_ns) noexcept;
    /// Returns `now_ns`, or for `unclocked` the newest time known to the bus. [any]
    std::int64_t time(std::int64_t now_ns) const noexcept {
        return now_ns == unclocked ? latest_.load(std::memory_order_relaxed) : now_ns;
    }
    /// Notes that frames were queued; on a bus without a bit rate it delivers them. [realtime]
    void sent(std::int64_t now_ns) noexcept;

    /// Calls `change` while no thread pumps. [setup]
    template <class Change>
    auto exclusively(Change&& change) {
        const Hold hold(*this);
        return change();
    }

    using Disturbances = link::Disturbances<Disturbance>;
    Disturbances disturbances;  ///< only within exclusively(), as the next one
    std::vector<Node*> nodes;

    const std::string name;
    const std::uint32_t bit_rate, data_rate;  ///< bit_rate 0: frames take no time
    const bool fd;
    double load() const noexcept { return load_.load(std::memory_order_relaxed); }
    void publish(Node&) noexcept;  ///< publishes counters and the state derived from them

private:
    struct Hold {
        explicit Hold(Bus&) noexcept;
        ~Hold();
        Bus& bus;
    };
    struct Candidate {
        Node* node = nullptr;
        const Frame* frame = nullptr;
        bool babbling = false;
    };
    struct Arbitration {
        Candidate winner;
        std::uint32_t rank = UINT32_MAX;  ///< of the winner's frame
        unsigned acknowledging = 0;  ///< nodes that can acknowledge, the sender included
    };

    void work(std::int64_t now) noexcept;
    void work_untimed(std::int64_t now) noexcept;
    void recover(std::int64_t now) noexcept;
    std::int64_t earliest() noexcept;
    void transmit(std::int64_t start, std::int64_t now) noexcept;
    Arbitration arbitrate(std::int64_t start, std::int64_t now) noexcept;
    void send_alone(Node&, std::int64_t start, std::int64_t now) noexcept;
    bool also_sends(Node&, const Arbitration&, std::int64_t start) const noexcept;
    bool collides(const Arbitration&, std::int64_t start) const noexcept;
    void fail_to_acknowledge(const Candidate&, std::int64_t start, std::int64_t now) noexcept;
    void destroy(const Arbitration&, bool collision, std::int64_t start) noexcept;
    void count_protocol_error(const Candidate&, bool sending, std::int64_t noticed) noexcept;
    void discard_single_shot(const Candidate&) noexcept;
    void credit_receivers(const Node& sender) noexcept;
    void duplicate(const Candidate&, std::int64_t end) noexcept;
    void complete(const Arbitration&, std::int64_t start, std::int64_t end) noexcept;
    static bool is_ready(Node&, std::int64_t start) noexcept;
    void deliver(Node& from, const Frame&, std::int64_t time) noexcept;
    void done(const Candidate&, std::int64_t time) noexcept;
    void failed(Node&, std::int64_t time) noexcept;
    void event(Node&, std::uint32_t error_class, std::int64_t time) noexcept;
    void occupy(std::int64_t start, std::int64_t end) noexcept;
    bool hears(const Node&) const noexcept;
    bool discard_expired(std::int64_t start) noexcept;
    bool was_idle(std::int64_t from, std::int64_t until) const noexcept;
    void discard(Node&) noexcept;
    Disturbances::Active* struck(const Candidate&, std::int64_t start) noexcept;
    std::int64_t bits(unsigned count) const noexcept { return duration_ns({count, 0}, bit_rate); }

    std::vector<std::unique_ptr<Node>> leaving_;  ///< [setup]
    std::atomic_flag pumping_;
    std::atomic<std::int64_t> latest_{INT64_MIN};
    std::atomic<std::uint64_t> calls_{0};  ///< of sent(): a pump that sees it change checks again
    std::int64_t free_at_ = INT64_MIN;  ///< the bus is idle from here on
    std::atomic<std::int64_t> worked_until_{INT64_MIN};
    std::int64_t window_start_ = INT64_MIN;
    std::int64_t busy_ns_ = 0;
    std::atomic<double> load_{0.0};
    /// of the last frames, for windows that require an idle bus
    std::array<std::int64_t, 512> starts_{};
    std::size_t started_ = 0;
};

}  // namespace hal::can::simbus
