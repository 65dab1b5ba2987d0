// SPDX-License-Identifier: MIT
// A mailbox protocol of an emulated slave, and where its answers go.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "ethercat/wire/mailbox.hpp"
#include "ethercat/wire/states.hpp"

namespace hal::ethercat::devices {

/// Messages that wait for an empty send mailbox. Its size is fixed in setup.
class Outbox {
public:
    explicit Outbox(std::size_t messages = 4, std::size_t bytes = max_mailbox)
        : slots_(messages), memory_(messages * bytes), bytes_(bytes) {}
    /// Forgets all messages; messages are up to `mailbox` bytes long from now on. [realtime]
    void clear(std::size_t mailbox) noexcept {
        used_ = 0;
        first_ = 0;
        mailbox_ = mailbox < bytes_ ? mailbox : bytes_;
    }
    /// Returns the bytes of a message with its header. [realtime]
    std::size_t mailbox() const noexcept { return mailbox_; }
    bool full() const noexcept { return used_ == slots_.size(); }
    bool empty() const noexcept { return used_ == 0; }
    /// Returns where the payload of the next message goes; must not be full. [realtime]
    std::uint8_t* payload() noexcept {
        return at((first_ + used_) % slots_.size()) + mailbox_header_bytes;
    }
    /// Queues the message whose payload was written. [realtime]
    void send(MailboxType type, std::size_t length) noexcept {
        if (full()) return;
        const std::size_t n = (first_ + used_) % slots_.size();
        write_mailbox_header(at(n), length, 0, type, 0);
        slots_[n] = mailbox_header_bytes + length;
        ++used_;
    }
    /// [realtime]
    std::span<std::uint8_t> front() noexcept { return {at(first_), slots_[first_]}; }
    /// [realtime]
    void pop() noexcept {
        first_ = (first_ + 1) % slots_.size();
        --used_;
    }

private:
    std::uint8_t* at(std::size_t n) noexcept { return memory_.data() + n * bytes_; }
    std::vector<std::size_t> slots_;  ///< lengths with header
    std::vector<std::uint8_t> memory_;
    std::size_t bytes_ = 0;
    std::size_t mailbox_ = 0;
    std::size_t first_ = 0;
    std::size_t used_ = 0;
};

/// A mailbox protocol.
class MailboxService {
public:
    virtual ~MailboxService() = default;
    virtual MailboxType type() const noexcept = 0;
    /// Returns whether the protocol is available in the state BOOT.
    virtual bool in_boot() const noexcept { return false; }
    /// Ends transfers; called when the mailbox starts. [realtime]
    virtual void reset() noexcept {}
    /// Takes a message and answers it. The outbox has space for two messages. [realtime]
    virtual void take(const MailboxMessage&, State, Outbox&) noexcept = 0;
    /// Queues the next message of a long answer that take() has begun, if there is one; called
    /// while the outbox is empty, until it has queued none. [realtime]
    virtual void pump(Outbox&) noexcept {}
};

}  // namespace hal::ethercat::devices
