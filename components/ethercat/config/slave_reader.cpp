// SPDX-License-Identifier: MIT
// A slave of a `.ethercat` file: identity, settings, clocks, writes.
#include <algorithm>

#include "ethercat/config/slave_pdos.hpp"

namespace hal::ethercat::config {

namespace {

using master::StartupWrite;

constexpr std::int64_t ms = 1'000'000;
constexpr std::int64_t second = 1000 * ms;

class SlaveReader {
public:
    explicit SlaveReader(SlaveInput in)
        : in_(in), keys_(in.keys), report_(in.keys.report()), slave_(in.slave) {}

    void read() {
        keys_.find("type");
        const bool described = describe();
        identity();
        settings();
        read_eoe(in_);
        clocks();
        description_writes();
        if (!described) {  // unknown objects follow from it and are not reported
            for (Line* line : keys_.all()) {
                line->used = true;
            }
            return;
        }
        SlavePdos pdos(in_, device(), slave_.entries_per_pdo);
        writes(pdos);
        pdos.read();
        leftover();
    }

private:
    const esi::Device* device() const { return modular_ ? &*modular_ : device_; }

    bool describe() {
        const Line* const esi = keys_.find("esi");
        const Line* const name = keys_.find("device");
        std::uint64_t axes = 1;
        const bool axes_given = keys_.take_number("axes", axes, 1, 8);
        if (esi == nullptr) {
            if (name == nullptr) return true;
            if (!same_word(name->value.text, "cia402")) {
                report_.error(
                    Topic::slave, name->value.at, "unknown device '" + name->value.text + "'",
                    "write device = cia402, or esi = FILE for a device with a description");
                return false;
            }
            in_.info.type = "cia402";
            in_.info.cia402_axes = static_cast<unsigned>(axes);
            return true;
        }
        file_ = in_.descriptions.get(esi->value, report_);
        if (file_ == nullptr) return false;
        in_.info.description = esi->value.text;
        if (name != nullptr && !same_word(name->value.text, "cia402")) {
            device_ = file_->find(name->value.text);
        } else if (Line* product = keys_.find("product")) {
            const auto code = parse_natural(product->value.text);
            if (code) {
                device_ = file_->find(static_cast<std::uint32_t>(*code), revision());
            }
        } else {
            bool one = true;
            for (const esi::Device& d : file_->devices) {
                one = one && d.product == file_->devices[0].product;
            }
            if (one) {
                device_ = file_->find(file_->devices[0].product, revision());
            }
        }
        if (device_ == nullptr) {
            std::vector<std::string> names;
            for (const esi::Device& d : file_->devices) {
                if (std::find(names.begin(), names.end(), d.order) == names.end()) {
                    names.push_back(d.order);
                }
            }
            if (name != nullptr) {
                report_.error(Topic::slave, name->value.at,
                              "'" + esi->value.text + "' does not describe a device '" +
                                  name->value.text + "'",
                              suggestion(name->value.text, names, "the devices are"));
            } else if (const Line* product = keys_.find("product")) {
                report_.error(
                    Topic::slave, product->value.at,
                    "'" + esi->value.text + "' does not describe a product " + product->value.text,
                    "the devices are: " + listed(names));
            } else {
                report_.error(Topic::slave, esi->value.at,
                              "'" + esi->value.text + "' describes several devices",
                              "write device = NAME; the devices are: " + listed(names));
            }
            return false;
        }
        in_.info.type = device_->order;
        if (device_->profile == 402 || axes_given ||
            (name != nullptr && same_word(name->value.text, "cia402"))) {
            in_.info.cia402_axes = static_cast<unsigned>(axes);
        }
        modules();
        return true;
    }

    std::optional<std::uint32_t> revision() {
        const Line* line = keys_.find("revision");
        if (line == nullptr) {
            return {};
        }
        const std::string& text = line->value.text;
        const auto value =
            parse_natural(text.ends_with('+') ? std::string_view(text).substr(0, text.size() - 1)
                                              : std::string_view(text));
        return value ? std::optional(static_cast<std::uint32_t>(*value)) : std::nullopt;
    }

    void modules() {
        const Line* line = keys_.find("modules");
        std::vector<std::uint32_t> idents;
        if (line == nullptr) {
            for (const esi::Slot& s : device_->slots) {
                idents.push_back(s.default_module);
            }
            if (std::all_of(idents.begin(), idents.end(), [](std::uint32_t i) { return i == 0; })) {
                return;
            }
        } else {
            for (const Word& word : list_of(line->value)) {
                const auto found = std::find_if(file_->modules.begin(), file_->modules.end(),
                                                [&](const esi::Module& m) {
                    return same_word(m.type, word.text) || same_word(m.name, word.text) ||
                           parse_natural(word.text) == std::optional<std::uint64_t>(m.ident);
                });
                std::vector<std::string> names;
                for (const esi::Module& m : file_->modules) {
                    names.push_back(m.type);
                }
                if (word.text == "-") {
                    idents.push_back(0);
                } else if (found != file_->modules.end()) {
                    idents.push_back(found->ident);
                } else {
                    report_.error(Topic::slave, word.at, "unknown module '" + word.text + "'",
                                  suggestion(word.text, names, "the modules are"));
                }
            }
        }
        modular_ = esi::with_modules(*file_, *device_, idents);
        for (std::size_t i = 0; i < idents.size(); ++i) {  // the configured module list, ETG.5001
            slave_.startup.push_back(write(0xf030, static_cast<std::uint8_t>(i + 1),
                                           bytes(idents[i], 4), State::safeop));
        }
        if (!idents.empty()) {
            slave_.startup.push_back(write(0xf030, 0, bytes(idents.size(), 1), State::safeop));
        }
    }

    static std::vector<std::uint8_t> bytes(std::uint64_t value, unsigned count) {
        std::vector<std::uint8_t> out;
        for (unsigned i = 0; i < count; ++i) {
            out.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
        }
        return out;
    }
    static StartupWrite write(std::uint16_t index, std::uint8_t sub, std::vector<std::uint8_t> data,
                              State before) {
        StartupWrite w;
        w.index = index;
        w.sub = sub;
        w.data = std::move(data);
        w.before = before;
        return w;
    }

    void identity() {
        master::Identity& id = slave_.identity;
        if (device_ != nullptr) {
            id.vendor = file_->vendor;
            id.product = device_->product;
        }
        std::uint64_t n = 0;
        if (keys_.take_number("vendor", n, 1, 0xffffffff)) {
            id.vendor = static_cast<std::uint32_t>(n);
        }
        if (keys_.take_number("product", n, 1, 0xffffffff)) {
            id.product = static_cast<std::uint32_t>(n);
        }
        if (Line* line = keys_.find("revision");
            line != nullptr && !same_word(line->value.text, "any")) {
            if (const auto value = revision()) {
                id.revision = *value;
                id.revision_or_higher = line->value.text.ends_with('+');
            } else {
                keys_.reject(*line,
                             "any, a number, or one with + for this revision or a higher one, as "
                             "in 0x10001+");
            }
        }
        if (Line* line = keys_.find("serial");
            line != nullptr && !same_word(line->value.text, "any")) {
            if (keys_.take_number("serial", n, 0, 0xffffffff)) {
                id.serial = static_cast<std::uint32_t>(n);
            }
        }
        if (in_.info.type.empty() && id.product != 0) {
            char text[40];
            std::snprintf(text, sizeof text, "0x%08X:0x%08X", id.vendor, id.product);
            in_.info.type = text;
        }
    }

    void settings() {
        if (device_ != nullptr) {
            const esi::Timeouts& t = device_->timeouts;
            slave_.timeouts = {t.preop,          t.safeop_op, t.back_to_init,
                               t.back_to_safeop, t.request,   t.response};
            slave_.complete_access = device_->mailbox && device_->mailbox->complete_access;
        }
        keys_.take_flag("optional", slave_.optional);
        keys_.take_flag("lrw", slave_.use_lrw);
        keys_.take_flag("complete-access", slave_.complete_access);
        std::uint64_t entries = 0;
        if (keys_.take_number("entries-per-pdo", entries, 1, 255)) {
            slave_.entries_per_pdo = static_cast<unsigned>(entries);
        }
        const std::pair<const char*, std::uint32_t*> times[] = {
            {"preop-timeout", &slave_.timeouts.to_preop},
            {"op-timeout", &slave_.timeouts.to_safeop_op},
            {"mailbox-timeout", &slave_.timeouts.mailbox_response}};
        for (const auto& [key, to] : times) {
            if (std::int64_t time = 0; keys_.take_time(key, time, ms, 600 * second)) {
                *to = static_cast<std::uint32_t>(time / ms);
            }
        }
        if (Line* line = keys_.find("watchdog")) {
            const auto time = parse_duration_ns(line->value.text, 0.0);
            if (same_word(line->value.text, "none")) {
                slave_.watchdog.intervals = std::uint16_t{0};
            } else if (time && *time >= 100'000 && *time <= 65535 * 100'000LL) {  // 2498: 100 us
                slave_.watchdog.divider = std::uint16_t{2498};
                slave_.watchdog.intervals = static_cast<std::uint16_t>((*time + 99'999) / 100'000);
            } else {
                keys_.reject(*line, "none, or a time of 100us..6553ms");
            }
        }
        if (Line* line = keys_.find("state")) {
            constexpr std::pair<const char*, State> states[] = {{"op", State::op},
                                                                {"safeop", State::safeop},
                                                                {"preop", State::preop},
                                                                {"init", State::init}};
            const auto at = std::find_if(std::begin(states), std::end(states), [&](const auto& s) {
                return same_word(line->value.text, s.first);
            });
            if (at != std::end(states)) {
                slave_.target = at->second;
            } else {
                keys_.reject(*line, "op, safeop, preop or init");
            }
        }
        if (Line* line = keys_.find("domain")) {
            const auto& domains = in_.bus.setup.domains;
            const auto at =
                std::find_if(domains.begin(), domains.end(),
                             [&](const master::Domain& d) { return d.name == line->value.text; });
            std::vector<std::string> names;
            for (const auto& d : domains) {
                names.push_back(d.name);
            }
            if (at != domains.end()) {
                slave_.domain = static_cast<std::uint16_t>(at - domains.begin());
            } else {
                report_.error(Topic::slave, line->value.at,
                              "unknown domain '" + line->value.text + "'",
                              "write [domain " + line->value.text +
                                  "] and below it every = 4; the domains are: " + listed(names));
            }
        }
    }

    /// `sync0`, `sync0 250us`, `sync0+sync1`, the name of an operation mode, `clock`, `none`.
    void clocks() {
        Line* line = keys_.find("dc");
        master::Dc dc;
        if (line == nullptr || same_word(line->value.text, "none")) {
            for (const char* key :
                 {"sync0-cycle", "sync1-cycle", "sync1-shift", "assign-activate"}) {
                if (const Line* other = keys_.find(key)) {
                    report_.error(Topic::value, other->key.at,
                                  std::string("'") + key + "' applies only with distributed clocks",
                                  "write dc = sync0");
                }
            }
            return;
        }
        const auto words = words_of(line->value);
        const std::string& mode = words[0].text;
        const bool both = same_word(mode, "sync0+sync1");
        const esi::OpMode* chosen = nullptr;
        std::vector<std::string> names{"sync0", "sync0+sync1", "clock", "none"};
        if (device_ != nullptr) {
            for (const esi::OpMode& m : device_->op_modes) {
                names.push_back(m.name);
                const bool fits = same_word(mode, "sync0")
                                      ? (m.assign_activate & 0x700) == 0x300
                                      : both && (m.assign_activate & 0x700) == 0x700;
                if (chosen == nullptr && (fits || same_word(m.name, mode))) {
                    chosen = &m;
                }
            }
            if (!device_->has_dc) {
                report_.error(Topic::value, line->value.at,
                              "'" + in_.info.type + "' has no distributed clocks",
                              "delete the line");
            }
        }
        if (chosen != nullptr) {
            const std::int64_t cycle = in_.bus.setup.cycle_ns;
            dc.assign_activate = chosen->assign_activate;
            if (chosen->sync0_cycle_ns != 0) {
                dc.sync0_cycle_ns = chosen->sync0_cycle_ns;
            } else if (chosen->sync0_factor > 1) {
                dc.sync0_cycle_ns = cycle * chosen->sync0_factor;
            } else if (chosen->sync0_factor < -1) {
                dc.sync0_cycle_ns = cycle / -std::int64_t{chosen->sync0_factor};
            } else {
                dc.sync0_cycle_ns = 0;
            }
            const std::int64_t base = dc.sync0_cycle_ns != 0 ? dc.sync0_cycle_ns : cycle;
            dc.sync1_cycle_ns =
                chosen->sync1_cycle_ns != 0 ? chosen->sync1_cycle_ns : base * chosen->sync1_factor;
            dc.sync0_shift_ns = chosen->sync0_shift_ns;
            dc.sync1_shift_ns = chosen->sync1_shift_ns;
        } else if (same_word(mode, "sync0") || both) {
            dc.assign_activate = both ? 0x700 : 0x300;
        } else if (!same_word(mode, "clock")) {
            return keys_.reject(*line, listed(names) + "; a shift may follow, as in sync0 250us");
        }
        if (words.size() > 1) {
            const auto shift = signed_duration(words[1].text);
            if (!shift || words.size() > 2) {
                return keys_.reject(*line, "a mode and a shift, as in sync0 250us");
            }
            const std::int64_t cycle = in_.bus.setup.cycle_ns;
            if (*shift >= cycle || *shift <= -cycle) {
                return keys_.reject(*line, "a shift that is shorter than the cycle");
            }
            dc.sync0_shift_ns = *shift;
        }
        std::uint64_t activate = 0;
        if (keys_.take_number("assign-activate", activate, 0, 0xffff)) {
            dc.assign_activate = static_cast<std::uint16_t>(activate);
        }
        keys_.take_time("sync0-cycle", dc.sync0_cycle_ns, 10'000, second);
        keys_.take_time("sync1-cycle", dc.sync1_cycle_ns, 0, second);
        keys_.take_time("sync1-shift", dc.sync1_shift_ns, -second, second);
        slave_.dc = dc;
    }

    void description_writes() {
        if (device() == nullptr) return;
        for (const esi::InitCmd& c : device()->init_commands) {
            for (const std::string& t : c.transitions) {
                const State before = t == "IP"   ? State::preop
                                     : t == "PS" ? State::safeop
                                     : t == "SO" ? State::op
                                                 : State::none;
                if (before == State::none) continue;
                // An object needs the mailbox, which works from PRE-OP on.
                StartupWrite w =
                    write(c.index, c.sub, c.data, before == State::preop ? State::safeop : before);
                w.protocol = c.protocol == esi::InitCmd::Protocol::soe
                                 ? StartupWrite::Protocol::soe
                                 : StartupWrite::Protocol::coe;
                w.complete = c.complete;
                slave_.startup.push_back(std::move(w));
            }
        }
    }

    void writes(const SlavePdos& pdos) {
        for (Line* line : keys_.all()) {
            const auto words = words_of({line->key.text, line->key.at});
            const std::string what = line->used || words.size() < 2 ? "" : words[0].text;
            if (what == "idn") {
                line->used = true;
                idn(*line, words);
            } else if (what == "aoe") {
                line->used = true;
                aoe(*line, words);
            } else if (what == "sdo" || what == "register") {
                line->used = true;
                sdo(*line, words, pdos);
            }
        }
    }

    /// `sdo 6060 = 8`, `sdo 2000:1 u16 = 5`, `sdo 8000 complete = 01 00 02`, `register 0420 u16 = 1000`.
    void sdo(const Line& line, const std::vector<Word>& words, const SlavePdos& pdos) {
        const bool is_register = words[0].text == "register";
        const auto at = address(words[1].text);
        if (!at || words.size() > 3) {
            return report_.error(Topic::value, line.key.at,
                                 "invalid " + words[0].text + " '" +
                                     line.key.text.substr(words[0].text.size() + 1) + "'",
                                 is_register
                                     ? "write register 0420 u16 = 1000"
                                     : "write sdo 6060 = 8, or with a type: sdo 2000:1 u16 = 5");
        }
        StartupWrite w = write(at->index, at->sub, {}, State::safeop);
        w.line = line.key.at.line;
        if (is_register) {
            w.protocol = StartupWrite::Protocol::reg;
        }
        const std::string how = words.size() == 3 ? words[2].text : "";
        if (how == "complete" || how == "raw") {
            const auto data = esi::hex_bytes(line.value.text);
            if (!data || data->empty()) {
                return keys_.reject(
                    line, "hexadecimal bytes in the order of the wire, as in 01 00 E8 03");
            }
            w.complete = how == "complete";
            w.data = *data;
            slave_.startup.push_back(std::move(w));
            return;
        }
        Known known = is_register ? Known{} : pdos.known(at->index, at->sub);
        const TypeWord* type = how.empty() ? nullptr : type_named(how);
        if (!how.empty() && type == nullptr) {
            return report_.error(Topic::value, words[2].at, "unknown type '" + how + "'",
                                 "the types are " + std::string(type_words) + ", complete and raw");
        }
        const std::string label = is_register ? "register " + words[1].text
                                              : "object " + address_text(at->index, at->sub);
        if (type == nullptr && known.bits == 0) {
            return report_.error(
                Topic::object, line.key.at,
                device() != nullptr && !is_register
                    ? label + " is not in the description of '" + in_.info.type + "'"
                    : label + " has no known type",
                "write its type, as in " + words[0].text + " " + words[1].text +
                    " u16 = " + line.value.text);
        }
        TypeWord own{"", "", known.type, static_cast<std::uint8_t>(std::min(known.bits, 64U))};
        std::string problem;
        const auto data = value_bytes(line.value.text, type != nullptr ? *type : own, problem);
        if (!data) {
            return report_.error(Topic::value, line.value.at,
                                 "invalid value '" + line.value.text + "' of " + label,
                                 "write " + problem);
        }
        w.data = *data;
        slave_.startup.push_back(std::move(w));
    }

    /// Adds a write of hexadecimal bytes.
    void bytes_write(const Line& line, StartupWrite::Protocol protocol, unsigned index,
                     unsigned sub, std::uint16_t port = 0) {
        const auto data = esi::hex_bytes(line.value.text);
        if (!data || data->empty()) {
            return keys_.reject(line, "hexadecimal bytes in the order of the wire, as in 07 00");
        }
        StartupWrite w = write(static_cast<std::uint16_t>(index), static_cast<std::uint8_t>(sub),
                               *data, State::safeop);
        w.protocol = protocol;
        w.port = port;
        w.line = line.key.at.line;
        slave_.startup.push_back(std::move(w));
    }

    /// `idn S-0-15 = 07 00`, `idn P-0-150 1 = 01 00`: the number after it is the drive's.
    void idn(const Line& line, const std::vector<Word>& words) {
        const std::string& text = words[1].text;  // lower case
        const auto parts = list_of({text, line.key.at}, '-');
        const auto set = parts.size() == 3 ? parse_natural(parts[1].text) : std::nullopt;

        const auto number = parts.size() == 3 ? parse_natural(parts[2].text) : std::nullopt;
        const auto drive =
            words.size() == 3 ? parse_natural(words[2].text) : std::optional<std::uint64_t>(0);
        if (!set || *set > 7 || !number || *number > 4095 ||
            (parts[0].text != "s" && parts[0].text != "p") || !drive || *drive > 7 ||
            words.size() > 3) {
            return report_.error(Topic::value, line.key.at, "invalid IDN '" + text + "'",
                                 "write idn S-0-15 = 07 00, or idn P-0-150 1 = 07 00 for drive 1");
        }
        const unsigned product = parts[0].text == "p" ? 0x8000U : 0U;
        bytes_write(line, StartupWrite::Protocol::soe,
                    product | static_cast<unsigned>(*set << 12 | *number),
                    static_cast<unsigned>(*drive));
    }

    /// `aoe 2001 = 05 00`, `aoe 8000:1 1001 = 01 00`: the number after the object is the port.
    void aoe(const Line& line, const std::vector<Word>& words) {
        const auto at = address(words[1].text);
        const auto port =
            words.size() == 3 ? parse_natural(words[2].text) : std::optional<std::uint64_t>(0);
        if (!at || !port || *port > 0xffff || words.size() > 3) {
            return report_.error(Topic::value, line.key.at,
                                 "invalid aoe '" + line.key.text.substr(4) + "'",
                                 "write aoe 8000:1 1001 = 01 00");
        }
        bytes_write(line, StartupWrite::Protocol::aoe, at->index, at->sub,
                    static_cast<std::uint16_t>(*port));
    }

    void leftover() {
        constexpr const char* keys =
            "type esi device axes modules vendor product revision serial optional lrw "
            "complete-access entries-per-pdo preop-timeout "
            "op-timeout "
            "mailbox-timeout watchdog state domain eoe dc sync0-cycle sync1-cycle sync1-shift "
            "assign-activate outputs inputs pdo-order sdo "
            "idn "
            "aoe register";
        std::vector<std::string> all;
        for (const Word& word : words_of({keys, {}})) {
            all.push_back(word.text);
        }
        for (const Line* line : keys_.all()) {
            if (!line->used) {
                report_.error(Topic::line, line->key.at,
                              "unknown key '" + line->key.text + "' of a slave",
                              suggestion(line->key.text, all, "the keys are"));
            }
        }
    }

    SlaveInput in_;
    Keys& keys_;
    Report& report_;
    master::Slave& slave_;
    const esi::File* file_ = nullptr;
    const esi::Device* device_ = nullptr;
    std::optional<esi::Device> modular_;
};

}  // namespace

void read_slave(SlaveInput in) { SlaveReader(in).read(); }

}  // namespace hal::ethercat::config
