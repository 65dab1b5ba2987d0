// SPDX-License-Identifier: MIT
#include <time.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <memory>
#include <mutex>
#include <optional>

#include "dds/attendance.hpp"
#include "dds/field_pins.hpp"
#include "dds/outbox.hpp"

namespace {

using namespace hal::dds;

class DdsPublish : public hal::Component, private Listener, private Served {
public:
    explicit DdsPublish(const hal_host* host) : Component(host) {
        if (!(rate_ >= 0)) throw hal::ArgumentError("rate", "rate= is below 0; write samples per second, or 0 for every cycle");
    }

    void start() {
        attendance_.begin(arguments_, settings_, *this, [this](Participant& p) { return p.writer(topic_, quality_, this); });
    }
    void stop() noexcept { attendance_.end(*this); }

    /// Stores the pins into the next place of the outbox, every n-th cycle. [realtime]
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
            if (std::uint8_t* to = outbox_.begin()) {
                fields_.store(to);
                outbox_.commit(cycle.start_ns());
            } else {
                dropped = dropped + 1;
            }
        }
        due_.store(cycle.start_ns() + every_ * period_, std::memory_order_release);  // after the sample: who sees this sees it
        sent = sent_.load(std::memory_order_relaxed);
        refused = refused_.load(std::memory_order_relaxed);
        matched = attendance_.matched();
        wrong_type = attendance_.wrong_type();
    }

private:
    static std::int64_t clock(clockid_t id) noexcept {
        timespec t{};
        clock_gettime(id, &t);
        return std::int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec;
    }

    /// Writes what waits, and says when the next is to be expected: shortly before the cycle that makes it, so that a short look into the
    /// outbox every now and then replaces being woken by the cycle, which would cost it a system call.
    std::int64_t serve(std::int64_t now) noexcept override {
        const std::int64_t due = due_.load(std::memory_order_acquire);
        bool               found = false;
        std::int64_t       made = 0;
        if (now >= flush_at_) flush_at_ = now + 500'000'000, arguments_.flush_log();
        for (std::span<std::uint8_t> bytes; !(bytes = outbox_.front(made)).empty(); outbox_.take()) {
            found = true;
            write(bytes, made);
        }
        if (found) {
            // Waiting for a sample costs time of a processor, coming after it delays it: it is aimed at looking for 15 us.
            const std::int64_t looked = expected_ == made ? now - since_ : 0;
            if (looked <= 0) lead_ -= 4'000;
            else lead_ += (looked - 15'000) / 8;
            lead_ = std::clamp<std::int64_t>(lead_, -150'000, 150'000);
            expected_ = 0;
            return now;  // once more, as `due` may be of before the sample
        }
        const bool ours = std::abs(due - now) < 2'000'000'000;  // else it is not this machine's clock, but a virtual one
        if (!ours) return now + 1'000'000;
        if (due + lead_ > now) {
            expected_ = 0;
            return std::min(due + lead_, now + 20'000'000);
        }
        if (expected_ != due) {
            expected_ = due;
            since_ = now;
        }
        if (now - since_ < 60'000) return now;  // at once again
        return now + (now - due < 5'000'000 ? 100'000 : 5'000'000);
    }

    void write(std::span<std::uint8_t> bytes, std::int64_t made) noexcept {
        const std::int64_t ago = clock(CLOCK_MONOTONIC) - made, real = clock(CLOCK_REALTIME);
        const std::int64_t source = ago >= 0 && ago < 2'000'000'000 ? real - ago : real;
        if (schema_.stamp != 0) {
            const auto sec = static_cast<std::int32_t>(source / 1'000'000'000);
            const auto nanosec = static_cast<std::uint32_t>(source % 1'000'000'000);
            std::memcpy(bytes.data() + schema_.stamp, &sec, sizeof sec);
            std::memcpy(bytes.data() + schema_.stamp + 4, &nanosec, sizeof nanosec);
        }
        (attendance_.endpoint().write(bytes, source) ? sent_ : refused_).fetch_add(1, std::memory_order_relaxed);
    }

    void on_event(Event e, int count, const std::string& words) noexcept override {
        attendance_.met(arguments_, e, count, words, "a subscriber of topic '" + topic_.name + "' asks for more than is offered: ");
    }

    Arguments         arguments_{*this};
    hal::RealArgument rate_{*this, "rate", 100, "samples per second, rounded to cycles; 0: every cycle"};
    hal::Function     publish_{*this, "", &DdsPublish::publish, "takes the pins' values, every n-th cycle"};

    const Schema    schema_ = arguments_.schema();
    const TopicType topic_ = arguments_.topic(schema_);
    const Quality   quality_ = arguments_.quality();
    const Settings  settings_ = arguments_.participant.settings();

    FieldPins<hal::In> fields_{*this, publish_, schema_, "field of the topic"};
    hal::In<bool>      enable{*this, publish_, "enable", "FALSE: nothing is published", {.initial = true}};

    hal::Out<std::uint32_t> matched{*this, publish_, "matched", "subscribers"};
    hal::Out<std::uint64_t> sent{*this, publish_, "sent", "samples written"};
    hal::Out<std::uint64_t> dropped{*this, publish_, "dropped", "samples the DDS thread was too slow to take"};
    hal::Out<std::uint64_t> refused{*this, publish_, "refused",
                                    "samples that a reliable subscriber, which does not keep up, has left no room for"};
    hal::Out<bool>          wrong_type{*this, publish_, "wrong-type", "somebody subscribes to this topic with another type"};

    // The cycle's
    std::int64_t period_ = 0, every_ = 1, left_ = 0;
    // Between the cycle and the DDS thread
    Outbox                     outbox_{schema_.sample, 64};
    std::atomic<std::int64_t>  due_{0};  // when the next sample is made
    std::atomic<std::uint64_t> sent_{0}, refused_{0};
    // The DDS thread's
    std::int64_t lead_ = 0;  // when it looks first, from the beginning of the cycle
    std::int64_t flush_at_ = 0;
    std::int64_t expected_ = 0, since_ = 0;  // the cycle it is looking for, and since when

    Attendance<Writer> attendance_;
};

}  // namespace

HAL_COMPONENT(DdsPublish, "dds_publish", "Publishes a group of pins as a DDS topic", R"(
The values of all fields, taken in one cycle, are one sample of a typed topic: final, without a key, XCDR1. The cycle only stores them into a
queue; a thread of the process, not a real-time one, writes them. `hal doc dds_subscribe` is the other side.

    loadrt dds_publish topic=arm/state names=state fields=angle:float,ready:bit,joint:float*6 rate=0 deadline_ms=20
    addf state servo-thread
    net angle  => state.angle
    net j0     => state.joint-0

`rate` is in samples per second; 0 is every cycle. Nothing leaves the machine unless `interfaces=` says so.

Two groups meet when topic, type and domain are equal. Without `type=` the type's name is made of names and types of the fields, so that
groups that differ never exchange anything; both sides then say which types they have (`wrong-type`).

ROS 2 sees `ros=std_msgs/Float64 topic=/arm/angle` as its topic /arm/angle. The fields are then the message's: `data`; `linear-x` to
`angular-z`; `force-x` to `torque-z`; of a JointState NAME-position, NAME-velocity, NAME-effort for each of `joints=`; `height`, `width`,
`step` of an Image, which is sent without pixels. The stamp of a header is the time of the cycle.
)")
