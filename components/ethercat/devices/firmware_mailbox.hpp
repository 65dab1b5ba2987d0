// SPDX-License-Identifier: MIT
// The mailbox of an emulated slave: passes a request to the service of its protocol, sends the
// answers one at a time, and repeats an answer that the master lost.
#pragma once

#include <memory>
#include <vector>

#include "ethercat/devices/firmware_faults.hpp"
#include "ethercat/devices/mailbox_service.hpp"
#include "ethercat/esc/pdi.hpp"
#include "ethercat/wire/coe.hpp"
#include "ethercat/wire/sii.hpp"

namespace hal::ethercat::devices {

/// The mailbox. [realtime] unless marked.
class FirmwareMailbox {
public:
    explicit FirmwareMailbox(const FirmwareFaults&);  ///< [setup]
    /// Adds a protocol. [setup]
    void add(std::unique_ptr<MailboxService> service) { services_.push_back(std::move(service)); }

    /// Starts with the areas of a state; all transfers end.
    void start(const sii::Mailboxes&) noexcept;
    void stop() noexcept { running_ = false; }
    /// Works once, if it is started.
    void run(esc::Pdi&, State, std::int64_t now_ns) noexcept;
    /// Returns whether an answer waits to be sent.
    bool waits() const noexcept { return running_ && (!outbox_.empty() || resend_newest_); }
    /// Queues an emergency. Returns false when the outbox is full: the emergency is dropped.
    bool send(const coe::Emergency&) noexcept;

private:
    /// A message with its header.
    struct Mail {
        Mail() : data(max_mailbox) {}
        void store(std::span<const std::uint8_t> from) noexcept;
        std::span<const std::uint8_t> bytes() const noexcept { return {data.data(), length}; }
        bool empty() const noexcept { return length == 0; }

        std::vector<std::uint8_t> data;
        std::size_t length = 0;
    };
    void receive(esc::Pdi&, State, std::int64_t now_ns) noexcept;
    void answer(std::span<const std::uint8_t> request, State, std::int64_t now_ns) noexcept;
    void refuse(MailboxError) noexcept;
    void pump() noexcept;
    void send(esc::Pdi&, std::int64_t now_ns) noexcept;
    void repeat(esc::Pdi&) noexcept;

    const FirmwareFaults& faults_;
    std::vector<std::unique_ptr<MailboxService>> services_;
    Outbox outbox_;
    std::vector<std::uint8_t> received_;
    Mail request_;   ///< the newest request
    Mail newest_;    ///< the newest answer
    Mail previous_;  ///< the answer before
    std::int64_t answer_at_ns_ = 0;
    std::uint8_t counter_ = 0;
    bool running_ = false;
    bool repeat_ = false;         ///< repeat request of the master, as last seen
    bool resend_newest_ = false;  ///< as soon as the mailbox is empty
    bool has_parts_ = false;      ///< a protocol may have another part of an answer
};

}  // namespace hal::ethercat::devices
