// SPDX-License-Identifier: MIT
// Vendor-specific messages over EtherCAT: sent as they are, received at any time.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <span>

#include "ethercat/master/mailbox.hpp"
#include "hal/queue.hpp"

namespace hal::ethercat::master {

/// A message and its sender.
struct VoeMessage {
    std::uint16_t slave = 0;  ///< BusSlave::number
    std::uint16_t length = 0;
    VoeHeader header;
    std::array<std::uint8_t, max_mailbox> data{};
};

/// See the top of this file. Received messages go from the cycle to one other thread.
class VoeClient final : public MailboxSink {
public:
    /// Allocates space for received messages and registers at all mailboxes. [setup]
    explicit VoeClient(Mailboxes& mailboxes, std::size_t capacity = 8)
        : mailboxes_(mailboxes), queue_(capacity) {
        for (std::size_t i = 0; i < mailboxes.size(); ++i) {
            mailboxes.at(i).set_sink(MailboxType::voe, this);
        }
    }
    /// Sends a message; nothing answers it. [realtime]
    Task<MailboxResult> send(Channel& channel, BusSlave& slave, VoeHeader header,
                             std::span<const std::uint8_t> data) noexcept {
        SlaveMailbox* mailbox = mailboxes_.find(slave);
        if (mailbox == nullptr) co_return refused();
        const SlaveMailbox::Hold hold = co_await mailbox->hold(channel);
        const auto body = mailbox->body(slave);
        if (body.size() < voe_header_bytes + data.size()) co_return refused(0, data.size());
        write_voe(body.data(), header);
        if (!data.empty()) {
            std::memcpy(body.data() + voe_header_bytes, data.data(), data.size());
        }
        const MailboxResult result = co_await mailbox->send(channel, slave, MailboxType::voe,
                                                            voe_header_bytes + data.size());
        co_return result;
    }
    bool take(const BusSlave& slave, const MailboxMessage& message) noexcept override {
        const auto header = read_voe(message.payload);
        VoeMessage* to = header ? queue_.place() : nullptr;
        if (to == nullptr) {
            ++lost_;
            return true;
        }
        const auto data = message.payload.subspan(voe_header_bytes);
        to->slave = slave.number;
        to->header = *header;

        to->length = static_cast<std::uint16_t>(data.size());
        if (!data.empty()) {
            std::memcpy(to->data.data(), data.data(), data.size());
        }
        queue_.commit();
        return true;
    }
    /// Returns the oldest message, valid until drop(), or nullptr. [any] one reader
    const VoeMessage* front() noexcept { return queue_.front(); }
    void drop() noexcept { queue_.drop(); }
    /// Returns the number of messages that were too short or found the queue full.
    std::uint32_t lost() const noexcept { return lost_; }

private:
    Mailboxes& mailboxes_;
    Queue<VoeMessage> queue_;
    std::uint32_t lost_ = 0;
};

}  // namespace hal::ethercat::master
