// SPDX-License-Identifier: MIT
#include "can/journal/ordered_link.hpp"

#include <optional>
#include <utility>

#include "link/call_order.hpp"
#include "link/simulation.hpp"

namespace hal::can::journal {

namespace {

using link::CallOrder;
using link::JournaledCall;
using link::OrderedCall;
using Wait = OrderedCall::Wait;

/// Fault injection in the order of the calls.
class OrderedSimulation final : public Simulation {
public:
    OrderedSimulation(CallOrder& order, Simulation& bus) : order_(order), bus_(bus) {}

    int node() const noexcept override { return bus_.node(); }
    void seed(std::uint64_t value) override {
        const OrderedCall call(order_, Wait::made);
        bus_.seed(value);
    }
    int disturb(const Disturbance& what) override {
        const OrderedCall call(order_, Wait::made);
        return bus_.disturb(what);
    }
    std::uint64_t hits(int number) const override {
        const OrderedCall call(order_, Wait::made);
        return bus_.hits(number);
    }
    void calm() override {
        const OrderedCall call(order_, Wait::made);
        bus_.calm();
    }
    void babble(const Frame& frame, std::int64_t period_ns) override {
        const OrderedCall call(order_, Wait::made);
        bus_.babble(frame, period_ns);
    }
    void cut(int node, bool is_cut) override {
        const OrderedCall call(order_, Wait::made);
        bus_.cut(node, is_cut);
    }
    void set_counters(int node, unsigned send_errors, unsigned receive_errors) override {
        const OrderedCall call(order_, Wait::made);
        bus_.set_counters(node, send_errors, receive_errors);
    }
    std::int64_t time_ns() const noexcept override {
        return link::ordered_value(order_, [this] {
            return bus_.time_ns();
        }, [](JournaledCall& call, std::int64_t& time) { call.time(time, 0); });
    }

private:
    CallOrder& order_;
    Simulation& bus_;
};

class OrderedLink final : public Link {
public:
    OrderedLink(std::shared_ptr<CallOrder> order, std::unique_ptr<Link> inner)
        : order_(std::move(order)), inner_(std::move(inner)) {
        pending_.reserve(max_pending);
        if (Simulation* const bus = inner_->simulation()) {
            simulation_.emplace(*order_, *bus);
        }
    }
    ~OrderedLink() override {
        const OrderedCall call(*order_, Wait::made);
        inner_.reset();
    }

    Sent send(const Frame& frame, std::int64_t now_ns) noexcept override {
        return send({frame, std::nullopt, now_ns});
    }
    Sent send_within(const Frame& frame, const Window& window,
                     std::int64_t now_ns) noexcept override {
        return send({frame, window, now_ns});
    }
    void flush(std::int64_t now_ns) noexcept override {
        const OrderedCall call(*order_, Wait::bounded);
        if (!call.is_made()) return;
        send_pending();
        inner_->flush(now_ns);
    }
    std::size_t receive(std::span<Frame> frames, std::int64_t now_ns) noexcept override {
        const OrderedCall call(*order_, Wait::bounded);
        return call.is_made() ? inner_->receive(frames, now_ns) : 0;
    }

    Statistics statistics() const noexcept override {
        return link::ordered_value(*order_, [this] {
            return inner_->statistics();
        }, [](JournaledCall& call, Statistics& value) { call.bytes(&value, sizeof value); });
    }
    State state() const noexcept override {
        return link::ordered_value(*order_, [this] { return inner_->state(); },
                                   [](JournaledCall& call, State& value) { call.number(value); });
    }
    void restart() noexcept override {
        const OrderedCall call(*order_, Wait::made);
        inner_->restart();
    }

    bool set_filters(std::span<const Filter> filters) override {
        const OrderedCall call(*order_, Wait::made);
        return inner_->set_filters(filters);
    }
    const Description& description() const noexcept override { return inner_->description(); }
    std::vector<DeliveryTime> delivery_times() const override { return inner_->delivery_times(); }
    bool wait(std::int64_t at_most_ns) override { return inner_->wait(at_most_ns); }
    std::int64_t closing_ns() const noexcept override { return inner_->closing_ns(); }
    Simulation* simulation() noexcept override { return simulation_ ? &*simulation_ : nullptr; }

private:
    /// A frame that was sent while another thread had the bus for too long.
    struct Pending {
        Frame frame;
        std::optional<Window> window;
        std::int64_t now_ns = 0;
    };
    static constexpr std::size_t max_pending = 512;

    Sent send(const Pending& frame) noexcept {
        const OrderedCall call(*order_, Wait::bounded);
        if (call.is_made()) {
            send_pending();
            return send_now(frame);
        }
        if (pending_.size() == max_pending) return Sent::full;
        pending_.push_back(frame);
        return Sent::queued;
    }
    Sent send_now(const Pending& f) noexcept {
        return f.window ? inner_->send_within(f.frame, *f.window, f.now_ns)
                        : inner_->send(f.frame, f.now_ns);
    }
    void send_pending() noexcept {
        for (const Pending& frame : pending_) {
            send_now(frame);
        }
        pending_.clear();
    }

    const std::shared_ptr<CallOrder> order_;
    std::unique_ptr<Link> inner_;
    std::optional<OrderedSimulation> simulation_;
    std::vector<Pending> pending_;  // the sending thread's own; its capacity is fixed
};

}  // namespace

Opened open_ordered(std::string_view address, const std::function<Opened()>& open) {
    if (link::journal_mode() == link::JournalMode::none) return open();
    std::shared_ptr<CallOrder> order = CallOrder::of("can", address);
    const OrderedCall call(*order, Wait::made);
    Opened opened = open();
    if (!opened) return opened;
    return {std::make_unique<OrderedLink>(std::move(order), std::move(opened.link)), {}};
}

}  // namespace hal::can::journal
