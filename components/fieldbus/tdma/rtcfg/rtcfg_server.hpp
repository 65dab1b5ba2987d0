// SPDX-License-Identifier: MIT
// Gives stations their configuration, and notices when one is gone, while its own station sends the syncs: the master, or a backup in its
// place. Its frames wait in slot 0 of the station, behind all others. A station that is heard to send is at work already, by a file of its
// own, and is not asked.
#pragma once

#include <string>
#include <vector>

#include "fieldbus/tdma/station/station.hpp"
#include "fieldbus/tdma/wire/rtcfg_frames.hpp"

namespace hal::tdma::rtcfg {

enum class ClientState : std::uint8_t { searching, configuring, ready, dead };

/// [realtime] called by the server
class ServerEvents {
public:
    virtual ~ServerEvents() = default;
    virtual void on_client(std::size_t client, ClientState, const Address&) noexcept = 0;
    /// A client that nothing is heard of may need a stage 1 which slot 0 has no room for. Once for each.
    virtual void on_too_long(std::size_t client) noexcept = 0;
};

class Server final : public Companion {
public:
    struct ClientSetup {
        Address     mac{};     ///< zeros: known by `logical` only
        Logical     logical;
        std::string stage_1, stage_2;
    };
    /// [setup] Both outlive it.
    Server(Station& station, Logical own, std::vector<ClientSetup> clients, std::uint16_t heartbeat_ms, ServerEvents* events = nullptr);

    void          arrived(std::span<const std::uint8_t> frame, Time now) noexcept override;
    void          before_slots(Time now) noexcept override;
    void          heard(const Address&, Time now) noexcept override;
    ClientState   state(std::size_t client) const noexcept { return clients_[client].state; }
    std::size_t   clients() const noexcept { return clients_.size(); }
    std::uint32_t ready() const noexcept { return ready_; }          ///< clients that are configured and alive
    std::uint64_t foreign() const noexcept { return foreign_; }      ///< frames that were not acted on: cut, invented, of others
    void          begin() noexcept;                                           ///< knows of no station any more. [setup]

private:
    static constexpr Time invitation = 1'000'000'000, long_silence = 10 * invitation;
    struct Client {
        ClientSetup   setup;
        ClientState   state = ClientState::searching;
        Time          invited = INT64_MIN / 2, heard = 0;  // as a client
        Time          seen = INT64_MIN / 2;        // to send anything
        bool          learnt = false;              // its MAC address, by its IP address
        bool          restart = false;             // it has a configuration that this server does not know of
        bool          told_too_long = false;
        std::uint32_t sent = 0;                    // bytes of stage 2; with an acknowledgement: that it has
        std::uint8_t  burst = 4, left = 0;         // frames until the next acknowledgement
        bool          began = false;               // the first frame of stage 2 was sent
    };
    Client* find(const Message&) noexcept;
    bool    send(Message& m) noexcept;
    bool    send_stage_2(Client&) noexcept;
    bool    invite(Client&, Time now) noexcept;
    bool    take(Client&, const Message&, Time now) noexcept;
    void    become(Client&, ClientState) noexcept;
    void    serve(Time now) noexcept;
    void    rest() noexcept;

    Station&                                          station_;
    Logical                                           own_;
    std::vector<Client>                               clients_;
    std::uint16_t                                     heartbeat_ms_;
    ServerEvents*                                     events_;
    std::size_t                                       next_ = 0;
    std::uint32_t                                     ready_ = 0;
    std::uint64_t                                     foreign_ = 0;
    bool                                              serves_ = false;
    Time                                              began_ = 0;  // to serve
    std::array<std::uint8_t, ethernet::largest_frame> frame_{};
};

}  // namespace hal::tdma::rtcfg
