// SPDX-License-Identifier: MIT
#include "bus/ethercat/sii_reader.hpp"

#include <algorithm>

#include "ethercat/wire/registers.hpp"
#include "ethercat/wire/sii.hpp"

namespace hal::tools {

namespace {

namespace reg = ethercat::registers;

constexpr std::int64_t access_timeout_ns = 100'000'000;
constexpr std::uint16_t busy = 0x8000;
constexpr std::uint16_t failed = 0x6000;
constexpr std::uint16_t wide = 0x0040;
constexpr std::uint16_t read_command = 0x0100;
constexpr std::uint16_t write_command = 0x0201;
constexpr std::uint16_t registers_bytes = 14;
constexpr std::size_t data_at = 6;

}  // namespace

bool SiiReader::advance(Access& access, const WireDatagram& answer) {
    if (!answer.accepted()) {
        access.stage = Access::Stage::failed;
        return false;
    }
    if (access.stage == Access::Stage::start) {
        access.stage = Access::Stage::poll;
        return false;
    }
    access.registers = answer.data;
    const auto control = ethercat::get<std::uint16_t>(answer.data.data());
    if ((control & busy) != 0) return false;
    const bool rejected = (control & failed) != 0;
    access.stage = rejected ? Access::Stage::start : Access::Stage::done;
    return rejected;
}

void SiiReader::clear_errors(std::span<const std::size_t> positions) {
    const std::uint8_t nothing[2] = {0, 0};
    std::vector<WireDatagram> datagrams;
    for (const std::size_t position : positions) {
        datagrams.push_back(write_datagram(position, reg::eeprom_control, nothing));
    }
    exchange_.run(datagrams);
}

void SiiReader::execute(std::vector<Access>& accesses) {
    const std::int64_t until_ns = access_.now_ns() + access_timeout_ns;
    for (;;) {
        std::vector<WireDatagram> datagrams;
        std::vector<Access*> active;
        for (Access& access : accesses) {
            if (access.stage == Access::Stage::start) {
                std::uint8_t request[6];
                ethercat::put(request, access.command);
                ethercat::put(request + 2, access.word);
                datagrams.push_back(write_datagram(access.position, reg::eeprom_control, request));
                active.push_back(&access);
            } else if (access.stage == Access::Stage::poll) {
                datagrams.push_back(
                    read_datagram(access.position, reg::eeprom_control, registers_bytes));
                active.push_back(&access);
            }
        }
        if (active.empty()) return;
        exchange_.run(datagrams);
        std::vector<std::size_t> rejecting;
        for (std::size_t n = 0; n < active.size(); ++n) {
            if (advance(*active[n], datagrams[n])) {
                rejecting.push_back(active[n]->position);
            }
        }
        // an EEPROM that stores a word does not acknowledge
        if (!rejecting.empty()) {
            clear_errors(rejecting);
        }
        if (access_.now_ns() < until_ns) continue;
        for (Access* access : active) {
            if (access->stage != Access::Stage::done) {
                access->stage = Access::Stage::failed;
            }
        }
        return;
    }
}

std::vector<SiiReader::Image> SiiReader::read(std::span<const std::size_t> positions,
                                              std::size_t length) {
    const std::uint8_t to_master[] = {0};
    std::vector<Image> images(positions.size());
    std::vector<WireDatagram> owners;
    for (const std::size_t position : positions) {
        owners.push_back(read_datagram(position, reg::eeprom_configuration, 1));
    }
    exchange_.run(owners);
    std::vector<WireDatagram> claims;
    std::vector<WireDatagram> releases;
    for (std::size_t n = 0; n < positions.size(); ++n) {
        if (!owners[n].accepted()) continue;
        images[n].emplace();
        if (owners[n].data[0] == 0) continue;
        claims.push_back(write_datagram(positions[n], reg::eeprom_configuration, to_master));
        releases.push_back(write_datagram(positions[n], reg::eeprom_configuration, owners[n].data));
    }
    exchange_.run(claims);
    for (;;) {
        std::vector<Access> accesses;
        for (std::size_t n = 0; n < positions.size(); ++n) {
            if (!images[n]) continue;
            const std::size_t present = images[n]->size();
            const std::size_t needed =
                length != 0 ? length : ethercat::sii::bytes_needed(*images[n]);
            if (present >= needed) continue;
            accesses.push_back({.slave = n,
                                .position = positions[n],
                                .command = read_command,
                                .word = static_cast<std::uint32_t>(present / 2)});
        }
        if (accesses.empty()) break;
        execute(accesses);
        for (const Access& access : accesses) {
            Image& image = images[access.slave];
            if (access.stage != Access::Stage::done) {
                image.reset();
                continue;
            }
            const auto control = ethercat::get<std::uint16_t>(access.registers.data());
            const std::size_t bytes = (control & wide) != 0 ? 8 : 4;
            const auto data = access.registers.begin() + data_at;
            image->insert(image->end(), data, data + static_cast<std::ptrdiff_t>(bytes));
        }
    }
    exchange_.run(releases);
    for (Image& image : images) {
        if (image && length != 0) {
            image->resize(length);
        }
    }
    return images;
}

bool SiiReader::write(std::size_t position, std::uint32_t word, std::uint16_t value) {
    const std::uint8_t to_master[] = {0};
    const std::uint8_t bytes[] = {static_cast<std::uint8_t>(value),
                                  static_cast<std::uint8_t>(value >> 8)};
    // in this order, and each after the one before was executed
    for (const WireDatagram& step : {write_datagram(position, reg::eeprom_configuration, to_master),
                                     write_datagram(position, reg::eeprom_data, bytes)}) {
        WireDatagram datagram = step;
        exchange_.run({&datagram, 1});
        if (!datagram.accepted()) return false;
    }
    std::vector<Access> accesses{{.position = position, .command = write_command, .word = word}};
    execute(accesses);
    return accesses.front().stage == Access::Stage::done;
}

}  // namespace hal::tools
