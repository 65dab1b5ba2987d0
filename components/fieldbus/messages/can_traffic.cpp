// SPDX-License-Identifier: MIT
#include <array>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <vector>

#include "hal/component.hpp"
#include "link/can.hpp"
#include "message_fields.hpp"

namespace {

struct CanTraffic : hal::Component {
    using Component::Component;

    hal::TextArgument address{*this,
                              "link",
                              "sim:can0",
                              "address of the bus, as in sim:can0 or can:can0",
                              {.per_instance = true}};
    hal::Argument id{*this,
                     "id",
                     0x100,
                     "identifier of the first message",
                     {.per_instance = true, .min = 0, .max = 0x1fffffff}};
    hal::Argument count{*this,
                        "messages",
                        8,
                        "messages, each with an identifier and a node of its own",
                        {.per_instance = true, .min = 0, .max = 128}};
    hal::Argument length{*this,
                         "length",
                         8,
                         "bytes of data of each message",
                         {.per_instance = true, .min = 0, .max = 8}};

    hal::TextArgument data{*this,
                           "data",
                           "varied",
                           "varied: data change from message to message; longest: nearly the "
                           "largest number of stuff bits",
                           {.per_instance = true}};

    hal::Argument one_node{*this,
                           "one_node",
                           0,
                           "1: all messages are from one node, in order of their identifiers",
                           {.per_instance = true, .min = 0, .max = 1}};

    hal::In<bool> enable{*this, "enable", "FALSE: no messages", {.initial = true}};
    hal::Param<double> period{*this,
                              "period",
                              "time between two releases of all messages together",
                              {.initial = 0.01, .unit = "s"}};
    hal::Out<std::uint64_t> released{*this, "released", "messages released"};
    hal::Out<std::uint64_t> sent{*this, "sent", "messages that were on the bus"};
    hal::Out<std::uint64_t> dropped{*this, "dropped",
                                    "messages not queued: queue full, bus down or off"};
    hal::Out<double> worst{*this,
                           "worst-response",
                           "longest time from a release to the end of a message",
                           {.unit = "s"}};

    hal::Function run{*this, "update", &CanTraffic::update,
                      "releases the messages when they are due"};

    void start() {
        if (data.get() != "varied" && data.get() != "longest") {
            throw hal::ArgumentError("data",
                                     "data=" + data.get() + " is unknown; write varied or longest");
        }
        varied_ = data.get() == "varied";
        first_ = hal::messages::identifier(id, count > 0 ? count - 1 : 0);
        messages_.assign(static_cast<std::size_t>(count), {});
        nodes_.resize(one_node != 0 ? std::min<std::size_t>(messages_.size(), 1)
                                    : messages_.size());
        for (Node& node : nodes_) {
            auto opened = hal::can::open(
                address.get(), {.own_frames = true, .send_capacity = 256, .receive_capacity = 256});
            if (!opened) throw std::runtime_error(opened.problem);
            node.link = std::move(opened.link);
            node.first = static_cast<std::size_t>(&node - nodes_.data());
            node.end = one_node != 0 ? messages_.size() : node.first + 1;
            const hal::can::Filter own{.id = first_ + static_cast<std::uint32_t>(node.first),
                                       .mask = one_node != 0 ? 0 : 0x1fffffffU,
                                       .extended = first_ > 0x7ff};
            node.link->set_filters(std::span(&own, 1));
        }
    }
    void stop() noexcept { nodes_.clear(); }

    void update(hal::Cycle cycle) noexcept {
        const std::int64_t now = cycle.start_ns();
        const double every = period * 1e9;
        bool due = false;
        if (enable && every >= 1.0 && every < 1e18) {
            const auto step = static_cast<std::int64_t>(std::llround(every));
            if (!started_) {
                begin_ = now;
                started_ = true;
            }
            const std::int64_t instant = (now - begin_) / step;
            due = instant != last_;
            last_ = instant;
        }
        std::uint64_t all_sent = 0;
        std::uint64_t all_dropped = 0;
        for (Node& node : nodes_) {
            work(node, due, now);
            const auto statistics = node.link->statistics();
            all_sent += statistics.sent;
            all_dropped += statistics.dropped;
        }
        sent = all_sent;
        dropped = all_dropped + busy_;
    }

private:
    static constexpr std::size_t max_waiting = 8;
    struct Node {
        std::unique_ptr<hal::can::Link> link;
        std::size_t first = 0;
        std::size_t end = 0;  // of messages_
    };
    /// The last releases of a message without an echo. A link without echoes never removes them.
    struct Message {
        std::array<std::int64_t, max_waiting> release{};
        std::uint64_t queued = 0;
        std::uint64_t done = 0;
    };
    void work(Node& node, bool due, std::int64_t now) noexcept {
        while (node.link->receive(buffer_, now)) {
            const std::size_t number = buffer_.id - first_;
            if (!buffer_.own || number >= messages_.size()) continue;
            Message& message = messages_[number];
            if (message.done == message.queued) continue;
            worst = std::fmax(
                worst, 1e-9 * static_cast<double>(buffer_.time_ns -
                                                  message.release[message.done++ % max_waiting]));
        }
        for (std::size_t i = node.first; due && i < node.end; ++i) {
            release(node, i, now);
        }
        node.link->flush(now);
    }
    void release(Node& node, std::size_t number, std::int64_t now) noexcept {
        hal::can::Frame frame;
        frame.id = first_ + static_cast<std::uint32_t>(number);
        frame.extended = first_ > 0x7ff;
        frame.length = static_cast<std::uint8_t>(length);
        // Data that change from message to message, so that the number of stuff bits does, too (G.
        // Marsaglia, Xorshift RNGs, 2003).
        random_ ^= random_ << 13;
        random_ ^= random_ >> 7;
        random_ ^= random_ << 17;
        for (unsigned n = 0; n < frame.length; ++n) {
            frame.data[n] =
                varied_ ? static_cast<std::uint8_t>(random_ >> (8 * n)) : std::uint8_t{0x3c};
        }
        released = released + 1;
        if (node.link->statistics().queued >= max_waiting * (node.end - node.first)) {
            ++busy_;
            return;
        }
        if (node.link->send(frame, now) != hal::can::Sent::queued) return;
        Message& message = messages_[number];
        if (message.queued - message.done == max_waiting) {
            ++message.done;
        }
        message.release[message.queued++ % max_waiting] = now;
    }

    std::vector<Node> nodes_;
    std::vector<Message> messages_;
    std::uint64_t busy_ = 0;
    hal::can::Frame buffer_;
    std::uint64_t random_ = 0x9E3779B97F4A7C15u;
    std::uint32_t first_ = 0;
    std::int64_t begin_ = 0;
    std::int64_t last_ = -1;
    bool started_ = false;
    bool varied_ = true;
};

}  // namespace

HAL_COMPONENT(CanTraffic, "can_traffic", "The load of other nodes on a CAN bus", R"(
`messages=` messages with consecutive identifiers, each from a node of its own, are released
together at multiples of `period`: the critical instant of the response-time analysis for every
message with a higher identifier. Their data change from message to message, always in the same way;
with `data=longest` each has nearly as many stuff bits as a message can have.

`worst-response` is the longest time from a release to the last bit of a message on the bus; it must
not exceed the computed response time (`hal canopen plan`); 0 on a bus that does not report what was
sent. A message that is released while eight of its predecessors wait is dropped. With `one_node=1`
all messages come from one node.

    loadrt can_traffic names=others link=sim:can0 id=0x200 messages=18
    addf others.update bus
    setp others.period 0.01013
)")
