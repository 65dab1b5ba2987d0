// SPDX-License-Identifier: MIT
// A CANopen node: an object dictionary and all services of CiA 301, 304 and 305 around it. A device is built on it, and so is the
// master's own node. It owns no bus, no clock and no thread:
//
//     Device device(description, {.node_id = 5}, events);   // [setup]
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

struct DeviceSettings {
    std::uint8_t node_id = unconfigured;  ///< 1–127; unconfigured: waits for an LSS master
    std::size_t queue = 1024;             ///< frames on their way out
    bool auto_start = false;         ///< becomes operational after boot-up without being told
    bool nmt_slave = true;                ///< false: it is the NMT master
    bool lss = true;
    SdoServerSettings sdo{};
    SdoClientSettings sdo_client{};
    PdoSettings pdo{};
};

class Device final : private Handler {
public:
    Device(const Description&, const DeviceSettings&, Events&);  // [setup]

    /// Boots: the values in the dictionary hold, the boot-up message goes out. [realtime]
    void start(Time now) noexcept;
    void handle(const Frame&, Time now) noexcept;
    void poll(Time now) noexcept;
    FrameQueue& out() noexcept { return out_; }

    NmtState state() const noexcept { return state_; }
    std::uint8_t node_id() const noexcept { return node_id_; }
    /// What the NMT master would command, by itself. [realtime]
    void command(NmtCommand, Time now) noexcept;
    /// The bus went off: errors are handled as 1029h says. [realtime]
    void bus_off(Time now) noexcept { communication_error(0x8140, 0, now); }
    void bus_recovered() noexcept { emcy_.clear(0x8140); }
    /// The master's thread produces the SYNC itself: as if one had come. False: not the producer, or no room. [realtime]
    bool produce_sync(Time now) noexcept;

    Dictionary& dictionary() noexcept { return dictionary_; }
    Pdos& pdos() noexcept { return pdos_; }
    Srdos& srdos() noexcept { return srdos_; }
    const Srdos& srdos() const noexcept { return srdos_; }
    Emcy& emcy() noexcept { return emcy_; }
    Sync& sync() noexcept { return sync_; }
    TimeStamp& time() noexcept { return time_; }
    ErrorControl& error_control() noexcept { return error_control_; }
    LssSlave& lss() noexcept { return lss_; }
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
    void take_sync(Time now) noexcept;
    void configure_channel(std::uint16_t index) noexcept;

    const DeviceSettings settings_;
    Events& events_;
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
