// SPDX-License-Identifier: MIT
// Ethernet over EtherCAT as the master uses it (ETG.1000.6, clause 5.7): the IP settings of slaves,
// and learning switches, each between slaves and one interface of the host. The interface itself,
// such as a TAP, belongs to a thread that exchanges frames through two queues.
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
    std::uint16_t length = 0;
    std::array<std::uint8_t, eoe::max_frame> bytes{};
};

struct EoeCounters {
    std::uint32_t from_slave = 0;
    std::uint32_t to_slave = 0;  ///< frames
    /// frames to the slave that found its queue full, that it did not take, or that were discarded
    std::uint32_t lost = 0;
};

/// A slave with EoE, and the interface of the host that it is connected to.
struct EoePort {
    std::uint16_t slave = 0;  ///< index in Setup::slaves
    std::uint16_t host = 0;  ///< slaves of the same interface reach each other too
};

/// See the top of this file.
class EoeSwitch final : public MailboxSink {
public:
    /// Allocates queues of `depth` frames for each slave in `ports`, and of four times as many for
    /// each of their interfaces. [setup]
    EoeSwitch(Mailboxes& mailboxes, std::span<const EoePort> ports, std::size_t depth = 8);

    /// Moves the frames of the interfaces to the queues of the slaves. Call once per cycle.
    /// [realtime]
    void pump() noexcept;
    /// Discards the frames that wait for a slave, and counts them as lost: the machine was stopped,
    /// and they are stale. A frame that is being sent is not one of them. [realtime]
    void discard() noexcept;
    /// Returns how many frames to slaves were lost. [realtime]
    std::uint32_t lost() const noexcept;
    /// Returns whether a slave has EoE. [realtime]
    bool has(const BusSlave& slave) const noexcept { return port_of(slave) != nullptr; }
    /// Returns whether frames wait for a slave that can take them. [realtime]
    bool pending(const BusSlave& slave) const noexcept;
    /// Sends the oldest frame for a slave. [realtime]
    Task<MailboxResult> serve(Channel&, BusSlave&) noexcept;
    bool take(const BusSlave&, const MailboxMessage&) noexcept override;

    /// Returns the number of interfaces. [any]
    std::size_t hosts() const noexcept { return hosts_.size(); }
    /// Return the frames for an interface, read by its thread, and those from it, written by that
    /// thread. [any]
    Queue<EthernetFrame>& to_host(std::size_t n = 0) noexcept { return hosts_[n]->to; }
    Queue<EthernetFrame>& from_host(std::size_t n = 0) noexcept { return hosts_[n]->from; }
    EoeCounters counters(const BusSlave& slave) const noexcept;  ///< [any]

private:
    struct Host {
        explicit Host(std::size_t depth) : to(depth), from(depth) {}
        Queue<EthernetFrame> to, from;
    };
    struct Port {
        explicit Port(std::uint16_t of, std::size_t depth) : host(of), queue(depth) {}
        std::uint16_t host;
        Queue<EthernetFrame> queue;
        /// the first ones of the queue are to be discarded; the very first may be being sent
        std::size_t stale = 0;
        bool sending = false;
        eoe::Joiner joiner;
        EoeCounters counters;
        std::uint8_t frame = 0;  // number of the next one, modulo 16
    };
    struct Learned {
        std::array<std::uint8_t, 6> address{};
        std::uint16_t host = 0;  // of the switch
        unsigned port = 0;
        bool used = false;
    };
    static constexpr unsigned the_host = 0xffff;  // as a port of a switch
    Port* port_of(const BusSlave& slave) const noexcept;
    static void drop_stale(Port& port) noexcept;
    void forward(std::uint16_t host, unsigned from, std::span<const std::uint8_t> frame) noexcept;
    Learned& slot_of(std::uint16_t host, const std::uint8_t* address) noexcept;
    void deliver(std::uint16_t host, unsigned port, std::span<const std::uint8_t> frame) noexcept;

    Mailboxes& mailboxes_;
    std::vector<std::unique_ptr<Host>> hosts_;
    std::vector<std::unique_ptr<Port>> ports_;
    std::vector<int> port_by_slave_;  // by index in Setup::slaves
    std::array<Learned, 256> learned_{};
};

/// The IP settings of slaves. All functions [realtime]. A result other than ok ends as `aborted`
/// with its code (eoe::Result).
class EoeClient {
public:
    explicit EoeClient(Mailboxes& mailboxes) noexcept : mailboxes_(mailboxes) {}
    /// Writes the settings. All fields up to DNS are sent and flagged, because slaves disagree on
    /// the position of a field after a gap.
    Task<MailboxResult> set_ip(Channel&, BusSlave&, const eoe::Ip&) noexcept;
    Task<MailboxResult> get_ip(Channel&, BusSlave&, eoe::Ip& to) noexcept;

private:
    Mailboxes& mailboxes_;
};

}  // namespace hal::ethercat::master
