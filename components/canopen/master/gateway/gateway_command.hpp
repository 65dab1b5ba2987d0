// SPDX-License-Identifier: MIT
// A line of CiA 309-3, read: `[1] 1 5 read 0x1018 1 u32`.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "gateway_values.hpp"

namespace hal::canopen::gateway {

/// Lists the gateway's own codes of `ERROR:n`; the others are SDO abort codes.
enum class Error : std::uint16_t {
    none = 0,
    not_supported = 100,
    syntax = 101,
    state = 102,
    timeout = 103,
    no_net = 104,
    no_node = 105,
    bad_net = 106,
    bad_node = 107,
    lost_guarding = 200,
    heartbeat_started = 202,
    lost_heartbeat = 203,
    boot_up = 205,
    init_failed = 304,
    pdo_used = 400,
    pdo_length = 401,
    lss_own = 501,
    lss_node_id = 502,
    lss_bit_rate = 503,
    lss_store = 504,
    lss_media = 505,
    no_memory = 600,
};
/// "syntax error", …
const char* to_string(Error);

enum class Verb : std::uint8_t {
    none,  ///< an empty line or a comment
    read,
    write,
    read_pdo,
    write_pdo,
    set_rpdo,
    set_tpdo,
    start,
    stop,
    preoperational,
    reset_node,
    reset_communication,
    enable_guarding,
    disable_guarding,
    enable_heartbeat,
    disable_heartbeat,
    init,
    set_heartbeat,
    set_id,
    set_command_timeout,
    set_command_size,
    set_sdo_timeout,
    set_sdo_block,
    boot_up_indication,
    store,
    restore,
    set_network,
    set_node,
    info_version,
    help,
    lss_switch_global,
    lss_switch_selective,
    lss_set_node,
    lss_bit_rate,
    lss_activate,
    lss_store,
    lss_inquire,
    lss_get_node,
    lss_identify,
    lss_identify_unconfigured,
    lss_fastscan,
};

struct Command {
    std::uint32_t sequence = 0;
    Verb verb = Verb::none;
    std::optional<std::uint32_t> net = {};
    std::optional<std::uint32_t> node = {};
    std::uint16_t index = 0;               ///< of read and write
    std::uint8_t sub = 0;
    const Format* format = nullptr;        ///< none was given: the bytes as they are
    std::vector<std::uint8_t> value = {};  ///< of write
    /// arguments; of PDOs: number, COB-ID, transmission type
    std::vector<std::uint32_t> numbers = {};
    std::vector<const Format*> formats = {};   ///< of set rpdo and set tpdo
    std::vector<std::string> values = {};      ///< of write pdo: their words
};

struct Parsed {
    Command command;
    Error error = Error::none;
    std::string why;  ///< what is wrong, for the comment behind an error
};

/// Reads one line without its end. Never throws; what cannot be read is an error with the sequence
/// number as far as there is one.
Parsed parse(std::string_view line);
/// What can be typed, a line each.
std::string_view help_text();

/// Transmission types of PDO commands that are written as a word: `event`, `rtr`, `sync0` …
/// `sync240`.
inline constexpr std::uint32_t max_synchronous = 240;
inline constexpr std::uint32_t on_event = 255;
inline constexpr std::uint32_t on_request = 253;

}  // namespace hal::canopen::gateway
