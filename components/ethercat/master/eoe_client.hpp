// SPDX-License-Identifier: MIT
// Ethernet over EtherCAT as the master uses it (ETG.1000.6, clause 5.7): the IP settings of slaves, and a learning switch between slaves
// and one interface of the host. The interface itself, such as a TAP, belongs to a thread that exchanges frames through two queues.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "ethercat/master/mailbox.hpp"
#include "ethercat/wire/eoe.hpp"
#include "hal/queue.hpp"

namespace hal::ethercat::master {

/// An Ethernet frame from the destination address on, without check sequence.
struct EthernetFrame {
    std::uint16_t                                length = 0;
    std::array<std::uint8_t, eoe::largest_frame> bytes{};
};

struct EoeCounters {
    std::uint32_t from_slave = 0, to_slave = 0;  ///< frames
    std::uint32_t lost = 0;                      ///< frames that found a queue full
};

/// See the top of this file.
class EoeSwitch final : public MailboxSink {
public:
    static constexpr unsigned host = 0xffff;

    /// Allocates queues of `depth` frames for the host and for each slave in `slaves`, the numbers of those with EoE. [setup]
    EoeSwitch(Mailboxes& mailboxes, std::span<const std::uint16_t> slaves, std::size_t depth = 8);

    /// Moves the frames of the host to the queues of the slaves. Call once per cycle. [realtime]
    void pump() noexcept;
    /// Returns whether frames wait for a slave. [realtime]
    bool pending(const BusSlave& slave) const noexcept;
    /// Sends the oldest frame for a slave. [realtime]
    Task<MailboxResult> serve(Channel&, BusSlave&) noexcept;
    bool                take(const BusSlave&, const MailboxMessage&) noexcept override;

    Queue<EthernetFrame>& to_host() noexcept { return to_host_; }      ///< Returns the frames for the host; read by its thread. [any]
    Queue<EthernetFrame>& from_host() noexcept { return from_host_; }  ///< Returns the frames of the host; written by its thread. [any]
    EoeCounters           counters(const BusSlave& slave) const noexcept;        ///< [any]

private:
    struct Port {
        explicit Port(std::uint16_t number, std::size_t depth) : slave(number), queue(depth) {}
        std::uint16_t        slave;
        Queue<EthernetFrame> queue;
        eoe::Joiner          joiner;
        EoeCounters          counters;
        std::uint8_t         frame = 0;  // number of the next one, modulo 16
    };
    struct Learned {
        std::array<std::uint8_t, 6> address{};
        std::uint16_t               port = 0;
        bool                        used = false;
    };
    Port*    port_of(const BusSlave& slave) const noexcept;
    void     forward(unsigned from, std::span<const std::uint8_t> frame) noexcept;
    Learned& slot_of(const std::uint8_t* address) noexcept;
    void     deliver(unsigned port, std::span<const std::uint8_t> frame) noexcept;

    Mailboxes&                         mailboxes_;
    std::vector<std::unique_ptr<Port>> ports_;
    std::vector<int>                   port_by_slave_;
    std::array<Learned, 256>           learned_{};
    Queue<EthernetFrame>               to_host_, from_host_;
};

/// The IP settings of slaves. All functions [realtime]. A result other than ok ends as `aborted` with its code (eoe::Result).
class EoeClient {
public:
    explicit EoeClient(Mailboxes& mailboxes) noexcept : mailboxes_(mailboxes) {}
    /// Writes the settings. All fields up to DNS are sent and flagged, because slaves disagree on the position of a field after a gap.
    Task<MailboxResult> set_ip(Channel&, BusSlave&, const eoe::Ip&) noexcept;
    Task<MailboxResult> get_ip(Channel&, BusSlave&, eoe::Ip& to) noexcept;

private:
    Mailboxes& mailboxes_;
};

}  // namespace hal::ethercat::master
