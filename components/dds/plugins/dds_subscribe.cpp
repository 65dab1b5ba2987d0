// SPDX-License-Identifier: MIT
#include <algorithm>
#include <atomic>
#include <cmath>
#include <memory>
#include <mutex>
#include <utility>

#include "dds/field_pins.hpp"
#include "dds/topic_connection.hpp"
#include "hal/age.hpp"
#include "hal/lasting_fault.hpp"
#include "hal/queue.hpp"

namespace {

using namespace hal::dds;

/// What is known about a sample.
struct SampleInfo {
    std::int64_t monotonic_ns = 0;  // reception time
    std::int64_t transit_ns = 0;    // its age at reception, by the writer's clock
    std::uint64_t sequence = 0;
    std::uint64_t lost = 0;
    std::uint64_t received = 0;
    std::uint64_t malformed = 0;
    bool clock_differs = false;
    // of a JointState, which several publishers may share
    bool is_complete = true;  // each joint has had a value
    std::size_t oldest_joint = 0;
    std::int64_t lag_ns = 0;  // from the newest value of that joint to this sample
};

/// The newest sample, for the cycle.
struct Message : SampleInfo {
    std::vector<hal_value> values;
};

class DdsSubscribe : public hal::Component, private Listener, private Served {
public:
    explicit DdsSubscribe(const hal_host* host) : Component(host) {
        if (timeout_ms_ == 0) {
            timeout_ = (arguments_.deadline_ms() > 0 ? arguments_.deadline_ms() : 1000) * 1'000'000;
        } else {
            timeout_ = timeout_ms_ * 1'000'000;
        }
        const std::string limit = std::to_string(timeout_ / 1'000'000) + " ms";
        stale_text_ = "no sample of topic '" + topic_.shown + "' for {} s (timeout " + limit +
                      "); its pins are not valid";
        for (const std::string& joint : schema_.names) {
            joint_texts_.push_back("no value of joint '" + joint + "' in topic '" + topic_.shown +
                                   "' for {} s (timeout " + limit +
                                   "); the pins of the topic are not valid");
        }
        joint_ns_.resize(schema_.names.size());
    }

    void start() {
        faults_ = hal::extension<hal_faults>("hal.faults/1");
        connection_.open(arguments_, settings_, *this,
                         [this](Participant& p) { return p.reader(topic_, quality_, this); });
    }
    void stop() noexcept { connection_.close(*this); }

    /// Sets the pins from the newest sample; without one within the timeout they are not valid.
    /// [realtime]
    void take(hal::Cycle cycle) noexcept {
        const bool is_fresh = receive();
        const Message& m = taken_;
        const std::int64_t now = cycle.start_ns();
        if (is_fresh) {
            is_finite_ = !requires_finite_ || fields_.are_finite(m.values.data());
            if (is_finite_) {
                fields_.load(m.values.data());
            } else {
                not_finite = not_finite + 1;
            }
            // A virtual clock has another origin: then the sample counts as received now.
            constexpr std::int64_t max_wait_ns = 10'000'000'000;
            const std::int64_t waited = now - m.monotonic_ns;
            const bool is_plausible = waited >= 0 && waited < max_wait_ns;
            sample_seen_ = is_plausible ? m.monotonic_ns : now;
            seen_ = sample_seen_ - m.lag_ns;
            transit_ = m.transit_ns;
            seq = m.sequence;
            lost = m.lost;
            received = m.received;
            clock_differs = m.clock_differs;
            have_ = m.is_complete;
        }
        const std::int64_t silence = now - seen_;
        if (have_) {
            age = static_cast<double>(silence + transit_) * 1e-6;
        }
        const bool is_recent = have_ && silence <= timeout_;
        const bool good = is_recent && is_finite_;
        if (!good && valid) {
            fields_.make_safe();
            report_invalid(is_recent, now, silence);
        }
        if (good && invalid_fault_.lasts()) {
            invalid_fault_.end(faults_, this);
        }
        valid = good;
        const State sample_state = is_recent ? State::valid : State::stale;
        state_.store(have_ ? sample_state : State::waiting, std::memory_order_relaxed);
        matched = connection_.matched_of_cycle();
        malformed = counted_.malformed(malformed_.load(std::memory_order_relaxed));
        wrong_type = connection_.wrong_type_of_cycle();
        silent = counted_.silent(silent_.load(std::memory_order_relaxed));
        watch_second_writer(now);
        ignored = counted_.ignored(ignored_.load(std::memory_order_relaxed));
        flood = counted_.flood(flood_.load(std::memory_order_relaxed));
    }

    /// Takes the newest sample of the engine, or of the journal. Returns false when there is no
    /// other one than in the cycle before. [realtime]
    bool receive() noexcept {
        bool is_fresh = false;
        const Message& newest = mailbox_.get(&is_fresh);
        hal::journaled(is_fresh);
        if (!is_fresh) return false;
        std::copy(newest.values.begin(), newest.values.end(), taken_.values.begin());
        static_cast<SampleInfo&>(taken_) = newest;
        hal::journaled(taken_.values.data(), taken_.values.size());
        hal::journaled(static_cast<SampleInfo&>(taken_));
        return true;
    }

    /// Raises the fault that lasts until the topic is valid again. [realtime]
    void report_invalid(bool is_recent, std::int64_t now, std::int64_t silence) noexcept {
        if (is_recent) {
            return invalid_fault_.begin(faults_, this, not_finite_text_.c_str());
        }
        const bool lacks_joint = now - sample_seen_ <= timeout_;
        const std::string& text = lacks_joint ? joint_texts_[taken_.oldest_joint] : stale_text_;
        invalid_fault_.begin(faults_, this, text.c_str(), static_cast<double>(silence) * 1e-9);
    }

    /// A second writer of a topic is a fault only where the values must be of one writer.
    /// [realtime]
    void watch_second_writer(std::int64_t now) noexcept {
        const std::uint64_t others = counted_.others(others_.load(std::memory_order_relaxed));
        if (others != others_seen_) {
            others_seen_ = others;
            second_until_ = now + second;
        }
        const bool with_other = now < second_until_;
        if (with_other && !second_writer && exclusive_) {
            second_fault_.begin(faults_, this, second_text_.c_str());
        }
        if (!with_other && second_fault_.lasts()) {
            second_fault_.end(faults_, this);
        }
        second_writer = with_other;
    }

private:
    enum class State { waiting, valid, stale };
    /// What the cycle reads of the engine's threads besides samples.
    struct Counted {
        hal::JournaledValue<std::uint64_t> malformed, ignored, others;
        hal::JournaledValue<bool> silent, flood;
    };
    static constexpr std::int64_t second = 1'000'000'000;

    /// A topic has one owner: the first publisher, until it sends nothing for half of the timeout
    /// or is lost.
    bool is_owners(const Sample& s) noexcept {
        if (s.writer != owner_) {
            const bool has_one = owner_at_ != 0 && connection_.matched() > 1 &&
                                 s.monotonic_ns - owner_at_ < timeout_ / 2;
            if (has_one) {
                const std::lock_guard lock(names_);
                owner_named_ = owner_;
                other_named_ = s.writer;
                other_at_.store(s.monotonic_ns, std::memory_order_relaxed);
                others_.fetch_add(1, std::memory_order_relaxed);
                if (exclusive_) {
                    ignored_.fetch_add(1, std::memory_order_relaxed);
                    return false;
                }
            }
            owner_ = s.writer;
        }
        owner_at_ = s.monotonic_ns;
        return true;
    }

    void on_sample(const Sample& s) noexcept override {
        if (!is_owners(s)) return;
        ++arrivals_;
        if (s.monotonic_ns - window_ >= second) {
            rate_ = static_cast<double>(arrivals_) * 1e9 /
                    static_cast<double>(std::max<std::int64_t>(s.monotonic_ns - window_, 1));
            if (window_ != 0) {
                check_rate();
            }
            window_ = s.monotonic_ns;
            arrivals_ = 0;
        }
        last_.store(s.monotonic_ns, std::memory_order_relaxed);
        if (s.writer == writer_ && s.sequence > message_.sequence) {
            message_.lost += s.sequence - message_.sequence - 1;
        }
        writer_ = s.writer;
        message_.sequence = s.sequence;
        if (arrivals_ > static_cast<std::uint64_t>(flood_limit_) && ++skipped_ % 16 != 0) {
            ++message_.received;
            return;
        }
        if (!decode(schema_, s.bytes, message_.values, has_joint_)) {
            if (malformed_.fetch_add(1, std::memory_order_relaxed) == 0) {
                arguments_.log("topic '" + topic_.shown + "': dropped a malformed sample of " +
                               std::to_string(s.bytes.size()) + " bytes; expected type " +
                               topic_.type + ", final, " + std::to_string(schema_.sample.size()) +
                               " bytes: compare the fields of both sides");
            }
            return;
        }
        ++message_.received;
        message_.monotonic_ns = s.monotonic_ns;
        note_joints(s.monotonic_ns);
        const std::int64_t transit = s.received_ns - s.source_ns;
        message_.clock_differs = transit < -5'000'000 || transit > 2 * second;
        message_.transit_ns = message_.clock_differs ? 0 : std::max<std::int64_t>(transit, 0);
        if (message_.clock_differs != clock_differed_) {
            check_clock(transit);
        }
        mailbox_.put(message_);
    }

    /// The topic is as old as the joint whose value is the oldest.
    void note_joints(std::int64_t now) noexcept {
        if (joint_ns_.empty()) return;
        for (std::size_t i = 0; i < joint_ns_.size(); ++i) {
            if (std::exchange(has_joint_[i], false)) {
                joint_ns_[i] = now;
            }
        }
        const auto oldest = std::min_element(joint_ns_.begin(), joint_ns_.end());
        message_.oldest_joint = static_cast<std::size_t>(oldest - joint_ns_.begin());
        message_.is_complete = *oldest != 0;
        message_.lag_ns = message_.is_complete ? now - *oldest : 0;
        missing_joint_.store(
            message_.is_complete ? -1 : static_cast<std::ptrdiff_t>(message_.oldest_joint),
            std::memory_order_relaxed);
    }

    void check_rate() noexcept {
        const bool floods = rate_ > static_cast<double>(flood_limit_);
        if (floods != flood_.load(std::memory_order_relaxed)) {
            arguments_.log(
                "topic '" + topic_.shown + "': " + (floods ? "flood of " : "flood ended: ") +
                std::to_string(std::llround(rate_)) +
                " samples per second (flood_limit=" + std::to_string(flood_limit_) + ")" +
                (floods ? "; only one of 16 samples above the limit is decoded" : ""));
        }
        flood_.store(floods, std::memory_order_relaxed);
    }
    void check_clock(std::int64_t transit) noexcept {
        clock_differed_ = message_.clock_differs;
        char seconds[32];
        std::snprintf(seconds, sizeof seconds, "%.3f",
                      std::abs(static_cast<double>(transit)) * 1e-9);
        if (clock_differed_) {
            arguments_.log("topic '" + topic_.shown + "': the publisher's clock is " + seconds +
                           " s " + (transit < 0 ? "ahead of" : "behind") +
                           " this machine's; age-ms now counts from the reception of a sample");
        } else {
            arguments_.log("topic '" + topic_.shown +
                           "': the publisher's clock agrees with this machine's again");
        }
    }

    void on_event(Event e, int count, const std::string& text) noexcept override {
        connection_.handle(
            arguments_, e, count, text,
            "topic '" + topic_.shown + "': a publisher does not offer the requested QoS: ");
    }

    /// Reports what the cycle found, and publishers that send nothing. A lost publisher is reported
    /// by its fault. [the DDS thread]
    std::int64_t serve(std::int64_t now) noexcept override {
        const State s = state_.load(std::memory_order_relaxed);
        if (s == State::valid && reported_ == State::stale) {
            arguments_.log("topic '" + topic_.shown + "' is valid again");
        }
        reported_ = s;
        const bool second_one = other_at_.load(std::memory_order_relaxed) > now - second;
        if (second_one && !reported_second_) {
            std::unique_lock lock(names_);
            const auto owner = owner_named_;
            const auto other = other_named_;
            lock.unlock();
            arguments_.log(
                "topic '" + topic_.shown + "': second publisher " + connection_.describe(other) +
                " in addition to " + connection_.describe(owner) +
                (exclusive_
                     ? "; its samples are ignored: stop it, or accept all publishers by exclusive=0"
                     : "; the samples of both are accepted: to accept only the first, use "
                       "exclusive=1"));
        }
        reported_second_ = second_one;
        const bool has_publisher = connection_.matched() > 0;
        if (!has_publisher || quiet_since_ == 0) {
            quiet_since_ = now;
        }
        const std::int64_t since = std::max(last_.load(std::memory_order_relaxed), quiet_since_);
        const bool quiet = has_publisher && now - since > silence_ms_ * 1'000'000;
        if (quiet && !silent_.load(std::memory_order_relaxed)) {
            arguments_.log("topic '" + topic_.shown +
                           "': no sample from the matched publisher for " +
                           std::to_string(silence_ms_) +
                           " ms; check that it is enabled, that its data representation is XCDR1, "
                           "or XCDR2 of a final type, and the firewall");
        }
        silent_.store(quiet, std::memory_order_relaxed);
        report_missing_joint(now);
        arguments_.flush_log();
        return now + 20'000'000;
    }

    /// Reports once a joint that no sample contains. [the DDS thread]
    void report_missing_joint(std::int64_t now) noexcept {
        const std::ptrdiff_t missing = missing_joint_.load(std::memory_order_relaxed);
        if (missing < 0) {
            missing_since_ = 0;
            return;
        }
        if (missing_since_ == 0) {
            missing_since_ = now;
        }
        if (now - missing_since_ < silence_ms_ * 1'000'000 || reported_joint_ == missing) return;
        reported_joint_ = missing;
        arguments_.log("topic '" + topic_.shown + "': no sample contains joint '" +
                       schema_.names[static_cast<std::size_t>(missing)] +
                       "'; compare joints= with the names that its publishers send");
    }

    Arguments arguments_{*this};
    hal::Argument timeout_ms_{
        *this,
        argument::timeout_ms,
        0,
        "timeout after which the topic is not valid (ms); 0: deadline_ms, or 1000 without it",
        {.min = 0, .max = 86'400'000}};
    hal::Argument silence_ms_{
        *this,
        "silence_ms",
        3000,
        "time without samples from a matched publisher until it is reported (ms)",
        {.min = 10, .max = 86'400'000}};
    hal::Argument flood_limit_{*this,
                               "flood_limit",
                               20'000,
                               "samples per second above which most are not decoded",
                               {.min = 1, .max = 100'000'000}};
    hal::Argument exclusive_argument_{
        *this,
        "exclusive",
        -1,
        "1: accepts one publisher, a second one is a fault; 0: accepts all; -1: 1, but 0 with ros=",
        {.min = -1, .max = 1}};
    hal::Argument finite_argument_{
        *this,
        "finite",
        -1,
        "1: a sample with a NaN or an infinity is not valid; 0: its values are set as they are; "
        "-1: "
        "1, but 0 for a JointState, in which NaN stands for what a joint does not measure",
        {.min = -1, .max = 1}};
    hal::Function take_{*this, "", &DdsSubscribe::take, "sets the pins from the newest sample"};

    const Schema schema_ = arguments_.schema();
    const TopicType topic_ = arguments_.topic(schema_);
    const Quality quality_ = arguments_.quality();
    const Settings settings_ = arguments_.participant.settings();

    FieldPins<HAL_DIR_OUT> fields_{*this, take_, schema_, "field of the topic"};
    hal::Out<std::uint64_t> seq{*this, take_, "seq",
                                "sequence number of the sample, counted by its publisher"};
    hal::Out<double> age{
        *this,
        take_,
        pin::age_ms,
        "age of the sample, by the publisher's clock; infinite without one, and while the thread "
        "is stopped",
        {.initial = hal::infinite_age, .unit = "ms", .safe = hal::infinite_age}};
    hal::Out<bool> valid{*this,
                         take_,
                         pin::valid,
                         "a sample was received within the timeout, and its values are finite",
                         {.safe = false}};
    hal::Out<std::uint64_t> lost{*this, take_, "lost", "gaps in the sequence numbers"};
    hal::Out<std::uint64_t> received{*this, take_, "received", "samples received"};
    hal::Out<std::uint32_t> matched{*this, take_, "matched", "matched publishers"};
    hal::Out<std::uint64_t> malformed{*this, take_, "malformed",
                                      "samples that do not match the type"};
    hal::Out<std::uint64_t> not_finite{*this, take_, "not-finite",
                                       "samples that were not set: a value is NaN or infinite"};
    hal::Out<bool> wrong_type{*this, take_, "wrong-type",
                              "a publisher uses this topic with another type"};
    hal::Out<bool> silent{*this, take_, "silent",
                          "a publisher is matched, but sends nothing for silence_ms"};
    hal::Out<bool> second_writer{*this, take_, "second-publisher",
                                 "another publisher writes this topic too"};
    hal::Out<std::uint64_t> ignored{*this, take_, "ignored",
                                    "samples ignored because they are from a second publisher"};
    hal::Out<bool> flood{*this, take_, "flood", "the sample rate is above flood_limit"};
    hal::Out<bool> clock_differs{
        *this, take_, "clock-differs",
        "the publisher's clock is more than 5 ms ahead or more than 2 s behind"};

    // The cycle's
    const hal_faults* faults_ = nullptr;
    hal::LastingFault invalid_fault_, second_fault_;
    std::int64_t timeout_ = 0;
    std::int64_t seen_ = 0;  // the oldest value of the newest sample
    std::int64_t sample_seen_ = 0;
    std::int64_t transit_ = 0;
    bool have_ = false;
    bool is_finite_ = true;  // the newest sample
    Message taken_{{}, std::vector<hal_value>(schema_.fields.size())};
    Counted counted_;
    std::uint64_t others_seen_ = 0;
    std::int64_t second_until_ = INT64_MIN;
    std::string stale_text_;
    const std::string not_finite_text_ = "a sample of topic '" + topic_.shown +
                                         "' has a value that is NaN or infinite; its pins are not "
                                         "valid";
    std::vector<std::string> joint_texts_;
    const bool exclusive_ =
        exclusive_argument_ == 1 || (exclusive_argument_ == -1 && schema_.ros.empty());
    const bool requires_finite_ =
        finite_argument_ == 1 || (finite_argument_ == -1 && schema_.names.empty());
    const std::string second_text_ =
        "a second publisher writes topic '" + topic_.shown + "'; its samples are ignored";
    // The engine's threads', one at a time
    Message message_{{}, std::vector<hal_value>(schema_.fields.size())};
    std::array<std::uint8_t, 16> writer_{}, owner_{};
    std::int64_t owner_at_ = 0;
    std::uint64_t arrivals_ = 0;
    std::uint64_t skipped_ = 0;
    std::int64_t window_ = 0;
    double rate_ = 0;
    bool clock_differed_ = false;
    std::array<bool, 256> has_joint_{};
    std::vector<std::int64_t> joint_ns_;  // when each joint had its newest value; 0: never
    // Between them
    hal::Mailbox<Message> mailbox_{message_};
    std::atomic<State> state_{State::waiting};
    std::atomic<std::ptrdiff_t> missing_joint_{-1};  // in all samples so far
    std::atomic<std::uint64_t> malformed_{0};
    std::atomic<std::int64_t> last_{0};
    std::atomic<bool> silent_{false};
    std::atomic<bool> flood_{false};
    std::atomic<std::int64_t> other_at_{INT64_MIN / 2};
    std::atomic<std::uint64_t> ignored_{0};
    std::atomic<std::uint64_t> others_{0};
    std::mutex names_;  // of the next two, never of the cycle
    std::array<std::uint8_t, 16> owner_named_{}, other_named_{};
    // The DDS thread's
    State reported_ = State::waiting;
    bool reported_second_ = false;
    std::int64_t quiet_since_ = 0;
    std::int64_t missing_since_ = 0;
    std::ptrdiff_t reported_joint_ = -1;

    TopicConnection<Reader> connection_;
};

}  // namespace

HAL_COMPONENT(DdsSubscribe, "dds_subscribe",
              "Subscribes to a DDS topic and sets pins from its newest sample", R"(
The subscriber for `dds_publish`: give both the same `topic`, `fields` and `domain`. Samples arrive
in threads that are not real-time; each cycle uses the newest complete one.

    loadrt dds_subscribe topic=arm/state names=state fields=angle:float=0,ready:bit=0,joint:float*6 timeout_ms=50
    addf state servo-thread
    net angle  <= state.angle
    net ok     <= state.valid

`valid` is true while a sample was received within `timeout_ms`, by this machine's monotonic clock.
When it becomes false, fields with `=VALUE` take this value, the others keep theirs, and a fault is
raised. It recovers by itself. `age-ms` counts from the publisher's cycle and needs synchronised
clocks; when they differ (`clock-differs`), it counts from the reception.

A sample with a value that is NaN or infinite is not valid either: its values are not set, a fault is
raised, and `not-finite` counts it. With `finite=0` they are set as they are, for messages in which they have a
meaning; that is the default for a JointState, in which NaN stands for what a joint does not measure.

`lost` counts gaps in the publisher's sequence numbers. With `reliable=1` a lost sample is
retransmitted while it is among the newest `depth` samples of the publisher and at most `depth`
newer ones arrived here: a subscriber that needs every sample, even after its host was suspended,
needs a `depth` of as many samples as are published meanwhile.

A topic has one publisher: the first one, until it sends nothing for half of the timeout. Samples of
a second one are ignored, `second-publisher` becomes true, a fault is raised, and its participant is
named. `exclusive=0`, the default with `ros=`, accepts all publishers.

`silent`: a publisher is matched, but sent nothing for `silence_ms`. `wrong-type`: another
participant uses the topic with another type. Each is reported once on standard error. `ros=` is as
for `dds_publish`; joints are matched by name, in any order. Several publishers may each send some
of the `joints=`: `valid` and `age-ms` are those of the joint whose newest value is the oldest, and a
joint that no sample contains is reported after `silence_ms`.
)")
