// SPDX-License-Identifier: MIT
// The mailbox gateway (ETG.8200): programs of vendors reach the mailboxes of slaves by UDP or TCP
// while the machine runs. The protocol has no access control.
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "ethercat/master/request_queue.hpp"

struct pollfd;

namespace hal::ethercat::master {

/// A slave as the gateway offers it: found by its station address, described in the master's own
/// dictionary.
struct GatewaySlave {
    std::uint16_t station = 0;
    std::uint16_t number = 0;  ///< number: BusSlave::number
    std::uint32_t vendor = 0;
    std::uint32_t product = 0;
    std::uint32_t revision = 0;
    std::uint32_t serial = 0;
};

/// The slaves as the cycle knows them, for the thread of the gateway.
class GatewaySlaves {
public:
    explicit GatewaySlaves(std::size_t max) : rows_(max) {}  ///< [setup]
    /// Sets the slaves in the order of their positions: `slave(n)` returns the BusSlave at position
    /// n. [realtime] one thread
    template <class Slave>
    void set(std::size_t count, Slave slave) noexcept {
        count = count < rows_.size() ? count : rows_.size();
        for (std::size_t n = 0; n < count; ++n) {
            const BusSlave& s = slave(n);
            Row& row = rows_[n];
            row.station = 0;  // not valid until all of it is written
            row.number = s.number;
            row.vendor = s.vendor;
            row.product = s.product;

            row.revision = s.revision;
            row.serial = s.serial;
            row.station = s.station;
        }
        count_ = count;
    }
    /// Returns the slaves; one that changes at this moment is left out. [setup]
    std::vector<GatewaySlave> all() const;

private:
    struct Row {
        std::atomic<std::uint16_t> station{0};
        std::atomic<std::uint16_t> number{0};
        std::atomic<std::uint32_t> vendor{0};
        std::atomic<std::uint32_t> product{0};
        std::atomic<std::uint32_t> revision{0};
        std::atomic<std::uint32_t> serial{0};
    };
    std::vector<Row> rows_;
    std::atomic<std::size_t> count_{0};
};

struct GatewaySetup {
    /// of the interface to listen on; "0.0.0.0": all
    std::string address = "127.0.0.1";
    std::uint16_t port = 34980;  ///< 0: any free one
    bool tcp = true;
    std::size_t max_clients = 16;  ///< of TCP
    /// A request that the cycle has not begun by then, because it does not run or the slave is busy,
    /// is dropped. Shorter than the 2 s that clients usually wait: what it writes later would
    /// surprise them.
    std::chrono::milliseconds max_wait{1500};
    /// Returns the slaves; called in the gateway's thread.
    std::function<std::vector<GatewaySlave>()> slaves;
};

/// Answers an SDO upload, also with complete access, or a request for SDO information, from the
/// dictionary of the master (ETG.1510): names, 8000h + n configuration of slave n, F000h, F020h
/// addresses. The list of objects is as long as one message.
/// `message` holds the request, and then the answer; returns its length, 0 for a message that is
/// not understood. [any]
std::size_t answer_for_master(std::span<const GatewaySlave> slaves, std::span<std::uint8_t> message,
                              std::size_t length) noexcept;

/// See the top of this file. All functions [setup].
class Gateway {
public:
    /// Opens the sockets and starts the thread. `problem` is set when a socket cannot be opened;
    /// then the gateway does nothing. `port` must be used by nothing else, and its server must
    /// serve or be stopped until the gateway is destroyed.
    Gateway(RequestPort& port, GatewaySetup setup, std::string& problem);
    ~Gateway();
    Gateway(const Gateway&) = delete;
    Gateway& operator=(const Gateway&) = delete;
    std::uint16_t port() const noexcept { return number_; }  ///< Returns the UDP and TCP port.
    std::uint32_t answered() const noexcept { return answered_; }
    /// Returns the number of invalid requests and of those without a reply.
    std::uint32_t dropped() const noexcept { return dropped_; }

private:
    struct Sender;
    struct Client;
    struct Pending;
    void run();
    void list_polled(std::vector<pollfd>& polled) const;
    static void forget_closed(const pollfd& polled, int& fd);
    void serve(Client& client, short events);
    void accept_client();
    void take(std::span<const std::uint8_t> bytes, const Sender& sender);
    void answer(const Sender& sender, std::span<const std::uint8_t> message);
    void read_udp();
    void read_tcp(Client& client);
    void collect();
    /// A reply to the client is pending.
    bool is_waiting(const Client& client) const;

    RequestPort& requests_;
    GatewaySetup setup_;
    int udp_ = -1;
    int tcp_ = -1;
    std::uint16_t number_ = 0;
    std::vector<std::unique_ptr<Client>> clients_;
    std::vector<std::unique_ptr<Pending>> pending_;
    std::uint32_t next_client_ = 1;
    std::atomic<std::uint32_t> answered_{0};
    std::atomic<std::uint32_t> dropped_{0};
    std::atomic<bool> stop_{false};
    std::thread thread_;
};

}  // namespace hal::ethercat::master
