// SPDX-License-Identifier: MIT
// The service of a master, or of a backup in its place, for stations without a schedule: sends each
// one its block and its file by RTcfg.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "fieldbus/tdma/config/schedule.hpp"
#include "rtcfg_server.hpp"

namespace hal::tdma::rtcfg {

/// Serves all stations of the schedule that have an ip or a mac.
class Service final : private ServerEvents {
public:
    /// Reads a file for stage 2 into `bytes`. Returns false and sets `bytes` to the reason.
    using Read = std::function<bool(const std::string& name, std::string& bytes)>;

    /// The arguments must outlive it. Throws std::invalid_argument when a stage 2 file cannot be
    /// sent; a backup omits that file. [setup]
    Service(Station& station, const config::Schedule& schedule, std::size_t own, const Read& read,
            Events& events);

    Server& server() noexcept { return server_; }
    void begin() noexcept;  ///< [setup]
    std::uint32_t dead() const noexcept { return dead_; }  ///< clients that went offline

private:
    void on_client(std::size_t client, ClientState, const Address&) noexcept override;
    void on_too_long(std::size_t client) noexcept override;
    static Logical logical_of(const config::StationEntry&);
    std::vector<Server::ClientSetup> clients_of(const config::Schedule&, std::size_t own,
                                                const Read&);

    std::vector<std::size_t> numbers_;  // indices of the clients in the schedule
    std::vector<bool> is_dead_;
    std::uint32_t dead_ = 0;
    Events& events_;
    Server server_;
};

}  // namespace hal::tdma::rtcfg
