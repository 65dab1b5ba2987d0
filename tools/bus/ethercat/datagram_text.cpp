// SPDX-License-Identifier: MIT
#include "bus/ethercat/datagram_text.hpp"

#include <algorithm>
#include <fmt/core.h>
#include <iterator>
#include <span>

#include "ethercat/wire/al_status_codes.hpp"
#include "ethercat/wire/coe.hpp"
#include "ethercat/wire/foe.hpp"
#include "ethercat/wire/mailbox.hpp"
#include "ethercat/wire/registers.hpp"
#include "ethercat/wire/states.hpp"
#include "text/glyphs.hpp"

namespace hal::tools {

namespace {

using namespace hal::ethercat;
using Bytes = std::span<const std::uint8_t>;

struct RegisterName {
    std::uint16_t first, last;
    const char* name;
};
constexpr RegisterName names[] = {{0x0000, 0x000f, "ESC information"},
                                  {0x0010, 0x0011, "station address"},
                                  {0x0012, 0x0013, "station alias"},
                                  {0x0100, 0x0103, "DL control"},
                                  {0x0110, 0x0111, "DL status"},
                                  {0x0120, 0x0121, "AL control"},
                                  {0x0130, 0x0133, "AL status"},
                                  {0x0134, 0x0135, "AL status code"},
                                  {0x0140, 0x0151, "PDI"},
                                  {0x0200, 0x0201, "ECAT event mask"},
                                  {0x0204, 0x0207, "AL event mask"},
                                  {0x0210, 0x0211, "ECAT event"},
                                  {0x0220, 0x0223, "AL event"},
                                  {0x0300, 0x0313, "error counters"},
                                  {0x0400, 0x0443, "watchdog"},
                                  {0x0500, 0x050f, "EEPROM"},
                                  {0x0600, 0x06ff, "FMMU"},
                                  {0x0800, 0x087f, "sync manager"},
                                  {0x0900, 0x090f, "DC receive times"},
                                  {0x0910, 0x0917, "DC system time"},
                                  {0x0918, 0x091f, "DC receive time"},
                                  {0x0920, 0x0927, "DC system time offset"},
                                  {0x0928, 0x092b, "DC transmission delay"},
                                  {0x092c, 0x092f, "DC system time difference"},
                                  {0x0930, 0x0935, "DC control loop"},
                                  {0x0980, 0x09af, "DC SYNC"}};

const char* register_name(std::uint16_t address) {
    const auto found = std::find_if(std::begin(names), std::end(names), [&](const RegisterName& r) {
        return address >= r.first && address <= r.last;
    });
    return found == std::end(names) ? "" : found->name;
}

std::string state_name(unsigned status) {
    const char* const words[] = {"none", "INIT", "PRE-OP", "BOOT", "SAFE-OP", "5", "6", "7", "OP"};
    const unsigned state = status & 0x0f;
    return fmt::format("{}{}", state <= 8 ? words[state] : "several",
                       (status & 0x10) != 0 ? ", error" : "");
}

std::string object(std::uint16_t index, unsigned sub) {
    return fmt::format("0x{:04X}:{}", index, sub);
}

std::string sdo_text(Bytes payload, bool request) {
    const auto sdo = coe::read_sdo(payload);
    if (!sdo) return "SDO";
    namespace command = coe::command;
    const std::string name =
        object(sdo->index, sdo->sub) + (sdo->complete() ? ", complete access" : "");
    if (sdo->is(command::abort)) {
        return fmt::format("SDO abort {}: 0x{:08X}, {}", object(sdo->index, sdo->sub), sdo->value,
                           coe::abort_text(sdo->value));
    }
    if (request) {
        if (sdo->is(command::download)) return "SDO download " + name;
        if (sdo->is(command::upload)) return "SDO upload " + name;
        return sdo->is(command::upload_segment) ? "SDO upload segment" : "SDO download segment";
    }
    if (sdo->is(command::upload_response)) return "SDO uploaded " + name;
    if (sdo->is(command::download_response)) return "SDO downloaded " + name;
    return sdo->is(command::upload_segment_response) ? "SDO segment uploaded"
                                                     : "SDO segment downloaded";
}

std::string coe_text(Bytes payload) {
    if (payload.size() < coe::header_bytes) return "";
    switch (coe::service_of(payload.data())) {
    case coe::Service::emergency:
        if (const auto e = coe::read_emergency(payload)) {
            return fmt::format("emergency 0x{:04X}", e->code);
        }
        return "emergency";
    case coe::Service::sdo_request: return sdo_text(payload, true);
    case coe::Service::sdo_response: return sdo_text(payload, false);
    case coe::Service::sdo_information: return "SDO information";
    default:
        return fmt::format("service {}", static_cast<unsigned>(coe::service_of(payload.data())));
    }
}

std::string foe_text(Bytes payload) {
    const auto m = foe::read(payload);
    if (!m) return "";
    const std::string text(m->text());
    switch (m->opcode) {
    case foe::Opcode::read: return "read '" + printable(text) + "'";
    case foe::Opcode::write: return "write '" + printable(text) + "'";
    case foe::Opcode::data: return fmt::format("data packet {}, {} bytes", m->value, text.size());
    case foe::Opcode::ack: return fmt::format("acknowledge packet {}", m->value);
    case foe::Opcode::error:
        return fmt::format("error 0x{:X}, {}", m->value,
                           foe::to_string(static_cast<foe::Error>(m->value)));
    case foe::Opcode::busy: return "busy";
    }
    return "";
}

/// A mailbox message; empty when the bytes cannot be one.
std::string mailbox_text(Bytes bytes) {
    const auto m = read_mailbox(bytes);
    if (!m || m->payload.empty() || (bytes[5] & 0x80) != 0 || bytes[4] != 0) return "";
    const std::string name = to_string(m->type);
    switch (m->type) {
    case MailboxType::coe: return name + " " + coe_text(m->payload);
    case MailboxType::foe: return name + " " + foe_text(m->payload);
    case MailboxType::error: {
        const auto error = read_mailbox_error(m->payload);
        return error ? name + ": " + to_string(*error) : "";
    }
    default:
        if (bit_of(m->type) == 0) return "";
        return fmt::format("{}, {} bytes", name, m->payload.size());
    }
}

}  // namespace

std::string datagram_address(const DatagramView& d, bool passed) {
    switch (d.command) {
    case Command::nop: return "";
    case Command::aprd:
    case Command::apwr:
    case Command::aprw:
    case Command::armw:
        if (passed) {
            return fmt::format("position of 0x{:04X}", d.position());
        }
        return fmt::format("slave {}", static_cast<std::uint16_t>(-static_cast<int>(d.position())));
    case Command::fprd:
    case Command::fpwr:
    case Command::fprw:
    case Command::frmw: return fmt::format("station 0x{:04X}", d.position());
    case Command::brd:
    case Command::bwr:
    case Command::brw: return "all slaves";
    case Command::lrd:
    case Command::lwr:
    case Command::lrw: return fmt::format("logical 0x{:08X}", d.address);
    }
    return "";
}

namespace {

/// Returns ": SAFE-OP, acknowledge": the state that the master requests.
std::string control_text(const DatagramView& d) {
    const bool acknowledges = (d.data[0] & 0x10) != 0;
    return ": " + state_name(d.data[0] & 0x0fU) + (acknowledges ? ", acknowledge" : "");
}

/// Returns ": SAFE-OP + ERR 0x001B, text": the state of a slave, with the cause of an error.
std::string status_text(const DatagramView& d) {
    const std::string text = ": " + state_name(d.data[0]);
    const bool has_error = (d.data[0] & 0x10) != 0;
    const std::uint16_t code = d.length >= 6 ? get<std::uint16_t>(d.data + 4) : 0;
    if (!has_error || code == 0) return text;
    const std::string hexadecimal = fmt::format(" 0x{:04X}", code);
    const AlStatusCode* row = al_status(code);
    return text + (row ? fmt::format("{}, {}", hexadecimal, row->text) : hexadecimal);
}

/// Returns " 1, full": which sync manager, and the state of its buffer where that alone is read.
std::string sync_manager_text(const DatagramView& d, std::uint16_t address) {
    constexpr std::size_t bytes = 8;
    constexpr std::size_t status = 5;
    const std::size_t offset = address - registers::sync_manager;
    const bool is_one = d.length < bytes * 9;
    const bool is_status = offset % bytes == status && d.length == 1;
    const std::string number = is_one ? fmt::format(" {}", offset / bytes) : "";
    if (!is_status) return number;
    const bool is_full = (d.data[0] & 0x08) != 0;
    return number + (is_full ? ", full" : ", empty");
}

/// Returns what the bytes of a register mean, to be put behind its name.
std::string value_text(const DatagramView& d, std::uint16_t address) {
    constexpr std::uint16_t end_of_fmmus = 0x0700;
    constexpr std::uint16_t end_of_sync_managers = 0x0880;
    if (address == registers::al_control && d.length >= 1) return control_text(d);
    if (address == registers::al_status && d.length >= 1) return status_text(d);
    if (address >= registers::sync_manager && address < end_of_sync_managers) {
        return sync_manager_text(d, address);
    }
    if (address >= registers::fmmu && address < end_of_fmmus) {
        return fmt::format(" {}", (address - registers::fmmu) / 16);
    }
    if (address == registers::dc_system_time && d.length == 8) {
        return fmt::format(": {} ns", get<std::uint64_t>(d.data));
    }
    return "";
}

}  // namespace

std::string datagram_text(const DatagramView& d) {
    if (d.command == Command::nop || is_logical(d.command)) return "";
    const std::uint16_t address = d.register_address();
    if (address >= registers::process_data_memory) {
        return mailbox_text({d.data, d.length});
    }
    return register_name(address) + value_text(d, address);
}

}  // namespace hal::tools
