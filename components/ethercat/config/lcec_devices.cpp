// SPDX-License-Identifier: MIT
#include "ethercat/config/lcec_devices.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "ethercat/config/lcec_cia402.hpp"
#include "ethercat/config/lcec_table.hpp"

namespace hal::ethercat::config {

namespace {

using master::Type;
using Words = TableWords;

const LcecTable& table() {
    static const LcecTable read(lcec_device_table);
    return read;
}

/// Reads the lines of a shape for one slave.
class ShapeReader {
public:
    ShapeReader(const LcecDevice& device, const std::map<std::string, std::string>& parameters,
                std::int64_t cycle_ns, master::Slave& slave, SlaveInfo& info,
                std::vector<std::string>& problems)
        : device_(device),
          parameters_(parameters),
          cycle_ns_(cycle_ns),
          slave_(slave),
          info_(info),
          problems_(problems) {}

    void read() {
        for (const TableLine& line : table().lines_of(device_)) {
            if (!applies(line)) continue;
            step_ = line.step;
            read(line.words);
        }
        std::erase_if(slave_.sync_managers,
                      [](const master::SyncManager& sm) { return sm.pdos.empty(); });
    }

private:
    bool applies(const TableLine& line) const {
        return std::all_of(line.conditions.begin(), line.conditions.end(),
                           [&](const std::string& condition) {
            const std::size_t equals = condition.find('=');
            const std::string value = option(condition.substr(0, equals));
            const Words accepted = split(condition.substr(equals + 1), ',');
            return std::any_of(accepted.begin(), accepted.end(),
                               [&](const std::string& word) { return same_word(word, value); });
        });
    }

    void read(const Words& words) {
        const std::string& keyword = words[0];
        if (keyword == "option") {
            read_option(words);
        } else if (keyword == "sm") {
            sync_manager(words);
        } else if (keyword == "pdo") {
            pdo(words);
        } else if (keyword == "entries") {
            add_entries(words, 1, slave_.sync_managers.back().pdos.back());
        } else if (keyword == "sdo") {
            write(words[1], fixed_value(words[2]));
        } else if (keyword == "param") {
            parameter(words);
        } else if (keyword == "dc") {
            clocks(words);
        } else if (keyword == "cia402") {
            drive(words);
        } else if (keyword == "fsoe") {
            safety_frame(words);
        } else if (keyword == "set") {
            apply_effects(words[1] == "-" ? "" : with_step(words[1]), words, 2);
        } else if (keyword == "follows") {
            return;  // count_as_neighbour() has read it
        } else if (keyword == "fsoe-logic") {
            info_.fsoe_logic = true;
        } else {
            channel(words);
        }
    }

    /// `fsoe SLAVE-BYTES MASTER-BYTES CHANNELS [SLAVE-OBJECT MASTER-OBJECT]`
    void safety_frame(const Words& words) {
        info_.fsoe = {count_of(device_, words[1]), count_of(device_, words[2]),
                      count_of(device_, words[3])};
        if (words.size() > 5) {
            info_.fsoe.slave_object = static_cast<std::uint16_t>(hexadecimal(words[4]));
            info_.fsoe.master_object = static_cast<std::uint16_t>(hexadecimal(words[5]));
        }
    }

    /// `option NAME DEFAULT OTHER...`: a modParam that selects lines.
    void read_option(const Words& words) {
        const std::string name = with_step(words[1]);
        std::string value = words[2];
        for (const auto& [of_device, of_value] : device_.options) {
            if (of_device == name) {
                value = of_value;
            }
        }
        if (const auto given = parameters_.find(name); given != parameters_.end()) {
            value = given->second;
            const bool on = same_word(value, "true");
            if (on || same_word(value, "false")) {
                value = on ? "1" : "0";
            }
        }
        const bool known = std::any_of(words.begin() + 2, words.end(),
                                       [&](const std::string& w) { return same_word(w, value); });
        if (!known) {
            problems_.push_back("invalid value '" + value + "' of modParam '" + name +
                                "': expected " +
                                bus::choice_form(Words(words.begin() + 2, words.end())).expected);
            value = words[2];
        }
        options_[name] = value;
    }
    /// Returns the value of an option, or of N.
    std::string option(const std::string& name) const {
        if (name == "N") return std::to_string(device_.count);
        const auto at = options_.find(name);
        return at == options_.end() ? std::string() : at->second;
    }

    /// `sm NUMBER in|out [write|assign|unwatched]...`: with `write` the assignment and the mapping
    /// are written, with `assign` the assignment only; `unwatched` outputs have no watchdog.
    void sync_manager(const Words& words) {
        master::SyncManager sm;
        sm.number = static_cast<std::uint8_t>(std::atoi(words[1].c_str()));
        sm.output = words[2] == "out";
        const auto has = [&](const char* word) {
            return std::find(words.begin() + 3, words.end(), word) != words.end();
        };
        writes_ = has("write");
        sm.write_assignment = writes_ || has("assign");
        sm.watchdog = !has("unwatched");
        slave_.sync_managers.push_back(std::move(sm));
    }

    /// `pdo INDEX ENTRY...`
    void pdo(const Words& words) {
        master::Pdo p;
        p.index = static_cast<std::uint16_t>(stepped(words[1], step_));
        p.write_mapping = writes_;
        add_entries(words, 2, p);
        slave_.sync_managers.back().pdos.push_back(std::move(p));
    }
    void add_entries(const Words& words, std::size_t first, master::Pdo& p) {
        for (std::size_t i = first; i < words.size(); ++i) {
            const std::size_t star = words[i].find('*');
            const unsigned repeated =
                star == std::string::npos ? 1 : count_of(device_, words[i].substr(0, star));
            const std::string entry_text =
                star == std::string::npos ? words[i] : words[i].substr(star + 1);
            for (unsigned n = 0; n < repeated; ++n) {
                entry(entry_text, star == std::string::npos ? step_ : n, p);
            }
        }
    }

    /// `INDEX:SUB/BITS`, then `s` if it is signed, then `=PIN` or `{PIN,PIN,...}` for its bits, where
    /// `-` is a bit without a pin. `/BITS` is a gap.
    void entry(const std::string& text, unsigned step, master::Pdo& to) {
        master::Entry e;
        const std::size_t slash = text.find('/');
        if (slash > 0) {
            const ChannelObject object = address(text.substr(0, slash), step);
            e.index = object.index;
            e.sub = object.sub;
        }
        const std::string rest = text.substr(slash + 1);
        e.bits = static_cast<std::uint16_t>(std::atoi(rest.c_str()));
        const std::size_t behind = rest.find_first_not_of("0123456789");
        e.is_signed = behind != std::string::npos && rest[behind] == 's';
        e.type = e.bits == 1 ? Type::bit : type_of(e.bits, e.is_signed);
        if (const std::size_t equals = rest.find('='); equals != std::string::npos) {
            e.name = config::with_step(rest.substr(equals + 1), step);
            add_pin(e);
        }
        if (const std::size_t brace = rest.find('{'); brace != std::string::npos) {
            return add_bits(e, split(rest.substr(brace + 1, rest.size() - brace - 2), ','), step,
                            to);
        }
        to.entries.push_back(std::move(e));
    }
    void add_bits(const master::Entry& e, const Words& names, unsigned step, master::Pdo& to) {
        for (std::size_t bit = 0; bit < names.size(); ++bit) {
            master::Entry part = e;
            part.bits = 1;
            part.type = Type::bit;
            part.part = bit != 0;
            if (names[bit] != "-") {
                part.name = config::with_step(names[bit], step);
                add_pin(part);
            }
            to.entries.push_back(std::move(part));
        }
        if (names.size() < e.bits) {
            master::Entry rest = e;
            rest.bits = static_cast<std::uint16_t>(e.bits - names.size());
            rest.part = true;
            to.entries.push_back(std::move(rest));
        }
    }
    void add_pin(const master::Entry& e) {
        info_.pins.push_back({e.name, {"", object_text(e.index, e.sub)}});
    }

    /// `KIND NAME ROLE=OBJECT SETTING=NUMBER ...`; the name `-` is empty.
    void channel(const Words& words) {
        Channel made;
        made.kind = words[0];
        made.name = words[1] == "-" ? "" : with_step(words[1]);
        for (std::size_t i = 2; i < words.size(); ++i) {
            const std::size_t equals = words[i].find('=');
            const std::string key = words[i].substr(0, equals);
            const std::string value = words[i].substr(equals + 1);
            if (value.find(':') != std::string::npos) {
                made.objects[key] = address(value, step_);
            } else {
                made.settings[key] =
                    value == "N" ? device_.count : std::strtod(with_step(value).c_str(), nullptr);
            }
        }
        for (const auto& [name, settings] : effects_) {
            if (name != made.name) continue;
            for (const auto& [key, value] : settings) {
                made.settings[key] = value;
            }
        }
        info_.channels.push_back(std::move(made));
    }

    /// `cia402 NAME=VALUE...`: the process data and the pins of basic_cia402 with these modParams,
    /// which those of the file replace.
    void drive(const Words& words) {
        std::map<std::string, std::string> all;
        for (std::size_t i = 1; i < words.size(); ++i) {
            const std::size_t equals = words[i].find('=');
            all[words[i].substr(0, equals)] = words[i].substr(equals + 1);
        }
        for (const auto& [name, value] : parameters_) {
            all[name] = value;
        }
        build_cia402(all, slave_, info_, problems_);
        writes_ = true;
    }

    void clocks(const Words& words) {
        if (slave_.dc) return;  // the file has its own
        master::Dc dc;
        dc.assign_activate = static_cast<std::uint16_t>(hexadecimal(words[1]));
        dc.sync0_cycle_ns = cycle_ns_;
        if (words.size() > 2) {
            dc.sync1_cycle_ns = cycle_ns_;
        }
        slave_.dc = dc;
    }

    /// A number, or a part of the cycle time as CiA 402 has it: mantissa * 10^exponent seconds.
    std::int64_t fixed_value(const std::string& text) const {
        if (!text.starts_with('@')) return std::strtoll(text.c_str(), nullptr, 0);
        std::int64_t mantissa = cycle_ns_;
        int exponent = -9;
        while (mantissa > 255 || (mantissa % 10 == 0 && mantissa > 0)) {
            mantissa /= 10;
            ++exponent;
        }
        return text == "@mantissa" ? mantissa : exponent;
    }

    /// A line `param NAME OBJECT/BITS [*FACTOR] [for=CHANNEL] [WORD=VALUE[;SETTING=NUMBER...]...]`.
    /// Without any WORD the modParam is a number; each SETTING changes CHANNEL.
    struct ParameterLine {
        struct Choice {
            std::string word;
            std::string value;
            Words settings;
        };
        std::string name;
        std::string object;
        double factor = 1;
        std::string channel;
        std::vector<Choice> choices;
    };
    ParameterLine parameter_line(const Words& words) const {
        ParameterLine line;
        line.name = with_step(words[1]);
        line.object = words[2];
        for (std::size_t i = 3; i < words.size(); ++i) {
            if (words[i].starts_with('*')) {
                line.factor = std::strtod(words[i].c_str() + 1, nullptr);
            } else if (words[i].starts_with("for=")) {
                line.channel = with_step(words[i].substr(4));
            } else {
                for (const std::string& text : split(words[i], ',')) {
                    line.choices.push_back(choice(text));
                }
            }
        }
        return line;
    }
    /// `WORD=VALUE[;SETTING=NUMBER...]`
    static ParameterLine::Choice choice(const std::string& text) {
        const std::size_t equals = text.find('=');
        Words parts = split(text.substr(equals + 1), ';');
        ParameterLine::Choice made;
        made.word = text.substr(0, equals);
        made.value = parts[0];
        made.settings.assign(parts.begin() + 1, parts.end());
        return made;
    }
    /// Writes the object of a `param` line if the user's file has the modParam.
    void parameter(const Words& words) {
        const ParameterLine line = parameter_line(words);
        const auto given = parameters_.find(line.name);
        if (given == parameters_.end()) return;
        const std::string& value = given->second;
        if (line.choices.empty()) {
            write_number(line.name, line.object, value, line.factor);
            return;
        }
        const auto chosen = std::ranges::find_if(
            line.choices, [&](const auto& choice) { return same_word(choice.word, value); });
        if (chosen == line.choices.end()) {
            report_unknown_choice(line, value);
            return;
        }
        apply_effects(line.channel, chosen->settings, 0);
        write(line.object, std::atoll(chosen->value.c_str()));
    }
    void report_unknown_choice(const ParameterLine& line, const std::string& value) {
        Words known;
        for (const ParameterLine::Choice& choice : line.choices) {
            known.push_back(choice.word);
        }
        problems_.push_back("invalid value '" + value + "' of modParam '" + line.name +
                            "': expected " + bus::choice_form(known).expected);
    }
    void write_number(const std::string& name, const std::string& object, const std::string& text,
                      double factor) {
        std::string number = text;
        if (same_word(text, "true")) {
            number = "1";
        }
        if (same_word(text, "false")) {
            number = "0";
        }
        const auto value = parse_real(number);
        if (!value) {
            problems_.push_back("invalid value '" + text + "' of modParam '" + name +
                                "': expected a number");
            return;
        }
        write(object, std::llround(*value * factor));
    }
    /// `scale=0.1` replaces a setting of a channel, `scale*=0.1` multiplies it.
    void apply_effects(const std::string& channel, const Words& parts, std::size_t first) {
        auto& settings = effects_[channel];
        for (std::size_t i = first; i < parts.size(); ++i) {
            const std::size_t equals = parts[i].find('=');
            const bool multiplies = parts[i][equals - 1] == '*';
            const std::string key = parts[i].substr(0, multiplies ? equals - 1 : equals);
            const double value = std::strtod(parts[i].c_str() + equals + 1, nullptr);
            if (multiplies) {
                settings.emplace(key, 0.1).first->second *= value;
            } else {
                settings[key] = value;
            }
        }
    }

    void write(const std::string& object, std::int64_t value) {
        const std::size_t slash = object.find('/');
        const ChannelObject to = address(object.substr(0, slash), step_);
        master::StartupWrite w;
        w.index = to.index;
        w.sub = to.sub;
        w.line = slave_.line;
        w.data = little_endian(static_cast<std::uint64_t>(value),
                               static_cast<unsigned>(std::atoi(object.c_str() + slash + 1)));
        slave_.startup.push_back(std::move(w));
    }

    /// `INDEX[+STEP]:SUB[+STEP]`, hexadecimal, and in channels `.BIT[/BITS]` behind it, decimal.
    static ChannelObject address(const std::string& text, unsigned step) {
        ChannelObject object;
        const std::size_t colon = text.find(':');
        object.index = static_cast<std::uint16_t>(stepped(text.substr(0, colon), step));
        std::string sub = text.substr(colon + 1);
        if (const std::size_t dot = sub.find('.'); dot != std::string::npos) {
            const std::string bits = sub.substr(dot + 1);
            const std::size_t slash = bits.find('/');
            object.first_bit = static_cast<unsigned>(std::atoi(bits.c_str()));
            object.bits = slash == std::string::npos
                              ? 1
                              : static_cast<unsigned>(std::atoi(bits.c_str() + slash + 1));
            sub.erase(dot);
        }
        object.sub = static_cast<std::uint8_t>(stepped(sub, step));
        return object;
    }
    static std::uint32_t stepped(const std::string& text, unsigned step) {
        const std::size_t plus = text.find('+');
        const std::uint32_t first = hexadecimal(text.substr(0, plus));
        return plus == std::string::npos ? first
                                         : first + step * hexadecimal(text.substr(plus + 1));
    }

    std::string with_step(const std::string& text) const { return config::with_step(text, step_); }

    const LcecDevice& device_;
    const std::map<std::string, std::string>& parameters_;
    const std::int64_t cycle_ns_;
    master::Slave& slave_;
    SlaveInfo& info_;
    std::vector<std::string>& problems_;
    std::map<std::string, std::string> options_;
    std::map<std::string, std::map<std::string, double>> effects_;  // settings by channel
    unsigned step_ = 0;
    bool writes_ = false;
};

}  // namespace

std::optional<LcecDevice> find_lcec_device(std::string_view name) {
    for (const LcecDevice& device : table().devices()) {
        if (device.name == name) return device;
    }
    return std::nullopt;
}

bool count_as_neighbour(LcecDevice& device, const LcecDevice* before) {
    for (const TableLine& line : table().lines_of(device)) {
        if (line.words[0] != "follows") continue;
        const auto shapes = line.words.begin() + 1;
        const bool fits = before != nullptr &&
                          std::find(shapes, line.words.end(), before->shape) != line.words.end();
        if (!fits) return false;
        device.count = before->count;
        device.second_count = before->second_count;
    }
    return true;
}

std::vector<std::string> lcec_device_names() {
    std::vector<std::string> names;
    for (const LcecDevice& device : table().devices()) {
        names.push_back(device.name);
    }
    return names;
}

std::vector<std::string> unsupported_lcec_devices() { return table().unsupported(); }

std::vector<std::string> lcec_parameters(const LcecDevice& device) {
    std::vector<std::string> names;
    const auto add = [&](const std::string& name) {
        if (std::find(names.begin(), names.end(), name) == names.end()) {
            names.push_back(name);
        }
    };
    for (const auto& [conditions, words, step] : table().lines_of(device)) {
        if (words[0] == "fsoe-logic") {
            names.insert(names.end(), {"fsoeSlaveIdx", "stdInName", "stdOutName"});
        } else if (words[0] == "cia402") {
            const auto of_drive = cia402_parameters();
            names.insert(names.end(), of_drive.begin(), of_drive.end());
        } else if (words[0] == "param" || words[0] == "option") {
            add(with_step(words[1], step));
        }
    }
    return names;
}

void build_lcec_device(const LcecDevice& device,
                       const std::map<std::string, std::string>& parameters, std::int64_t cycle_ns,
                       master::Slave& slave, SlaveInfo& info, std::vector<std::string>& problems) {
    ShapeReader(device, parameters, cycle_ns, slave, info, problems).read();
}

}  // namespace hal::ethercat::config
