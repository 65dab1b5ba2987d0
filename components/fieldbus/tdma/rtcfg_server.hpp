// SPDX-License-Identifier: MIT
// Gives stations their configuration, and notices when one is gone. Its frames wait in slot 0 of the station, behind all others.
#pragma once

#include <string>
#include <vector>

#include "rtcfg_frames.hpp"
#include "station.hpp"

namespace hal::tdma::rtcfg {

enum class ClientState : std::uint8_t { searching, configuring, ready, dead };

/// [realtime] called by the server
class ServerEvents {
public:
    virtual ~ServerEvents() = default;
    virtual void on_client(std::size_t client, ClientState) noexcept = 0;
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

    void arrived(std::span<const std::uint8_t> frame, Time now) noexcept override;
    void before_slots(Time now) noexcept override;
    ClientState state(std::size_t client) const noexcept { return clients_[client].state; }
    std::size_t clients() const noexcept { return clients_.size(); }

private:
    static constexpr Time invitation = 1'000'000'000;
    struct Client {
        ClientSetup   setup;
        ClientState   state = ClientState::searching;
        Time          invited = INT64_MIN / 2, heard = 0;
        std::uint32_t acknowledged = 0, sent = 0;  // bytes of stage 2
        std::uint8_t  burst = 4, left = 0;         // frames until the next acknowledgement
        bool          began = false;               // the first frame of stage 2 was sent
    };
    Client* find(const Message&) noexcept;
    bool send(Message& m) noexcept;
    bool send_stage_2(Client&) noexcept;
    void become(Client&, ClientState) noexcept;

    Station&            station_;
    Logical             own_;
    std::vector<Client> clients_;
    std::uint16_t       heartbeat_ms_;
    ServerEvents*       events_;
    std::size_t         next_ = 0;
    std::array<std::uint8_t, ethernet::largest_frame> frame_{};
};

}  // namespace hal::tdma::rtcfg
