// SPDX-License-Identifier: MIT
#include "can/journal/journaled_link.hpp"

#include <algorithm>
#include <utility>

#include "link/call_journal.hpp"
#include "link/journaled_open.hpp"

namespace hal::can::journal {

namespace {

using link::HiddenReadings;
using link::JournaledCall;

constexpr std::size_t max_delivery_times = 4096;

void exchange(JournaledCall& call, Description& d) {
    call.text(d.address);
    call.text(d.transport);
    call.number(d.bit_rate);
    call.number(d.data_rate);
    for (bool* const flag : {&d.fd, &d.simulated, &d.in_memory, &d.has_bit_rate, &d.has_stamps,
                             &d.has_windows, &d.fd_on_request, &d.in_slots}) {
        call.number(*flag);
    }
    call.text(d.interface);
    call.text(d.segment);
    call.text(d.file);
}

void exchange(JournaledCall& call, Statistics& s) noexcept {
    call.number(s.state);
    call.number(s.send_errors);
    call.number(s.receive_errors);
    for (std::uint64_t* const count :
         {&s.sent, &s.sent_bytes, &s.received, &s.received_bytes, &s.lost, &s.lost_on_wire,
          &s.rejected, &s.dropped, &s.errors, &s.bus_offs, &s.restarts}) {
        call.number(*count);
    }
    call.number(s.queued);
    call.real(s.load);
}

void exchange(JournaledCall& call, DeliveryTime& d) {
    call.text(d.station);
    call.time(d.there_ns, 0);
    call.time(d.back_ns, 0);
    call.number(d.there_cycles);
    call.number(d.back_cycles);
    call.number(d.round_trip);
}

/// The flags of a frame, and whether its identifier has more than 16 bits, in two bytes.
struct FrameHead {
    std::uint8_t flags = 0;
    std::uint8_t length = 0;
};

constexpr bool Frame::* frame_flags[] = {
    &Frame::extended,    &Frame::remote, &Frame::fd, &Frame::bit_rate_switch,
    &Frame::error_state, &Frame::error,  &Frame::own};

/// The bytes of the frame behind its data are zeros afterwards, in both executions.
void exchange(JournaledCall& call, Frame& frame, std::int64_t now_ns) noexcept {
    FrameHead head{0, std::min<std::uint8_t>(frame.length, 64)};
    for (std::size_t i = 0; i < std::size(frame_flags); ++i) {
        head.flags = static_cast<std::uint8_t>(head.flags | unsigned{frame.*frame_flags[i]} << i);
    }
    call.bytes(&head, sizeof head);
    for (std::size_t i = 0; i < std::size(frame_flags); ++i) {
        frame.*frame_flags[i] = (head.flags >> i & 1) != 0;
    }
    frame.length = std::min<std::uint8_t>(head.length, 64);
    call.number(frame.id);
    call.time(frame.time_ns, now_ns == unclocked ? 0 : now_ns);
    const std::size_t size = frame.remote ? 0 : frame.length;
    call.bytes(frame.data.data(), size);
    std::fill(frame.data.begin() + static_cast<std::ptrdiff_t>(size), frame.data.end(),
              std::uint8_t{0});
}

void add_to(link::SentChecksum& sum, const Frame& frame) noexcept {
    std::uint64_t head = std::uint64_t{frame.id} << 16 | std::uint64_t{frame.length} << 8;
    for (std::size_t i = 0; i < std::size(frame_flags); ++i) {
        head |= std::uint64_t{frame.*frame_flags[i]} << i;
    }
    sum.add(head);
    sum.add(frame.bytes());
}

/// `inner` is nullptr when the journal is executed again.
class JournaledLink final : public Link {
public:
    JournaledLink(std::unique_ptr<Link> inner, Description description, std::int64_t closing_ns)
        : inner_(std::move(inner)), description_(std::move(description)), closing_ns_(closing_ns) {}

    Sent send(const Frame& frame, std::int64_t now_ns) noexcept override {
        return send(frame, [&] { return inner_->send(frame, now_ns); });
    }
    Sent send_within(const Frame& frame, const Window& window,
                     std::int64_t now_ns) noexcept override {
        const Sent sent = send(frame, [&] { return inner_->send_within(frame, window, now_ns); });
        for (const std::int64_t time : {window.not_before_ns, window.last_start_ns,
                                        window.idle_from_ns, window.idle_until_ns}) {
            sum_.add(static_cast<std::uint64_t>(time));
        }
        return sent;
    }
    void flush(std::int64_t now_ns) noexcept override {
        if (inner_) {
            const HiddenReadings hidden;
            inner_->flush(now_ns);
        }
        JournaledCall call;
        if (!call.is_journaled()) return;
        bool has_sent = std::exchange(has_sent_, false);
        const bool computed = has_sent;
        call.sent(JournaledCall::Sending::flush, has_sent, description_.address.c_str());
        if (has_sent || computed) {
            call.compare(std::exchange(sum_, {}).value(), description_.address.c_str());
        }
    }
    std::size_t receive(std::span<Frame> frames, std::int64_t now_ns) noexcept override {
        std::size_t count = 0;
        if (inner_) {
            const HiddenReadings hidden;
            count = inner_->receive(frames, now_ns);
        }
        JournaledCall call;
        if (!call.is_journaled()) return count;
        call.number(count);
        count = std::min(count, frames.size());
        for (Frame& frame : frames.first(count)) {
            exchange(call, frame, now_ns);
        }
        return count;
    }

    Statistics statistics() const noexcept override {
        Statistics statistics;
        if (inner_) {
            const HiddenReadings hidden;
            statistics = inner_->statistics();
        }
        JournaledCall call;
        exchange(call, statistics);
        return statistics;
    }
    State state() const noexcept override {
        State state = State::active;
        if (inner_) {
            const HiddenReadings hidden;
            state = inner_->state();
        }
        JournaledCall call;
        call.number(state);
        return std::min(state, State::down);
    }
    void restart() noexcept override {
        if (inner_) {
            const HiddenReadings hidden;
            inner_->restart();
        }
    }

    bool set_filters(std::span<const Filter> filters) override {
        bool set = inner_ && inner_->set_filters(filters);
        JournaledCall call;
        call.number(set);
        return set;
    }
    const Description& description() const noexcept override { return description_; }
    std::vector<DeliveryTime> delivery_times() const override {
        std::vector<DeliveryTime> times;
        if (inner_) {
            times = inner_->delivery_times();
        }
        JournaledCall call;
        std::size_t count = times.size();
        call.number(count);
        times.resize(std::min(count, max_delivery_times));
        for (DeliveryTime& time : times) {
            exchange(call, time);
        }
        return times;
    }
    bool wait(std::int64_t at_most_ns) override {
        bool has_frame = false;
        if (inner_) {
            const HiddenReadings hidden;
            has_frame = inner_->wait(at_most_ns);
        }
        JournaledCall call;
        call.number(has_frame);
        return has_frame;
    }
    std::int64_t closing_ns() const noexcept override {
        return inner_ ? inner_->closing_ns() : closing_ns_;
    }
    int descriptor() const noexcept override { return inner_ ? inner_->descriptor() : -1; }
    bool rejected(Rejected& report) noexcept override {
        bool has_report = false;
        if (inner_) {
            const HiddenReadings hidden;
            has_report = inner_->rejected(report);
        }
        JournaledCall call;
        call.number(has_report);
        if (has_report) {
            call.number(report.why);
            call.number(report.id);
            call.number(report.from);
            call.number(report.count);
        }
        return has_report;
    }

private:
    template <class Send>
    Sent send(const Frame& frame, Send send_now) noexcept {
        Sent sent = Sent::queued;
        if (inner_) {
            const HiddenReadings hidden;
            sent = send_now();
        }
        JournaledCall call;
        if (!call.is_journaled()) return sent;
        call.sent(JournaledCall::Sending::send, sent, description_.address.c_str());
        add_to(sum_, frame);
        has_sent_ = true;
        return std::min(sent, Sent::rejected);
    }

    const std::unique_ptr<Link> inner_;
    const Description description_;
    const std::int64_t closing_ns_;
    link::SentChecksum sum_;  // since the last flush
    bool has_sent_ = false;
};

}  // namespace

Opened open_journaled(const std::function<Opened()>& open) {
    const auto wrap = [](JournaledCall& call, std::unique_ptr<Link> inner) {
        Description description;
        std::int64_t closing_ns = 0;
        if (inner) {
            description = inner->description();
            closing_ns = inner->closing_ns();
        }
        exchange(call, description);
        call.time(closing_ns, 0);
        return std::make_unique<JournaledLink>(std::move(inner), std::move(description),
                                               closing_ns);
    };
    return link::open_journaled(open, "link", wrap);
}

}  // namespace hal::can::journal
