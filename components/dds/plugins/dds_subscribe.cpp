// SPDX-License-Identifier: MIT
#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <memory>
#include <mutex>

#include "dds/attendance.hpp"
#include "dds/field_pins.hpp"
#include "hal/queue.hpp"

namespace {

using namespace hal::dds;

/// The newest sample on its way to the cycle.
struct Message {
    std::vector<hal_value> values;
    std::int64_t           monotonic_ns = 0;  // when it came
    std::int64_t           transit_ns = 0;    // how old it was then, by the writer's clock
    std::uint64_t          sequence = 0, lost = 0, received = 0, malformed = 0;
    bool                   clock_differs = false;
};

class DdsSubscribe : public hal::Component, private Listener, private Served {
public:
    explicit DdsSubscribe(const hal_host* host) : Component(host) {
        if (timeout_ms_ == 0) timeout_ = (arguments_.deadline_ms() > 0 ? arguments_.deadline_ms() : 1000) * 1'000'000;
        else timeout_ = timeout_ms_ * 1'000'000;
        limit_words_ = std::to_string(timeout_ / 1'000'000) + " ms";
        stale_words_ = "no sample of topic '" + topic_.name + "' for {} s (limit " + limit_words_ + "); its pins are not valid";
    }

    void start() {
        faults_ = hal::extension<hal_faults>("hal.faults/1");
        attendance_.begin(arguments_, settings_, *this, [this](Participant& p) { return p.reader(topic_, quality_, this); });
    }
    void stop() noexcept { attendance_.end(*this); }

    /// Shows the newest sample; no newer one within the timeout: not valid. [realtime]
    void take(hal::Cycle cycle) noexcept {
        bool               fresh = false;
        const Message&     m = mailbox_.get(&fresh);
        const std::int64_t now = cycle.start_ns();
        if (fresh) {
            fields_.load(m.values.data());
            // Since when it waits here. On a virtual clock that cannot be known: then it has just come.
            const std::int64_t waited = now - m.monotonic_ns;
            seen_ = waited >= 0 && waited < 10'000'000'000 ? m.monotonic_ns : now;
            transit_ = m.transit_ns;
            seq = m.sequence;
            lost = m.lost;
            received = m.received;
            clock_differs = m.clock_differs;
            have_ = true;
        }
        const std::int64_t silence = now - seen_;
        if (have_) age = static_cast<double>(silence + transit_) * 1e-6;
        const bool good = have_ && silence <= timeout_;
        if (!good && valid) {
            fields_.make_safe();
            if (faults_ != nullptr) faults_->raise(faults_, this, stale_words_.c_str(), static_cast<double>(silence) * 1e-9);
        }
        valid = good;
        state_.store(!have_ ? State::waiting : good ? State::valid : State::stale, std::memory_order_relaxed);
        matched = attendance_.matched();
        malformed = malformed_.load(std::memory_order_relaxed);
        wrong_type = attendance_.wrong_type();
        silent = silent_.load(std::memory_order_relaxed);
        const std::uint64_t others = others_.load(std::memory_order_relaxed);
        if (others != others_seen_) others_seen_ = others, second_until_ = now + second;
        const bool with_other = now < second_until_;
        if (with_other && !second_writer && exclusive_ && faults_ != nullptr)
            faults_->raise(faults_, this, second_words_.c_str(), std::numeric_limits<double>::quiet_NaN());
        second_writer = with_other;
        ignored = ignored_.load(std::memory_order_relaxed);
        flood = flood_.load(std::memory_order_relaxed);
    }

private:
    enum class State { waiting, valid, stale };
    static constexpr std::int64_t second = 1'000'000'000;

    /// One publisher has the topic: the first, until no sample of it came for half of the timeout, or it is gone.
    bool is_owners(const Sample& s) noexcept {
        if (s.writer != owner_) {
            const bool has_one = owner_at_ != 0 && attendance_.matched() > 1 && s.monotonic_ns - owner_at_ < timeout_ / 2;
            if (has_one) {
                const std::lock_guard lock(names_);
                owner_named_ = owner_, other_named_ = s.writer;
                other_at_.store(s.monotonic_ns, std::memory_order_relaxed);
                others_.fetch_add(1, std::memory_order_relaxed);
                if (exclusive_) return ignored_.fetch_add(1, std::memory_order_relaxed), false;
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
            rate_ = static_cast<double>(arrivals_) * 1e9 / static_cast<double>(std::max<std::int64_t>(s.monotonic_ns - window_, 1));
            if (window_ != 0) judge_rate();
            window_ = s.monotonic_ns;
            arrivals_ = 0;
        }
        last_.store(s.monotonic_ns, std::memory_order_relaxed);
        if (s.writer == writer_ && s.sequence > message_.sequence) message_.lost += s.sequence - message_.sequence - 1;
        writer_ = s.writer;
        message_.sequence = s.sequence;
        if (arrivals_ > static_cast<std::uint64_t>(flood_limit_) && ++skipped_ % 16 != 0) {
            ++message_.received;
            return;
        }
        if (!decode(schema_, s.bytes, message_.values)) {
            if (malformed_.fetch_add(1, std::memory_order_relaxed) == 0)
                arguments_.say("topic '" + topic_.name + "': a sample of " + std::to_string(s.bytes.size()) + " bytes is not of the type " +
                               topic_.type + " (" + std::to_string(schema_.sample.size()) +
                               " bytes here); it is not used: the type is made of other fields, or not final");
            return;
        }
        ++message_.received;
        message_.monotonic_ns = s.monotonic_ns;
        const std::int64_t transit = s.received_ns - s.source_ns;
        message_.clock_differs = transit < -5'000'000 || transit > 2 * second;
        message_.transit_ns = message_.clock_differs ? 0 : std::max<std::int64_t>(transit, 0);
        if (message_.clock_differs != clock_differed_) judge_clock(transit);
        mailbox_.put(message_);
    }

    void judge_rate() noexcept {
        const bool floods = rate_ > static_cast<double>(flood_limit_);
        if (floods != flood_.load(std::memory_order_relaxed))
            arguments_.say("topic '" + topic_.name + "' " + (floods ? "is a flood: " : "is no flood any more: ") +
                           std::to_string(std::llround(rate_)) + " samples per second (flood_limit=" + std::to_string(flood_limit_) + ")" +
                           (floods ? "; one of 16 of the rest is looked at" : ""));
        flood_.store(floods, std::memory_order_relaxed);
    }
    void judge_clock(std::int64_t transit) noexcept {
        clock_differed_ = message_.clock_differs;
        char seconds[32];
        std::snprintf(seconds, sizeof seconds, "%.3f", std::abs(static_cast<double>(transit)) * 1e-9);
        if (clock_differed_)
            arguments_.say("topic '" + topic_.name + "': its publisher's clock is " + seconds + " s " +
                           (transit < 0 ? "ahead of" : "behind") + " this machine's; age-ms counts from when a sample comes");
        else arguments_.say("topic '" + topic_.name + "': its publisher's clock agrees again");
    }

    void on_event(Event e, int count, const std::string& words) noexcept override {
        attendance_.met(arguments_, e, count, words, "a publisher of topic '" + topic_.name + "' offers less than is asked for: ");
    }

    /// Says what the cycle noticed, and that nothing comes. [the DDS thread]
    std::int64_t serve(std::int64_t now) noexcept override {
        const State s = state_.load(std::memory_order_relaxed);
        if (s == State::stale && said_ != State::stale)
            arguments_.say("no sample of topic '" + topic_.name + "' for more than " + limit_words_ + "; its pins are not valid");
        if (s == State::valid && said_ == State::stale) arguments_.say("topic '" + topic_.name + "' is valid again");
        said_ = s;
        const bool second_one = other_at_.load(std::memory_order_relaxed) > now - second;
        if (second_one && !said_second_) {
            std::unique_lock lock(names_);
            const auto owner = owner_named_, other = other_named_;
            lock.unlock();
            arguments_.say("topic '" + topic_.name + "' has a second publisher, " + attendance_.called(other) + ", beside " +
                           attendance_.called(owner) +
                           (exclusive_ ? "; its samples are ignored. Stop it, or take the samples of all: exclusive=0"
                                       : "; the samples of both are taken. To take those of one: exclusive=1"));
        }
        said_second_ = second_one;
        const bool somebody = attendance_.matched() > 0;
        if (!somebody || quiet_since_ == 0) quiet_since_ = now;
        const std::int64_t since = std::max(last_.load(std::memory_order_relaxed), quiet_since_);
        const bool         quiet = somebody && now - since > silence_ms_ * 1'000'000;
        if (quiet && !silent_.load(std::memory_order_relaxed))
            arguments_.say(
                "topic '" + topic_.name + "' has a publisher and no sample has come for " + std::to_string(silence_ms_) +
                " ms; is it enabled, does its type's representation fit (XCDR1, or XCDR2 of a final type), does a firewall stop data?");
        silent_.store(quiet, std::memory_order_relaxed);
        arguments_.flush_log();
        return now + 20'000'000;
    }

    Arguments     arguments_{*this};
    hal::Argument timeout_ms_{
        *this, "timeout_ms", 0, "no sample for so long: not valid; 0: deadline_ms, without one 1000", {.min = 0, .max = 86'400'000}};
    hal::Argument silence_ms_{*this, "silence_ms", 3000, "a publisher and no sample for so long: said", {.min = 10, .max = 86'400'000}};
    hal::Argument flood_limit_{*this, "flood_limit", 20'000, "samples per second that are too many", {.min = 1, .max = 100'000'000}};
    hal::Argument exclusive_argument_{
        *this, "exclusive", -1, "1: takes the samples of one publisher, a second one is a fault; 0: of all; -1: 1, with ros= 0",
        {.min = -1, .max = 1}};
    hal::Function take_{*this, "", &DdsSubscribe::take, "shows the newest sample"};

    const Schema    schema_ = arguments_.schema();
    const TopicType topic_ = arguments_.topic(schema_);
    const Quality   quality_ = arguments_.quality();
    const Settings  settings_ = arguments_.participant.settings();

    FieldPins<hal::Out>     fields_{*this, take_, schema_, "field of the topic"};
    hal::Out<std::uint64_t> seq{*this, take_, "seq", "number of the sample, as its publisher counts"};
    hal::Out<double>        age{*this, take_, "age-ms", "time since the sample was taken, by the publisher's clock", {.unit = "ms"}};
    hal::Out<bool>          valid{*this, take_, "valid", "a sample came within the timeout", {.safe = false}};
    hal::Out<std::uint64_t> lost{*this, take_, "lost", "samples missing between those that came"};
    hal::Out<std::uint64_t> received{*this, take_, "received", "samples that came"};
    hal::Out<std::uint32_t> matched{*this, take_, "matched", "publishers"};
    hal::Out<std::uint64_t> malformed{*this, take_, "malformed", "samples that are not of the type"};
    hal::Out<bool>          wrong_type{*this, take_, "wrong-type", "somebody publishes this topic with another type"};
    hal::Out<bool>          silent{*this, take_, "silent", "there is a publisher, and nothing comes"};
    hal::Out<bool>          second_writer{*this, take_, "second-publisher", "somebody else publishes this topic, too"};
    hal::Out<std::uint64_t> ignored{*this, take_, "ignored", "samples of a second publisher that were not taken"};
    hal::Out<bool>          flood{*this, take_, "flood", "more comes than flood_limit"};
    hal::Out<bool>          clock_differs{*this, take_, "clock-differs", "the publisher's clock is ahead, or more than 2 s behind"};

    // The cycle's
    const hal_faults* faults_ = nullptr;
    std::int64_t      timeout_ = 0, seen_ = 0, transit_ = 0;
    bool              have_ = false;
    std::uint64_t     others_seen_ = 0;
    std::int64_t      second_until_ = INT64_MIN;
    std::string       limit_words_, stale_words_;
    const bool        exclusive_ = exclusive_argument_ == 1 || (exclusive_argument_ == -1 && schema_.ros.empty());
    const std::string second_words_ = "a second publisher writes topic '" + topic_.name + "'; its samples are ignored";
    // The engine's threads', one at a time
    Message                      message_{std::vector<hal_value>(schema_.fields.size())};
    std::array<std::uint8_t, 16> writer_{}, owner_{};
    std::int64_t                 owner_at_ = 0;
    std::uint64_t                arrivals_ = 0, skipped_ = 0;
    std::int64_t                 window_ = 0;
    double                       rate_ = 0;
    bool                         clock_differed_ = false;
    // Between them
    hal::Mailbox<Message>      mailbox_{message_};
    std::atomic<State>         state_{State::waiting};
    std::atomic<std::uint64_t> malformed_{0};
    std::atomic<std::int64_t>  last_{0};
    std::atomic<bool>          silent_{false}, flood_{false};
    std::atomic<std::int64_t>  other_at_{INT64_MIN / 2};
    std::atomic<std::uint64_t> ignored_{0}, others_{0};
    std::mutex                 names_;  // of the next two, never of the cycle
    std::array<std::uint8_t, 16> owner_named_{}, other_named_{};
    // The DDS thread's
    State        said_ = State::waiting;
    bool         said_second_ = false;
    std::int64_t quiet_since_ = 0;

    Attendance<Reader> attendance_;
};

}  // namespace

HAL_COMPONENT(DdsSubscribe, "dds_subscribe", "Shows the newest sample of a DDS topic on pins", R"(
The other side of `dds_publish`: `topic`, `fields` and `domain` as there. Samples arrive in threads that are not real-time; the cycle takes the
newest, whole.

    loadrt dds_subscribe topic=arm/state names=state fields=angle:float=0,ready:bit=0,joint:float*6 timeout_ms=50
    addf state servo-thread
    net angle  <= state.angle
    net ok     <= state.valid

`valid` says that a sample came within `timeout_ms` by this machine's own steady clock; when it falls, fields with `=VALUE` take this value, the
others stay, and a fault is raised. It rises again by itself. `age-ms` counts from the publisher's cycle, so it needs clocks that agree; when they do
not (`clock-differs`) it counts from the arrival.

`lost` are gaps in a publisher's numbers. With `reliable=1` what is missing is sent again, while the publisher has it among its newest `depth` and
no more than `depth` came after it here: a subscriber that must have every sample, also when its computer stood still, needs a `depth` of so many.

A topic has one publisher: the first that comes, until nothing came of it for half of the timeout. The samples of a second one are not taken,
`second-publisher` rises, a fault is raised, and its participant is named. `exclusive=0` takes those of all, which is the default with `ros=`.

`silent`: there is a publisher and nothing has come for `silence_ms`. `wrong-type`: somebody has the topic with another type. Each is
said once on standard error. `ros=` as in `dds_publish`; joints are found by name, in any order.
)")
