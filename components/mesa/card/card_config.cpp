// SPDX-License-Identifier: MIT
// Reads a configuration: [card], [motor NAME], [switch NAME], [spindle NAME], [input NAME], [output
// NAME].
#include "card_config.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include "bus/config/key_table.hpp"
#include "bus/config/section_file.hpp"
#include "text/characters.hpp"
#include "text/numbers.hpp"
#include "text/quoting.hpp"
#include "text/suggest.hpp"

namespace hal::mesa {

namespace {

using bus::Entry;
using text::Span;
using text::Word;

constexpr std::int64_t ms = 1'000'000;

constexpr bus::SectionKind section_kinds[] = {{"card", "[card]", bus::SectionUse::once},
                                              {"motor", "[motor NAME]", bus::SectionUse::named},
                                              {"switch", "[switch NAME]", bus::SectionUse::named},
                                              {"spindle", "[spindle NAME]", bus::SectionUse::named},
                                              {"input", "[input NAME]", bus::SectionUse::named},
                                              {"output", "[output NAME]", bus::SectionUse::named}};

constexpr const char* terminal_form =
    "gpio 17, inm 3, inmux 3, ssr 0, outm 4, or remote CHANNEL NUMBER as in remote 0 5";

struct TerminalWord {
    const char* word;
    Terminal::Kind kind;
    unsigned max;
};
constexpr TerminalWord terminal_words[] = {
    {"gpio", Terminal::Kind::gpio, max_pins}, {"inm", Terminal::Kind::inm, 31},
    {"inmux", Terminal::Kind::inmux, 31},     {"ssr", Terminal::Kind::ssr, 30},
    {"outm", Terminal::Kind::outm, 31},       {"remote", Terminal::Kind::remote, 31}};

bool parse_terminal(Terminal& to, const Entry& entry) {
    const auto words = text::words_of(entry.value);
    if (words.empty()) return false;
    for (const TerminalWord& one : terminal_words) {
        if (!same_word(words[0].text, one.word)) continue;
        const bool has_channel = one.kind == Terminal::Kind::remote;
        if (words.size() != (has_channel ? 3U : 2U)) return false;
        const auto number = parse_natural(words.back().text);
        const auto channel = has_channel ? parse_natural(words[1].text) : std::uint64_t{0};
        if (!number || *number > one.max || !channel || *channel > 7) return false;
        to.kind = one.kind;
        to.channel = static_cast<std::uint8_t>(*channel);
        to.number = static_cast<std::uint8_t>(*number);
        return true;
    }
    return false;
}

/// A finite number.
template <class Get>
auto real(Get get, const char* example) {
    return bus::own(std::string("a number, as in ") + example, "number",
                    [get](auto& to, const Entry& entry) {
        const auto value = parse_real(entry.value.text);
        if (!value || !std::isfinite(*value)) return false;
        std::invoke(get, to) = *value;
        return true;
    });
}
/// A finite number that is not 0.
template <class Get>
auto nonzero(Get get, const char* example) {
    return bus::own(std::string("a number other than 0, as in ") + example, "number, not 0",
                    [get](auto& to, const Entry& entry) {
        const auto value = parse_real(entry.value.text);
        if (!value || !std::isfinite(*value) || *value == 0.0) return false;
        std::invoke(get, to) = *value;
        return true;
    });
}

bool parse_type(CardConfig& card, const Entry& entry) {
    card.model = find_card_model(lower(entry.value.text));
    return card.model != nullptr;
}
/// A version of the list, decimal or hexadecimal.
bool parse_version(std::optional<std::uint8_t>& to, const Entry& entry,
                   std::span<const std::uint8_t> versions) {
    const auto number = parse_natural(entry.value.text);
    if (!number || std::ranges::find(versions, *number) == versions.end()) return false;
    to = static_cast<std::uint8_t>(*number);
    return true;
}
bool parse_stepgen_version(CardConfig& card, const Entry& entry) {
    return parse_version(card.stepgen_version, entry, kind_of(Tag::stepgen)->versions);
}
bool parse_encoder_version(CardConfig& card, const Entry& entry) {
    return parse_version(card.encoder_version, entry, kind_of(Tag::encoder)->versions) ||
           parse_version(card.encoder_version, entry, kind_of(Tag::muxed_encoder)->versions);
}
bool parse_remotes(CardConfig& card, const Entry& entry) {
    card.remotes = 0;
    if (same_word(entry.value.text, "none")) return true;
    for (const Word& word : text::list_of(entry.value)) {
        const auto channel = parse_natural(word.text);
        if (!channel || *channel > 7) return false;
        card.remotes = static_cast<std::uint8_t>(card.remotes | 1U << *channel);
    }
    return true;
}

const bus::KeyTable<CardConfig>& card_keys() {
    static const bus::KeyTable<CardConfig> table{{
        {"type", bus::own("7i92, 7i76e, 7i95 or 7i96s", "7i92, 7i76e, 7i95, 7i96s", parse_type), "",
         "The card."},
        {"address", bus::text_value(&CardConfig::address, "ADDRESS"), "",
         "`sim:NAME` for the component; for `hal node mesa` the IP address of this computer on "
         "which the card answers, as in `127.0.0.1` or `10.10.10.10:27181`."},
        {"remotes",
         bus::own("channels 0..7 as in 0, 2, or none", "channels 0..7, or none", parse_remotes),
         "`0`; of a 7i95 or 7i96s `none`", "The smart-serial channels that have a 7I76."},
        {"name", bus::text_value(&CardConfig::reported, "NAME"), "that of the card",
         "The name that the card reports."},
        {"lbp-version", bus::number(&CardConfig::lbp_version, 2, 9), "`3`",
         "The version of LBP16; a card with 2 has no memory space 4."},
        {"idrom-type", bus::number(&CardConfig::idrom_type, 1, 9), "that of the card",
         "The type of the IDROM, for tests of a driver."},
        {"stepgens", bus::number(&CardConfig::stepgens, 0, 10), "all",
         "The step generators of another firmware: fewer."},
        {"encoders", bus::number(&CardConfig::encoders, 0, 10), "all", "The same for encoders."},
        {"pwmgens", bus::number(&CardConfig::pwmgens, 0, 10), "all", "The same for PWM."},
        {"3pwmgens", bus::number(&CardConfig::three_phase_pwms, 0, 2), "`0`",
         "The three-phase PWM generators of another firmware, of a 7i76e."},
        {"pktuarts", bus::number(&CardConfig::packet_uarts, 0, 1), "`0`",
         "The packet UARTs of another firmware, of a 7i76e: descriptors without a function."},
        {"stepgen-version",
         bus::own("0, 1, 2, 0x42 or 0xC2", "0, 1, 2, 0x42, 0xC2", parse_stepgen_version), "`2`",
         "The version of the step generators: from 0x42 step and direction can be exchanged, and "
         "0xC2 has index and probe."},
        {"encoder-version",
         bus::own("2, 3, 4, 0x83 or 0x84", "2, 3, 4, 0x83, 0x84", parse_encoder_version),
         "`2`; of a 7i95 `4`",
         "The version of the encoders: 0x83, and of a 7i95 0x84, has a probe."},
    }};
    return table;
}

const bus::KeyTable<MotorConfig>& motor_keys() {
    static const bus::KeyTable<MotorConfig> table{{
        {"stepgen", bus::number(&MotorConfig::stepgen, 0, 9), "`0`",
         "The step generator that drives it."},
        {"scale", nonzero(&MotorConfig::scale, "200"), "`200`",
         "Steps per unit of length; negative: it turns the other way."},
        {"start", real(&MotorConfig::start, "12.5"), "`0`", "The position at power-up."},
        {"min", real(&MotorConfig::min, "-2"), "none",
         "The lower mechanical stop: steps against it are lost."},
        {"max", real(&MotorConfig::max, "310"), "none", "The upper mechanical stop."},
        {"encoder", bus::number(&MotorConfig::encoder, 0, 9), "none", "An encoder on the axis."},
        {"encoder-scale", nonzero(&MotorConfig::encoder_scale, "1000"), "`1000`",
         "Its edges per unit of length."},
        {"index-every", real(&MotorConfig::index_every, "5"), "none",
         "The length between two index pulses."},
    }};
    return table;
}

const bus::KeyTable<SwitchConfig>& switch_keys() {
    static const bus::KeyTable<SwitchConfig> table{{
        {"terminal",
         bus::own(terminal_form, "`gpio N`, `inm N`, `inmux N`, `remote CHANNEL N`",
                  [](SwitchConfig& to, const Entry& entry) {
        return parse_terminal(to.terminal, entry);
    }),
         "", "The input that it is connected to."},
        {"motor", bus::text_value(&SwitchConfig::motor, "NAME"), "", "The motor that moves it."},
        {"below", real(&SwitchConfig::below, "-1"), "", "It closes below this position."},
        {"above", real(&SwitchConfig::above, "301"), "", "It closes above this position."},
        {"normally-closed", bus::flag(&SwitchConfig::normally_closed), "`no`",
         "It opens there instead."},
    }};
    return table;
}

bool parse_drive(SpindleConfig& to, const Entry& entry) {
    const auto words = text::words_of(entry.value);
    if (words.size() != 2) return false;
    const auto number = parse_natural(words[1].text);
    if (!number || *number > 7) return false;
    to.number = static_cast<unsigned>(*number);
    to.drive =
        same_word(words[0].text, "pwm") ? SpindleConfig::Drive::pwm : SpindleConfig::Drive::remote;
    return same_word(words[0].text, "pwm") || same_word(words[0].text, "remote");
}

const bus::KeyTable<SpindleConfig>& spindle_keys() {
    static const bus::KeyTable<SpindleConfig> table{{
        {"drive", bus::own("pwm N or remote CHANNEL", "`pwm N`, `remote CHANNEL`", parse_drive),
         "`pwm 0`", "The output that commands its speed."},
        {"max-speed", nonzero(&SpindleConfig::max_rpm, "24000"), "`24000`",
         "The speed in rpm at the full output."},
        {"time-constant", bus::time(&SpindleConfig::time_constant_ns, ms, 60'000 * ms), "`200ms`",
         "How fast it follows."},
        {"encoder", bus::number(&SpindleConfig::encoder, 0, 9), "none", "Its encoder."},
        {"edges", bus::number(&SpindleConfig::edges, 4, 1'000'000), "`4096`",
         "Edges of the encoder per turn; each turn has an index."},
    }};
    return table;
}

const bus::KeyTable<WireConfig>& wire_keys() {
    static const bus::KeyTable<WireConfig> table{{
        {"terminal",
         bus::own(
             terminal_form, "`gpio N`, `inm N`, `inmux N`, `ssr N`, `outm N`, `remote CHANNEL N`",
             [](WireConfig& to, const Entry& entry) { return parse_terminal(to.terminal, entry); }),
         "", "The input or output that it is connected to."},
        {"initial", bus::flag(&WireConfig::initial), "`no`",
         "The level of an input until it is set."},
    }};
    return table;
}

/// Reads a configuration and collects what is wrong.
class Reader {
public:
    Reader(std::string_view text, const std::string& file)
        : sections_(text, section_kinds, "[motor x]", key_report_) {
        out_.card.file = file;
    }

    CardReadResult read() {
        bus::Section* const section = sections_.one("card");
        if (section == nullptr) {
            report_.error(Topic::line, {1, 1, 0, 0}, "missing section [card]",
                          "write [card] and below it type = 7i76e");
        } else {
            read_card_section(*section);
        }
        read_all("motor", motor_keys(), out_.card.motors);
        read_all("switch", switch_keys(), out_.card.switches);
        read_all("spindle", spindle_keys(), out_.card.spindles);
        read_all("input", wire_keys(), out_.card.inputs);
        read_all("output", wire_keys(), out_.card.outputs);
        sections_.warn_unused_types("[motor …]");
        if (!report_.failed()) {
            check();
        }
        out_.messages = std::move(report_.all);
        text::sort(out_.messages);
        return std::move(out_);
    }

private:
    void error(const Span& at, std::string sentence, std::string help) {
        report_.error(Topic::plant, at, std::move(sentence), std::move(help));
    }

    void read_card_section(bus::Section& section) {
        CardConfig& card = out_.card;
        card.at = section.at;
        bus::Keys keys(key_report_);
        keys.add(section);
        const bool has_remotes = keys.find("remotes") != nullptr;
        const bool has_type = keys.find("type") != nullptr;
        card_keys().apply(keys, card, key_report_);
        keys.report_rest("in [card]", card_keys().names());
        if (!has_type) {
            report_.error(Topic::line, section.at, "[card] has no type",
                          "write type = 7i92, 7i76e, 7i95 or 7i96s");
        }
        if (!has_remotes && card.model != nullptr) {
            card.remotes = card.model->default_remotes;
        }
    }

    template <class Part>
    void read_all(const char* kind, const bus::KeyTable<Part>& table, std::vector<Part>& to) {
        for (bus::Section* section : sections_.all(kind)) {
            Part part;
            part.at = section->words.size() > 1 ? section->words[1].at : section->at;
            part.name = section->words.size() > 1 ? dashed(section->words[1].text) : "";
            bus::Keys keys(key_report_);
            if (!sections_.add_keys(*section, keys)) continue;
            keys.find("type");
            table.apply(keys, part, key_report_);
            keys.report_rest("in [" + std::string(kind) + " " + part.name + "]", table.names());
            to.push_back(std::move(part));
        }
    }

    // --- Whether the parts fit the card

    void check() {
        check_names();
        check_versions();
        for (const MotorConfig& motor : out_.card.motors) {
            check_unit(motor.at, Tag::stepgen, motor.stepgen);
            check_encoder(motor.at, motor.encoder);
            if (!(motor.min <= motor.start && motor.start <= motor.max)) {
                error(motor.at,
                      "the start of motor " + quoted(motor.name) + " is not between its stops",
                      "write start = a number from min to max");
            }
        }
        for (SwitchConfig& one : out_.card.switches) {
            check_switch(one);
        }
        for (const SpindleConfig& spindle : out_.card.spindles) {
            if (spindle.drive == SpindleConfig::Drive::pwm) {
                check_unit(spindle.at, Tag::pwm, spindle.number);
            } else {
                check_channel(spindle.at, spindle.number);
            }
            check_encoder(spindle.at, spindle.encoder);
        }
        for (const WireConfig& wire : out_.card.inputs) {
            check_terminal(wire.at, wire.terminal, true);
        }
        for (const WireConfig& wire : out_.card.outputs) {
            check_terminal(wire.at, wire.terminal, false);
        }
        check_sharing();
    }

    template <class Visit>
    void visit_names(Visit visit) const {
        const CardConfig& card = out_.card;
        for (const auto& part : card.motors) {
            visit(part.name, part.at);
        }
        for (const auto& part : card.switches) {
            visit(part.name, part.at);
        }
        for (const auto& part : card.spindles) {
            visit(part.name, part.at);
        }
        for (const auto& part : card.inputs) {
            visit(part.name, part.at);
        }
        for (const auto& part : card.outputs) {
            visit(part.name, part.at);
        }
    }

    void check_names() {
        std::map<std::string, std::uint32_t> first;
        visit_names([&](const std::string& name, const Span& at) {
            const auto [found, is_new] = first.emplace(name, at.line);
            if (!is_new) {
                error(at, "duplicate name " + quoted(name),
                      "first in line " + std::to_string(found->second));
            }
        });
    }

    void check_unit(const Span& at, Tag tag, unsigned unit) {
        const unsigned count = out_.card.instances(tag);
        if (unit < count) return;
        const std::string name(name_of(tag));
        error(at, "this card has no " + name + " " + std::to_string(unit),
              count == 0 ? "its firmware has none"
                         : "write a number from 0 to " + std::to_string(count - 1));
    }
    void check_encoder(const Span& at, const std::optional<unsigned>& encoder) {
        if (encoder) {
            check_unit(at, out_.card.encoder_tag(), *encoder);
        }
    }
    void check_channel(const Span& at, unsigned channel) {
        if ((out_.card.remotes >> channel & 1U) != 0) return;
        error(at, "there is no device on smart-serial channel " + std::to_string(channel),
              "add the channel to remotes = in [card]");
    }

    void check_switch(SwitchConfig& one) {
        check_terminal(one.at, one.terminal, true);
        if (!one.below && !one.above) {
            error(one.at, "switch " + quoted(one.name) + " has no position",
                  "write below = NUMBER or above = NUMBER");
        }
        std::vector<std::string> names;
        for (std::size_t n = 0; n < out_.card.motors.size(); ++n) {
            names.push_back(out_.card.motors[n].name);
            if (names.back() == dashed(one.motor)) {
                one.motor_index = n;
                return;
            }
        }
        error(one.at, "switch " + quoted(one.name) + " has no motor " + quoted(one.motor),
              names.empty() ? "write a section [motor NAME]"
                            : suggestion(one.motor, names, "motors are"));
    }

    void check_terminal(const Span& at, const Terminal& terminal, bool is_input) {
        using Kind = Terminal::Kind;
        switch (terminal.kind) {
        case Kind::none:
            error(at, "the terminal is missing", std::string("write terminal = ") + terminal_form);
            return;
        case Kind::remote:
            check_channel(at, terminal.channel);
            if (!is_input && terminal.number > 15) {
                error(at, "a 7I76 has outputs 0 to 15", "write remote CHANNEL 0 to 15");
            }
            return;
        case Kind::gpio:
            if (terminal.number >= out_.card.model->ports * out_.card.model->pins) {
                error(at, "this card has no pin " + std::to_string(terminal.number),
                      "`hal mesa pins` lists the pins of a card");
            }
            return;
        case Kind::inm: check_module(at, Tag::inm, is_input); return;
        case Kind::inmux: check_module(at, Tag::inmux, is_input); return;
        case Kind::ssr: check_module(at, Tag::ssr, !is_input); return;
        case Kind::outm: check_module(at, Tag::outm, !is_input); return;
        }
    }
    void check_module(const Span& at, Tag tag, bool right_direction) {
        const std::string name(name_of(tag));
        if (out_.card.instances(tag) == 0) {
            error(at, "this card has no module " + name, cards_with(tag));
        } else if (!right_direction) {
            const bool is_input = tag == Tag::inm || tag == Tag::inmux;
            error(at, name + " is of the other direction",
                  is_input ? "an output is ssr, outm, gpio or remote"
                           : "an input is inm, inmux, gpio or remote");
        }
    }

    /// Names the cards that have a module.
    static std::string cards_with(Tag tag) {
        std::string types;
        for (const CardModel& model : card_models()) {
            const bool has = std::ranges::find(model.modules, tag, &ModuleDescriptor::tag) !=
                             model.modules.end();
            if (!has) continue;
            types += types.empty() ? "" : " and ";
            types += model.type;
        }
        return "cards with it: " + types;
    }
    void check_versions() {
        CardConfig& card = out_.card;
        const Tag tag = card.encoder_tag();
        if (!card.encoder_version || card.instances(tag) == 0) return;
        const ModuleKind& kind = *kind_of(tag);
        if (std::ranges::find(kind.versions, *card.encoder_version) != kind.versions.end()) return;
        const bool is_muxed = tag == Tag::muxed_encoder;
        error(card.at, "this card has no encoders of this version",
              is_muxed ? "write encoder-version = 2, 3, 4 or 0x84"
                       : "write encoder-version = 2, 3 or 0x83");
    }

    void check_sharing() {
        std::map<unsigned, std::string> users;
        const auto use = [&](const std::optional<unsigned>& encoder, const std::string& name,
                             const Span& at) {
            if (!encoder) return;
            const auto [found, is_new] = users.emplace(*encoder, name);
            if (!is_new) {
                error(at,
                      "encoder " + std::to_string(*encoder) + " is already that of " +
                          quoted(found->second),
                      "give each encoder one motor or spindle");
            }
        };
        for (const MotorConfig& motor : out_.card.motors) {
            use(motor.encoder, motor.name, motor.at);
        }
        for (const SpindleConfig& spindle : out_.card.spindles) {
            use(spindle.encoder, spindle.name, spindle.at);
        }
    }

    text::Messages<Topic> report_;
    bus::TopicReport<Topic> key_report_{report_};
    bus::SectionFile sections_;
    CardReadResult out_;
};

}  // namespace

const char* code_of(Topic topic) {
    switch (topic) {
    case Topic::line: return "mesa-line";
    case Topic::value: return "mesa-value";
    case Topic::plant: return "mesa-plant";
    }
    return "mesa-line";
}

unsigned CardConfig::instances(Tag tag) const {
    if (model == nullptr) return 0;
    for (const ModuleDescriptor& module : model->modules) {
        if (module.tag != tag) continue;
        const unsigned all = module.instances;
        switch (tag) {
        case Tag::stepgen: return std::min(all, stepgens.value_or(all));
        case Tag::encoder:
        case Tag::muxed_encoder: return std::min(all, encoders.value_or(all));
        case Tag::pwm: return std::min(all, pwmgens.value_or(all));
        case Tag::three_phase_pwm: return std::min(all, three_phase_pwms.value_or(0));
        case Tag::packet_uart_transmit:
        case Tag::packet_uart_receive: return std::min(all, packet_uarts.value_or(0));
        default: return all;
        }
    }
    return 0;
}

Tag CardConfig::encoder_tag() const {
    return instances(Tag::muxed_encoder) > 0 ? Tag::muxed_encoder : Tag::encoder;
}

std::uint8_t CardConfig::version_of(const ModuleDescriptor& module) const {
    switch (module.tag) {
    case Tag::stepgen: return stepgen_version.value_or(module.version);
    case Tag::encoder:
    case Tag::muxed_encoder: return encoder_version.value_or(module.version);
    default: return module.version;
    }
}

CardReadResult read_card(std::string_view text, const std::string& file) {
    return Reader(text, file).read();
}

std::string card_reference() { return card_keys().reference(); }
std::string motor_reference() { return motor_keys().reference(); }
std::string switch_reference() { return switch_keys().reference(); }
std::string spindle_reference() { return spindle_keys().reference(); }
std::string wire_reference() { return wire_keys().reference(); }

}  // namespace hal::mesa
