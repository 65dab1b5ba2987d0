// SPDX-License-Identifier: MIT
#include "ethernet/journal/journaled_port.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include "link/call_journal.hpp"
#include "link/journaled_open.hpp"

namespace hal::ethernet::journal {

namespace {

using link::HiddenReadings;
using link::JournaledCall;

/// of a received frame: jumbo frames have at most 9216 bytes
constexpr std::size_t max_received = 16384;

void exchange(JournaledCall& call, Description& d) {
    call.text(d.address);
    call.text(d.transport);
    call.text(d.interface);
    call.text(d.remark);
    for (bool* const flag : {&d.simulated, &d.in_memory, &d.datagrams, &d.recorded, &d.paced}) {
        call.number(*flag);
    }
}

void exchange(JournaledCall& call, Statistics& s) noexcept {
    call.number(s.up);
    call.number(s.speed);
    call.number(s.mtu);
    for (std::uint64_t* const count : {&s.sent, &s.sent_bytes, &s.received, &s.received_bytes,
                                       &s.lost, &s.dropped, &s.late, &s.errors, &s.downs}) {
        call.number(*count);
    }
    call.time(s.launch_error_ns, 0);
    call.time(s.departure_ns, 0);
}

/// `inner` is nullptr when the journal is executed again.
class JournaledPort final : public Port {
public:
    JournaledPort(std::unique_ptr<Port> inner, Description description, const Address& address)
        : inner_(std::move(inner)),
          description_(std::move(description)),
          address_(address),
          received_(inner_ ? 0 : max_received) {}

    const Address& address() const noexcept override { return address_; }

    Sent send(std::span<const std::uint8_t> frame, const Launch& launch,
              std::int64_t now_ns) noexcept override {
        Sent sent = Sent::queued;
        if (inner_) {
            const HiddenReadings hidden;
            sent = inner_->send(frame, launch, now_ns);
        }
        JournaledCall call;
        if (!call.is_journaled()) return sent;
        call.sent(JournaledCall::Sending::send, sent, description_.address.c_str());
        link::SentChecksum sum;
        sum.add(frame);
        sum.add(static_cast<std::uint64_t>(launch.at_ns));
        sum.add(static_cast<std::uint64_t>(launch.stamp_add_ns));
        call.compare(sum.value(), description_.address.c_str());
        return std::min(sent, Sent::rejected);
    }

    std::optional<Arrival> receive(std::int64_t now_ns) noexcept override {
        std::optional<Arrival> arrival;
        if (inner_) {
            const HiddenReadings hidden;
            arrival = inner_->receive(now_ns);
        }
        JournaledCall call;
        if (!call.is_journaled()) return arrival;
        // 0: none; else one more than the number of bytes
        std::size_t code = arrival ? arrival->bytes.size() + 1 : 0;
        call.number(code);
        if (code == 0) return std::nullopt;
        std::int64_t time_ns = arrival ? arrival->time_ns : 0;
        call.time(time_ns, now_ns == unclocked ? 0 : now_ns);
        if (!call.is_repeated()) {
            // recorded, not changed
            call.bytes(const_cast<std::uint8_t*>(arrival->bytes.data()), arrival->bytes.size());
            return arrival;
        }
        const std::span<std::uint8_t> bytes(received_.data(), std::min(code - 1, received_.size()));
        call.bytes(bytes.data(), bytes.size());
        return Arrival{bytes, time_ns};
    }

    bool wait(std::int64_t until_ns) noexcept override {
        bool has_frame = false;
        if (inner_) {
            const HiddenReadings hidden;
            has_frame = inner_->wait(until_ns);
        }
        JournaledCall call;
        call.number(has_frame);
        return has_frame;
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
    const Description& description() const noexcept override { return description_; }
    int descriptor() const noexcept override { return inner_ ? inner_->descriptor() : -1; }

private:
    const std::unique_ptr<Port> inner_;
    const Description description_;
    const Address address_;
    std::vector<std::uint8_t> received_;  // the newest frame, when executed again
};

}  // namespace

Opened open_journaled(const std::function<Opened()>& open) {
    const auto wrap = [](JournaledCall& call, std::unique_ptr<Port> inner) {
        Description description;
        Address address{};
        if (inner) {
            description = inner->description();
            address = inner->address();
        }
        exchange(call, description);
        call.bytes(address.data(), address.size());
        return std::make_unique<JournaledPort>(std::move(inner), std::move(description), address);
    };
    return link::open_journaled(open, "port", wrap);
}

}  // namespace hal::ethernet::journal
