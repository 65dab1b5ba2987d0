// SPDX-License-Identifier: MIT
#include <time.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <memory>
#include <mutex>
#include <optional>

#include "dds/field_pins.hpp"
#include "dds/outbox.hpp"
#include "dds/topic_connection.hpp"

namespace {

using namespace hal::dds;

class DdsPublish : public hal::Component, private Listener, private Served {
public:
    explicit DdsPublish(const hal_host* host) : Component(host) {
        if (!(rate_ >= 0)) {
            throw hal::ArgumentError(
                "rate", "rate= is negative; write samples per second, or 0 for every cycle");
        }
    }

    void start() {
        connection_.open(arguments_, settings_, *this,
                         [this](Participant& p) { return p.writer(topic_, quality_, this); });
    }
    void stop() noexcept { connection_.close(*this); }

    /// Stores the pins into the next slot of the outbox, every n-th cycle. [realtime]
    void publish(hal::Cycle cycle) noexcept {
        if (cycle.period_ns() != period_) {
            period_ = cycle.period_ns();
            const double cycles = rate_ > 0 ? 1e9 / (rate_ * static_cast<double>(period_)) : 1;
            every_ = static_cast<std::int64_t>(std::clamp(std::round(cycles), 1.0, 1e12));
            left_ = 0;
        }
        if (left_-- > 0) return;
        left_ = every_ - 1;
        if (enable) {
            queue_sample(cycle.start_ns());
        }
        // After the sample, so that a reader of this sees the sample too.
        due_.store(cycle.start_ns() + every_ * period_, std::memory_order_release);
        sent = seen_sent_(sent_.load(std::memory_order_relaxed));
        rejected = seen_rejected_(rejected_.load(std::memory_order_relaxed));
        matched = connection_.matched_of_cycle();
        wrong_type = connection_.wrong_type_of_cycle();
    }

private:
    /// Stores the pins into the next slot of the outbox. [realtime]
    void queue_sample(std::int64_t now) noexcept {
        std::uint8_t* const slot = outbox_.begin();
        bool has_space = slot != nullptr;
        hal::journaled(has_space);
        if (!has_space || slot == nullptr) {
            dropped = dropped + 1;
            return;
        }
        fields_.store(slot);
        outbox_.commit(now);
        if (hal::is_executed_again()) {
            outbox_.take();  // nothing is published again
        }
    }
    static std::int64_t clock(clockid_t id) noexcept {
        timespec t{};
        clock_gettime(id, &t);
        return std::int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec;
    }

    /// Writes the queued samples. Returns the time of the next call, shortly before the cycle that
    /// makes the next sample: polling the outbox for a moment replaces a wake-up by the cycle,
    /// which would cost the cycle a system call.
    std::int64_t serve(std::int64_t now) noexcept override {
        const std::int64_t due = due_.load(std::memory_order_acquire);
        bool found = false;
        std::int64_t made = 0;
        if (now >= flush_at_) {
            flush_at_ = now + 500'000'000;
            arguments_.flush_log();
        }
        for (std::span<std::uint8_t> bytes; !(bytes = outbox_.front(made)).empty();
             outbox_.take()) {
            found = true;
            write(bytes, made);
        }
        if (found) {
            // Polling for a sample costs CPU time, polling after it adds latency: the target is 15
            // us of polling.
            const std::int64_t looked = expected_ == made ? now - since_ : 0;
            if (looked <= 0) {
                lead_ -= 4'000;
            } else {
                lead_ += (looked - 15'000) / 8;
            }
            lead_ = std::clamp<std::int64_t>(lead_, -150'000, 150'000);
            expected_ = 0;
            return now;  // once more, because `due` may be older than the sample
        }
        // otherwise the cycle runs on a virtual clock
        const bool ours = std::abs(due - now) < 2'000'000'000;
        if (!ours) return now + 1'000'000;
        if (due + lead_ > now) {
            expected_ = 0;
            return std::min(due + lead_, now + 20'000'000);
        }
        if (expected_ != due) {
            expected_ = due;
            since_ = now;
        }
        if (now - since_ < 60'000) {
            return now;  // poll again
        }
        return now + (now - due < 5'000'000 ? 100'000 : 5'000'000);
    }

    void write(std::span<std::uint8_t> bytes, std::int64_t made) noexcept {
        const std::int64_t ago = clock(CLOCK_MONOTONIC) - made;
        const std::int64_t real = clock(CLOCK_REALTIME);
        const std::int64_t source = ago >= 0 && ago < 2'000'000'000 ? real - ago : real;
        if (schema_.stamp != 0) {
            const auto sec = static_cast<std::int32_t>(source / 1'000'000'000);
            const auto nanosec = static_cast<std::uint32_t>(source % 1'000'000'000);
            std::memcpy(bytes.data() + schema_.stamp, &sec, sizeof sec);
            std::memcpy(bytes.data() + schema_.stamp + 4, &nanosec, sizeof nanosec);
        }
        (connection_.endpoint().write(bytes, source) ? sent_ : rejected_)
            .fetch_add(1, std::memory_order_relaxed);
    }

    void on_event(Event e, int count, const std::string& text) noexcept override {
        connection_.handle(
            arguments_, e, count, text,
            "topic '" + topic_.shown + "': a subscriber requests a QoS that is not offered: ");
    }

    Arguments arguments_{*this};
    hal::RealArgument rate_{*this, argument::rate, 100,
                            "samples per second, rounded to cycles; 0: every cycle"};
    hal::Function publish_{*this, "", &DdsPublish::publish, "samples the pins, every n-th cycle"};

    const Schema schema_ = arguments_.schema();
    const TopicType topic_ = arguments_.topic(schema_);
    const Quality quality_ = arguments_.quality();
    const Settings settings_ = arguments_.participant.settings();

    FieldPins<HAL_DIR_IN> fields_{*this, publish_, schema_, "field of the topic"};
    hal::In<bool> enable{
        *this, publish_, "enable", "TRUE: samples are published", {.initial = true}};

    hal::Out<std::uint32_t> matched{*this, publish_, "matched", "matched subscribers"};
    hal::Out<std::uint64_t> sent{*this, publish_, "sent", "samples written"};
    hal::Out<std::uint64_t> dropped{*this, publish_, "dropped",
                                    "samples lost because the queue to the DDS thread was full"};
    hal::Out<std::uint64_t> rejected{
        *this, publish_, "rejected",
        "samples lost because the history was full: a reliable subscriber does not keep up"};
    hal::Out<bool> wrong_type{*this, publish_, "wrong-type",
                              "a subscriber uses this topic with another type"};

    // The cycle's
    std::int64_t period_ = 0;
    std::int64_t every_ = 1;
    std::int64_t left_ = 0;
    hal::JournaledValue<std::uint64_t> seen_sent_, seen_rejected_;
    // Between the cycle and the DDS thread
    Outbox outbox_{schema_.sample, 64};
    std::atomic<std::int64_t> due_{0};  // when the next sample is made
    std::atomic<std::uint64_t> sent_{0};
    std::atomic<std::uint64_t> rejected_{0};
    // The DDS thread's
    std::int64_t lead_ = 0;  // start of polling, relative to the beginning of the cycle
    std::int64_t flush_at_ = 0;
    std::int64_t expected_ = 0;
    std::int64_t since_ = 0;  // the cycle whose sample it polls for, and since when

    TopicConnection<Writer> connection_;
};

}  // namespace

HAL_COMPONENT(DdsPublish, "dds_publish", "Publishes a group of pins as a DDS topic", R"(
The values of all fields, sampled in the same cycle, are one sample of a typed topic: final, without
a key, XCDR1. The cycle only stores them into a queue; a thread of the process, not a real-time one,
writes them. `hal doc dds_subscribe` describes the subscriber.

    loadrt dds_publish topic=arm/state names=state fields=angle:float,ready:bit,joint:float*6 rate=0 deadline_ms=20
    addf state servo-thread
    net angle  => state.angle
    net j0     => state.joint-0

NaN and infinity are sent as they are; `dds_subscribe` does not accept them unless it has `finite=0`.

`rate` is in samples per second; 0 is every cycle. Nothing leaves the machine without `interfaces=`.

A publisher and a subscriber match when topic, type and domain are equal. Without `type=` the type
name is derived from names and types of the fields, so that different groups never exchange data;
both sides then report both types (`wrong-type`).

ROS 2 sees `ros=std_msgs/Float64 topic=/arm/angle` as its topic /arm/angle. The fields are then
those of the message: `data`; `linear-x` to `angular-z`; `force-x` to `torque-z`; of a JointState
NAME-position, NAME-velocity, NAME-effort for each of `joints=`; `height`, `width`, `step` of an
Image, which is sent without pixels. The stamp of the header is the time of the cycle.
)")
