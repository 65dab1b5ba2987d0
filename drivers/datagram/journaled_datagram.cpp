// SPDX-License-Identifier: MIT
#include "datagram/journaled_datagram.hpp"

#include <algorithm>
#include <utility>

#include "link/call_journal.hpp"
#include "link/journaled_open.hpp"

namespace hal::datagram::journal {

namespace {

using link::HiddenReadings;
using link::JournaledCall;

void exchange(JournaledCall& call, Description& d) {
    call.text(d.address);
    call.text(d.transport);
    call.text(d.remark);
    call.number(d.in_memory);
}

/// `inner` is nullptr when the journal is executed again.
class JournaledPort final : public Port {
public:
    JournaledPort(std::unique_ptr<Port> inner, Description description)
        : inner_(std::move(inner)), description_(std::move(description)) {}

    bool send(std::span<const std::uint8_t> bytes, std::int64_t now_ns) noexcept override {
        bool is_sent = true;
        if (inner_) {
            const HiddenReadings hidden;
            is_sent = inner_->send(bytes, now_ns);
        }
        JournaledCall call;
        if (!call.is_journaled()) return is_sent;
        call.sent(JournaledCall::Sending::send, is_sent, description_.address.c_str());
        link::SentChecksum sum;
        sum.add(bytes);
        call.compare(sum.value(), description_.address.c_str());
        return is_sent;
    }
    std::size_t receive(std::span<std::uint8_t> to, std::int64_t now_ns) noexcept override {
        std::size_t size = 0;
        if (inner_) {
            const HiddenReadings hidden;
            size = inner_->receive(to, now_ns);
        }
        JournaledCall call;
        if (!call.is_journaled()) return size;
        call.number(size);
        size = std::min(size, to.size());
        call.bytes(to.data(), size);
        return size;
    }
    bool wait(std::int64_t limit_ns) noexcept override {
        bool has_arrived = false;
        if (inner_) {
            const HiddenReadings hidden;
            has_arrived = inner_->wait(limit_ns);
        }
        JournaledCall call;
        call.number(has_arrived);
        return has_arrived;
    }
    const Description& description() const noexcept override { return description_; }

private:
    const std::unique_ptr<Port> inner_;
    const Description description_;
};

}  // namespace

Opened open_journaled(const std::function<Opened()>& open) {
    const auto wrap = [](JournaledCall& call, std::unique_ptr<Port> inner) {
        Description description;
        if (inner) {
            description = inner->description();
        }
        exchange(call, description);
        return std::make_unique<JournaledPort>(std::move(inner), std::move(description));
    };
    return link::open_journaled(open, "port", wrap);
}

}  // namespace hal::datagram::journal
