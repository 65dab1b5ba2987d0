// SPDX-License-Identifier: MIT
#include "scocan_link.hpp"

#include <ctime>

#include "discipline/slot_exchange.hpp"
#include "link/filtering.hpp"
#include "text/numbers.hpp"
#include "text/quoting.hpp"

namespace hal::can::scocan {

namespace {

/// Identifiers of CANopen that the discipline uses itself, and those in their place on the bus,
/// from the unassigned range.
struct Replaced {
    std::uint32_t here, there;
};
constexpr Replaced replaced[] = {{0x000, 0x77a}, {0x7e4, 0x77b}, {0x7e5, 0x77c}};

std::uint32_t on_bus(std::uint32_t id) noexcept {
    for (const auto& r : replaced) {
        if (id == r.here) return r.there;
    }
    return id;
}
std::uint32_t of_user(std::uint32_t id) noexcept {
    for (const auto& r : replaced) {
        if (id == r.there) return r.here;
    }
    return id;
}

struct Place {
    std::string node;
    std::uint32_t slot = SlotFrame::any_slot;
    std::string problem{};
};

Place parse(const std::string& text) {
    const auto question = std::min(text.find('?'), text.size());
    Place target{text.substr(0, question)};
    if (question == text.size()) return target;
    const std::string option = text.substr(question + 1);

    const std::string value = option.substr(std::min(option.find('=') + 1, option.size()));
    if (!parse_whole(value, target.slot) || target.slot == 0 || target.slot > 255) {
        target.problem = "invalid slot '" + value + "'; write the number of a private slot of " +
                         target.node + ", as in scocan:" + target.node + "?slot=3";
    }
    return target;
}

Description description_of(const Place& target) {
    Description d;
    d.address = "scocan:" + target.node;
    if (target.slot != SlotFrame::any_slot) {
        d.address += "?slot=" + std::to_string(target.slot);
    }
    d.transport = "time slots on CAN (SCoCAN)";
    d.in_slots = true;
    if (const auto exchange = slots_of(target.node)) {
        d.bit_rate = exchange->description.bit_rate;
        d.simulated = exchange->description.simulated;
    }
    d.has_stamps = true;
    return d;
}

class SlotLink final : public FilteringLink {
public:
    SlotLink(const Place& target, std::shared_ptr<SlotExchange> exchange, const Options& options)
        : place_(target),
          options_(options),
          exchange_(std::move(exchange)),
          user_(options.send_capacity, options.receive_capacity) {
        description_ = description_of(target);
    }
    ~SlotLink() override { exchange_->remove(user_); }
    bool join() { return exchange_->add(user_); }

    Sent send(const Frame& frame, std::int64_t) noexcept override {
        if (!frame.valid() || frame.fd || frame.extended || options_.listen_only) {
            return counting_.drop(Sent::rejected);
        }
        if (state() == State::down) return counting_.drop(Sent::down);
        SlotFrame outgoing{frame, place_.slot};
        outgoing.frame.id = on_bus(frame.id);
        if (!user_.outgoing.push(outgoing)) return counting_.drop(Sent::full);
        counting_.count_sent(frame);
        return Sent::queued;
    }
    void flush(std::int64_t) noexcept override {}
    std::size_t receive(std::span<Frame> frames, std::int64_t) noexcept override {
        std::size_t count = 0;
        for (Frame frame; count < frames.size() && user_.incoming.pop(frame);) {
            frame.id = of_user(frame.id);
            if (!filters_.pass(frame)) continue;
            counting_.count_received(frame);
            frames[count++] = frame;
        }
        return count;
    }

    Statistics statistics() const noexcept override {
        auto s = counting_.read(user_.outgoing.size());
        s.lost += user_.lost.load(std::memory_order_relaxed);
        s.dropped += user_.rejected.load(std::memory_order_relaxed);
        s.state = state();
        return s;
    }
    State state() const noexcept override {
        return exchange_->state.load(std::memory_order_relaxed);
    }
    bool wait(std::int64_t at_most_ns) override {
        // the node does not wake a waiting thread: that would cost its cycle a system call
        constexpr std::int64_t step_ns = 100'000;
        for (; user_.incoming.size() == 0; at_most_ns -= step_ns) {
            if (at_most_ns <= 0) return false;
            const timespec pause{0, static_cast<long>(std::min(step_ns, at_most_ns))};
            nanosleep(&pause, nullptr);
        }
        return true;
    }

private:
    const Place place_;
    const Options options_;
    const std::shared_ptr<SlotExchange> exchange_;
    SlotUser user_;
};

}  // namespace

bool is_own_option(std::string_view key) { return key == "slot"; }
std::string own_options() { return "slot"; }

Description describe(const std::string& target) { return description_of(parse(target)); }

Opened open(const std::string& text, const Options& options) {
    const Place target = parse(text);
    if (target.node.empty()) {
        return {nullptr, "missing name of the node; write scocan:motor"};
    }
    if (!target.problem.empty()) {
        return {nullptr, target.problem};
    }
    auto exchange = slots_of(target.node);
    if (!exchange) {
        std::string names;
        for (const auto& name : offered_slots()) {
            append_item(names, name);
        }
        return {nullptr,
                "no node '" + target.node + "' in this process; " +
                    (names.empty()
                         ? "load it before: loadrt scocan config=FILE.scocan node=" + target.node
                         : "nodes are " + names)};
    }
    auto link = std::make_unique<SlotLink>(target, std::move(exchange), options);
    if (!link->join()) {
        return {nullptr, "node '" + target.node + "' has 16 links already"};
    }
    return {std::move(link), {}};
}

}  // namespace hal::can::scocan
