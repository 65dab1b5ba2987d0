// SPDX-License-Identifier: MIT
#include "bus/ethercat/wire.hpp"

#include <algorithm>
#include <fmt/core.h>
#include <tuple>

#include "cli/output.hpp"
#include "ethercat/master/topology.hpp"
#include "ethercat/wire/registers.hpp"

namespace hal::tools {

namespace {

namespace reg = ethercat::registers;
using ethercat::Command;
using ethercat::get;

void set_state(ethercat::master::BusSlave& s, const WireDatagram& answer) {
    if (!answer.accepted()) {
        s.state = ethercat::State::none;
        return;
    }
    s.state = static_cast<ethercat::State>(answer.data[0] & 0x0f);
    s.al_failed = (answer.data[0] & ethercat::al_error) != 0;
    s.al_code = get<std::uint16_t>(answer.data.data() + 4);
}

constexpr std::uint16_t al_status_bytes = 6;

}  // namespace

std::optional<std::vector<std::uint8_t>> EthercatWire::read(std::size_t position,
                                                            std::uint16_t address,
                                                            std::uint16_t length) {
    WireDatagram datagram = read_datagram(position, address, length);
    exchange_.run({&datagram, 1});
    if (!datagram.accepted()) return std::nullopt;
    return datagram.data;
}

bool EthercatWire::write(std::size_t position, std::uint16_t address,
                         std::span<const std::uint8_t> bytes) {
    WireDatagram datagram = write_datagram(position, address, bytes);
    exchange_.run({&datagram, 1});
    return datagram.accepted();
}

bool EthercatWire::write(std::size_t position, std::uint16_t address, std::uint16_t value) {
    const std::uint8_t bytes[] = {static_cast<std::uint8_t>(value),
                                  static_cast<std::uint8_t>(value >> 8)};
    return write(position, address, bytes);
}

void EthercatWire::read_state(ethercat::master::BusSlave& s) {
    WireDatagram datagram = read_datagram(s.position, reg::al_status, al_status_bytes);
    exchange_.run({&datagram, 1});
    set_state(s, datagram);
}

std::optional<std::vector<std::uint8_t>> EthercatWire::sii(std::size_t position,
                                                           std::size_t length) {
    return sii_.read({&position, 1}, length).front();
}

bool EthercatWire::write_sii(std::size_t position, std::uint32_t word, std::uint16_t value) {
    return sii_.write(position, word, value);
}

void EthercatWire::keep(std::size_t position, const SiiReader::Image& image) {
    auto& c = contents_[position].emplace();
    if (image) {
        c = ethercat::sii::parse(*image);
    }
    auto& s = slaves_[position];
    s.vendor = c.vendor;
    s.product = c.product;
    s.revision = c.revision;
    s.serial = c.serial;
    s.protocols = c.protocols;
}

void EthercatWire::identify() {
    std::vector<std::size_t> positions;
    for (std::size_t n = 0; n < size(); ++n) {
        if (!contents_[n]) {
            positions.push_back(n);
        }
    }
    const std::vector<SiiReader::Image> images = sii_.read(positions);
    for (std::size_t n = 0; n < positions.size(); ++n) {
        keep(positions[n], images[n]);
    }
}

const ethercat::sii::Contents& EthercatWire::contents(std::size_t position) {
    if (!contents_[position]) {
        keep(position, sii(position));
    }
    return *contents_[position];
}

std::string EthercatWire::name(std::size_t position) {
    const auto& c = contents(position);
    return c.general.name.empty() ? fmt::format("0x{:08X}:0x{:08X}", c.vendor, c.product)
                                  : c.general.name;
}

bool EthercatWire::read_registers() {
    constexpr std::size_t each = 5;
    std::vector<WireDatagram> datagrams;
    for (std::size_t n = 0; n < size(); ++n) {
        datagrams.push_back(read_datagram(n, reg::type, 10));
        datagrams.push_back(read_datagram(n, reg::station_address, 4));
        datagrams.push_back(read_datagram(n, reg::dl_status, 2));
        datagrams.push_back(read_datagram(n, reg::al_status, al_status_bytes));
        datagrams.push_back(read_datagram(n, reg::dc_receive_time, 16));
    }
    exchange_.run(datagrams);
    for (std::size_t n = 0; n < size(); ++n) {
        const WireDatagram* const answers = &datagrams[each * n];
        const auto& [type, station, link] = std::tie(answers[0], answers[1], answers[2]);
        auto& s = slaves_[n];
        s.number = static_cast<std::uint16_t>(n);
        s.position = s.number;
        if (!type.accepted() || !station.accepted() || !link.accepted()) return false;
        s.present = true;
        s.fmmus = type.data[4];
        s.sync_managers = type.data[5];
        s.port_descriptor = type.data[7];
        s.features = get<std::uint16_t>(type.data.data() + 8);
        s.station = get<std::uint16_t>(station.data.data());
        s.alias = get<std::uint16_t>(station.data.data() + 2);
        s.dl_status = get<std::uint16_t>(link.data.data());
        set_state(s, answers[3]);
        if (!s.has_dc() || !answers[4].accepted()) continue;
        for (std::size_t port = 0; port < 4; ++port) {
            s.receive_time[port] = get<std::uint32_t>(answers[4].data.data() + 4 * port);
        }
    }
    return true;
}

bool EthercatWire::open(const EthercatOptions& options, bool alone) {
    if (!access_.open(options, alone)) return false;
    const std::uint16_t slaves = count_slaves();
    if (slaves == 0) {
        fail(options, fmt::format("no slave responds on {}; check cable and supply, and "
                                  "that it is the right interface",
                                  address()));
        return false;
    }
    latch_receive_times();
    slaves_.assign(slaves, {});
    contents_.assign(size(), std::nullopt);
    if (!read_registers()) {
        const auto missing =
            std::ranges::find_if(slaves_, [](const auto& s) { return !s.present; });
        fail(options, fmt::format("{} slaves respond on {}, but slave {} stopped doing "
                                  "so; check its cable and supply",
                                  size(), address(), missing->number));
        return false;
    }
    measure_line();
    return true;
}

/// Returns how many slaves a broadcast passes.
std::uint16_t EthercatWire::count_slaves() {
    WireDatagram count{Command::brd, ethercat::at_position(0, reg::type), {0}};
    exchange_.run({&count, 1});
    return count.working_counter.value_or(0);
}

/// Lets each slave latch at each port when this frame passes: the delays are computed from that.
void EthercatWire::latch_receive_times() {
    WireDatagram latch{Command::bwr, ethercat::at_position(0, reg::dc_receive_time), {0, 0, 0, 0}};
    exchange_.run({&latch, 1});
}

/// Finds the parent of each slave, and its delay from the first one with distributed clocks.
void EthercatWire::measure_line() {
    std::vector<ethercat::master::BusSlave*> line;
    for (auto& slave : slaves_) {
        line.push_back(&slave);
    }
    ethercat::master::find_tree(line);
    const auto first = std::ranges::find_if(line, [](const auto* s) { return s->has_dc(); });
    if (first != line.end()) {
        ethercat::master::find_delays(line, static_cast<std::size_t>(first - line.begin()));
    }
}

ethercat::master::BusSlave* EthercatWire::chosen(const EthercatPositionOptions& options) {
    const auto position = chosen_position(options, size());
    return position ? &slaves_[*position] : nullptr;
}

bool EthercatWire::without_arguments(const EthercatOptions& options) const {
    return arguments().empty() ||
           (fail(options, fmt::format("unexpected argument '{}'", arguments().front())), false);
}

}  // namespace hal::tools
