// SPDX-License-Identifier: MIT
#include "sim_can.hpp"

#include <time.h>

#include <algorithm>

#include "can_bus.hpp"
#include "link/counting.hpp"

namespace hal::can::simbus {

namespace {

constexpr std::size_t max_filters = 1024;

class SimulatedLink final : public Link, public Simulation {
public:
    SimulatedLink(std::shared_ptr<Bus> bus, const Options& options)
        : bus_(std::move(bus)), owned_(std::make_unique<Node>(options)), node_(*owned_) {
        node_.fd = bus_->fd;
        node_.own_frames = options.own_frames;
        node_.error_frames = options.error_frames;
        node_.listen_only = options.listen_only;
        node_.restart_ms = options.restart_ms;
        description_ = describe(bus_->name);
        description_.bit_rate = bus_->bit_rate;
        description_.data_rate = bus_->data_rate;

        description_.fd = bus_->fd;
        description_.listen_only = options.listen_only;
        description_.has_windows = bus_->bit_rate != 0;
        bus_->add(node_);
    }
    ~SimulatedLink() override { bus_->remove(std::move(owned_)); }

    Sent send(const Frame& frame, std::int64_t now_ns) noexcept override {
        const Sent refusal = refuse(frame);
        if (refusal != Sent::queued) return drop(refusal);
        return queue({frame}, bus_->time(now_ns), now_ns);
    }
    Sent send_within(const Frame& frame, const Window& window,
                     std::int64_t now_ns) noexcept override {
        const Sent refusal = bus_->bit_rate == 0 ? Sent::rejected : refuse(frame);
        if (refusal != Sent::queued) return drop(refusal);
        const Outgoing outgoing{frame, window.last_start_ns, window.idle_from_ns,
                                window.idle_until_ns, window.single_shot};
        return queue(outgoing, std::max(window.not_before_ns, bus_->time(now_ns)), now_ns);
    }
    void flush(std::int64_t now_ns) noexcept override {
        bus_->pump(now_ns);
        bus_->sent(bus_->time(now_ns));
    }
    std::size_t receive(std::span<Frame> frames, std::int64_t now_ns) noexcept override {
        bus_->pump(now_ns);
        const auto now = bus_->time(now_ns);
        std::size_t count = 0;
        while (count < frames.size()) {
            const Frame* next = node_.incoming.front();
            if (next == nullptr || next->time_ns > now) break;
            trace(link::can_received, *next);
            frames[count++] = *next;
            node_.incoming.drop();
        }
        return count;
    }

    Statistics statistics() const noexcept override {
        const auto read = [](const auto& counter) {
            return counter.load(std::memory_order_relaxed);
        };
        const auto counters = read(node_.counters);
        Statistics s;
        s.state = state();
        s.send_errors = static_cast<std::uint8_t>(counters >> 16);
        s.receive_errors = static_cast<std::uint8_t>(counters & 0xff);
        s.sent = read(node_.sent);
        s.sent_bytes = read(node_.sent_bytes);
        s.received = read(node_.received);
        s.received_bytes = read(node_.received_bytes);
        s.lost = read(node_.lost);
        s.dropped = read(node_.dropped) + read(node_.thrown_away);
        s.errors = read(node_.errors);
        s.bus_offs = read(node_.bus_offs);
        s.restarts = read(node_.restarts);
        s.queued = static_cast<std::uint32_t>(node_.outgoing.size());
        s.load = bus_->load();
        return s;
    }
    State state() const noexcept override { return node_.state.load(std::memory_order_relaxed); }
    void restart() noexcept override { node_.wants_restart.store(true); }

    bool set_filters(std::span<const Filter> filters) override {
        if (filters.size() > max_filters) return false;
        std::vector<Filter> wanted(filters.begin(), filters.end());
        bus_->exclusively([&] { node_.filters.swap(wanted); });
        return true;
    }
    const Description& description() const noexcept override { return description_; }
    bool wait(std::int64_t at_most_ns) override {
        // Waiting threads are not woken: that would cost each cycle a system call.
        constexpr std::int64_t step_ns = 100'000;
        for (;;) {
            bus_->pump(unclocked);
            const Frame* next = node_.incoming.front();
            if (next != nullptr && next->time_ns <= bus_->time(unclocked)) return true;
            if (at_most_ns <= 0) return false;
            const timespec pause{0, static_cast<long>(std::min(step_ns, at_most_ns))};
            nanosleep(&pause, nullptr);
            at_most_ns -= step_ns;
        }
    }
    Simulation* simulation() noexcept override { return this; }

    int node() const noexcept override { return node_.number; }
    void seed(std::uint64_t value) override {
        bus_->exclusively([&] { bus_->disturbances.random.seed(value); });
    }
    int disturb(const Disturbance& what) override {
        return bus_->exclusively([&] { return bus_->disturbances.add(what); });
    }
    std::uint64_t hits(int number) const override {
        return bus_->exclusively([&] { return bus_->disturbances.hits(number); });
    }
    void calm() override {
        bus_->exclusively([&] {
            bus_->disturbances.clear();
            for (Node* n : bus_->nodes) {
                n->babble_period = 0;
                n->cut.store(false);
            }
        });
    }
    void babble(const Frame& frame, std::int64_t period_ns) override {
        bus_->exclusively([&] {
            node_.babble = frame;
            node_.babble_period = frame.valid() && period_ns > 0 ? period_ns : 0;
            node_.babble_at = bus_->time(unclocked);
        });
    }
    void cut(int node, bool is_cut) override {
        bus_->exclusively([&] {
            for (Node* n : bus_->nodes) {
                if (n->number == node) {
                    n->cut.store(is_cut, std::memory_order_relaxed);
                }
            }
        });
    }
    void set_counters(int node, unsigned send_errors, unsigned receive_errors) override {
        bus_->exclusively([&] {
            for (Node* n : bus_->nodes) {
                if (n->number == node) {
                    n->tec = std::min(send_errors, 255U);
                    n->rec = std::min(receive_errors, 255U);

                    bus_->publish(*n);
                }
            }
        });
    }
    std::int64_t time_ns() const noexcept override { return bus_->time(unclocked); }

private:
    Sent queue(Outgoing frame, std::int64_t time_ns, std::int64_t now_ns) noexcept {
        frame.time_ns = time_ns;
        frame.own = false;
        trace(link::can_sent, frame);
        if (node_.outgoing.push(frame)) return Sent::queued;
        flush(now_ns);
        return node_.outgoing.push(frame) ? Sent::queued : drop(Sent::full);
    }
    /// Returns why a frame is not sent; queued: it may be.
    Sent refuse(const Frame& frame) const noexcept {
        if (!frame.valid() || node_.listen_only || (frame.fd && !bus_->fd)) return Sent::rejected;
        return state() == State::bus_off ? Sent::bus_off : Sent::queued;
    }
    Sent drop(Sent why) noexcept {
        node_.dropped.fetch_add(1, std::memory_order_relaxed);
        return why;
    }

    const std::shared_ptr<Bus> bus_;
    std::unique_ptr<Node> owned_;
    Node& node_;
    Description description_;
};

}  // namespace

Description describe(const std::string& name) {
    return {.address = "sim:" + name,
            .transport = "bus in memory",
            .simulated = true,
            .in_memory = true,
            .has_stamps = true,
            .has_echo = true};
}

Opened open(const std::string& name, const Options& options) {
    if (name.empty()) {
        return {nullptr, "missing name of the bus; write sim:bus0"};
    }
    std::string problem;
    auto bus = Bus::find(name, options, problem);
    if (!bus) {
        return {nullptr, problem};
    }
    return {std::make_unique<SimulatedLink>(std::move(bus), options), {}};
}

}  // namespace hal::can::simbus
