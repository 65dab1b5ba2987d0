// SPDX-License-Identifier: MIT
#include "remote_discovery.hpp"

#include <algorithm>
#include <cctype>
#include <ctime>
#include <optional>

#include "mesa/hostmot2/registers.hpp"

namespace hal::mesa {

namespace {

namespace ss = smart_serial;

constexpr std::size_t max_records = 64;
constexpr unsigned max_field_bits = 64;
constexpr std::size_t max_record_size = 14 + 2 * 49;
/// Time of a port for a reset and for the start of its channels.
constexpr int slow_polls = 8000;
constexpr int fast_polls = 1000;

/// One port during the discovery.
class PortSession {
public:
    PortSession(SetupLink& link, const CardImage& image, const RemotePort& port)
        : link_(link), image_(image), port_(port) {}

    void command(std::uint32_t value, int polls = fast_polls) {
        Request request;
        request.write32(port_.command, value);
        request.read(Space::hostmot2, port_.command, Unit::u32);
        std::uint32_t left = load<std::uint32_t>(link_.exchange(request).data());
        for (int n = 0; left != 0; ++n) {
            if (n >= polls) {
                fail("does not execute the command " + std::to_string(value));
            }
            pause();
            left = link_.read32(port_.command);
        }
    }
    std::uint32_t local_byte(std::uint32_t address) {
        command(ss::port::read_local | address);
        return link_.read32(port_.data) & 0xffU;
    }
    void reset() {
        link_.write32(port_.command, ss::port::reset);
        link_.write32(port_.command, ss::port::clear);
        for (int n = 0; n < fast_polls; ++n) {
            if (link_.read32(port_.command) == 0 &&
                local_byte(ss::local::version) != ss::local::not_ready) {
                return;
            }
            pause();
        }
        fail("does not start after its reset");
    }
    void write_channel(unsigned reg, unsigned channel, std::uint32_t value) {
        link_.write32(port_.of_channel(reg, channel), value);
    }
    std::uint32_t read_channel(unsigned reg, unsigned channel) {
        return link_.read32(port_.of_channel(reg, channel));
    }
    /// Sends a request to the device of a channel and returns its user register 0.
    std::uint32_t ask(unsigned channel, std::uint32_t request) {
        const std::uint16_t status = port_.of_channel(ss::control_status, channel);
        link_.write32(status, request);
        for (int n = 0; (link_.read32(status) & 0xff00U) != 0; ++n) {
            if (n >= fast_polls) {
                fail("channel " + std::to_string(channel) + " does not accept a request");
            }
            pause();
        }
        command(ss::port::do_it | 1U << channel);
        if ((link_.read32(port_.data) >> channel & 1U) != 0) {
            fail("the device on channel " + std::to_string(channel) + " does not answer");
        }
        return read_channel(ss::user, channel);
    }
    std::uint8_t byte(unsigned channel, std::uint16_t address) {
        return static_cast<std::uint8_t>(
            ask(channel, ss::remote::request(ss::remote::read_byte, address)));
    }

    [[noreturn]] void fail(const std::string& what) const {
        throw CardError(image_.address + " (" + image_.card + "): smart-serial port " +
                        std::to_string(port_.port) + " " + what);
    }

private:
    void pause() const {
        if (link_.in_memory()) return;
        const timespec time{0, 1'000'000};
        nanosleep(&time, nullptr);
    }

    SetupLink& link_;
    const CardImage& image_;
    const RemotePort& port_;
};

std::string pin_name_of(const std::string& name) {
    std::string result;
    for (const char c : name) {
        const auto character = static_cast<unsigned char>(c);
        const bool is_kept = std::isalnum(character) != 0 || c == '-' || c == '_' || c == '.';
        result += is_kept ? static_cast<char>(std::tolower(character)) : '-';
    }
    return result;
}

std::vector<std::uint16_t> read_addresses(PortSession& port, unsigned channel,
                                          std::uint16_t table) {
    std::vector<std::uint16_t> addresses;
    for (std::size_t n = 0; table != 0 && n < max_records; ++n) {
        const auto at = static_cast<std::uint16_t>(table + 2 * n);
        const unsigned low = port.byte(channel, at);
        const unsigned high = port.byte(channel, static_cast<std::uint16_t>(at + 1));
        if ((low | high) == 0) break;
        addresses.push_back(static_cast<std::uint16_t>(low | high << 8));
    }
    return addresses;
}

/// Reads bytes until they are a record. Returns nothing for a mode.
std::optional<ss::Record> read_record(PortSession& port, unsigned channel, std::uint16_t address) {
    std::vector<std::uint8_t> bytes;
    for (std::size_t n = 0; n < max_record_size; ++n) {
        bytes.push_back(port.byte(channel, static_cast<std::uint16_t>(address + n)));
        if (n == 0 && bytes[0] == ss::ModeRecord::mark) return {};
        if (n == 0 && bytes[0] != ss::Record::mark) break;
        auto record = ss::decode_record(bytes);
        if (record && record->bits > max_field_bits) break;
        if (record) return record;
    }
    port.fail("the device on channel " + std::to_string(channel) +
              " describes itself in an unknown form");
}

void add_field(Remote& remote, ss::Record record) {
    record.name = pin_name_of(record.name);
    const RemoteField field{std::move(record), 0};
    if (field.is_output()) {
        remote.outputs.push_back(field);
        remote.outputs.back().bit = remote.output_bits;
        remote.output_bits += field.record.bits;
    }
    if (field.is_input()) {
        remote.inputs.push_back(field);
        remote.inputs.back().bit = remote.input_bits;
        remote.input_bits += field.record.bits;
    }
}

/// Reads a value of up to 32 bits.
std::uint32_t read_value(PortSession& port, unsigned channel, const ss::Record& record) {
    std::uint32_t size = 0;  // binary logarithm of the bytes
    if (record.bits > 8) {
        size = record.bits > 16 ? 2 : 1;
    }
    const std::uint32_t value =
        port.ask(channel, ss::remote::request(ss::remote::read + size, record.address));
    return record.bits >= 32 ? value : value & ((1U << record.bits) - 1U);
}

void read_tables(PortSession& port, Remote& remote, std::uint32_t pointers, unsigned max_bits) {
    const auto process = read_addresses(port, remote.channel, pointers & 0xffffU);
    for (const std::uint16_t address : process) {
        if (auto record = read_record(port, remote.channel, address)) {
            add_field(remote, std::move(*record));
        }
    }
    for (const std::uint16_t address :
         read_addresses(port, remote.channel, static_cast<std::uint16_t>(pointers >> 16))) {
        if (std::ranges::find(process, address) != process.end()) continue;
        const auto record = read_record(port, remote.channel, address);
        if (!record || record->bits == 0 || record->bits > 32) continue;
        remote.constants.push_back(
            {pin_name_of(record->name), read_value(port, remote.channel, *record)});
    }
    if (std::max(remote.output_bits, remote.input_bits) > max_bits) {
        port.fail("the " + remote.kind + " on channel " + std::to_string(remote.channel) +
                  " needs " + std::to_string(std::max(remote.output_bits, remote.input_bits)) +
                  " bits; the firmware has " + std::to_string(max_bits));
    }
}

std::string kind_of_device(std::uint32_t letters) {
    std::string kind;
    for (unsigned n = 0; n < 4; ++n) {
        const auto c = static_cast<unsigned char>(letters >> 8 * n);
        if (std::isalnum(c) != 0) {
            kind += static_cast<char>(std::tolower(c));
        }
    }
    return kind.empty() ? "remote" : kind;
}

/// Makes the pins of all used channels outputs of the module, and nothing else.
void drive_pins(SetupLink& link, const CardImage& image, bool is_on) {
    const CardModule* const ports = image.find(Tag::ioport);
    const unsigned width = image.idrom.port_width;
    for (unsigned port = 0; ports != nullptr && port < image.idrom.ports; ++port) {
        std::uint32_t bits = 0;
        for (unsigned n = 0; n < width && port * width + n < image.pins.size(); ++n) {
            const CardPin& pin = image.pins[port * width + n];
            const Tag tag = pin.descriptor.module;
            const bool is_serial = tag == Tag::smart_serial || tag == Tag::wide_smart_serial;
            bits |= is_on && is_serial && pin.is_module_output() ? 1U << n : 0U;
        }
        link.write32(ports->addresses.at(ioport::source, port), bits);
        link.write32(ports->addresses.at(ioport::direction, port), bits);
    }
}

void discover_port(SetupLink& link, const CardImage& image, const ConfigString& config,
                   RemotePort& port, unsigned user_words) {
    PortSession session(link, image, port);
    const std::uint32_t channels = image.serial_channels(config, port.port);
    session.reset();
    session.command(ss::port::stop_all);
    for (unsigned channel = 0; channel < ss::max_channels; ++channel) {
        if ((channels >> channel & 1U) == 0) continue;
        const auto mode = static_cast<std::uint32_t>(config.serial_mode(port.port, channel));
        session.write_channel(ss::control_status, channel, mode << 24);
    }
    session.command(ss::port::start_setup | channels, slow_polls);
    for (unsigned channel = 0; channel < ss::max_channels; ++channel) {
        if ((channels >> channel & 1U) == 0) continue;
        const std::uint32_t pointers = session.read_channel(ss::user + 2, channel);
        if (pointers == 0) continue;
        Remote remote;
        remote.port = port.port;
        remote.channel = channel;
        remote.mode = static_cast<unsigned>(config.serial_mode(port.port, channel));
        remote.serial_number = session.read_channel(ss::user, channel);
        remote.kind = kind_of_device(session.read_channel(ss::user + 1, channel));
        read_tables(session, remote, pointers, 32 * user_words);
        port.remotes.push_back(std::move(remote));
    }
    session.command(ss::port::stop_all);
}

}  // namespace

std::vector<RemotePort> discover_remotes(SetupLink& link, const CardImage& image,
                                         const ConfigString& config) {
    std::vector<RemotePort> ports;
    drive_pins(link, image, true);
    for (const Tag tag : {Tag::smart_serial, Tag::wide_smart_serial}) {
        const CardModule* const module = image.find(tag);
        for (unsigned n = 0; module != nullptr && n < module->used; ++n) {
            if (image.serial_channels(config, n) == 0) continue;
            RemotePort port;
            port.port = n;
            port.addresses = module->addresses;
            port.command = module->addresses.at(ss::command, n);
            port.data = module->addresses.at(ss::data, n);
            discover_port(link, image, config, port, tag == Tag::smart_serial ? 3 : 7);
            if (!port.remotes.empty()) {
                ports.push_back(std::move(port));
            }
        }
    }
    drive_pins(link, image, false);
    return ports;
}

}  // namespace hal::mesa
