// SPDX-License-Identifier: MIT
// The mailbox of an emulated slave: requests to their protocol, answers one at a time, repeats of a
// lost answer.
#include <algorithm>
#include <cstring>

#include "ethercat/devices/firmware.hpp"

namespace hal::ethercat::devices {

void Firmware::start_mailbox(const sii::Mailboxes& m) noexcept {
    outbox_.clear(m.send.size);
    receive_bytes_ = m.receive.size;
    newest_bytes_ = previous_bytes_ = taken_bytes_ = 0;
    answer_at_ns_ = 0;
    counter_ = 0;
    repeat_ = resend_newest_ = false;
    mailbox_running_ = true;
    if (coe_) {
        coe_->reset();
    }
    for (auto& s : design_.services) {
        s->reset();
    }
}

void Firmware::run_mailbox(esc::Pdi& pdi) noexcept {
    repeat_mail(pdi);
    send_mail(pdi);
    receive_mail(pdi);
    if (outbox_.empty()) {
        if (coe_) {
            coe_->pump(outbox_);
        }
        for (auto& s : design_.services) {
            if (outbox_.empty()) {
                s->pump(outbox_);
            }
        }
    }
    send_mail(pdi);
}

void Firmware::receive_mail(esc::Pdi& pdi) noexcept {
    // the request waits in the mailbox, so that the outbox never overflows
    if (!outbox_.empty()) return;
    const std::size_t n = pdi.read_sync_manager(0, mail_);
    if (n == 0) return;
    outbox_.clear(std::min<std::size_t>(pdi.sync_manager(1).length, largest_mailbox));
    if (faults_.mailbox_dead.load(std::memory_order_relaxed)) return;
    const auto message = read_mailbox({mail_.data(), n});
    const auto delay = faults_.mailbox_delay_ns.load(std::memory_order_relaxed);
    if (delay > 0) {
        answer_at_ns_ = now_ns_ + delay;
    }
    const auto refuse = [&](MailboxError error) {
        outbox_.send(MailboxType::error, write_mailbox_error(outbox_.payload(), error));
    };
    if (!message) return refuse(MailboxError::invalid_size);
    // sent again: it is not executed twice
    if (message->counter != 0 && n == taken_bytes_ &&
        std::memcmp(taken_.data(), mail_.data(), n) == 0) {
        resend_newest_ = newest_bytes_ != 0;
        return;
    }
    std::memcpy(taken_.data(), mail_.data(), taken_bytes_ = n);
    if (message->type == MailboxType::error) return;
    if (coe_ && message->type == MailboxType::coe && state_ != State::boot) {
        return coe_->take(*message, state_, outbox_);
    }
    for (auto& s : design_.services) {
        if (s->type() == message->type &&
            (state_ != State::boot || s->type() == MailboxType::foe)) {
            return s->take(*message, state_, outbox_);
        }
    }
    refuse(MailboxError::protocol_not_supported);
}

void Firmware::send_mail(esc::Pdi& pdi) noexcept {
    if (resend_newest_) {
        if (pdi.write_sync_manager(1, {newest_.data(), newest_bytes_})) {
            resend_newest_ = false;
        }
        return;
    }
    if (outbox_.empty() || now_ns_ < answer_at_ns_) return;
    auto message = outbox_.front();
    const std::uint8_t counter = next_mailbox_counter(counter_);
    message[5] = static_cast<std::uint8_t>((message[5] & 0x0f) | counter << 4);
    if (!pdi.write_sync_manager(1, message)) return;
    counter_ = counter;
    std::swap(newest_, previous_);
    previous_bytes_ = newest_bytes_;
    newest_bytes_ = message.size();
    std::memcpy(newest_.data(), message.data(), message.size());
    outbox_.pop();
}

/// Puts the answer back that the master did not get. If the next one is already in the mailbox, it
/// waits until that was read.
void Firmware::repeat_mail(esc::Pdi& pdi) noexcept {
    const auto sm = pdi.sync_manager(1);
    if (sm.repeat_request == repeat_) return;
    repeat_ = sm.repeat_request;
    if (newest_bytes_ != 0 && !pdi.write_sync_manager(1, {newest_.data(), newest_bytes_}) &&
        previous_bytes_ != 0) {
        std::memcpy(pdi.memory(sm.start), previous_.data(),
                    std::min<std::size_t>(previous_bytes_, sm.length));
        resend_newest_ = true;
    }
    pdi.acknowledge_repeat(1);
}

}  // namespace hal::ethercat::devices
