// SPDX-License-Identifier: MIT
// Configures stations and monitors their heartbeats while its own station sends the syncs (RTnet,
// Documentation/RTcfg): the master, or a backup in its place. Its frames have the lowest priority
// in slot 0. A station that already sends has its own file and is not invited.
#pragma once

#include <string>
#include <vector>

#include "fieldbus/tdma/station/station.hpp"
#include "fieldbus/tdma/wire/rtcfg_frames.hpp"

namespace hal::tdma::rtcfg {

/// State of a client.
enum class ClientState : std::uint8_t { searching, configuring, ready, dead };

/// Events of the server. [realtime]
class ServerEvents {
public:
    virtual ~ServerEvents() = default;
    /// A client changed its state.
    virtual void on_client(std::size_t client, ClientState, const Address&) noexcept = 0;
    /// The stage 1 of an offline client does not fit into slot 0; reported once per client.
    virtual void on_too_long(std::size_t client) noexcept = 0;
};

class Server final : public Companion {
public:
    struct ClientSetup {
        Address mac{};     ///< zeros: identified by `logical` only
        Logical logical;
        std::string stage_1, stage_2;
    };
    /// `station` and `events` must outlive it. [setup]
    Server(Station& station, Logical own, std::vector<ClientSetup> clients,
           std::uint16_t heartbeat_ms, ServerEvents* events = nullptr);

    void arrived(std::span<const std::uint8_t> frame, Time now) noexcept override;
    void before_slots(Time now) noexcept override;
    void heard(const Address&, Time now) noexcept override;
    ClientState state(std::size_t client) const noexcept { return clients_[client].state; }
    std::size_t clients() const noexcept { return clients_.size(); }
    /// clients that are configured and online
    std::uint32_t ready() const noexcept { return ready_; }
    /// frames ignored: truncated, forged, of others
    std::uint64_t foreign() const noexcept { return foreign_; }
    /// forgets all clients. [setup]
    void begin() noexcept;

private:
    static constexpr Time invitation = 1'000'000'000;

private:
    static constexpr Time long_silence = 10 * invitation;
    struct Client {
        ClientSetup setup;
        ClientState state = ClientState::searching;
        Time invited = INT64_MIN / 2;
        Time heard = 0;  // as a client
        Time seen = INT64_MIN / 2;        // last frame of any kind
        bool learnt = false;              // MAC address learnt from its IP address
        bool restart = false;             // it has a configuration unknown to this server
        bool too_long_reported = false;
        std::uint32_t sent = 0;  // bytes of stage 2, reset by an acknowledgement
        std::uint8_t burst = 4;
        std::uint8_t left = 0;  // frames until the next acknowledgement
        bool began = false;  // the first frame of stage 2 was sent
    };
    Client* find(const Message&) noexcept;
    bool send(Message& m) noexcept;
    bool send_stage_2(Client&) noexcept;
    bool invite(Client&, Time now) noexcept;
    bool take(Client&, const Message&, Time now) noexcept;
    void become(Client&, ClientState) noexcept;
    void serve(Time now) noexcept;
    void rest() noexcept;
    void excuse(Time now) noexcept;

    Station& station_;
    Logical own_;
    std::vector<Client> clients_;
    std::uint16_t heartbeat_ms_;
    ServerEvents* events_;
    std::size_t next_ = 0;
    std::uint32_t ready_ = 0;
    std::uint64_t foreign_ = 0;
    bool serves_ = false;
    // local time when it began to serve
    Time began_ = 0;
    // local, last before_slots()
    Time last_slots_ = 0;
    std::array<std::uint8_t, ethernet::max_frame> frame_{};
};

}  // namespace hal::tdma::rtcfg
