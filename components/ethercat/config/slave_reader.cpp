// SPDX-License-Identifier: MIT
// A slave of a `.ethercat` file: description, identity, settings, clocks.
#include <algorithm>
#include <cstdio>

#include "ethercat/config/slave_oversampling.hpp"
#include "ethercat/config/slave_pdos.hpp"
#include "ethercat/config/slave_writes.hpp"
#include "ethercat/esi/lookup.hpp"

namespace hal::ethercat::config {

namespace {

using master::StartupWrite;

constexpr std::int64_t us = 1'000;
constexpr std::int64_t ms = 1'000'000;
constexpr std::int64_t second = 1000 * ms;

template <class T>
auto of_slave(T master::Slave::* member) {
    return [member](SlaveInput& to) -> T& { return to.slave.*member; };
}
template <class T>
auto of_timeouts(T master::Timeouts::* member) {
    return [member](SlaveInput& to) -> T& { return to.slave.timeouts.*member; };
}
std::uint32_t& vendor(SlaveInput& to) { return to.slave.identity.vendor; }
std::uint32_t& product(SlaveInput& to) { return to.slave.identity.product; }
std::optional<std::uint32_t>& serial(SlaveInput& to) { return to.slave.identity.serial; }

constexpr bus::Choice<State> states[] = {
    {"op", State::op}, {"safeop", State::safeop}, {"preop", State::preop}, {"init", State::init}};

/// Parses 0x10001 or 0x10001+.
std::optional<std::uint32_t> parse_revision(std::string_view text) {
    const auto value = parse_natural(text.substr(0, text.size() - (text.ends_with('+') ? 1 : 0)));
    return value ? std::optional(static_cast<std::uint32_t>(*value)) : std::nullopt;
}

bool read_revision(SlaveInput& to, const Line& line) {
    if (same_word(line.value.text, "any")) return true;
    if (same_word(line.value.text, "esi")) return true;  // SlaveReader::identity() has set it
    master::Identity& identity = to.slave.identity;
    identity.revision = parse_revision(line.value.text);
    const bool or_higher = line.value.text.ends_with('+');
    identity.revision_rule = or_higher ? RevisionRule::equal_or_higher : RevisionRule::equal;
    return identity.revision.has_value();
}

bool read_serial(SlaveInput& to, const Line& line) {
    if (same_word(line.value.text, "any")) return true;
    return bus::number(&serial, 0, 0xffffffff).parse(to, line);
}

/// Reads a time, or none, into the registers of the watchdog.
bool read_watchdog(SlaveInput& to, const Line& line) {
    constexpr std::int64_t unit_ns = 100 * us;  // with the divider 2498
    master::Watchdog& watchdog = to.slave.watchdog;
    if (same_word(line.value.text, "none")) {
        watchdog.intervals = std::uint16_t{0};
        return true;
    }
    const auto time = parse_duration_ns(line.value.text, 0.0);
    if (!time || *time < unit_ns || *time > 65535 * unit_ns) return false;
    watchdog.divider = std::uint16_t{2498};
    watchdog.intervals = static_cast<std::uint16_t>((*time + unit_ns - 1) / unit_ns);
    return true;
}

bool read_domain(SlaveInput& to, const Line& line) {
    const auto& domains = to.bus.setup.domains;
    const std::string& name = line.value.text;
    std::vector<std::string> names;
    for (std::size_t i = 0; i < domains.size(); ++i) {
        names.push_back(domains[i].name);
        if (domains[i].name != name) continue;
        to.slave.domain = static_cast<std::uint16_t>(i);
        return true;
    }
    to.report.error(
        Topic::slave, line.value.at, "unknown domain '" + name + "'",
        "write [domain " + name + "] and below it every = 4; the domains are: " + listed(names));
    return true;
}

const bus::KeyTable<SlaveInput>& slave_keys() {
    using S = master::Slave;
    using T = master::Timeouts;
    static const bus::KeyTable<SlaveInput> table{{
        {"type", "a name", "", "name of the `[type …]` section that applies"},
        {"esi", "a path", "", "path of the device description (ESI), relative to this file"},
        {"device", "a name, cia402", "the only device of the ESI",
         "order code or name of the device in the ESI. Without an ESI, `cia402` describes a drive "
         "with the objects of CiA 402"},
        {"axes", "1..8", "`1`",
         "number of drives in the slave. The object indices of each further axis are 800h higher "
         "than those of the axis before it"},
        {"modules", "names or numbers", "the default modules",
         "modules of a modular device in the order of the slots; `-` is an empty slot"},
        {"vendor", bus::number(&vendor, 1, 0xffffffff), "from the ESI", "expected identity"},
        {"product", bus::number(&product, 1, 0xffffffff), "from the ESI", "expected identity"},
        {"revision",
         bus::own("any, esi, a number, or one with + for this revision or a higher one, as in "
                  "0x10001+",
                  "any, esi, a number, a number+", &read_revision),
         "`any`",
         "expected identity; `revision = 0x10001+` also accepts higher revisions, `esi` those that "
         "`CheckRevisionNo` of the ESI accepts. A number also selects the description of that "
         "revision in the ESI"},
        {"serial",
         bus::own("a number of 0..4294967295, decimal or with 0x", "any, a number", &read_serial),
         "`any`", "expected identity"},
        {"optional", bus::flag(of_slave(&S::optional)), "`no`", "`yes`: the slave may be missing"},
        {"state", bus::choice(of_slave(&S::target), states), "`op`",
         "state to which the master brings the slave. If the state is lower than `op`, the pin "
         "`operational` of the slave is never TRUE, and `all-op` does not wait for OP of this "
         "slave"},
        {"domain", bus::own("", "a name", &read_domain), "`default`",
         "domain of the process data of the slave"},
        {"eoe", "no, yes, dhcp, an address", "`no`",
         "Ethernet over EtherCAT; see [below](#ethernet-over-ethercat)"},
        {"watchdog",
         bus::own("none, or a time of 100us..6553ms", "none, 100us..6553ms", &read_watchdog),
         "that of the slave", "process data watchdog"},
        {"lrw", bus::flag(of_slave(&S::use_lrw)), "`yes`",
         "`no`: outputs and inputs are transferred in separate datagrams"},
        {"preop-timeout", bus::time(of_timeouts(&T::to_preop), ms, 600 * second).in(ms),
         "from the ESI; otherwise 3 s", "timeout of the state change to PRE-OP"},
        {"op-timeout", bus::time(of_timeouts(&T::to_safeop_op), ms, 600 * second).in(ms),
         "from the ESI; otherwise 10 s", "timeout of the state changes to SAFE-OP and OP"},
        {"mailbox-timeout", bus::time(of_timeouts(&T::mailbox_response), ms, 600 * second).in(ms),
         "from the ESI; otherwise 2 s", "timeout of a mailbox response"},
        {"entries-per-pdo", bus::number(of_slave(&S::entries_per_pdo), 1, 255), "none",
         "maximum number of entries per PDO; further objects go to the next PDOs"},
        {"complete-access", bus::flag(of_slave(&S::complete_access)), "from the ESI",
         "`yes`: the mapping and the assignment are written in one transfer each"},
        {"sdo OBJECT", "a value", "", "a [start-up write](#start-up-writes) by CoE"},
        {"idn IDN", "bytes", "", "a start-up write by SoE"},
        {"aoe OBJECT", "bytes", "", "a start-up write by AoE"},
        {"register ADDRESS", "a value", "", "a start-up write to a register"},
    }};
    return table;
}

/// The keys that apply only with distributed clocks.
const bus::KeyTable<master::Dc>& clock_keys() {
    using D = master::Dc;
    static const bus::KeyTable<master::Dc> table{{
        {"dc", "sync0, sync0+sync1, a mode of the ESI, clock, none", "`none`",
         "use of the distributed clock: `sync0`, `sync0+sync1`, the name of an operation mode of "
         "the ESI, `clock` (without SYNC signals), or `none`. A shift may follow: `sync0 250us`"},
        {"assign-activate", bus::number(&D::assign_activate, 0, 0xffff),
         "from the ESI; otherwise `0x300` for `sync0`, `0x700` for `sync0+sync1`",
         "value of registers 0980h and 0981h"},
        {"oversampling", "1..1000", "from the mode of `dc`; otherwise `1`",
         "samples in a cycle, of a device that takes one at each pulse of SYNC0; see "
         "[Oversampling](#oversampling)"},
        {"sync0-cycle", bus::time(&D::sync0_cycle_ns, 10 * us, second),
         "from the ESI; otherwise the cycle time of the bus", "cycle time of SYNC0"},
        {"sync1-cycle", bus::time(&D::sync1_cycle_ns, 0, second), "from the ESI",
         "time from a pulse of SYNC0 to the one of SYNC1 (register 09A4h); the next SYNC0 after it "
         "starts it again"},
        {"sync1-shift", bus::time(&D::sync1_shift_ns, -second, second), "from the ESI; otherwise 0",
         "added to `sync1-cycle`"},
    }};
    return table;
}

/// Finds the operation mode with this name, or the first one with the signals that `sync0` or
/// `sync0+sync1` requests.
const esi::OpMode* find_mode(const esi::Device& device, std::string_view name) {
    constexpr unsigned signals = 0x700;
    unsigned wanted = 0;
    if (same_word(name, "sync0")) {
        wanted = 0x300;
    } else if (same_word(name, "sync0+sync1")) {
        wanted = 0x700;
    }
    const auto at =
        std::find_if(device.op_modes.begin(), device.op_modes.end(), [&](const esi::OpMode& mode) {
        const bool fits = wanted != 0 && (mode.assign_activate & signals) == wanted;
        return fits || same_word(mode.name, name);
    });
    return at == device.op_modes.end() ? nullptr : &*at;
}

class SlaveReader {
public:
    explicit SlaveReader(SlaveInput in)
        : in_(in), keys_(in.keys), report_(in.report), key_report_(report_), slave_(in.slave) {}

    void read() {
        keys_.find("type");
        const bool described = describe();
        identity();
        settings();
        read_eoe(in_);
        clocks();
        description_writes();
        if (!described) return;  // unknown objects follow from it and are not reported
        SlavePdos pdos(in_, device(), mode_, slave_.entries_per_pdo);
        SlaveWrites(in_, device(), pdos).read();
        pdos.read();
        SlaveOversampling(in_, device()).expand();
        keys_.report_rest("of a slave", names());
    }

    static std::vector<std::string> names() {
        std::vector<std::string> all = slave_keys().names();
        for (const auto& more : {clock_keys().names(), SlavePdos::key_names()}) {
            all.insert(all.end(), more.begin(), more.end());
        }
        return all;
    }

private:
    const esi::Device* device() const { return modular_ ? &*modular_ : device_; }

    /// Finds the description of the device. Returns false after reporting that it is missing.
    bool describe() {
        const Line* const esi = keys_.find("esi");
        const Line* const name = keys_.find("device");
        const auto get_axes = [this](SlaveInput&) -> unsigned& { return axes_; };
        const bool axes_given = keys_.read("axes", bus::number(get_axes, 1, 8), in_);
        if (esi == nullptr) return name == nullptr || use_profile(*name);
        file_ = in_.descriptions.get(esi->value, report_);
        if (file_ == nullptr) return false;
        in_.info.description = esi->value.text;
        device_ = find_device(*esi, name);
        if (device_ == nullptr) return false;
        in_.info.type = device_->order;
        const bool is_drive = name != nullptr && same_word(name->value.text, "cia402");
        if (device_->profile == 402 || axes_given || is_drive) {
            in_.info.cia402_axes = axes_;
        }
        modules();
        return true;
    }

    bool use_profile(const Line& name) {
        if (same_word(name.value.text, "cia402")) {
            in_.info.type = "cia402";
            in_.info.cia402_axes = axes_;
            return true;
        }
        report_.error(Topic::slave, name.value.at, "unknown device '" + name.value.text + "'",
                      "write device = cia402, or esi = FILE for a device with a description");
        return false;
    }

    /// Returns the number of a key; nullopt: it is not given, or invalid.
    std::optional<std::uint32_t> number_of(const char* key) {
        const Line* line = keys_.find(key);
        if (line == nullptr) return std::nullopt;
        const auto value = parse_natural(line->value.text);
        return value ? std::optional(static_cast<std::uint32_t>(*value)) : std::nullopt;
    }

    std::optional<std::uint32_t> revision() {
        const Line* line = keys_.find("revision");
        return line != nullptr ? parse_revision(line->value.text) : std::nullopt;
    }

    /// Finds the device of the ESI by `device`, `vendor`, `product` and `revision`, or because it
    /// is the only one. Reports a missing one, and then returns nullptr.
    const esi::Device* find_device(const Line& esi, const Line* name) {
        const bool is_named = name != nullptr && !same_word(name->value.text, "cia402");
        esi::Wanted wanted;
        if (is_named) {
            wanted.name = name->value.text;
        }
        wanted.vendor = number_of("vendor").value_or(0);
        wanted.product = number_of("product");
        wanted.revision = revision();
        const esi::Match match = esi::look_up(*file_, wanted);
        const std::string file = "'" + esi.value.text + "'";
        if (match.device == nullptr) {
            report_no_device(match, file, deciding_key(esi, is_named ? name : nullptr));
            return nullptr;
        }
        if (match.revision == esi::Match::Revision::other) {
            const Line& line = *keys_.find("revision");
            report_.warning(
                Topic::slave, line.value.at,
                file + " does not describe revision " + line.value.text + " of '" +
                    match.device->order + "'; the description of revision " +
                    esi::number_text(match.device->revision) + " is used",
                "the revisions are: " + listed(esi::revisions_of(*file_, *match.device)));
        }
        return match.device;
    }

    /// Returns the line that an unsuccessful look-up is reported at.
    const Line& deciding_key(const Line& esi, const Line* name) {
        if (name != nullptr) return *name;
        const Line* product = keys_.find("product");
        return product != nullptr ? *product : esi;
    }

    void report_no_device(const esi::Match& match, const std::string& file, const Line& line) {
        std::string help;
        if (match.choices.empty()) {
            help = "correct the key, or write the ESI file of the device";
        } else if (line.key.text == "device") {
            help = suggestion(line.value.text, match.choices, "the devices are");
        } else if (line.key.text == "esi") {
            help = "write device = NAME; the devices are: " + listed(match.choices);
        } else {
            help = "the devices are: " + listed(match.choices);
        }
        report_.error(Topic::slave, line.value.at, file + " " + match.problem, help);
    }

    /// Builds a modular device, and writes its configured module list (ETG.5001).
    void modules() {
        const Line* line = keys_.find("modules");
        const std::vector<std::uint32_t> idents =
            line != nullptr ? configured_modules(*line) : esi::default_modules(*device_);
        const bool all_empty =
            std::all_of(idents.begin(), idents.end(), [](std::uint32_t i) { return i == 0; });
        if (line == nullptr && all_empty) return;
        modular_ = esi::with_modules(*file_, *device_, idents);
        if (!device_->download_modules.value_or(true)) return;
        for (std::size_t i = 0; i < idents.size(); ++i) {
            slave_.startup.push_back(startup_write(0xf030, static_cast<unsigned>(i + 1),
                                                   little_endian(idents[i], 32), State::safeop));
        }
        if (!idents.empty()) {
            slave_.startup.push_back(
                startup_write(0xf030, 0, little_endian(idents.size(), 8), State::safeop));
        }
    }

    std::vector<std::uint32_t> configured_modules(const Line& line) {
        std::vector<std::uint32_t> idents;
        for (const Word& word : list_of(line.value)) {
            const auto ident = module_ident(word);
            if (!ident) continue;
            check_slot(word, idents.size(), *ident);
            idents.push_back(*ident);
        }
        return idents;
    }

    /// Reports a module without a slot, and one that its slot does not name.
    void check_slot(const Word& word, std::size_t number, std::uint32_t ident) {
        const auto& slots = device_->slots;
        if (slots.empty()) return;
        if (number >= slots.size()) {
            report_.error(Topic::slave, word.at,
                          "module '" + word.text + "' has no slot: '" + device_->order + "' has " +
                              std::to_string(slots.size()),
                          "leave it out");
            return;
        }
        const auto& modules = slots[number].modules;
        const bool is_named = std::find(modules.begin(), modules.end(), ident) != modules.end();
        if (ident == 0 || modules.empty() || is_named) return;
        std::vector<std::string> names;
        for (const esi::Module& m : file_->modules) {
            if (std::find(modules.begin(), modules.end(), m.ident) != modules.end()) {
                names.push_back(m.type);
            }
        }
        report_.warning(Topic::slave, word.at,
                        "slot " + std::to_string(number + 1) + " of '" + device_->order +
                            "' does not name module '" + word.text + "'",
                        "the modules of the slot are: " + listed(names));
    }

    /// Returns the number of a module, 0 for an empty slot; nothing after reporting an unknown one.
    std::optional<std::uint32_t> module_ident(const Word& word) {
        if (const auto ident = esi::find_module(*file_, word.text)) return ident;
        std::vector<std::string> names;
        for (const esi::Module& m : file_->modules) {
            names.push_back(m.type);
        }
        report_.error(Topic::slave, word.at, "unknown module '" + word.text + "'",
                      suggestion(word.text, names, "the modules are"));
        return std::nullopt;
    }

    /// Sets the identity and the settings of the description, which keys override.
    void identity() {
        master::Identity& id = slave_.identity;
        if (device_ == nullptr) return;
        id.vendor = device_->vendor;
        id.product = device_->product;
        const Line* revision = keys_.find("revision");
        if (revision != nullptr && same_word(revision->value.text, "esi")) {
            id.revision = device_->revision;
            id.revision_rule = device_->check_revision.value_or(RevisionRule::equal_or_higher);
        }
        const esi::Timeouts& t = device_->timeouts;
        slave_.timeouts = {t.preop,          t.safeop_op, t.back_to_init,
                           t.back_to_safeop, t.request,   t.response};
        slave_.complete_access = device_->mailbox && device_->mailbox->complete_access;
    }

    void settings() {
        slave_keys().apply(keys_, in_, key_report_);
        const master::Identity& id = slave_.identity;
        if (in_.info.type.empty() && id.product != 0) {
            in_.info.type = bus::hex_text(id.vendor, 8) + ":" + bus::hex_text(id.product, 8);
        }
    }

    /// `sync0`, `sync0 250us`, `sync0+sync1`, the name of an operation mode, `clock`, `none`.
    void clocks() {
        const Line* line = keys_.find("dc");
        if (line == nullptr && keys_.find("oversampling") != nullptr) return oversampled_clocks();
        if (line == nullptr || same_word(line->value.text, "none")) {
            reject_clock_keys();
            return reject_oversampling(line);
        }
        const auto words = words_of(line->value);
        auto dc = clock_mode(*line, words[0].text);
        if (!dc || !read_shift(*line, words, *dc)) return;
        clock_keys().apply(keys_, *dc, key_report_);
        slave_.dc = dc;
    }

    /// Sets the clocks of the first operation mode with the samples of `oversampling`.
    void oversampled_clocks() {
        mode_ = SlaveOversampling(in_, device()).read(nullptr);
        if (mode_ == nullptr) return;
        slave_.dc = clocks_of_mode();
        clock_keys().apply(keys_, *slave_.dc, key_report_);
    }

    /// Reports `oversampling` beside a `dc` without an operation mode of the description.
    void reject_oversampling(const Line* dc) {
        const Line* const line = keys_.find("oversampling");
        if (line == nullptr || dc == nullptr) return;
        if (device_ == nullptr || device_->op_modes.empty()) {
            SlaveOversampling(in_, device()).read(nullptr);
            return;
        }
        report_.error(Topic::value, line->key.at,
                      "'oversampling' needs SYNC0, but dc is '" + dc->value.text + "'",
                      "delete the line dc, or name an operation mode: " + mode_names());
    }

    std::string mode_names() const {
        std::vector<std::string> names;
        for (const esi::OpMode& mode : device_->op_modes) {
            names.push_back(mode.name);
        }
        return listed(names);
    }

    /// Returns the clocks of the operation mode, with the samples of the slave.
    master::Dc clocks_of_mode() const {
        return SlaveOversampling::clocks_of(*mode_, in_.bus.setup.cycle_ns, slave_.oversampling);
    }

    void reject_clock_keys() {
        for (const char* key : {"sync0-cycle", "sync1-cycle", "sync1-shift", "assign-activate"}) {
            if (const Line* other = keys_.find(key)) {
                report_.error(Topic::value, other->key.at,
                              std::string("'") + key + "' applies only with distributed clocks",
                              "write dc = sync0");
            }
        }
    }

    std::optional<master::Dc> clock_mode(const Line& line, const std::string& mode) {
        std::vector<std::string> names{"sync0", "sync0+sync1", "clock", "none"};
        if (device_ != nullptr) {
            if (!device_->has_dc) {
                report_.error(Topic::value, line.value.at,
                              "'" + in_.info.type + "' has no distributed clocks",
                              "delete the line");
            }
            if (const esi::OpMode* found = find_mode(*device_, mode)) {
                mode_ = SlaveOversampling(in_, device()).read(found);
                return clocks_of_mode();
            }
            for (const esi::OpMode& m : device_->op_modes) {
                names.push_back(m.name);
            }
        }
        master::Dc dc;
        if (same_word(mode, "clock")) {
            reject_oversampling(&line);
            return dc;
        }
        if (same_word(mode, "sync0") || same_word(mode, "sync0+sync1")) {
            reject_oversampling(&line);
            dc.assign_activate = same_word(mode, "sync0") ? 0x300 : 0x700;
            return dc;
        }
        keys_.reject(line, listed(names) + "; a shift may follow, as in sync0 250us");
        return std::nullopt;
    }

    bool read_shift(const Line& line, const std::vector<Word>& words, master::Dc& dc) {
        if (words.size() == 1) return true;
        const auto shift = bus::parse_time(words[1].text);
        if (!shift || words.size() > 2) {
            keys_.reject(line, "a mode and a shift, as in sync0 250us");
            return false;
        }
        const std::int64_t cycle = in_.bus.setup.cycle_ns;
        if (*shift >= cycle || *shift <= -cycle) {
            keys_.reject(line, "a shift that is shorter than the cycle");
            return false;
        }
        dc.sync0_shift_ns = *shift;
        return true;
    }

    /// Returns the state before which a command at a transition is written; none: it is left out.
    /// An object needs the mailbox, which works from PRE-OP on.
    static State state_of(const std::string& transition) {
        if (transition == "IP" || transition == "PS") return State::safeop;
        return transition == "SO" ? State::op : State::none;
    }

    void description_writes() {
        if (device() == nullptr) return;
        for (const esi::InitCmd& c : device()->init_commands) {
            for (const std::string& t : c.transitions) {
                const State before = state_of(t);
                if (before == State::none) continue;
                StartupWrite w = startup_write(c.index, c.sub, c.data, before);
                w.protocol = c.protocol == esi::InitCmd::Protocol::soe
                                 ? StartupWrite::Protocol::soe
                                 : StartupWrite::Protocol::coe;
                w.complete = c.complete;
                slave_.startup.push_back(std::move(w));
            }
        }
    }

    SlaveInput in_;
    Keys& keys_;
    Report& report_;
    bus::TopicReport<Topic> key_report_;
    master::Slave& slave_;
    unsigned axes_ = 1;
    const esi::File* file_ = nullptr;
    const esi::Device* device_ = nullptr;
    std::optional<esi::Device> modular_;
    const esi::OpMode* mode_ = nullptr;  ///< of the description, with distributed clocks
};

}  // namespace

std::string slave_reference() { return slave_keys().reference(); }
std::string clock_reference() { return clock_keys().reference(); }

void read_slave(SlaveInput in) { SlaveReader(in).read(); }

}  // namespace hal::ethercat::config
