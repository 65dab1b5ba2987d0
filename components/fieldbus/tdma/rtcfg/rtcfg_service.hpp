// SPDX-License-Identifier: MIT
// What the master of a segment, or a backup in its place, does for stations without a schedule: gives each of its file its block and its
// file, by RTcfg.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "fieldbus/tdma/config/schedule.hpp"
#include "rtcfg_server.hpp"

namespace hal::tdma::rtcfg {

/// A station that stage 1 cannot reach has neither an ip nor a mac in the file, and is left out. [setup]
class Service final : private ServerEvents {
public:
    /// The bytes of a file that stage 2 sends, or false and the reason in `bytes`.
    using Read = std::function<bool(const std::string& name, std::string& bytes)>;

    /// All outlive it. Throws std::invalid_argument when a stage 2 file cannot be sent; a backup has none for that station then. [setup]
    Service(Station& station, const config::Schedule& schedule, std::size_t own, const Read& read, Events& events);

    Server&       server() noexcept { return server_; }
    void          begin() noexcept;                       ///< [setup]
    std::uint32_t dead() const noexcept { return dead_; } ///< clients that were there and are not

private:
    void                             on_client(std::size_t client, ClientState, const Address&) noexcept override;
    void                             on_too_long(std::size_t client) noexcept override;
    static Logical                   logical_of(const config::StationEntry&);
    std::vector<Server::ClientSetup> clients_of(const config::Schedule&, std::size_t own, const Read&);

    std::vector<std::size_t> numbers_;  // of clients in the schedule
    std::vector<bool>        is_dead_;
    std::uint32_t            dead_ = 0;
    Events&                  events_;
    Server                   server_;
};

}  // namespace hal::tdma::rtcfg
