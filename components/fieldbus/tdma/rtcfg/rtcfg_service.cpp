// SPDX-License-Identifier: MIT
#include "rtcfg_service.hpp"

#include <algorithm>
#include <stdexcept>

#include "rtcfg_client.hpp"

namespace hal::tdma::rtcfg {

namespace {

/// Returns the payload bytes of slot 0.
std::size_t capacity_of(const config::StationEntry& e) {
    for (const config::SlotEntry& slot : e.slots) {
        if (slot.setup.id == default_slot) return slot.setup.size;
    }
    return 0;
}

}  // namespace

Logical Service::logical_of(const config::StationEntry& e) {
    Logical logical;
    if (e.ip) {
        logical.by_ip = true;
        logical.ip = *e.ip;
    }
    return logical;
}

std::vector<Server::ClientSetup> Service::clients_of(const config::Schedule& schedule,
                                                     std::size_t own, const Read& read) {
    std::vector<Server::ClientSetup> clients;
    for (std::size_t i = 0; i < schedule.stations.size(); ++i) {
        const config::StationEntry& e = schedule.stations[i];
        if (i == own || e.role == Role::master || (!e.ip && !e.mac)) continue;
        Server::ClientSetup client{
            e.mac.value_or(Address{}), logical_of(e), config::block_of(schedule, i), {}};
        if (!e.stage_2.empty()) {
            // a backup omits what it cannot send
            const bool must = schedule.stations[own].role == Role::master;
            Message first;
            first.client = client.logical;
            first.data = std::span(reinterpret_cast<const std::uint8_t*>(client.stage_1.data()),
                                   client.stage_1.size());
            if (const std::size_t needs = stage_1_bytes(first),
                has = capacity_of(schedule.stations[own]);
                must && needs > has) {
                throw std::invalid_argument(
                    "slot 0 of the master is too short for station " + e.name +
                    ", which has a stage2: its block needs " + std::to_string(needs) +
                    " bytes in one frame, slot 0 " +
                    (has == 0 ? "is missing; add one"
                              : "has " + std::to_string(has) + "; make it longer") +
                    ", for example slot 0 100 1/1 " + std::to_string(needs));
            }
            const std::string which =
                "stage2 of station " + e.name + ": the file '" + e.stage_2 + "'";
            if (!read(e.stage_2, client.stage_2)) {
                if (must) throw std::invalid_argument(which + " cannot be read: " + client.stage_2);
                client.stage_2.clear();
            }
            if (client.stage_2.size() > max_stage_2_size) {
                throw std::invalid_argument(
                    which + " has " + std::to_string(client.stage_2.size()) + " bytes (limit " +
                    std::to_string(max_stage_2_size) + ")");
            }
        }
        clients.push_back(std::move(client));
        numbers_.push_back(i);
    }
    is_dead_.resize(clients.size());
    return clients;
}

Service::Service(Station& station, const config::Schedule& schedule, std::size_t own,
                 const Read& read, Events& events)
    : events_(events),
      server_(station, logical_of(schedule.stations.at(own)), clients_of(schedule, own, read),
              schedule.heartbeat_ms, this) {}

void Service::begin() noexcept {
    server_.begin();
    dead_ = 0;
    std::fill(is_dead_.begin(), is_dead_.end(), false);
}

void Service::on_client(std::size_t client, ClientState state, const Address& who) noexcept {
    const auto number = static_cast<Time>(numbers_[client]);
    if (state == ClientState::ready) {
        if (is_dead_[client]) {
            is_dead_[client] = false;
            --dead_;
        }
        events_.on_event(Event::station_ready, who, number);
    } else if (state == ClientState::dead) {
        if (!is_dead_[client]) {
            is_dead_[client] = true;
            ++dead_;
        }
        events_.on_event(Event::station_dead, who, number);
    }
}

void Service::on_too_long(std::size_t client) noexcept {
    events_.on_event(Event::station_too_long, {}, static_cast<Time>(numbers_[client]));
}

}  // namespace hal::tdma::rtcfg
