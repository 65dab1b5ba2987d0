// SPDX-License-Identifier: MIT
// LinuxCNC's ethercat-conf.xml (the format of the lcec component): generic slaves, the class
// basic_cia402, and the devices of the table.
#include <algorithm>
#include <cmath>
#include <set>

#include "ethercat/config/lcec_cia402.hpp"
#include "ethercat/config/lcec_devices.hpp"
#include "ethercat/config/lcec_fsoe.hpp"
#include "ethercat/config/lcec_init_commands.hpp"
#include "ethercat/config/lcec_xml.hpp"
#include "ethercat/master/soe_client.hpp"

namespace hal::ethercat::config {

namespace {

using master::StartupWrite;
using master::Type;

class Lcec : private LcecXml {
public:
    Lcec(std::string_view text, const std::string& path, const ReadFile& read_file,
         const IsAssumed& is_assumed)
        : LcecXml(text),
          folder_(path.find('/') == path.npos ? "" : path.substr(0, path.rfind('/') + 1)),
          read_file_(read_file),
          is_assumed_(is_assumed) {}

    ReadResult read() {
        out_.lcec = true;
        pugi::xml_document document;
        const auto result = document.load_buffer(text_.data(), text_.size());
        if (!result) {
            const auto at = std::min(
                static_cast<std::size_t>(std::max<std::ptrdiff_t>(result.offset, 0)), text_.size());
            const auto line = static_cast<std::uint32_t>(
                1 +
                std::count(text_.begin(), text_.begin() + static_cast<std::ptrdiff_t>(at), '\n'));
            report_.error(Topic::line, {line, 1, static_cast<std::uint32_t>(at), 0},
                          "invalid XML: " + lower(result.description()),
                          "the file begins with <masters>");
            return finish();
        }
        const Xml root = document.document_element();
        if (std::string_view(root.name()) != "masters") {
            report_.error(Topic::line, esi::span_of(root, text_),
                          "the root element is '" + std::string(root.name()) + "', not masters",
                          "the file begins with <masters>");
            return finish();
        }
        attributes(root, {});
        children(root, {"master"}, [&](const Xml& node) { master_of(node); });
        if (out_.buses.empty()) {
            report_.error(Topic::line, esi::span_of(root, text_), "the file has no master",
                          "write <master idx=\"0\" appTimePeriod=\"1000000\">");
        }
        for (const Bus& bus : out_.buses) {
            check_bus(bus, report_);
        }
        return finish();
    }

private:
    ReadResult finish() {
        out_.messages = std::move(report_.all);
        text::sort(out_.messages);
        return std::move(out_);
    }

    /// A time in ns, or `*N`: N cycles.
    std::optional<std::int64_t> cycles(const Xml& node, const char* name) {
        const std::string_view value = node.attribute(name).value();
        if (value.empty()) {
            return {};
        }
        if (value.starts_with('*')) {
            if (const auto n = parse_natural(value.substr(1)); n && *n >= 1 && *n <= 1000) {
                return static_cast<std::int64_t>(*n) * bus_->setup.cycle_ns;
            }
        }
        if (const auto n = parse_natural(value); n && *n <= 1'000'000'000) {
            return static_cast<std::int64_t>(*n);
        }
        error(Topic::value, node,
              "invalid " + std::string(name) + " '" + std::string(value) + "' of <" + node.name() +
                  ">",
              "write a time in ns, or *1 for one cycle");
        return {};
    }

    /// Reads a <master> with its slaves, and adds it to the buses.
    void master_of(const Xml& node) {
        attributes(node, {"idx", "name", "appTimePeriod", "refClockSyncCycles", "syncToRefClock",
                          "refClockSlaveIdx"});
        Bus bus;
        bus.at = esi::span_of(node, text_);
        const auto idx = number(node, "idx", 0, 255).value_or(0);
        bus.name = node.attribute("name") ? node.attribute("name").value() : std::to_string(idx);
        bus.lcec = true;
        bus.index = static_cast<unsigned>(idx);
        bus.link = "sim:ethercat" + std::to_string(idx);
        if (const auto period = number(node, "appTimePeriod", 10'000, 1'000'000'000)) {
            bus.setup.cycle_ns = *period;
        }
        bus.cycle_given = true;
        bus.setup.lead = clock_lead_of(node);
        const auto reference = number(node, "refClockSlaveIdx", -1, 65535).value_or(-1);
        bus_ = &bus;
        fsoe_logics_.clear();
        children(node, {"slave"}, [&](const Xml& slave) { slave_of(slave); });
        build_fsoe_logics(bus);
        for (std::size_t i = 0; i < bus.setup.slaves.size(); ++i) {
            if (bus.setup.slaves[i].position == reference) {
                bus.setup.reference_slave = static_cast<std::uint16_t>(i);
            }
        }
        for (const Bus& other : out_.buses) {
            if (other.name == bus.name) {
                error(Topic::slave, node, "duplicate master '" + bus.name + "'",
                      "first in line " + std::to_string(other.at.line));
            }
        }
        out_.buses.push_back(std::move(bus));
    }

    /// Returns which clock leads: a negative refClockSyncCycles has the meaning of syncToRefClock.
    master::ClockLead clock_lead_of(const Xml& node) {
        const auto sync = number(node, "refClockSyncCycles", -1, 1'000'000).value_or(0);
        const bool follow = flag(node, "syncToRefClock", sync < 0);
        if (node.attribute("syncToRefClock") && node.attribute("refClockSyncCycles") && sync != 0 &&
            follow != (sync < 0)) {
            error(Topic::value, node, "syncToRefClock contradicts the sign of refClockSyncCycles",
                  "delete syncToRefClock; refClockSyncCycles=\"-1\" synchronises the thread to the "
                  "reference clock");
        }
        if (follow) return master::ClockLead::reference;
        return sync > 0 ? master::ClockLead::thread : master::ClockLead::none;
    }

    /// Connects the safety logics of the slaves, which name other slaves of the bus.
    void build_fsoe_logics(Bus& bus) {
        for (const auto& [number, at, parameters] : fsoe_logics_) {
            std::vector<std::string> problems;
            build_fsoe_logic(bus, number, parameters, problems);
            for (const std::string& problem : problems) {
                error(Topic::value, at, problem, "correct the modParam");
            }
        }
    }

    /// Reads a <slave> and adds it to the bus that is read. What its type means is in the table of
    /// lcec's devices, but for `generic`, whose children describe it, and `basic_cia402`.
    void slave_of(const Xml& node) {
        attributes(
            node, {"idx", "type", "name", "vid", "pid", "configPdos", "syncUnit", "syncUnitCycle"});
        begin_slave(node);
        master::Slave s;
        s.line = info_.at.line;
        s.position =
            static_cast<std::uint16_t>(number(node, "idx", 0, 65535, false, true).value_or(0));
        s.name =
            node.attribute("name") ? node.attribute("name").value() : std::to_string(s.position);
        if (!is_generic() && !is_cia402() && !device_) {
            unknown_type(node, s.name);
        }
        identity_of(node, s);
        configure_ = flag(node, "configPdos", false);
        if (const std::string unit = node.attribute("syncUnit").value();
            !unit.empty() || node.attribute("syncUnitCycle")) {
            domain(node, s, unit.empty() ? "default" : unit);
        }
        children(
            node,
            {"dcConf", "watchdog", "sdoConfig", "idnConfig", "initCmds", "modParam", "syncManager"},
            [&](const Xml& child) { child_of_slave(child, s); });
        build(node, s);
        if (info_.fsoe_logic) {
            fsoe_logics_.push_back({bus_->setup.slaves.size(), node, fsoe_parameters_});
        }
        bus_->setup.slaves.push_back(std::move(s));
        bus_->slaves.push_back(std::move(info_));
    }

    bool is_generic() const { return info_.type == "generic"; }
    bool is_cia402() const { return info_.type == "basic_cia402"; }

    /// Forgets the slave before, and finds the device of this one's type.
    void begin_slave(const Xml& node) {
        info_ = {};
        pins_.clear();
        parameters_.clear();
        fsoe_parameters_.clear();
        info_.at = esi::span_of(node, text_);
        info_.type = node.attribute("type").value();
        device_ = is_generic() || is_cia402() ? std::nullopt : find_lcec_device(info_.type);
    }

    /// Sets vendor and product: as the file has them, or else of the slave's device.
    void identity_of(const Xml& node, master::Slave& s) {
        const bool is_required = is_generic() || is_cia402();
        if (const auto vid = number(node, "vid", 0, 0xffffffff, true, is_required)) {
            s.identity.vendor = static_cast<std::uint32_t>(*vid);
        }
        if (const auto pid = number(node, "pid", 0, 0xffffffff, true, is_required)) {
            s.identity.product = static_cast<std::uint32_t>(*pid);
        }
        if (!device_) return;
        s.identity.vendor = s.identity.vendor != 0 ? s.identity.vendor : device_->vendor;
        s.identity.product = s.identity.product != 0 ? s.identity.product : device_->product;
        count_as_neighbour(node, s.position);
    }

    void child_of_slave(const Xml& child, master::Slave& s) {
        const std::string_view name = child.name();
        if (name == "dcConf") {
            dc(child, s);
        } else if (name == "watchdog") {
            watchdog(child, s);
        } else if (name == "sdoConfig") {
            sdo(child, s);
        } else if (name == "idnConfig") {
            idn(child, s);
        } else if (name == "initCmds") {
            init_commands(child, s);
        } else if (name == "modParam") {
            parameter(child, is_cia402());
        } else if (is_generic()) {
            sync_manager(child, s);
        } else {
            error(Topic::line, child, "<syncManager> applies only to type=\"generic\"",
                  "delete it, or write type=\"generic\"");
        }
    }

    /// Adds process data and pins of a slave whose type describes them.
    void build(const Xml& node, master::Slave& s) {
        std::vector<std::string> problems;
        if (is_cia402()) {
            build_cia402(parameters_, s, info_, problems);
        }
        if (device_) {
            build_lcec_device(*device_, parameters_, bus_->setup.cycle_ns, s, info_, problems);
        }
        for (const std::string& problem : problems) {
            error(Topic::value, node, problem);
        }
    }

    /// Gives an option card the number of axes of its drive, the slave before it.
    void count_as_neighbour(const Xml& node, std::uint16_t position) {
        std::optional<LcecDevice> before;
        for (const Xml& other : node.parent().children("slave")) {
            if (other.attribute("idx").as_int(-1) == int{position} - 1) {
                before = find_lcec_device(other.attribute("type").value());
            }
        }
        if (!config::count_as_neighbour(*device_, before ? &*before : nullptr)) {
            error(Topic::slave, node,
                  info_.type + " is an option of a drive, which must be the slave before it",
                  "write its drive as idx=\"" + std::to_string(int{position} - 1) + "\"");
        }
    }

    void unknown_type(const Xml& node, const std::string& slave) {
        if (info_.type.empty()) {
            return error(Topic::slave, node, "missing attribute 'type' of <slave>",
                         "write the type of the device, as in type=\"EL1008\", or "
                         "type=\"generic\" with its PDOs");
        }
        const auto unsupported = unsupported_lcec_devices();
        const bool of_lcec =
            std::find(unsupported.begin(), unsupported.end(), info_.type) != unsupported.end();
        const std::string what = of_lcec ? "lcec's driver '" + info_.type + "' is not supported"
                                         : "unknown slave type '" + info_.type + "'";
        const std::string pins = "lcec." + bus_->name + "." + slave;
        if (is_assumed_ && is_assumed_(pins)) {
            return report_.warning(Topic::slave, esi::span_of(node, text_),
                                   what + ": slave '" + slave + "' has no pins",
                                   "they are assumed to exist");
        }
        const std::string near =
            of_lcec ? std::string() : did_you_mean(info_.type, lcec_device_names());
        error(Topic::slave, node, what,
              (near.empty() ? std::string() : near + " Or ") +
                  "write type=\"generic\" with vid, pid and the PDOs of the device; `hal check "
                  "--assume " +
                  pins + "` checks the rest");
    }

    void domain(const Xml& node, master::Slave& s, const std::string& unit) {
        auto& domains = bus_->setup.domains;
        const std::int64_t time = cycles(node, "syncUnitCycle").value_or(bus_->setup.cycle_ns);
        if (time == 0 || time % bus_->setup.cycle_ns != 0) {
            return error(Topic::value, node, "syncUnitCycle is not a multiple of appTimePeriod",
                         "write *1, *2, …");
        }
        const auto every = static_cast<unsigned>(time / bus_->setup.cycle_ns);
        auto at = std::find_if(domains.begin(), domains.end(),
                               [&](const master::Domain& d) { return d.name == unit; });
        if (at == domains.end()) {
            at = domains.insert(at, {unit, every});
        } else if (node.attribute("syncUnitCycle")) {
            at->every = every;
        }
        s.domain = static_cast<std::uint16_t>(at - domains.begin());
    }

    void dc(const Xml& node, master::Slave& s) {
        attributes(node,
                   {"assignActivate", "sync0Cycle", "sync0Shift", "sync1Cycle", "sync1Shift"});
        master::Dc dc;
        dc.assign_activate = static_cast<std::uint16_t>(
            number(node, "assignActivate", 0, 0xffff, true, true).value_or(0));
        dc.sync0_cycle_ns = cycles(node, "sync0Cycle").value_or(0);

        dc.sync1_cycle_ns = cycles(node, "sync1Cycle").value_or(0);
        dc.sync0_shift_ns = number(node, "sync0Shift", -1'000'000'000, 1'000'000'000).value_or(0);
        dc.sync1_shift_ns = number(node, "sync1Shift", -1'000'000'000, 1'000'000'000).value_or(0);
        s.dc = dc;
    }
    void watchdog(const Xml& node, master::Slave& s) {
        attributes(node, {"divider", "intervals"});
        if (const auto n = number(node, "divider", 0, 65535)) {
            s.watchdog.divider = static_cast<std::uint16_t>(*n);
        }
        if (const auto n = number(node, "intervals", 0, 65535)) {
            s.watchdog.intervals = static_cast<std::uint16_t>(*n);
        }
    }
    void sdo(const Xml& node, master::Slave& s) {
        attributes(node, {"idx", "subIdx"});
        StartupWrite w;
        w.line = esi::span_of(node, text_).line;
        w.index =
            static_cast<std::uint16_t>(number(node, "idx", 1, 0xffff, true, true).value_or(0));
        w.complete = same_word(node.attribute("subIdx").value(), "complete");
        if (!w.complete) {
            w.sub =
                static_cast<std::uint8_t>(number(node, "subIdx", 0, 0xff, true, true).value_or(0));
        }
        w.data = raw_data(node, "sdoDataRaw");
        if (!w.data.empty()) {
            s.startup.push_back(std::move(w));
        }
    }
    /// LinuxCNC's lcec loads no file with this element, because it never finds `state`; here it may
    /// be missing.
    void idn(const Xml& node, master::Slave& s) {
        attributes(node, {"drive", "idn", "state"});
        StartupWrite w;
        w.protocol = StartupWrite::Protocol::soe;
        w.line = esi::span_of(node, text_).line;
        w.sub = static_cast<std::uint8_t>(number(node, "drive", 0, 7).value_or(0));
        const std::string_view name = trimmed(node.attribute("idn").value());

        const std::string_view state = trimmed(node.attribute("state").value());
        if (const auto parsed = master::parse_idn(name)) {
            w.index = *parsed;
        } else {
            error(Topic::value, node,
                  name.empty() ? "missing attribute 'idn' of <idnConfig>"
                               : "invalid idn '" + std::string(name) + "' of <idnConfig>",
                  "write idn=\"S-0-15\" or idn=\"P-0-150\"");
        }
        if (state == "SAFEOP") {
            w.before = State::op;
        } else if (!state.empty() && state != "PREOP") {
            error(
                Topic::value, node, "invalid state '" + std::string(state) + "' of <idnConfig>",
                "write state=\"PREOP\" or state=\"SAFEOP\", the state in which the IDN is written");
        }
        w.data = raw_data(node, "idnDataRaw");
        if (!w.data.empty()) {
            s.startup.push_back(std::move(w));
        }
    }
    void init_commands(const Xml& node, master::Slave& s) {
        attributes(node, {"filename"});
        const std::string given = node.attribute("filename").value();

        const std::string path = given.starts_with('/') ? given : folder_ + given;
        if (given.empty()) {
            return error(Topic::value, node, "missing attribute 'filename' of <initCmds>",
                         "write filename=\"drive-init.xml\"");
        }
        std::string text;
        if (!read_file_(path, text)) {
            return error(Topic::value, node, "cannot read '" + path + "': " + text,
                         "write the path of a file beside this one");
        }
        const auto report = [&](bool is_error, std::uint32_t line, const std::string& sentence,
                                std::string help) {
            const std::string where =
                "'" + path + "', line " + std::to_string(line) + ": " + sentence;
            if (is_error) {
                error(Topic::value, node, where, std::move(help));
            } else {
                report_.warning(Topic::value, esi::span_of(node, text_), where, std::move(help));
            }
        };
        for (StartupWrite& w : read_init_commands(text, report)) {
            w.line = esi::span_of(node, text_).line;
            s.startup.push_back(std::move(w));
        }
    }
    /// Returns the bytes of the elements `name`; reports when they are missing.
    std::vector<std::uint8_t> raw_data(const Xml& node, const char* name) {
        std::vector<std::uint8_t> bytes;
        bool valid = true;
        children(node, {name}, [&](const Xml& raw) {
            attributes(raw, {"data"});
            const auto data = esi::hex_bytes(raw.attribute("data").value());
            if (data) return void(bytes.insert(bytes.end(), data->begin(), data->end()));
            valid = false;
            error(Topic::value, raw,
                  "invalid data '" + std::string(raw.attribute("data").value()) + "'",
                  "write hexadecimal bytes in the order of the wire, as in data=\"E8 03\"");
        });
        if (bytes.empty() && valid) {
            error(Topic::value, node, "<" + std::string(node.name()) + "> has no data",
                  "write <" + std::string(name) + " data=\"E8 03\"/> in it");
        }
        return bytes;
    }
    void parameter(const Xml& node, bool drive) {
        attributes(node, {"name", "value"});
        const std::string name = node.attribute("name").value();
        std::vector<std::string> names;
        if (device_) {
            names = lcec_parameters(*device_);
        } else if (drive) {
            names = cia402_parameters();
        }
        if (names.empty()) {
            return error(Topic::line, node,
                         "<modParam> has no effect on type=\"" + info_.type + "\"", "delete it");
        }
        if (std::find(names.begin(), names.end(), name) == names.end()) {
            return error(Topic::line, node, "unsupported modParam '" + name + "'",
                         suggestion(name, names, "the parameters are"));
        }
        parameters_[name] = node.attribute("value").value();
        fsoe_parameters_.emplace_back(name, node.attribute("value").value());
    }

    void sync_manager(const Xml& node, master::Slave& s) {
        attributes(node, {"idx", "dir"});
        master::SyncManager sm;
        sm.number = static_cast<std::uint8_t>(number(node, "idx", 0, 15, false, true).value_or(2));
        const std::string dir = node.attribute("dir").value();
        if (dir != "in" && dir != "out") {
            error(Topic::value, node, "invalid dir '" + dir + "' of <syncManager>",
                  "write dir=\"in\" for what the slave sends, or dir=\"out\"");
        }
        sm.output = dir == "out";
        sm.write_assignment = configure_;
        children(node, {"pdo"}, [&](const Xml& pdo) {
            attributes(pdo, {"idx"});
            master::Pdo p;
            p.index = static_cast<std::uint16_t>(required_hex(pdo, "idx", 1, 0xffff));
            p.write_mapping = configure_;
            children(pdo, {"pdoEntry"}, [&](const Xml& e) { entry(e, sm, p); });
            sm.pdos.push_back(std::move(p));
        });
        if (!sm.pdos.empty()) {
            s.sync_managers.push_back(std::move(sm));
        }
    }

    /// Reads a <pdoEntry>: a value, or with halType="complex" the parts of one.
    void entry(const Xml& node, const master::SyncManager& sm, master::Pdo& pdo) {
        attributes(node, {"idx", "subIdx", "bitLen", "halType", "halPin", "scale", "offset"});
        master::Entry entry;
        entry.index = static_cast<std::uint16_t>(required_hex(node, "idx", 0, 0xffff));
        const bool is_gap = entry.index == 0;
        entry.sub =
            static_cast<std::uint8_t>(is_gap ? number(node, "subIdx", 0, 0xff, true).value_or(0)
                                             : required_hex(node, "subIdx", 0, 0xff));
        const std::uint16_t bits = bit_length(node, 255, 8);
        const bool is_complex = std::string_view(node.attribute("halType").value()) == "complex";
        if (is_complex) return complex_entry(node, sm, entry, bits, pdo);
        children(node, {}, [](const Xml&) {});
        typed(node, sm, entry, bits, pdo);
    }

    /// Adds an entry for each <complexEntry> of a <pdoEntry>, and one for the bits behind the last.
    /// All of them are parts of the object of the first.
    void complex_entry(const Xml& node, const master::SyncManager& sm, const master::Entry& entry,
                       std::uint16_t bits, master::Pdo& pdo) {
        if (node.attribute("halPin")) {
            error(Topic::value, node, "an entry of halType complex has no pin of its own",
                  "write halPin in its <complexEntry> elements");
        }
        const std::size_t first = pdo.entries.size();
        unsigned used = 0;
        children(node, {"complexEntry"}, [&](const Xml& part) {
            attributes(part, {"bitLen", "halType", "halPin", "scale", "offset"});
            const std::uint16_t length = bit_length(part, 32, 1);
            used += length;
            if (used <= bits) return typed(part, sm, entry, length, pdo);
            error(Topic::value, part,
                  "the <complexEntry> elements have more bits than their <pdoEntry>, which has " +
                      std::to_string(bits),
                  "correct bitLen");
        });
        if (used < bits) {
            master::Entry rest = entry;
            rest.bits = static_cast<std::uint16_t>(bits - used);
            pdo.entries.push_back(std::move(rest));
        }
        for (std::size_t i = first; i < pdo.entries.size(); ++i) {
            pdo.entries[i].part = i != first;
        }
    }

    /// Returns a hexadecimal attribute; 0 after reporting that it is missing or invalid.
    std::int64_t required_hex(const Xml& node, const char* name, std::int64_t min,
                              std::int64_t max) {
        return number(node, name, min, max, true, true).value_or(0);
    }
    /// Returns bitLen of an entry; `fallback` after reporting that it is missing or invalid.
    std::uint16_t bit_length(const Xml& node, std::int64_t max, std::uint16_t fallback) {
        const auto bits = number(node, "bitLen", 1, max, false, true);
        return static_cast<std::uint16_t>(bits.value_or(fallback));
    }

    /// Adds an entry, or `bits` single bits if it is a `bit` of several.
    void typed(const Xml& node, const master::SyncManager& sm, master::Entry e, std::uint16_t bits,
               master::Pdo& to) {
        const std::string pin = node.attribute("halPin").value();
        e.bits = bits;
        const HalType type = hal_type(node);
        e.type = type.real != Type::bit ? type.real : type_for(type, bits);
        e.is_signed = is_signed(e.type);
        if (type.is_float) {
            scale(node, sm.output, e);
            check_width(node, e);
        } else if (node.attribute("scale") || node.attribute("offset")) {
            error(Topic::value, node, "scale and offset apply only to the float types",
                  "write halType=\"float\"");
        }
        if (pin.empty() || e.index == 0) {
            to.entries.push_back(std::move(e));
            return;
        }
        if (std::string_view(node.attribute("halType").value()).empty()) {
            error(Topic::value, node, "pin '" + pin + "' has no halType", "write halType=\"u32\"");
        }
        if (e.type == Type::bit && bits > 1) return add_bits(node, e, pin, to);
        if (bits > 32 && e.type != Type::real64) {
            error(Topic::value, node,
                  "pin '" + pin + "' has " + std::to_string(bits) + " bits; 32 are possible",
                  "delete halPin");
        }
        add_pin(node, e, pin);
        to.entries.push_back(std::move(e));
    }

    /// A halType: an integer of as many bits as the entry, or a real type.
    struct HalType {
        const char* name;
        bool is_float;
        bool is_signed;
        Type real = Type::bit;  ///< a real type; bit: none
        bool is_bit = false;
    };
    HalType hal_type(const Xml& node) {
        static constexpr HalType types[] = {{"bit", false, false, Type::bit, true},
                                            {"s32", false, true},
                                            {"u32", false, false},
                                            {"", false, false},
                                            {"float", true, true},
                                            {"float-unsigned", true, false},
                                            {"float-ieee", true, true, Type::real32},
                                            {"float-double-ieee", true, true, Type::real64}};
        const std::string name = node.attribute("halType").value();
        for (const HalType& type : types) {
            if (name == type.name) return type;
        }
        error(Topic::value, node, "unknown halType '" + name + "'",
              suggestion(name,
                         {"bit", "s32", "u32", "float", "float-unsigned", "float-ieee",
                          "float-double-ieee", "complex"},
                         "the types are"));
        return types[2];
    }
    static Type type_for(const HalType& type, unsigned bits) {
        return type.is_bit ? Type::bit : type_of(std::max(bits, 2U), type.is_signed);
    }

    double real(const Xml& node, const char* name, double otherwise) {
        if (!node.attribute(name)) return otherwise;
        const auto value = parse_real(trimmed(node.attribute(name).value()));
        if (value && (std::string_view(name) != "scale" || *value != 0)) return *value;
        error(Topic::value, node,
              "invalid " + std::string(name) + " '" + node.attribute(name).value() + "'",
              "write a number other than 0");
        return otherwise;
    }

    /// Written values are (pin + offset) * scale.
    void scale(const Xml& node, bool output, master::Entry& e) {
        e.scaled = true;
        e.scale = real(node, "scale", 1);
        e.offset = real(node, "offset", 0);
        if (output) {
            e.scale = 1 / e.scale;
            e.offset = -e.offset;
        }
    }

    void check_width(const Xml& node, const master::Entry& e) {
        if (!is_real(e.type)) return;
        const unsigned width = e.type == Type::real32 ? 32 : 64;
        if (e.bits == width) return;
        error(Topic::value, node,
              std::string("halType ") + node.attribute("halType").value() + " has " +
                  std::to_string(width) + " bits, not " + std::to_string(e.bits),
              "correct bitLen");
    }

    void add_pin(const Xml& node, master::Entry& e, const std::string& pin) {
        e.name = pin;
        if (!pins_.insert(pin).second) {
            error(Topic::slave, node, "duplicate pin '" + pin + "' of this slave",
                  "choose another halPin");
        }
        info_.pins.push_back({pin, {"", object_text(e.index, e.sub)}});
    }

    /// Adds each bit as an entry; the first 32 are pins.
    void add_bits(const Xml& node, const master::Entry& e, const std::string& pin,
                  master::Pdo& to) {
        for (unsigned i = 0; i < e.bits; ++i) {
            master::Entry bit = e;
            bit.bits = 1;
            bit.part = i != 0;
            if (i < 32) {
                add_pin(node, bit, pin + "-" + std::to_string(i));
            }
            to.entries.push_back(std::move(bit));
        }
    }

    std::string folder_;  // of the file, with a slash at its end
    const ReadFile& read_file_;
    const IsAssumed& is_assumed_;
    ReadResult out_;
    Bus* bus_ = nullptr;
    SlaveInfo info_;
    std::set<std::string> pins_;
    std::map<std::string, std::string> parameters_;
    FsoeParameters fsoe_parameters_;  // the same in the order of the file
    /// A logic terminal, whose safe terminals may follow it.
    struct FsoeLogicNode {
        std::size_t number;
        Xml at;
        FsoeParameters parameters;
    };
    std::vector<FsoeLogicNode> fsoe_logics_;
    std::optional<LcecDevice> device_;  // of the table; not set: generic or basic_cia402
    bool configure_ = false;
};

}  // namespace

ReadResult read_lcec(std::string_view xml, const std::string& path, const ReadFile& read_file,
                     const IsAssumed& is_assumed) {
    return Lcec(xml, path, read_file, is_assumed).read();
}

}  // namespace hal::ethercat::config
