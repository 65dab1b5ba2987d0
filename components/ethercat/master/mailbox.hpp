// SPDX-License-Identifier: MIT
// The mailbox of a slave as the master uses it: one message to the slave, one from it, each a whole
// sync manager (ETG.1000.4, clause 5.6). Lost replies are requested again, messages nobody asked
// for go to their sinks, late and duplicate replies are dropped and counted.
//
//     SlaveMailbox* mailbox = mailboxes.find(slave);
//     SlaveMailbox::Hold hold = co_await mailbox->hold(channel);          // one exchange at a time
//     put(mailbox->body(slave).data(), ...);
//     const SdoResult sent = co_await mailbox->send(channel, slave, MailboxType::coe, length);
//     const SdoResult got = co_await mailbox->receive(channel, slave, channel.now_ns() + timeout_ns);
//     if (got) look_at(mailbox->reply());
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>

#include "ethercat/master/bus_slave.hpp"
#include "ethercat/master/channel.hpp"
#include "ethercat/master/coe_access.hpp"
#include "ethercat/wire/mailbox.hpp"

namespace hal::ethercat::master {

/// Result of an exchange of any mailbox protocol. `abort` has the code of that protocol if
/// `aborted`.
using MailboxResult = SdoResult;

/// How a reply is recognised: `accepts` is given this and the payload.
struct Expected {
    bool (*accepts)(const Expected&, std::span<const std::uint8_t>) noexcept = nullptr;
    std::uint32_t first = 0;
    std::uint32_t second = 0;
    std::uint32_t third = 0;  ///< what `accepts` compares
};

/// Takes messages that arrive without a request: emergencies, EoE frames, VoE.
class MailboxSink {
public:
    virtual ~MailboxSink() = default;
    /// Returns whether the message was consumed; otherwise it may be a reply. [realtime]
    virtual bool take(const BusSlave&, const MailboxMessage&) noexcept = 0;
};

/// Counters of a mailbox since the start. [any]
struct MailboxCounters {
    std::uint32_t sent = 0;
    std::uint32_t received = 0;
    std::uint32_t dropped = 0;  ///< late, duplicate or unexpected messages
    std::uint32_t malformed = 0;  ///< messages whose length does not fit
    std::uint32_t repeated = 0;  ///< replies requested again
    std::uint32_t resent = 0;  ///< requests sent again
};

/// See the top of this file. All functions [realtime] unless tagged otherwise, in the thread of the
/// master's cycle.
class SlaveMailbox {
public:
    static constexpr unsigned types = 16;

    /// Exclusive use of a mailbox; ends with its scope, also when the task is stopped.
    class Hold {
    public:
        Hold() = default;
        explicit Hold(SlaveMailbox& mailbox) noexcept : mailbox_(&mailbox) {
            mailbox.held_ = true;
            mailbox.interrupted_ = false;
        }
        Hold(Hold&& o) noexcept : mailbox_(std::exchange(o.mailbox_, nullptr)) {}
        Hold& operator=(Hold&& o) noexcept {
            std::swap(mailbox_, o.mailbox_);
            return *this;
        }
        ~Hold() {
            if (mailbox_ != nullptr) {
                mailbox_->held_ = false;
            }
        }

    private:
        SlaveMailbox* mailbox_ = nullptr;
    };

    /// Waits until no other task uses the mailbox.
    Task<Hold> hold(Channel&) noexcept;
    bool held() const noexcept { return held_; }

    /// Returns the space for the payload of the next request.
    std::span<std::uint8_t> body(const BusSlave& slave) noexcept {
        const std::size_t size = size_of_out(slave);
        return {request_.data() + mailbox_header_bytes,
                size < mailbox_header_bytes ? 0 : size - mailbox_header_bytes};
    }
    /// Sends the payload in body(). A message whose fate is unknown is sent again with the same
    /// counter, which a slave recognises.
    Task<MailboxResult> send(Channel&, BusSlave&, MailboxType, std::size_t length) noexcept;
    /// Waits for a message that no sink consumes. Times out at `until_ns`.
    Task<MailboxResult> receive(Channel&, BusSlave&, std::int64_t until_ns) noexcept;
    /// Returns the message received last, valid until the next receive().
    const MailboxMessage& reply() const noexcept { return reply_; }
    /// Declares that the reply that did not come in time is still waited for.
    void still_waiting() noexcept { stale_ = false; }
    /// Counts the last reply as one that was not expected.
    void drop() noexcept { ++counters_.dropped; }
    /// Reads the message in the mailbox, if there is one, without a request. For emergencies, EoE
    /// and VoE.
    Task<MailboxResult> poll(Channel&, BusSlave&) noexcept;

    /// Sends the payload in body() and waits for the reply; all other messages are dropped.
    Task<MailboxResult> exchange(Channel&, BusSlave&, MailboxType, std::size_t length,
                                 Expected expected) noexcept;
    /// Waits for a reply; all other messages are dropped. A mailbox error ends the wait.
    Task<MailboxResult> wait_for(Channel&, BusSlave&, MailboxType, std::int64_t timeout_ns,
                                 Expected expected) noexcept;
    /// Returns how long to wait for the reply of this slave, in ns.
    static std::int64_t response_timeout_ns(const BusSlave& slave) noexcept {
        return std::int64_t{slave.timeouts.mailbox_response} * 1'000'000;
    }

    /// Sets the consumer of unrequested messages of a type; nullptr: none. [setup]
    void set_sink(MailboxType type, MailboxSink* sink) noexcept {
        sinks_[static_cast<unsigned>(type) % types] = sink;
    }
    /// Sets the consumer of messages to another station than the master. [setup]
    void set_router(MailboxSink* router) noexcept { router_ = router; }
    const MailboxCounters& counters() const noexcept { return counters_; }
    /// Forgets what is under way, after the slave's sync managers were configured anew: its first
    /// message repeats a counter. The exchange of the present holder times out at once.
    void reset() noexcept {
        interrupted_ = held_;
        stale_ = false;
        advances_ = false;
        repeats_counter_ = false;
        last_counter_ = 0;
        lost_reads_ = 0;
        eager_ = true;
    }

private:
    friend class Hold;
    enum class Full : std::uint8_t { no, yes, absent, lost };
    /// How receive() finds out whether there is a message.
    enum class Approach : std::uint8_t {
        read,
        /// Sends another datagram before it reads again: a loss at regular intervals must not hit
        /// each read.
        shift_and_read,
        status_in_process_data,
        ask_status,
    };
    Approach approach(const BusSlave& slave) const noexcept;
    static std::size_t size_of_out(const BusSlave& slave) noexcept {
        return slave.area().out_size <= max_mailbox ? slave.area().out_size : max_mailbox;
    }
    Task<Full> is_full(Channel&, BusSlave&, unsigned sync_manager, unsigned repeats = 2) noexcept;
    // returns whether a message is in reply_
    Task<bool> read(Channel&, BusSlave&, std::int64_t until_ns) noexcept;
    // has the last message sent again
    Task<bool> repeat(Channel&, BusSlave&, std::int64_t until_ns) noexcept;
    // the bytes in reply_bytes_
    bool accept(const BusSlave&, std::size_t size) noexcept;
    bool is_duplicate(const MailboxMessage&) noexcept;

    std::array<std::uint8_t, max_mailbox> request_{}, reply_bytes_{};
    MailboxMessage reply_;
    std::array<MailboxSink*, types> sinks_{};
    MailboxSink* router_ = nullptr;
    MailboxCounters counters_;
    // of the last message, to recognise a duplicate
    std::uint64_t last_sum_ = 0;
    std::uint8_t last_counter_ = 0;
    std::uint8_t lost_reads_ = 0;
    bool eager_ = true;  ///< no read of a reply was in vain
    // the slave counts its messages
    bool advances_ = false;
    // it sends different messages with the same counter: not to be relied on
    bool repeats_counter_ = false;
    bool held_ = false;
    // reset() came after the present hold: the slave no longer knows of its exchange
    bool interrupted_ = false;
    bool stale_ = false;
};

/// The mailboxes of all slaves, by BusSlave::number.
class Mailboxes {
public:
    /// Allocates the mailboxes of slaves 0..count-1. [setup]
    explicit Mailboxes(std::size_t count)
        : count_(count), mailboxes_(std::make_unique<SlaveMailbox[]>(count)) {}
    /// Returns the mailbox of a slave; nullptr if the slave has none or is unknown. [realtime]
    SlaveMailbox* find(const BusSlave& slave) noexcept {
        return slave.number < count_ && slave.area().usable() ? &mailboxes_[slave.number] : nullptr;
    }
    /// Returns the mailbox number `n`, below size(). [any]
    SlaveMailbox& at(std::size_t n) noexcept { return mailboxes_[n]; }
    std::size_t size() const noexcept { return count_; }

private:
    std::size_t count_;
    std::unique_ptr<SlaveMailbox[]> mailboxes_;
};

/// Returns the result of a rejected request, `code` being a mailbox error or 0. [any]
constexpr MailboxResult refused(std::uint32_t code = 0, std::size_t length = 0) noexcept {
    return {MailboxResult::Outcome::refused, code, length};
}
/// Returns the result of a protocol's own error. [any]
constexpr MailboxResult aborted(std::uint32_t code) noexcept {
    return {MailboxResult::Outcome::aborted, code, 0};
}
/// Returns the result of success. [any]
constexpr MailboxResult succeeded(std::size_t length = 0) noexcept {
    return {MailboxResult::Outcome::done, 0, length};
}

}  // namespace hal::ethercat::master
