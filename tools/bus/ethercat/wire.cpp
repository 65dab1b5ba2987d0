// SPDX-License-Identifier: MIT
#include "bus/ethercat/wire.hpp"

#include <algorithm>
#include <cstring>
#include <fmt/core.h>

#include "cli/output.hpp"
#include "ethercat/master/topology.hpp"
#include "ethercat/wire/registers.hpp"

namespace hal::tools {

namespace {

namespace reg = ethercat::registers;
using ethercat::Command;
using ethercat::get;

constexpr std::int64_t answer_timeout_ns = 20'000'000;
constexpr std::int64_t eeprom_timeout_ns = 100'000'000;
constexpr unsigned tries_each = 3;
constexpr std::uint16_t eeprom_busy = 0x8000;
constexpr std::uint16_t eeprom_failed = 0x6000;
constexpr std::uint16_t eeprom_wide = 0x0040;

constexpr std::uint16_t eeprom_reads = 0x0100;
constexpr std::uint16_t eeprom_writes = 0x0201;

}  // namespace

std::optional<std::uint16_t> EthercatWire::exchange(Command command, std::uint32_t address,
                                                    std::span<std::uint8_t> data) {
    for (unsigned n = 0; n < tries_each; ++n) {
        std::array<std::uint8_t, ethercat::largest_frame_bytes> buffer;
        ethercat::FrameWriter frame(buffer, access_.port().address());
        ++index_;
        std::uint8_t* to =
            frame.add(command, index_, address, static_cast<std::uint16_t>(data.size()));
        if (to == nullptr) return std::nullopt;
        std::copy(data.begin(), data.end(), to);
        access_.port().send(frame.finish(), {}, access_.now_ns());
        const std::int64_t until = access_.now_ns() + answer_timeout_ns;
        while (auto bytes = access_.receive(until)) {
            ethercat::FrameReader reader(*bytes);
            const auto d = reader.next();
            const bool own = d && !d->more && d->command == command && d->index == index_ &&
                             d->length == data.size() && d->register_address() == address >> 16;
            if (!own) {
                continue;  // of another master
            }
            std::copy_n(d->data, d->length, data.begin());
            return d->wkc();
        }
    }
    return std::nullopt;
}

std::optional<std::vector<std::uint8_t>> EthercatWire::read(std::size_t position,
                                                            std::uint16_t address,
                                                            std::uint16_t length) {
    std::vector<std::uint8_t> bytes(length);
    if (exchange(Command::aprd, ethercat::at_position(static_cast<unsigned>(position), address),
                 bytes) != std::uint16_t{1}) {
        return std::nullopt;
    }
    return bytes;
}

bool EthercatWire::write(std::size_t position, std::uint16_t address,
                         std::span<const std::uint8_t> bytes) {
    std::vector<std::uint8_t> data(bytes.begin(), bytes.end());
    return exchange(Command::apwr, ethercat::at_position(static_cast<unsigned>(position), address),
                    data) == std::uint16_t{1};
}

bool EthercatWire::write(std::size_t position, std::uint16_t address, std::uint16_t value) {
    const std::uint8_t bytes[] = {static_cast<std::uint8_t>(value),
                                  static_cast<std::uint8_t>(value >> 8)};
    return write(position, address, bytes);
}

void EthercatWire::read_state(ethercat::master::BusSlave& s) {
    const auto bytes = read(s.position, reg::al_status, 6);
    if (!bytes) return void(s.state = ethercat::State::none);
    s.state = static_cast<ethercat::State>((*bytes)[0] & 0x0f);
    s.al_failed = ((*bytes)[0] & ethercat::al_error) != 0;
    s.al_code = get<std::uint16_t>(bytes->data() + 4);
}

bool EthercatWire::eeprom(std::size_t position, std::uint16_t command, std::uint32_t word,
                          std::vector<std::uint8_t>& answer) {
    std::uint8_t request[6];
    ethercat::put(request, command);
    ethercat::put(request + 2, word);
    for (const std::int64_t until = now_ns() + eeprom_timeout_ns; now_ns() < until;) {
        if (!write(position, reg::eeprom_control, request)) return false;
        std::uint16_t control = eeprom_busy;
        while ((control & eeprom_busy) != 0 && now_ns() < until) {
            const auto bytes = read(position, reg::eeprom_control, 14);
            if (!bytes) return false;
            answer = *bytes;
            control = get<std::uint16_t>(answer.data());
        }
        if ((control & (eeprom_busy | eeprom_failed)) == 0) return true;
        // clears the error; a part that stores a word does not acknowledge
        write(position, reg::eeprom_control, std::uint16_t{0});
    }
    return false;
}

std::optional<std::vector<std::uint8_t>> EthercatWire::sii(std::size_t position,
                                                           std::size_t length) {
    const auto owner = read(position, reg::eeprom_configuration, 1);
    if (!owner) return std::nullopt;
    const std::uint8_t to_master[] = {0};
    if ((*owner)[0] != 0 && !write(position, reg::eeprom_configuration, to_master)) {
        return std::nullopt;
    }
    std::vector<std::uint8_t> bytes, answer;
    bool good = true;
    while (good && bytes.size() < (length != 0 ? length : ethercat::sii::bytes_needed(bytes))) {
        good = eeprom(position, eeprom_reads, static_cast<std::uint32_t>(bytes.size() / 2), answer);
        if (good) {
            bytes.insert(bytes.end(), answer.begin() + 6,
                         answer.begin() + ((answer[0] & eeprom_wide) != 0 ? 14 : 10));
        }
    }
    if ((*owner)[0] != 0) {
        write(position, reg::eeprom_configuration, *owner);
    }
    if (!good) return std::nullopt;
    if (length != 0) {
        bytes.resize(length);
    }
    return bytes;
}

bool EthercatWire::write_sii(std::size_t position, std::uint32_t word, std::uint16_t value) {
    const std::uint8_t to_master[] = {0};
    std::vector<std::uint8_t> answer;
    return write(position, reg::eeprom_configuration, to_master) &&
           write(position, reg::eeprom_data, value) &&
           eeprom(position, eeprom_writes, word, answer);
}

const ethercat::sii::Contents& EthercatWire::contents(std::size_t position) {
    auto& cached = contents_[position];
    if (!cached) {
        const auto bytes = sii(position);
        cached = bytes ? ethercat::sii::parse(*bytes) : ethercat::sii::Contents{};
    }
    return *cached;
}

std::string EthercatWire::name(std::size_t position) {
    const auto& c = contents(position);
    return c.general.name.empty() ? fmt::format("0x{:08X}:0x{:08X}", c.vendor, c.product)
                                  : c.general.name;
}

bool EthercatWire::identify(std::size_t position) {
    auto& s = slaves_[position];
    s.number = s.position = static_cast<std::uint16_t>(position);
    const auto type = read(position, reg::type, 10);

    const auto station = read(position, reg::station_address, 4);

    const auto link = read(position, reg::dl_status, 2);
    if (!type || !station || !link) return false;
    s.present = true;
    s.fmmus = (*type)[4];
    s.sync_managers = (*type)[5];
    s.port_descriptor = (*type)[7];

    s.features = get<std::uint16_t>(type->data() + 8);
    s.station = get<std::uint16_t>(station->data());

    s.alias = get<std::uint16_t>(station->data() + 2);
    s.dl_status = get<std::uint16_t>(link->data());
    read_state(s);
    const auto& c = contents(position);
    s.vendor = c.vendor;
    s.product = c.product;
    s.revision = c.revision;
    s.serial = c.serial;

    s.protocols = c.protocols;
    if (!s.has_dc()) return true;
    const auto times = read(position, reg::dc_receive_time, 16);
    for (unsigned port = 0; times && port < 4; ++port) {
        s.receive_time[port] = get<std::uint32_t>(times->data() + 4 * port);
    }
    return true;
}

bool EthercatWire::open(const EthercatOptions& options, bool alone) {
    if (!access_.open(options, alone)) return false;
    std::vector<std::uint8_t> byte(1), latch(4);
    const auto count = exchange(Command::brd, ethercat::at_position(0, reg::type), byte);
    if (!count || *count == 0) {
        fail(options, fmt::format("no slave responds on {}; check cable and supply, and "
                                  "that it is the right interface",
                                  address()));

        return false;
    }
    // the receive times of this frame, for the delays
    exchange(Command::bwr, ethercat::at_position(0, reg::dc_receive_time), latch);
    slaves_.assign(*count, {});
    contents_.assign(*count, std::nullopt);
    std::vector<ethercat::master::BusSlave*> line;
    for (std::size_t n = 0; n < size(); ++n) {
        if (!identify(n)) {
            fail(options, fmt::format("{} slaves respond on {}, but slave {} stopped doing "
                                      "so; check its cable and supply",
                                      size(), address(), n));

            return false;
        }
        line.push_back(&slaves_[n]);
    }
    ethercat::master::find_tree(line);
    const auto first =
        std::find_if(line.begin(), line.end(), [](const auto* s) { return s->has_dc(); });
    if (first != line.end()) {
        ethercat::master::find_delays(line, static_cast<std::size_t>(first - line.begin()));
    }
    return true;
}

ethercat::master::BusSlave* EthercatWire::chosen(const EthercatPositionOptions& options) {
    if (options.position < 0 && size() != 1) {
        fail(options,
             fmt::format("{} slaves on the bus; choose one with -p 0 … -p {}", size(), size() - 1));

        return nullptr;
    }
    const auto position = static_cast<std::size_t>(options.position < 0 ? 0 : options.position);
    if (position >= size()) {
        fail(options, fmt::format("no slave at position {}; the last one of {} is at position {}",
                                  position, size(), size() - 1));

        return nullptr;
    }
    return &slaves_[position];
}

bool EthercatWire::without_arguments(const EthercatOptions& options) const {
    return arguments().empty() ||
           (fail(options, fmt::format("unexpected argument '{}'", arguments().front())), false);
}

}  // namespace hal::tools
