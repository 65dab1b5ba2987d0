// SPDX-License-Identifier: MIT
#include "ethercat/devices/firmware_mailbox.hpp"

#include <algorithm>
#include <cstring>

namespace hal::ethercat::devices {

FirmwareMailbox::FirmwareMailbox(const FirmwareFaults& faults)
    : faults_(faults), received_(max_mailbox) {}

void FirmwareMailbox::Mail::store(std::span<const std::uint8_t> from) noexcept {
    length = from.size();
    std::memcpy(data.data(), from.data(), length);
}

void FirmwareMailbox::start(const sii::Mailboxes& mailboxes) noexcept {
    outbox_.clear(mailboxes.send.size);
    request_.length = 0;
    newest_.length = 0;
    previous_.length = 0;
    answer_at_ns_ = 0;
    counter_ = 0;
    repeat_ = false;
    resend_newest_ = false;
    has_parts_ = false;
    running_ = true;
    for (auto& service : services_) {
        service->reset();
    }
}

void FirmwareMailbox::run(esc::Pdi& pdi, State state, std::int64_t now_ns) noexcept {
    if (!running_) return;
    repeat(pdi);
    send(pdi, now_ns);
    receive(pdi, state, now_ns);
    pump();
    send(pdi, now_ns);
}

/// Queues the next part of a long answer, which a request begins. When no protocol has a part,
/// the next one comes with the next request.
void FirmwareMailbox::pump() noexcept {
    if (!has_parts_) return;
    for (auto& service : services_) {
        if (!outbox_.empty()) return;
        service->pump(outbox_);
    }
    has_parts_ = !outbox_.empty();
}

bool FirmwareMailbox::send(const coe::Emergency& emergency) noexcept {
    if (outbox_.full()) return false;
    outbox_.send(MailboxType::coe, coe::write_emergency(outbox_.payload(), emergency));
    return true;
}

void FirmwareMailbox::refuse(MailboxError error) noexcept {
    outbox_.send(MailboxType::error, write_mailbox_error(outbox_.payload(), error));
}

void FirmwareMailbox::receive(esc::Pdi& pdi, State state, std::int64_t now_ns) noexcept {
    // the request waits in the mailbox, so that the outbox never overflows
    if (!outbox_.empty()) return;
    const std::size_t n = pdi.read_sync_manager(0, received_);
    if (n == 0) return;
    outbox_.clear(std::min<std::size_t>(pdi.sync_manager(1).length, max_mailbox));
    if (faults_.mailbox_dead.load(std::memory_order_relaxed)) return;
    answer({received_.data(), n}, state, now_ns);
}

void FirmwareMailbox::answer(std::span<const std::uint8_t> request, State state,
                             std::int64_t now_ns) noexcept {
    const auto message = read_mailbox(request);
    const auto delay = faults_.mailbox_delay_ns.load(std::memory_order_relaxed);
    if (delay > 0) {
        answer_at_ns_ = now_ns + delay;
    }
    if (!message) return refuse(MailboxError::invalid_size);
    const auto before = request_.bytes();
    const bool sent_again = message->counter != 0 && std::equal(request.begin(), request.end(),
                                                                before.begin(), before.end());
    if (sent_again) {  // it is not executed twice
        resend_newest_ = !newest_.empty();
        return;
    }
    request_.store(request);
    if (message->type == MailboxType::error) return;
    for (auto& service : services_) {
        const bool available = state != State::boot || service->in_boot();
        if (service->type() == message->type && available) {
            has_parts_ = true;
            return service->take(*message, state, outbox_);
        }
    }
    refuse(MailboxError::protocol_not_supported);
}

void FirmwareMailbox::send(esc::Pdi& pdi, std::int64_t now_ns) noexcept {
    if (resend_newest_) {
        resend_newest_ = !pdi.write_sync_manager(1, newest_.bytes());
        return;
    }
    if (outbox_.empty() || now_ns < answer_at_ns_) return;
    auto message = outbox_.front();
    const std::uint8_t counter = next_mailbox_counter(counter_);
    message[5] = static_cast<std::uint8_t>((message[5] & 0x0f) | counter << 4);
    if (!pdi.write_sync_manager(1, message)) return;
    counter_ = counter;
    std::swap(newest_, previous_);
    newest_.store(message);
    outbox_.pop();
}

/// Puts the answer back that the master did not get. If the next one is already in the mailbox, it
/// waits until that was read.
void FirmwareMailbox::repeat(esc::Pdi& pdi) noexcept {
    const auto sm = pdi.sync_manager(1);
    if (sm.repeat_request == repeat_) return;
    repeat_ = sm.repeat_request;
    const bool occupied = !newest_.empty() && !pdi.write_sync_manager(1, newest_.bytes());
    if (occupied && !previous_.empty()) {
        std::memcpy(pdi.memory(sm.start), previous_.data.data(),
                    std::min<std::size_t>(previous_.length, sm.length));
        resend_newest_ = true;
    }
    pdi.acknowledge_repeat(1);
}

}  // namespace hal::ethercat::devices
