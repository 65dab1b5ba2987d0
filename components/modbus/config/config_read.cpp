// SPDX-License-Identifier: MIT
// Reads a configuration: [bus], [slave N NAME], and lines `read NAME = …` and `write NAME = …`.
#include <algorithm>
#include <cmath>
#include <set>

#include "bus/config/key_table.hpp"
#include "bus/config/section_file.hpp"
#include "modbus/config/bus_config.hpp"
#include "text/characters.hpp"
#include "text/numbers.hpp"
#include "text/quoting.hpp"
#include "text/suggest.hpp"

namespace hal::modbus {

namespace {

using bus::Entry;
using text::Word;
using Words = std::vector<Word>;

constexpr std::int64_t ms = 1'000'000;
constexpr std::int64_t second = 1000 * ms;
constexpr std::int64_t read_period = 100 * ms;
constexpr std::int64_t write_period = second;

constexpr bus::SectionKind kinds[] = {{"bus", "[bus]", bus::SectionUse::once},
                                      {"slave", "[slave N NAME]", bus::SectionUse::any}};
constexpr const char* value_usage =
    "write TABLE ADDRESS [TYPE] and options: holding 0x2103 u16 "
    "scale 0.01 unit Hz every 100ms";
constexpr const char* write_usage = "write TABLE ADDRESS VALUE, ...: holding 0x2000 1, coil 0x4B 1";

constexpr bus::Choice<Framing> framings[] = {{"rtu", Framing::rtu}, {"tcp", Framing::tcp}};
constexpr bus::Choice<Confirm> confirms[] = {
    {"errors", Confirm::on_errors}, {"no", Confirm::never}, {"yes", Confirm::always}};
constexpr bus::Choice<Order> orders[] = {
    {"abcd", Order::abcd}, {"cdab", Order::cdab}, {"badc", Order::badc}, {"dcba", Order::dcba}};

bool parse_format_key(Bus& b, const Entry& entry) {
    return line::parse_format(entry.value.text, b.line);
}

const bus::KeyTable<Bus>& bus_keys() {
    static const bus::KeyTable<Bus> table{{
        {"link", bus::text_value(&Bus::link, "ADDRESS"), "",
         "The line: `serial:/dev/ttyUSB0`, `tcp:HOST:PORT`, `sim:NAME`. The load argument `link=` "
         "takes precedence."},
        {"baud", bus::number([](Bus& b) -> std::uint32_t& { return b.line.baud; }, 300, 4'000'000),
         "`19200`", "Bit/s of a serial line."},
        {"format", bus::own("8N1, 8E1, 8O1 or 8N2", "8N1, 8E1, 8O1, 8N2", parse_format_key),
         "`8N1`", "Data bits, parity, stop bits."},
        {"rs485", bus::flag([](Bus& b) -> bool& { return b.line.rs485; }), "`no`",
         "The kernel switches the direction of the transceiver, where its driver can. Most "
         "adapters switch by themselves."},
        {"protocol", bus::choice(&Bus::framing, framings), "`tcp` on `tcp:`, else `rtu`",
         "`rtu` on `tcp:` is RTU over TCP, as serial servers carry it."},
        {"guardian", bus::flag(&Bus::guardian), "`yes`",
         "Where a slave has stop telegrams, a process of its own owns the line and sends them when "
         "the runtime ends or hangs. Not in `hal sim`."},
        {"heartbeat", bus::time(&Bus::heartbeat_ns, 20 * ms, 10 * second), "`50ms`",
         "The guardian stops the drives when no cycle has run for this time, and at least for 3 "
         "periods of the thread."},
        {"broadcast-stop", "writes: `holding 0x2000 1, coil 3 0`", "none",
         "Stop telegrams to slave 0: all slaves that support broadcasts execute them, and none "
         "answers."},
        {"turnaround", bus::time(&Bus::turnaround_ns, ms, second), "`100ms`",
         "The silence after a broadcast, in which the slaves execute it."},
    }};
    return table;
}

const bus::KeyTable<Slave>& slave_keys() {
    static const bus::KeyTable<Slave> table{{
        {"profile", "a name of the table below", "none",
         "The slave is a frequency converter with the pins of a spindle."},
        {"timeout", bus::time(&Slave::timeout_ns, ms, 10 * second), "`100ms`",
         "The time in which the slave begins to answer."},
        {"gap", bus::time(&Slave::gap_ns, 0, second), "`0`, or what the profile needs",
         "The silence before a request, if it must be longer than 3.5 characters."},
        {"every", bus::time(&Slave::period_ns, ms, 3600 * second), "`100ms`",
         "The period of values that are read, and of the drive."},
        {"lost", bus::number(&Slave::lost, 1, 100), "`3`",
         "Failed requests in a row after which the slave is offline. A request that is rejected "
         "this often in a row is a fault."},
        {"max-registers", bus::number(&Slave::max_registers, 1, max_read_registers), "`125`",
         "The most registers in one telegram."},
        {"max-gap", bus::number(&Slave::max_gap, 0, 100), "`8`",
         "Values are read in one telegram if at most this many registers are between them. `0`: "
         "the slave rejects registers that it does not have."},
        {"single-writes", bus::flag(&Slave::single_writes), "`no`",
         "The slave does not support function 16 (write multiple registers)."},
        {"confirm", bus::choice(&Slave::confirm, confirms), "`errors`",
         "`yes`: a value is accepted when it is the same in two answers in a row. `errors`: only "
         "while more than 3 % of the answers are corrupt. `no`: never."},
        {"stop", "writes: `holding 0x2000 1, coil 3 0`", "that of the profile",
         "The stop telegrams, in their order; `none`: none."},
        {"stop-attempts", bus::number(&Slave::stop_attempts, 1, 1000), "`5`",
         "How often a stop telegram is sent, with nothing else on the line, until the slave "
         "acknowledges it."},
        {"read NAME", "`TABLE ADDRESS [TYPE] [OPTION…]`", "",
         "A value that becomes an output pin."},
        {"write NAME", "`TABLE ADDRESS [TYPE] [OPTION…]`", "",
         "A value that an input pin sets. It is written when it changes, and every second."},
    }};
    return table;
}

/// A drive and what the overriding keys need.
struct DriveTarget {
    Drive drive;
    double per_cent = 2.0;
};

const bus::KeyTable<DriveTarget>& drive_keys() {
    static const bus::KeyTable<DriveTarget> table{{
        {"max-speed",
         bus::own("a speed in rpm, as in 24000", "rpm",
                  [](DriveTarget& to, const Entry& entry) {
        const auto value = parse_real(entry.value.text);
        if (!value || !(*value >= 1 && *value <= 1e6)) return false;
        to.drive.max_speed_rpm = *value;
        return true;
    }),
         "`24000`", "The speed at `max-frequency`."},
        {"max-frequency",
         bus::own("a frequency in Hz, as in 400", "Hz",
                  [](DriveTarget& to, const Entry& entry) {
        const auto value = parse_real(entry.value.text);
        if (!value || !(*value >= 1 && *value <= 5000)) return false;
        to.drive.max_frequency_hz = *value;
        return true;
    }),
         "`400`", "The frequency at full speed."},
        {"tolerance",
         bus::own("a percentage of 0.1..50", "per cent",
                  [](DriveTarget& to, const Entry& entry) {
        const auto value = parse_real(entry.value.text);
        if (!value || !(*value >= 0.1 && *value <= 50)) return false;
        to.drive.tolerance = *value / 100;
        return true;
    }),
         "`2`", "The pin `at-speed` is TRUE within this share of the commanded speed."},
        {"stall-time",
         bus::time([](DriveTarget& to) -> std::int64_t& { return to.drive.stall_ns; }, 100 * ms,
                   600 * second),
         "`3s`",
         "The pin `stalled` is TRUE when the drive is commanded to turn and turns with less than "
         "10 % of the speed for this time."},
        {"forward", "writes", "that of the profile",
         "The writes that start it; `generic` needs it."},
        {"reverse", "writes", "that of the profile", "The same in the other direction."},
        {"reset", "writes", "that of the profile", "The writes that reset a trip."},
        {"speed", "`TABLE ADDRESS COUNTS`", "that of the profile",
         "The register of the set-point, and its value at `max-speed`; `generic` needs it."},
        {"feedback", "`TABLE ADDRESS COUNTS`", "that of the profile",
         "The register of the actual speed, and its value at `max-speed`; `generic` needs it."},
        {"load", "`TABLE ADDRESS SCALE`", "that of the profile",
         "The register of the load, and per cent per count."},
        {"fault", "`TABLE ADDRESS [MASK]`", "that of the profile",
         "The register of faults; any bit of the mask is a fault."},
        {"running", "`TABLE ADDRESS [MASK]`", "that of the profile",
         "The register with a bit that is set while the drive runs."},
    }};
    return table;
}

struct TableName {
    const char* name;
    Table table;
};
constexpr TableName table_names[] = {{"coil", Table::coil},
                                     {"discrete", Table::discrete},
                                     {"holding", Table::holding},
                                     {"input", Table::input}};

/// Reads a configuration and collects what is wrong.
class Reader {
public:
    Reader(std::string_view text, const std::string& file)
        : sections_(text, kinds, "[slave 1 NAME]", key_report_) {
        out_.bus.file = file;
    }

    ReadResult read() {
        bus::Section* const bus = sections_.one("bus");
        if (bus != nullptr) {
            out_.bus.at = bus->at;
            bus::Keys keys(key_report_);
            keys.add(*bus);
            bus_keys().apply(keys, out_.bus, key_report_);
            if (const Entry* entry = keys.find("broadcast-stop")) {
                out_.bus.broadcast_stop = writes_of(*entry);
            }
            keys.report_rest("in [bus]", bus_keys().names());
        } else {
            report_.error(Topic::line, {1, 1, 0, 0}, "missing section [bus]",
                          "write [bus] and below it link = serial:/dev/ttyUSB0 and baud = 19200");
        }
        for (bus::Section* section : sections_.all("slave")) {
            read_slave(*section);
        }
        sections_.warn_unused_types("[slave …]");
        if (out_.bus.slaves.empty() && bus != nullptr && !report_.failed()) {
            report_.error(Topic::line, bus->at, "the configuration has no slave",
                          "write [slave 1 NAME] and below it profile = NAME or read PIN = holding "
                          "0x2103 u16");
        }
        check_mixed_dialects();
        out_.messages = std::move(report_.all);
        text::sort(out_.messages);
        return std::move(out_);
    }

private:
    void error(Topic topic, const Span& at, std::string sentence, std::string help = {},
               std::string label = {}) {
        report_.error(topic, at, std::move(sentence), std::move(help), std::move(label));
    }

    // --- A slave

    void read_slave(bus::Section& section) {
        Slave slave;
        slave.at = section.at;
        if (!read_header(section, slave)) return;
        bus::Keys keys(key_report_);
        if (!sections_.add_keys(section, keys)) return;
        keys.find("type");
        slave_ = &slave;
        no_stop_ = false;
        slave_keys().apply(keys, slave, key_report_);
        read_profile(keys);
        read_stop(keys);
        read_values(keys);
        std::vector<std::string> names = slave_keys().names();
        for (const std::string& name : drive_keys().names()) {
            names.push_back(name);
        }
        keys.report_rest("in [slave " + std::to_string(slave.unit) + "]", names);
        check_slave();
        out_.bus.slaves.push_back(std::move(slave));
    }

    bool read_header(const bus::Section& section, Slave& slave) {
        const Words& w = section.words;
        const auto unit = w.size() >= 2 ? parse_natural(w[1].text) : std::nullopt;
        if (!unit || *unit < 1 || *unit > max_unit || w.size() > 3 ||
            (w.size() == 3 && !bus::is_name(w[2].text))) {
            error(Topic::line, w.size() >= 2 ? w[1].at : section.at,
                  "invalid slave section: expected an address of 1..247 and a name",
                  "write [slave 1 spindle]");
            return false;
        }
        slave.unit = static_cast<std::uint8_t>(*unit);
        slave.name = w.size() == 3 ? dashed(w[2].text) : "slave-" + std::to_string(*unit);
        for (const Slave& other : out_.bus.slaves) {
            const std::string first = "first in line " + std::to_string(other.at.line);
            if (other.unit == slave.unit) {
                error(Topic::slave, w[1].at, "duplicate slave address " + std::to_string(*unit),
                      first, "duplicate");
                return false;
            }
            if (other.name == slave.name) {
                error(Topic::slave, w.back().at, "duplicate slave name " + quoted(slave.name),
                      first, "duplicate");
                return false;
            }
        }
        return true;
    }

    // --- A drive

    void read_profile(bus::Keys& keys) {
        const Entry* entry = keys.find("profile");
        if (entry == nullptr) return;
        const Profile* const profile = find_profile(lower(entry->value.text));
        if (profile == nullptr) {
            std::vector<std::string> names;
            for (const Profile& p : profiles()) {
                names.emplace_back(p.name);
            }
            error(Topic::value, entry->value.at, "unknown profile " + quoted(entry->value.text),
                  suggestion(entry->value.text, names, "profiles are"));
            for (const std::string& name : drive_keys().names()) {
                keys.find(name);  // not an error of its own
            }
            return;
        }
        DriveTarget target;
        target.drive.profile = profile->name;
        drive_keys().apply(keys, target, key_report_);
        adopt(*profile, target.drive);
        if (keys.find("speed") == nullptr) {
            check_frequency(*profile, target.drive.max_frequency_hz);
        }
        override_writes(keys, target.drive);
        override_readings(keys);
        check_registers(*profile, target.drive);
        const std::int64_t period = slave_->period_ns != 0 ? slave_->period_ns : read_period;
        target.drive.period_ns = period;
        slave_->drive = std::move(target.drive);
        if (keys.find("gap") == nullptr) {
            slave_->gap_ns = std::int64_t{profile->gap_us} * 1000;
        }
    }

    static std::vector<Write> list_of(const Write (&writes)[2]) {
        std::vector<Write> out;
        for (const Write& write : writes) {
            if (write.table != Table::none) {
                out.push_back(write);
            }
        }
        return out;
    }

    void adopt(const Profile& p, Drive& d) {
        d.forward = list_of(p.forward);
        d.reverse = list_of(p.reverse);
        d.stop = list_of(p.stop);
        if (p.reset.table != Table::none) {
            d.reset.push_back(p.reset);
        }
        d.speed = p.speed;
        d.speed_by_16 = p.speed_by_16;
        d.one_telegram = p.one_telegram;
        if (p.counts_per_hz != 0) {
            d.speed.value = static_cast<std::uint16_t>(
                std::min(65535.0, std::round(d.max_frequency_hz * p.counts_per_hz)));
        }
        const double rpm_per_hz = d.max_speed_rpm / d.max_frequency_hz;
        double to_rpm = 1.0;
        switch (p.feedback) {
        case Feedback::frequency: to_rpm = rpm_per_hz; break;
        case Feedback::rpm: break;
        case Feedback::share: to_rpm = d.max_speed_rpm; break;
        }
        add_reading(Purpose::speed, p.actual, p.actual.scale * to_rpm);
        add_reading(Purpose::load, p.load, p.load.scale);
        add_reading(Purpose::running, p.running, 1);
        add_reading(Purpose::fault, p.fault, 1);
    }

    /// A set-point has 16 bits.
    void check_frequency(const Profile& p, double max_frequency_hz) {
        if (max_frequency_hz * p.counts_per_hz < 65535.5) return;
        char highest[48];
        std::snprintf(highest, sizeof highest, "write at most %g", 65535.0 / p.counts_per_hz);
        error(Topic::slave, slave_->at,
              "max-frequency does not fit into the set-point of the profile", highest);
    }

    void add_reading(Purpose purpose, const Reading& r, double scale) {
        if (r.table == Table::none) return;
        Value v;
        v.name = purpose_name(purpose);
        v.purpose = purpose;
        v.table = r.table;
        v.address = r.address;
        v.type = r.words == 2 ? bus::ValueType::u32 : bus::ValueType::u16;
        v.mask = r.mask;
        if (r.mask != 0) {
            v.type = bus::ValueType::bit;
        }
        v.scaled = r.mask == 0;
        v.scale = scale;
        v.period_ns = slave_->period_ns != 0 ? slave_->period_ns : read_period;
        v.at = slave_->at;
        std::erase_if(slave_->values, [&](const Value& o) { return o.purpose == purpose; });
        slave_->values.push_back(v);
    }

    static const char* purpose_name(Purpose purpose) {
        constexpr const char* names[] = {"pin", "speed-fb", "load", "running", "fault"};
        return names[static_cast<std::size_t>(purpose)];
    }

    void override_writes(bus::Keys& keys, Drive& d) {
        const auto list = [&](const char* key, std::vector<Write>& to) {
            if (const Entry* entry = keys.find(key)) {
                to = writes_of(*entry);
            }
        };
        list("forward", d.forward);
        list("reverse", d.reverse);
        list("reset", d.reset);
        if (const Entry* entry = keys.find("speed")) {
            d.speed = three(*entry, "COUNTS");
        }
    }

    /// A drive is not started before its speed was read.
    void check_registers(const Profile& p, const Drive& d) {
        const auto& values = slave_->values;
        const bool has_feedback = std::any_of(values.begin(), values.end(), [](const Value& v) {
            return v.purpose == Purpose::speed;
        });
        if (!d.forward.empty() && d.speed.table != Table::none && has_feedback) return;
        error(Topic::slave, slave_->at,
              std::string("the profile ") + p.name + " needs the keys forward, speed and feedback",
              "write forward = holding 0x2000 0x12, speed = holding 0x2001 10000, feedback = "
              "holding 0x2103 10000, on three lines");
    }

    void override_readings(bus::Keys& keys) {
        if (const Entry* entry = keys.find("feedback")) {
            const Write w = three(*entry, "COUNTS");
            if (w.value != 0) {
                const double rpm = max_speed(keys);
                add_reading(Purpose::speed, {w.table, w.address, 1, 0, 1}, rpm / w.value);
            }
        }
        if (const Entry* entry = keys.find("load")) {
            read_load(*entry);
        }
        mask_reading(keys, "fault", Purpose::fault);
        mask_reading(keys, "running", Purpose::running);
    }

    static double max_speed(bus::Keys& keys) {
        DriveTarget target;
        if (const Entry* entry = keys.find("max-speed")) {
            drive_keys().find("max-speed")->parse(target, *entry);
        }
        return target.drive.max_speed_rpm;
    }

    void read_load(const Entry& entry) {
        const Words w = text::words_of(entry.value);
        const auto scale = w.size() == 3 ? parse_real(w[2].text) : std::nullopt;
        Value v;
        if (!scale || !location(w, v)) {
            return bus::reject_value(entry, "TABLE ADDRESS SCALE: holding 0x210B 0.1", key_report_);
        }
        add_reading(Purpose::load, {v.table, v.address, 1, 0, 1}, *scale);
    }

    void mask_reading(bus::Keys& keys, const char* key, Purpose purpose) {
        const Entry* entry = keys.find(key);
        if (entry == nullptr) return;
        const Words w = text::words_of(entry->value);
        Value v;
        const auto mask = w.size() == 3 ? parse_natural(w[2].text) : std::uint64_t{0xffff};
        if (w.size() < 2 || w.size() > 3 || !mask || *mask == 0 || *mask > 0xffff ||
            !location(w, v)) {
            return bus::reject_value(*entry, "TABLE ADDRESS [MASK]: holding 0x2100 0xFF",
                                     key_report_);
        }
        const bool bits = is_bits(v.table);
        add_reading(
            purpose,
            {v.table, v.address, 1, bits ? std::uint16_t{1} : static_cast<std::uint16_t>(*mask), 1},
            1);
    }

    /// Reads TABLE ADDRESS NUMBER.
    Write three(const Entry& entry, const char* last) {
        const Words w = text::words_of(entry.value);
        const auto number = w.size() == 3 ? parse_natural(w[2].text) : std::nullopt;
        Value v;
        if (!number || *number == 0 || *number > 65535 || !location(w, v) || is_bits(v.table)) {
            bus::reject_value(entry,
                              std::string("TABLE ADDRESS ") + last + ": holding 0x2001 10000",
                              key_report_);
            return {};
        }
        return {v.table, v.address, static_cast<std::uint16_t>(*number)};
    }

    // --- Stop telegrams

    void read_stop(bus::Keys& keys) {
        const Entry* entry = keys.find("stop");
        no_stop_ = entry != nullptr && same_word(entry->value.text, "none");
        if (no_stop_) return;
        if (entry != nullptr) {
            slave_->stop = writes_of(*entry);
            if (slave_->drive) {
                slave_->drive->stop = slave_->stop;
            }
        } else if (slave_->drive) {
            slave_->stop = slave_->drive->stop;
            if (slave_->stop.empty()) {
                error(Topic::slave, slave_->at, "the profile generic needs the key stop",
                      "write stop = holding 0x2000 1");
            }
        }
    }

    std::vector<Write> writes_of(const Entry& entry) {
        std::vector<Write> out;
        for (const Word& one : text::list_of(entry.value)) {
            Words w = text::words_of(one);
            if (!w.empty() && same_word(w[0].text, "write")) {
                w.erase(w.begin());
                if (!w.empty() && parse_natural(w[0].text)) {
                    w.insert(w.begin(), Word{"holding", w[0].at});
                }
            }
            const auto value = w.size() == 3 ? parse_natural(w[2].text) : std::nullopt;
            Value v;
            if (!value || *value > 65535 || !location(w, v) || !is_writable(v.table) ||
                (v.table == Table::coil && *value > 1)) {
                error(Topic::value, one.at, "invalid write " + quoted(one.text), write_usage);
                return {};
            }
            out.push_back({v.table, v.address, static_cast<std::uint16_t>(*value)});
        }
        if (out.size() > 8) {
            error(Topic::value, entry.value.at, "more than 8 writes", "write at most 8");
            out.resize(8);
        }
        return out;
    }

    // --- Values

    void read_values(bus::Keys& keys) {
        for (const char* beginning : {"read ", "write "}) {
            for (Entry* entry : keys.all_of(beginning)) {
                entry->used = true;
                read_value(*entry, std::string_view(beginning) == "write ");
            }
        }
        const auto by_line = [](const Value& a, const Value& b) {
            return a.at.offset < b.at.offset;
        };
        std::stable_sort(slave_->values.begin(), slave_->values.end(), by_line);
    }

    /// Reads a line `read NAME = …` or `write NAME = …` into the slave that is read. An invalid
    /// line is reported and adds no value.
    void read_value(const Entry& entry, bool is_output) {
        Value v;
        v.is_output = is_output;
        v.at = entry.key.at;
        v.name = dashed(trimmed(std::string_view(entry.key.text).substr(is_output ? 6 : 5)));
        if (!bus::is_name(v.name)) {
            return error(Topic::line, entry.key.at, "invalid name " + quoted(v.name),
                         "use at most 40 letters, digits, '-' and '_'");
        }
        const Words w = text::words_of(entry.value);
        if (!location(w, v)) {
            return error(Topic::value, entry.value.at, "invalid value " + quoted(entry.value.text),
                         value_usage);
        }
        if (is_output && !is_writable(v.table)) {
            return error(Topic::value, w[0].at,
                         std::string(to_string(v.table)) + " registers cannot be written",
                         "write holding or coil");
        }
        if (is_output && v.mask != 0) {
            return error(Topic::value, w[1].at, "a bit of a register cannot be written alone",
                         "write the whole register");
        }
        std::size_t next = is_classic(w[0].text) ? 1 : 2;
        if (!read_type(w, next, v)) return;
        const std::int64_t own_period = slave_->period_ns != 0 ? slave_->period_ns : read_period;
        v.period_ns = is_output ? write_period : own_period;
        std::set<std::string> options;
        for (; next < w.size(); ++next) {
            if (!options.insert(lower(w[next].text)).second) {
                return error(Topic::line, w[next].at, "duplicate option " + quoted(w[next].text),
                             "delete one of them", "duplicate");
            }
            if (!read_option(w, next, v)) return;
        }
        if (v.address + v.size() > 0x10000) {
            return error(Topic::value, entry.value.at, "the value ends behind address 0xFFFF");
        }
        slave_->values.push_back(std::move(v));
    }

    static bool is_classic(std::string_view word) {
        return word.size() == 5 && word.find_first_not_of("0123456789") == word.npos &&
               (word[0] == '0' || word[0] == '1' || word[0] == '3' || word[0] == '4');
    }

    /// Reads TABLE ADDRESS, TABLE ADDRESS.BIT or the notation of manuals, 40001.
    bool location(const Words& w, Value& v) {
        if (w.empty()) return false;
        if (is_classic(w[0].text)) {
            constexpr Table tables[] = {Table::coil, Table::discrete, Table::none, Table::input,
                                        Table::holding};
            const auto number = parse_natural(w[0].text.substr(1));
            v.table = tables[w[0].text[0] - '0'];
            if (!number || *number == 0) return false;
            v.address = static_cast<std::uint16_t>(*number - 1);
            return true;
        }
        if (w.size() < 2) return false;
        const std::string name = lower(w[0].text);
        for (const TableName& one : table_names) {
            if (name == one.name) {
                v.table = one.table;
            }
        }
        const auto dot = std::min(w[1].text.find('.'), w[1].text.size());
        const auto address = parse_natural(w[1].text.substr(0, dot));
        if (v.table == Table::none || !address || *address > 0xffff) return false;
        v.address = static_cast<std::uint16_t>(*address);
        if (is_bits(v.table)) {
            v.type = bus::ValueType::bit;
        }
        if (dot == w[1].text.size()) return true;
        const auto bit = parse_natural(w[1].text.substr(dot + 1));
        if (!bit || *bit > 15 || is_bits(v.table)) return false;
        v.mask = static_cast<std::uint16_t>(1U << *bit);
        v.type = bus::ValueType::bit;
        return true;
    }

    bool read_type(const Words& w, std::size_t& next, Value& v) {
        if (next == w.size()) return true;
        const bus::TypeName type = bus::parse_value_type(w[next].text);
        if (type.name == nullptr) return true;
        const bool fits = type.bits == 16 || type.bits == 32 || type.bits == 64;
        if (v.is_bit() != (type.type == bus::ValueType::bit) || (!v.is_bit() && !fits)) {
            error(Topic::value, w[next].at,
                  std::string("a value of ") + (v.is_bit() ? "a bit" : "registers") +
                      " cannot have the type " + type.name,
                  "types of registers are u16, s16, u32, s32, u64, s64, f32, f64; ADDRESS.BIT is a "
                  "bit of a register");
            return false;
        }
        v.type = type.type;
        ++next;
        return true;
    }

    bool read_option(const Words& w, std::size_t& at, Value& v) {
        const std::string name = lower(w[at].text);
        if (name == "age") {
            v.has_age = true;
            return true;
        }
        static const std::vector<std::string> names = {"scale", "offset", "unit", "every",
                                                       "order", "safe",   "age"};
        if (std::find(names.begin(), names.end(), name) == names.end()) {
            error(Topic::line, w[at].at, "unknown option " + quoted(w[at].text),
                  suggestion(name, names, "options are"));
            return false;
        }
        if (at + 1 == w.size()) {
            error(Topic::line, w[at].at, quoted(w[at].text) + " has no value", value_usage);
            return false;
        }
        const Word& value = w[++at];
        if (apply_option(name, value, v)) return true;
        error(Topic::value, value.at, "invalid " + name + " " + quoted(value.text),
              option_help(name));
        return false;
    }

    static const char* option_help(std::string_view name) {
        if (name == "every") return "write a time of 1ms..3600s, as in 100ms";
        if (name == "order") {
            return "write abcd (high word first), cdab, badc or dcba; a value of one register has "
                   "no order";
        }
        return "write a number; a scale is not 0, and bits have neither scale nor offset";
    }

    static bool apply_option(std::string_view name, const Word& word, Value& v) {
        if (name == "unit") {
            v.unit = word.text;
            return true;
        }
        if (name == "every") {
            const auto time = bus::parse_time(word.text);
            if (!time || *time < ms || *time > 3600 * second) return false;
            v.period_ns = *time;
            return true;
        }
        if (name == "order") {
            Entry entry;
            entry.value = word;
            return v.size() > 1 && bus::choice(&Value::order, orders).parse(v, entry);
        }
        const auto number = parse_real(word.text);
        if (!number || !std::isfinite(*number)) return false;
        if (name == "safe") {
            v.safe = *number;
            return !v.is_output;
        }
        if (v.is_bit() || (name == "scale" && *number == 0)) return false;
        v.scaled = true;
        (name == "scale" ? v.scale : v.offset) = *number;
        return true;
    }

    // --- Checks

    void check_slave() {
        static const std::set<std::string_view> reserved = {"online",     "age",      "errors",
                                                            "exceptions", "timeouts", "stopped"};
        static const std::set<std::string_view> of_drives = {"speed-cmd", "run",      "reset",
                                                             "speed-fb",  "at-speed", "fault",
                                                             "load",      "stalled",  "running"};
        std::set<std::string, std::less<>> seen;
        for (const Value& v : slave_->values) {
            if (v.has_age) {
                seen.insert(v.name + "-age");
            }
        }
        for (const Value& v : slave_->values) {
            if (v.purpose != Purpose::pin) continue;
            if (reserved.contains(v.name) || (slave_->drive && of_drives.contains(v.name))) {
                error(Topic::slave, v.at, "the slave has a pin " + quoted(v.name) + " of its own",
                      "choose another name", "reserved");
            } else if (!seen.insert(v.name).second) {
                error(Topic::slave, v.at, "duplicate name " + quoted(v.name),
                      "a value is read or written; choose another name", "duplicate");
            }
        }
        check_double_writes();
        if (slave_->values.empty() && !slave_->drive && !report_.failed()) {
            report_.warning(Topic::slave, slave_->at,
                            "slave " + quoted(slave_->name) + " has no values",
                            "write read NAME = holding 0x2103 u16 below it, or delete it");
        }
        warn_of_missing_stop();
    }

    void check_double_writes() {
        const auto& values = slave_->values;
        for (std::size_t a = 0; a < values.size(); ++a) {
            for (std::size_t b = a + 1; b < values.size(); ++b) {
                if (!values[a].is_output || !values[b].is_output) continue;
                const bool overlap = values[a].table == values[b].table &&
                                     values[a].address < values[b].address + values[b].size() &&
                                     values[b].address < values[a].address + values[a].size();
                if (overlap) {
                    error(Topic::slave, values[b].at,
                          quoted(values[b].name) + " and " + quoted(values[a].name) +
                              " write the same " + to_string(values[b].table) + " register",
                          "delete one of them; bits of a register are written as one number");
                }
            }
        }
    }

    void warn_of_missing_stop() {
        if (!slave_->stop.empty() || no_stop_) return;
        const bool is_written = std::any_of(slave_->values.begin(), slave_->values.end(),
                                            [](const Value& v) { return v.is_output; });
        if (!is_written) return;
        const bool has_broadcast = !out_.bus.broadcast_stop.empty();
        report_.warning(
            Topic::slave, slave_->at,
            "no stop telegram for slave " + std::to_string(slave_->unit) + ", which is written to" +
                (has_broadcast ? "; it may miss the broadcast stop" : ""),
            std::string(has_broadcast ? "a broadcast that it misses is not repeated for it"
                                      : "a slave keeps its last command when the machine ends") +
                "; write stop = holding ADDRESS VALUE, or stop = none");
    }

    /// Frames of the first Huanyang dialect and of Modbus have different lengths: a slave of the
    /// one kind must not be asked while another slave still answers in the other.
    void check_mixed_dialects() {
        for (const Slave& slave : out_.bus.slaves) {
            if (slave.is_huanyang() && out_.bus.framing == Framing::tcp) {
                error(Topic::slave, slave.at,
                      "the profile huanyang is not Modbus and cannot be used with protocol = tcp",
                      "write protocol = rtu");
            }
        }
    }

    ReadResult out_;
    text::Messages<Topic> report_;
    bus::TopicReport<Topic> key_report_{report_};
    bus::SectionFile sections_;
    Slave* slave_ = nullptr;  // the one that is read
    bool no_stop_ = false;  // stop = none
};

}  // namespace

const char* code_of(Topic topic) {
    constexpr const char* codes[] = {"modbus-line", "modbus-value", "modbus-slave"};
    return codes[static_cast<std::size_t>(topic)];
}

std::uint16_t Value::size() const {
    const bool one_bit = type == bus::ValueType::bit && mask <= 1;
    if (is_bits(table)) return one_bit ? 1 : 16;
    if (type == bus::ValueType::bit) return 1;
    return static_cast<std::uint16_t>(std::max(1, bus::name_of(type).bits / 16));
}

bool Slave::is_huanyang() const { return drive && drive->speed.table == Table::huanyang; }

bool Bus::has_stops() const {
    return !broadcast_stop.empty() ||
           std::any_of(slaves.begin(), slaves.end(),
                       [](const Slave& slave) { return !slave.stop.empty(); });
}

std::int64_t Bus::max_gap_ns() const {
    std::int64_t gap = 0;
    for (const Slave& slave : slaves) {
        gap = std::max(gap, slave.gap_ns);
    }
    return gap;
}

Framing Bus::framing_on(const line::Description& of) const {
    return framing.value_or(of.is_stream ? Framing::tcp : Framing::rtu);
}

ReadResult read(std::string_view text, const std::string& file) {
    return Reader(text, file).read();
}

std::string bus_reference() { return bus_keys().reference(); }
std::string slave_reference() { return slave_keys().reference(); }
std::string drive_reference() { return drive_keys().reference(); }

}  // namespace hal::modbus
