// SPDX-License-Identifier: MIT
// The table from the address of a line to its driver.
#include "line/serial_line.hpp"
#include "line/sim_line.hpp"
#include "line/tcp_line.hpp"
#include "link/address.hpp"

namespace hal::line {

namespace {

constexpr link::Driver<Opened, Options, Description> line_drivers[] = {
    {link::form_of(address_forms, "serial"), serial::open, serial::describe},
    {link::form_of(address_forms, "pty"), serial::open_pty, serial::describe_pty, nullptr, nullptr,
     "rs485"},
    {link::form_of(address_forms, "tcp"), tcp::open, tcp::describe, nullptr, nullptr,
     "baud format rs485"},
    {link::form_of(address_forms, "listen"), tcp::open_listener, tcp::describe_listener, nullptr,
     nullptr, "baud format rs485"},
    {link::form_of(address_forms, "sim"), sim::open, sim::describe, nullptr, nullptr, "rs485"},
};

std::string set_format(const link::AddressOption& option, Options& options) {
    if (parse_format(option.value, options)) return {};
    return link::invalid_value(option, "8N1, 8E1, 8O1 or 8N2");
}

constexpr link::OptionRow<Options> line_options[] = {
    {"baud", link::set_number<&Options::baud, 300, 4'000'000>},
    {"format", set_format},
    {"rs485", link::set_flag<&Options::rs485>},
};

}  // namespace

// A line is used by a helper thread, whose values the journal of a machine does not have.
Opened open(std::string_view address, const Options& given) {
    return link::open_address<Opened, Options, Description>(
        address, given, line_drivers, line_options, "a line", {nullptr, nullptr});
}

Description describe(std::string_view address) {
    return link::describe_address<Opened, Options, Description>(address, line_drivers);
}

std::string listening_address(std::string_view address) {
    constexpr std::string_view prefix = "tcp:";
    if (!address.starts_with(prefix)) return {};
    return "listen:" + tcp::with_port(std::string(address.substr(prefix.size())));
}

bool parse_format(std::string_view text, Options& options) {
    if (text.size() != 3 || text[0] != '8' || (text[2] != '1' && text[2] != '2')) return false;
    switch (text[1]) {
    case 'N': options.parity = Parity::none; break;
    case 'E': options.parity = Parity::even; break;
    case 'O': options.parity = Parity::odd; break;
    default: return false;
    }
    options.stop_bits = text[2] == '2' ? 2 : 1;
    return true;
}

std::string format_text(const Options& options) {
    constexpr char parities[] = {'N', 'E', 'O'};
    return std::to_string(options.baud) + " 8" +
           parities[static_cast<std::size_t>(options.parity)] + std::to_string(options.stop_bits);
}

}  // namespace hal::line
