// SPDX-License-Identifier: MIT
// The seam to devices that answer datagrams: a card on the network, a card in memory. An address
// picks the driver: `eth:10.10.10.10` UDP to a host, `sim:NAME` a server in the memory of this
// process, which answers in the thread of the sender. This header does not know the protocol of the
// datagrams.
//
//     auto opened = hal::datagram::open("eth:10.10.10.10", {.port = 27181});   // [setup]
//     if (!opened) throw std::runtime_error(opened.problem);
//     port.send(request, now_ns);                                              // in the cycle
//     if (port.wait(deadline_ns)) size = port.receive(buffer, now_ns);
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>

namespace hal::datagram {

#pragma GCC visibility push(default)

/// Value of `now_ns` outside of a cycle. A server in memory uses the newest time it knows.
inline constexpr std::int64_t unclocked = INT64_MIN;
/// The payload of a UDP datagram in an Ethernet frame of 1500 bytes.
inline constexpr std::size_t max_size = 1472;

struct Options {
    std::uint16_t port = 0;  ///< UDP port of an address without one
    /// duration for which wait() spins before it sleeps, ns
    std::int64_t spin_ns = 150'000;
};

struct Description {
    std::string address;  ///< as opened
    std::string transport;  ///< "UDP", "card in memory"; empty: an unknown driver
    bool in_memory = false;  ///< one process; its time is what its users pass in
    std::string remark{};  ///< why answers may be missing, as a sentence; empty: unknown
};

/// One user's end. Opened and destroyed in setup, used by one thread at a time. No function
/// allocates or locks, except those marked [setup]; none waits except wait().
class Port {
public:
    virtual ~Port() = default;
    Port() = default;
    Port(const Port&) = delete;
    Port& operator=(const Port&) = delete;

    /// Sends a datagram of 1..max_size bytes. Returns false when it was not sent. [realtime]
    virtual bool send(std::span<const std::uint8_t> bytes, std::int64_t now_ns) noexcept = 0;
    /// Copies the oldest datagram that has arrived; what does not fit is cut off. Returns its size;
    /// 0: none has arrived. [realtime]
    virtual std::size_t receive(std::span<std::uint8_t> to, std::int64_t now_ns) noexcept = 0;
    /// Waits until a datagram has arrived or for `limit_ns`: spins for Options::spin_ns, then
    /// sleeps. Returns whether one has arrived. Does not wait on a port in memory, where time does
    /// not pass by waiting. [realtime] in a function whose job it is to wait
    virtual bool wait(std::int64_t limit_ns) noexcept = 0;
    /// [setup]
    virtual const Description& description() const noexcept = 0;
};

struct Opened {
    std::unique_ptr<Port> port;
    std::string problem;
    explicit operator bool() const noexcept { return port != nullptr; }
};

/// Opens `eth:HOST`, `eth:HOST:PORT` or `sim:NAME`, with `?spin=100us`. [setup]
Opened open(std::string_view address, const Options& options = {});
/// Describes what open() would return, without opening it. [setup]
Description describe(std::string_view address);
/// Returns an address as it is, and of a host, `10.10.10.10`, its address. [setup]
std::string address_of(std::string_view host_or_address);

/// Where a server in memory puts its answers.
class Replies {
public:
    virtual ~Replies() = default;
    /// Queues a datagram to the sender of the request that arrives at `at_ns`; one that finds the
    /// queue full is lost. [realtime]
    virtual void send(std::span<const std::uint8_t> bytes, std::int64_t at_ns) noexcept = 0;
};

/// A device in memory. It is called by the thread that sends, one call at a time.
class Server {
public:
    virtual ~Server() = default;
    /// Handles a request. `now_ns` is the start of the sender's cycle, or `unclocked`. [realtime]
    virtual void serve(std::span<const std::uint8_t> request, std::int64_t now_ns,
                       Replies& replies) noexcept = 0;
};

/// A server's registration; it ends with this object.
class Attachment {
public:
    virtual ~Attachment() = default;
    /// Calls `work(server)` while no request is served. Returns false, without a call, when another
    /// thread has the server for too long. [realtime]
    virtual bool exclusively(void (*work)(void* self), void* self) noexcept = 0;
};

struct Attached {
    std::unique_ptr<Attachment> attachment;
    std::string problem;
    explicit operator bool() const noexcept { return attachment != nullptr; }
};

/// Makes `server` the one that answers on `sim:NAME`; the address of another driver, or a name that
/// has a server, is a problem. The server outlives the attachment. [setup]
Attached attach(std::string_view address, Server& server);

/// The right to command a device; it ends with the last copy of `claim`.
struct Claimed {
    std::shared_ptr<const std::string> claim;  ///< nullptr: `holder` has it
    std::string holder{};
    explicit operator bool() const noexcept { return claim != nullptr; }
};

/// Makes `user` the only one of this process that commands the device of an address. The same user
/// gets a copy of its claim, as its next version in a reload. [setup]
Claimed claim(std::string_view address, const std::string& user);

#pragma GCC visibility pop

}  // namespace hal::datagram
