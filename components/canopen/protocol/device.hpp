// SPDX-License-Identifier: MIT
// A CANopen node: an object dictionary and the services of CiA 301, CiA 304 and CiA 305 around it.
// Devices are built on it, and so is the master's own node. It owns neither bus, clock nor thread:
//
//     Description d = basic_device({.vendor = 1, .product = 2, .heartbeat_ms = 100});
//     d.add(0x2000, 0, Type::integer32, Access::read_write, 7, "speed").mappable();
//     DeviceEvents events;                               // override what the application reacts to
//     Device device(d, {.node_id = 5}, events);          // [setup]
//     device.start(now);
//     each cycle:
//         while (link.receive(frame, now)) device.handle(frame, now);
//         device.poll(now);
//         for (const Frame* f; (f = device.out().front()) && link.send(*f, now) == Sent::queued;) device.out().drop();
#pragma once

#include <memory>
#include <vector>

#include "dictionary.hpp"
#include "emcy.hpp"
#include "error_control.hpp"
#include "events.hpp"
#include "frames.hpp"
#include "lss_slave.hpp"
#include "pdo.hpp"
#include "sdo_client.hpp"
#include "sdo_server.hpp"
#include "srdo.hpp"
#include "sync.hpp"

namespace hal::canopen {

/// How a node behaves.
struct DeviceSettings {
    std::uint8_t node_id = unconfigured;  ///< 1..127; unconfigured: waits for an LSS master
    std::size_t queue = 1024;  ///< capacity of the transmit queue in frames
    /// becomes operational after boot-up without an NMT command
    bool auto_start = false;
    bool nmt_slave = true;  ///< obeys NMT commands; false: it is the NMT master
    bool lss = true;  ///< answers LSS requests (CiA 305)
    SdoServerSettings sdo{};
    SdoClientSettings sdo_client{};
    PdoSettings pdo{};
};

/// One node. All calls belong to one thread.
class Device final : private Handler {
public:
    /// Builds the node; the events outlive it. [setup]
    Device(const Description&, const DeviceSettings&, DeviceEvents&);

    /// Boots the node with the present values of the dictionary and sends the boot-up message.
    /// [realtime]
    void start(Time now) noexcept;
    /// Processes a received frame. [realtime]
    void handle(const Frame&, Time now) noexcept;
    /// Does what is due: timers, PDOs, timeouts; call it once per cycle. [realtime]
    void poll(Time now) noexcept;
    /// Returns the transmit queue; the owner of the bus empties it. [realtime]
    FrameQueue& out() noexcept { return out_; }

    /// Returns the NMT state. [realtime]
    NmtState state() const noexcept { return state_; }
    /// Returns the node ID, 1..127, or `unconfigured`. [realtime]
    std::uint8_t node_id() const noexcept { return node_id_; }
    /// Executes an NMT command as if the NMT master had sent it. [realtime]
    void command(NmtCommand, Time now) noexcept;
    /// Reports bus-off: raises EMCY 8140h and reacts as object 1029h specifies. [realtime]
    void bus_off(Time now) noexcept { communication_error(0x8140, 0, now); }
    /// Reports that the bus is available again: clears EMCY 8140h. [realtime]
    void bus_recovered() noexcept { emcy_.clear(0x8140); }
    /// Sends a SYNC now and processes it as a received one, for a thread that is the clock. Returns
    /// false if this node is not the producer (1005h) or the queue is full. [realtime]
    bool produce_sync(Time now) noexcept;

    /// Return the services of the node. [realtime]
    Dictionary& dictionary() noexcept { return dictionary_; }
    Pdos& pdos() noexcept { return pdos_; }
    Srdos& srdos() noexcept { return srdos_; }
    const Srdos& srdos() const noexcept { return srdos_; }
    Emcy& emcy() noexcept { return emcy_; }
    Sync& sync() noexcept { return sync_; }
    TimeStamp& time() noexcept { return time_; }
    ErrorControl& error_control() noexcept { return error_control_; }
    LssSlave& lss() noexcept { return lss_; }
    /// Return the SDO channels; servers and clients count from 0. [realtime]
    std::size_t sdo_servers() const noexcept { return servers_.size(); }
    SdoServer& sdo_server(std::size_t n) noexcept { return *servers_[n].server; }
    std::size_t sdo_clients() const noexcept { return clients_.size(); }
    SdoClient& sdo_client(std::size_t n) noexcept { return *clients_[n].client; }

private:
    struct Server {
        std::uint16_t index;
        std::unique_ptr<SdoServer> server;
    };
    struct Client {
        std::uint16_t index;
        std::unique_ptr<SdoClient> client;
    };
    Abort reading(Entry&) noexcept override;
    Abort writing(Entry&, std::span<const std::uint8_t>) noexcept override;
    void written(Entry&) noexcept override;

    void reset_communication(Time now) noexcept;
    void enter(NmtState, Time now) noexcept;
    void communication_error(std::uint16_t code, std::uint8_t node, Time now) noexcept;
    void handle_nmt(const Frame&, Time now) noexcept;
    void handle_service(const Frame&, Time now) noexcept;
    void take_sync(Time now) noexcept;
    void configure_channel(std::uint16_t index) noexcept;

    const DeviceSettings settings_;
    DeviceEvents& events_;
    FrameQueue out_;
    Dictionary dictionary_;
    Emcy emcy_;
    EmcyConsumer emcy_consumer_;
    Sync sync_;
    TimeStamp time_;
    ErrorControl error_control_;
    Pdos pdos_;
    Srdos srdos_;
    LssSlave lss_;
    std::vector<Server> servers_;
    std::vector<Client> clients_;
    NmtState state_ = NmtState::initialising;
    std::uint8_t node_id_;
    bool started_ = false;
    Time now_ = 0;
};

}  // namespace hal::canopen
