// SPDX-License-Identifier: MIT
#include "ethernet/journal/ordered_port.hpp"

#include <algorithm>
#include <cstring>
#include <utility>
#include <vector>

#include "link/call_order.hpp"
#include "link/segment.hpp"

namespace hal::ethernet::journal {

namespace {

using link::CallOrder;
using link::JournaledCall;
using link::OrderedCall;
using Wait = OrderedCall::Wait;

/// Fault injection in the order of the calls.
class OrderedSegment final : public Segment {
public:
    OrderedSegment(CallOrder& order, Segment& segment) : order_(order), segment_(segment) {}

    int port() const noexcept override { return segment_.port(); }
    void seed(std::uint64_t value) override {
        const OrderedCall call(order_, Wait::made);
        segment_.seed(value);
    }
    int disturb(const Disturbance& what) override {
        const OrderedCall call(order_, Wait::made);
        return segment_.disturb(what);
    }
    std::uint64_t hits(int number) const override {
        const OrderedCall call(order_, Wait::made);
        return segment_.hits(number);
    }
    void calm() override {
        const OrderedCall call(order_, Wait::made);
        segment_.calm();
    }
    void babble(int port, std::span<const std::uint8_t> frame, std::int64_t period_ns) override {
        const OrderedCall call(order_, Wait::made);
        segment_.babble(port, frame, period_ns);
    }
    void cut(int port, bool is_cut) override {
        const OrderedCall call(order_, Wait::made);
        segment_.cut(port, is_cut);
    }
    std::int64_t time_ns() const noexcept override {
        return link::ordered_value(order_, [this] {
            return segment_.time_ns();
        }, [](JournaledCall& call, std::int64_t& time) { call.time(time, 0); });
    }
    bool respond(Responder* responder) override {
        const OrderedCall call(order_, Wait::made);
        return segment_.respond(responder);
    }

private:
    CallOrder& order_;
    Segment& segment_;
};

class OrderedPort final : public Port {
public:
    OrderedPort(std::shared_ptr<CallOrder> order, std::unique_ptr<Port> inner)
        : order_(std::move(order)), inner_(std::move(inner)), pending_(max_pending) {
        if (Segment* const segment = inner_->segment()) {
            segment_ = std::make_unique<OrderedSegment>(*order_, *segment);
        }
    }
    ~OrderedPort() override {
        const OrderedCall call(*order_, Wait::made);
        inner_.reset();
    }

    const Address& address() const noexcept override { return inner_->address(); }

    Sent send(std::span<const std::uint8_t> frame, const Launch& launch,
              std::int64_t now_ns) noexcept override {
        const OrderedCall call(*order_, Wait::bounded);
        if (call.is_made()) {
            send_pending();
            return inner_->send(frame, launch, now_ns);
        }
        if (frame.size() > max_frame) return Sent::rejected;
        if (pending_count_ == pending_.size()) return Sent::full;
        Pending& pending = pending_[pending_count_++];
        std::copy(frame.begin(), frame.end(), pending.bytes.begin());
        pending.length = frame.size();
        pending.launch = launch;
        pending.now_ns = now_ns;
        return Sent::queued;
    }
    std::optional<Arrival> receive(std::int64_t now_ns) noexcept override {
        const OrderedCall call(*order_, Wait::bounded);
        return call.is_made() ? inner_->receive(now_ns) : std::nullopt;
    }
    bool wait(std::int64_t until_ns) noexcept override {
        return link::ordered_value(*order_, [this, until_ns] {
            return inner_->wait(until_ns);
        }, [](JournaledCall& call, bool& has_frame) { call.number(has_frame); });
    }

    Statistics statistics() const noexcept override {
        return link::ordered_value(*order_, [this] {
            return inner_->statistics();
        }, [](JournaledCall& call, Statistics& value) { call.bytes(&value, sizeof value); });
    }
    const Description& description() const noexcept override { return inner_->description(); }
    int descriptor() const noexcept override { return inner_->descriptor(); }
    Segment* segment() noexcept override { return segment_.get(); }

private:
    /// A frame that was sent while another thread had the segment for too long.
    struct Pending {
        std::array<std::uint8_t, max_frame> bytes;
        std::size_t length = 0;
        Launch launch;
        std::int64_t now_ns = 0;
    };
    static constexpr std::size_t max_pending = 32;

    void send_pending() noexcept {
        for (std::size_t i = 0; i < pending_count_; ++i) {
            const Pending& pending = pending_[i];
            inner_->send({pending.bytes.data(), pending.length}, pending.launch, pending.now_ns);
        }
        pending_count_ = 0;
    }

    const std::shared_ptr<CallOrder> order_;
    std::unique_ptr<Port> inner_;
    std::unique_ptr<OrderedSegment> segment_;
    std::vector<Pending> pending_;  // the sending thread's own, as the next one
    std::size_t pending_count_ = 0;
};

}  // namespace

Opened open_ordered(std::string_view address, const std::function<Opened()>& open) {
    if (link::journal_mode() == link::JournalMode::none) return open();
    std::shared_ptr<CallOrder> order = CallOrder::of("ethernet", address);
    const OrderedCall call(*order, Wait::made);
    Opened opened = open();
    if (!opened) return opened;
    return {std::make_unique<OrderedPort>(std::move(order), std::move(opened.port)), {}};
}

}  // namespace hal::ethernet::journal
