// SPDX-License-Identifier: MIT
#include "bus/modbus/mb2hal_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/core.h>
#include <map>
#include <optional>

#include "text/find_row.hpp"
#include "text/numbers.hpp"

namespace hal::tools {
namespace {

using modbus::Table;

constexpr std::int64_t millisecond = 1'000'000;
constexpr std::size_t max_elements = 100;
constexpr std::size_t max_name_length = 28;
constexpr double max_delay_ms = 60'000;

struct Function {
    std::string_view name;
    Table table;
    bool is_output;
    bool is_single;
};
constexpr Function functions[] = {
    {"fnct_01_read_coils", Table::coil, false, false},
    {"fnct_02_read_discrete_inputs", Table::discrete, false, false},
    {"fnct_03_read_holding_registers", Table::holding, false, false},
    {"fnct_04_read_input_registers", Table::input, false, false},
    {"fnct_05_write_single_coil", Table::coil, true, true},
    {"fnct_06_write_single_register", Table::holding, true, true},
    {"fnct_15_write_multiple_coils", Table::coil, true, false},
    {"fnct_16_write_multiple_registers", Table::holding, true, false},
};

/// The numbers of slaves. 0 on a serial line: all slaves, and none answers.
struct Units {
    int min, max;
};
constexpr Units serial_units{1, 247};
constexpr Units tcp_units{0, 255};

struct ParityName {
    std::string_view name;
    line::Parity parity;
};
constexpr ParityName parities[] = {
    {"even", line::Parity::even}, {"odd", line::Parity::odd}, {"none", line::Parity::none}};

template <class Rows>
std::string listed(const Rows& rows) {
    std::string text;
    for (const auto& row : rows) {
        text += (text.empty() ? "" : ", ") + std::string(row.name);
    }
    return text;
}

std::vector<std::string> split_names(const std::string& text) {
    std::vector<std::string> names;
    std::size_t begin = 0;
    for (;;) {
        const std::size_t comma = text.find(',', begin);
        names.push_back(text.substr(begin, comma - begin));
        if (comma == std::string::npos) return names;
        begin = comma + 1;
    }
}

bool is_pin_name(const std::string& name) {
    const auto is_valid = [](char c) {
        return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
               c == '-' || c == '_' || c == '.';
    };
    return !name.empty() && std::ranges::all_of(name, is_valid);
}

/// Reads the sections in their order: a key that is not given keeps the value of the transaction
/// before.
class Reader {
public:
    Reader(const Ini& ini, const Sources& sources, Diagnostics& diagnostics, Span at)
        : ini_(ini), sources_(sources), diagnostics_(diagnostics), at_(at) {}

    Mb2halFile read() {
        section_ = "MB2HAL_INIT";
        file_.module = text("HAL_MODULE_NAME", file_.module);
        file_.has_new_names = number("VERSION", 1.0, 0.0, 100.0) >= 1.0999;
        const double slowdown_s = number("SLOWDOWN", 0.0, 0.0, 60.0);
        const Ini::Entry* const total = ini_.find(section_, "TOTAL_TRANSACTIONS");
        if (!total) {
            error(at_, "[MB2HAL_INIT]TOTAL_TRANSACTIONS is missing",
                  "add the section and the number of transactions: TOTAL_TRANSACTIONS = 2");
            return std::move(file_);
        }
        const auto count = static_cast<std::size_t>(number("TOTAL_TRANSACTIONS", 0, 1, 1000));
        for (std::size_t n = 0; n < count && !diagnostics_.failed(); ++n) {
            section_ = fmt::format("TRANSACTION_{:02}", n);
            read_transaction(n, static_cast<std::int64_t>(slowdown_s * 1e9));
        }
        warn_of_sections(count);
        return std::move(file_);
    }

private:
    const Ini::Entry* entry(std::string_view key) const { return ini_.find(section_, key); }

    void error(Span at, std::string message, std::string help) {
        diagnostics_.error(Code("modbus-value"), at, std::move(message), "", std::move(help));
    }
    void reject(std::string_view key, const std::string& what) {
        const Ini::Entry* const found = entry(key);
        error(found ? found->at : section_at(),
              fmt::format("[{}]{}: '{}' is invalid", section_, key, found ? found->value : ""),
              "write " + what);
    }
    void miss(std::string_view key, const std::string& what) {
        error(section_at(), fmt::format("[{}]{} is missing", section_, key), "add " + what);
    }
    bool has_section() const {
        return std::ranges::find(ini_.entries(), section_, &Ini::Entry::section) !=
               ini_.entries().end();
    }
    std::string text_of(std::string_view section, std::string_view key) const {
        return ini_.get(section, key).value_or("");
    }
    /// Returns the place of the first key of the section.
    Span section_at() const {
        const auto found = std::ranges::find(ini_.entries(), section_, &Ini::Entry::section);
        return found == ini_.entries().end() ? at_ : found->at;
    }

    std::string text(std::string_view key, const std::string& otherwise) const {
        const Ini::Entry* const found = entry(key);
        return found ? found->value : otherwise;
    }
    double number(std::string_view key, double otherwise, double min, double max) {
        const Ini::Entry* const found = entry(key);
        if (!found) return otherwise;
        // what follows a number, a comment for example, is not read
        const std::string word = found->value.substr(0, found->value.find_first_of(" \t;#"));
        const std::optional<double> value = parse_real(word);
        if (value && *value >= min && *value <= max) return *value;
        reject(key, fmt::format("a number of {:g} to {:g}", min, max));
        return otherwise;
    }
    int whole(std::string_view key, int otherwise, int min, int max) {
        const double value = number(key, otherwise, min, max);
        if (value != std::floor(value)) {
            reject(key, "a whole number");
        }
        return static_cast<int>(value);
    }

    void read_transaction(std::size_t number_of_it, std::int64_t slowdown_ns) {
        Mb2halTransaction t =
            file_.transactions.empty() ? Mb2halTransaction{} : file_.transactions.back();
        if (!has_section()) {
            return error(at_,
                         fmt::format("[{}] is missing: TOTAL_TRANSACTIONS is {}", section_,
                                     text_of("MB2HAL_INIT", "TOTAL_TRANSACTIONS")),
                         "add the section, or lower TOTAL_TRANSACTIONS");
        }
        t.name = text("HAL_TX_NAME", fmt::format("{:02}", number_of_it));
        t.line = sources_.place(section_at()).line;
        read_link(t);
        if (diagnostics_.failed()) return;
        if (entry("MB_SLAVE_ID")) {
            const Units units = file_.links[t.link].is_serial ? serial_units : tcp_units;
            t.unit = static_cast<std::uint8_t>(whole("MB_SLAVE_ID", 1, units.min, units.max));
        } else if (number_of_it == 0) {
            return miss("MB_SLAVE_ID", "the number of the slave: MB_SLAVE_ID = 1");
        }
        if (entry("FIRST_ELEMENT")) {
            t.address = static_cast<std::uint16_t>(whole("FIRST_ELEMENT", 0, 0, 65535));
        } else if (number_of_it == 0) {
            return miss("FIRST_ELEMENT", "the address of the first element: FIRST_ELEMENT = 0");
        }
        if (!read_function(t, number_of_it == 0)) return;
        read_elements(t, number_of_it == 0);
        t.timeout_ns = whole("MB_RESPONSE_TIMEOUT_MS", static_cast<int>(t.timeout_ns / millisecond),
                             1, 60000) *
                       millisecond;
        number("MB_BYTE_TIMEOUT_MS", 500, 0, 60000);  // the line's own silence ends a frame
        const double delay_ms = static_cast<double>(t.delay_ns) / millisecond;
        t.delay_ns = static_cast<std::int64_t>(
            number("SERIAL_DELAY_MS", delay_ms, 0, max_delay_ms) * millisecond);
        t.delay_ns = std::max(t.delay_ns, slowdown_ns);
        t.max_rate_hz = number("MAX_UPDATE_RATE", t.max_rate_hz, 0.0, 1e6);
        check_names(t);
        file_.transactions.push_back(std::move(t));
    }

    void read_link(Mb2halTransaction& t) {
        const std::string type = text("LINK_TYPE", "");
        if (type.empty()) {
            if (file_.links.empty()) {
                miss("LINK_TYPE", "LINK_TYPE = serial or LINK_TYPE = tcp");
            }
            return;
        }
        Mb2halLink link;
        if (type == "tcp") {
            if (!entry("TCP_IP")) return miss("TCP_IP", "the address: TCP_IP = 192.168.1.20");
            link.address =
                fmt::format("tcp:{}:{}", text("TCP_IP", ""), whole("TCP_PORT", 502, 1, 65535));
        } else if (type == "serial") {
            read_serial(link);
        } else {
            return reject("LINK_TYPE", "serial or tcp");
        }
        if (diagnostics_.failed()) return;
        const auto known = std::ranges::find(file_.links, link.address, &Mb2halLink::address);
        t.link = static_cast<std::size_t>(known - file_.links.begin());
        if (known == file_.links.end()) {
            file_.links.push_back(std::move(link));
        }
    }

    void read_serial(Mb2halLink& link) {
        if (!entry("SERIAL_PORT")) {
            return miss("SERIAL_PORT", "the device: SERIAL_PORT = /dev/ttyUSB0");
        }
        link.is_serial = true;
        link.address = fmt::format("serial:{}", text("SERIAL_PORT", ""));
        const auto known = std::ranges::find(file_.links, link.address, &Mb2halLink::address);
        if (known != file_.links.end()) {
            link.line = known->line;
        } else if (!entry("SERIAL_BAUD")) {
            return miss("SERIAL_BAUD", "the speed: SERIAL_BAUD = 9600");
        }
        link.line.baud = static_cast<std::uint32_t>(
            whole("SERIAL_BAUD", static_cast<int>(link.line.baud), 300, 4'000'000));
        if (whole("SERIAL_BITS", 8, 5, 8) != 8) {
            reject("SERIAL_BITS", "8: RTU frames are bytes");
        }
        link.line.stop_bits =
            static_cast<std::uint8_t>(whole("SERIAL_STOP", link.line.stop_bits, 1, 2));
        if (!entry("SERIAL_PARITY")) return;
        if (const ParityName* const row =
                find_row(parities, text("SERIAL_PARITY", ""), &ParityName::name)) {
            link.line.parity = row->parity;
        } else {
            reject("SERIAL_PARITY", listed(parities));
        }
    }

    bool read_function(Mb2halTransaction& t, bool is_first) {
        if (!entry("MB_TX_CODE")) {
            if (is_first) {
                miss("MB_TX_CODE", "the function: MB_TX_CODE = fnct_03_read_holding_registers");
            }
            return !is_first;
        }
        const Function* const row = find_row(functions, text("MB_TX_CODE", ""), &Function::name);
        if (!row) {
            reject("MB_TX_CODE", "one of " + listed(functions));
            return false;
        }
        t.table = row->table;
        t.is_output = row->is_output;
        t.is_single = row->is_single;
        return true;
    }

    void read_elements(Mb2halTransaction& t, bool is_first) {
        const bool has_names = entry("PIN_NAMES") != nullptr;
        if (has_names && entry("NELEMENTS")) {
            return reject("NELEMENTS", "either NELEMENTS or PIN_NAMES");
        }
        if (has_names) {
            t.elements = split_names(text("PIN_NAMES", ""));
            if (!std::ranges::all_of(t.elements, is_pin_name)) {
                return reject("PIN_NAMES", "names without blanks: PIN_NAMES = run,stop");
            }
        } else if (entry("NELEMENTS")) {
            t.elements.clear();
            const int count = whole("NELEMENTS", 1, 1, max_elements);
            for (int n = 0; n < count; ++n) {
                t.elements.push_back(fmt::format("{:02}", n));
            }
        } else if (is_first) {
            return miss("NELEMENTS", "how many elements there are: NELEMENTS = 4");
        }
        if (t.elements.size() > max_elements) {
            reject("PIN_NAMES", fmt::format("at most {} names", max_elements));
        } else if (t.is_single && t.elements.size() != 1) {
            reject(has_names ? "PIN_NAMES" : "NELEMENTS", "one element for functions 05 and 06");
        } else if (t.address + t.elements.size() > 65536) {
            reject("FIRST_ELEMENT", "an address whose last element is at most 65535");
        }
    }

    void check_names(const Mb2halTransaction& t) {
        if (!is_pin_name(t.name) || t.name.size() > max_name_length) {
            reject("HAL_TX_NAME", fmt::format("a name of at most {} letters, digits, '-' and '_'",
                                              max_name_length));
        }
        if (std::ranges::find(file_.transactions, t.name, &Mb2halTransaction::name) !=
            file_.transactions.end()) {
            reject("HAL_TX_NAME", "a name that no other transaction has");
        }
    }

    void warn_of_sections(std::size_t count) {
        const std::string next = fmt::format("TRANSACTION_{:02}", count);
        const auto found = std::ranges::find(ini_.entries(), next, &Ini::Entry::section);
        if (diagnostics_.failed() || found == ini_.entries().end()) return;
        diagnostics_.warning(Code("modbus-line"), found->at,
                             fmt::format("[{}] is not used: TOTAL_TRANSACTIONS is {}", next, count),
                             "", "increase TOTAL_TRANSACTIONS, or remove the section");
    }

    const Ini& ini_;
    const Sources& sources_;
    Diagnostics& diagnostics_;
    const Span at_;
    std::string section_;
    Mb2halFile file_;
};

/// Adds the transactions of a link to the plan of its bus.
class BusBuilder {
public:
    BusBuilder(const Mb2halFile& file, std::size_t link, Mb2halBus& to)
        : file_(file), link_(link), to_(to) {}

    void run() {
        std::map<std::uint8_t, std::vector<std::size_t>> by_unit;
        for (std::size_t n = 0; n < file_.transactions.size(); ++n) {
            if (file_.transactions[n].link == link_) {
                by_unit[file_.transactions[n].unit].push_back(n);
            }
        }
        to_.bus.slaves.reserve(by_unit.size());  // the plan points to their values
        for (const auto& [unit, transactions] : by_unit) {
            add_slave(unit, transactions);
        }
    }

private:
    void add_slave(std::uint8_t unit, const std::vector<std::size_t>& transactions) {
        modbus::Slave& slave = to_.bus.slaves.emplace_back();
        slave.unit = unit;
        slave.name = file_.transactions[transactions.front()].name;
        slave.timeout_ns = 0;
        std::size_t count = 0;
        for (const std::size_t n : transactions) {
            const Mb2halTransaction& t = file_.transactions[n];
            slave.timeout_ns = std::max(slave.timeout_ns, t.timeout_ns);
            slave.gap_ns = std::max(slave.gap_ns, t.delay_ns);
            count += t.elements.size();
        }
        slave.values.reserve(count);
        for (const std::size_t n : transactions) {
            add_telegram(slave, file_.transactions[n]);
            to_.transactions.push_back(n);
        }
    }

    void add_telegram(modbus::Slave& slave, const Mb2halTransaction& t) {
        constexpr std::int64_t as_often_as_possible_ns = millisecond;
        const auto index = static_cast<std::uint32_t>(to_.bus.slaves.size() - 1);
        modbus::Telegram telegram;
        telegram.kind = t.is_output ? modbus::Telegram::Kind::write : modbus::Telegram::Kind::read;
        telegram.slave = index;
        telegram.table = t.table;
        telegram.address = t.address;
        telegram.count = static_cast<std::uint16_t>(t.elements.size());
        telegram.period_ns =
            t.max_rate_hz > 0.0
                ? std::max(as_often_as_possible_ns, static_cast<std::int64_t>(1e9 / t.max_rate_hz))
                : as_often_as_possible_ns;
        for (std::uint16_t n = 0; n < telegram.count; ++n) {
            modbus::Value& value = slave.values.emplace_back();
            value.name = t.name + "." + t.elements[n];
            value.table = t.table;
            value.address = static_cast<std::uint16_t>(t.address + n);
            value.type = modbus::is_bits(t.table) ? bus::ValueType::bit : bus::ValueType::u16;
            value.is_output = t.is_output;
            value.period_ns = telegram.period_ns;
            value.at.line = t.line;
            telegram.values.push_back(static_cast<std::uint32_t>(to_.plan.values.size()));
            to_.plan.values.push_back(
                {index, &value, static_cast<std::uint32_t>(to_.plan.telegrams.size()), n});
        }
        to_.plan.telegrams.push_back(std::move(telegram));
    }

    const Mb2halFile& file_;
    const std::size_t link_;
    Mb2halBus& to_;
};

}  // namespace

Mb2halFile read_mb2hal(Sources& sources, const std::string& path, Diagnostics& diagnostics) {
    const Ini ini = Ini::read(sources, path, diagnostics);
    if (diagnostics.failed()) return {};
    const Span at = ini.empty() ? Span{} : ini.entries().front().at;
    return Reader(ini, sources, diagnostics, at).read();
}

void make_buses(const Mb2halFile& file, const std::string& path, std::deque<Mb2halBus>& buses) {
    for (std::size_t link = 0; link < file.links.size(); ++link) {
        Mb2halBus& to = buses.emplace_back();
        to.bus.file = path;
        to.bus.link = file.links[link].address;
        to.bus.line = file.links[link].line;
        to.bus.guardian = false;
        BusBuilder(file, link, to).run();
    }
}

}  // namespace hal::tools
