// SPDX-License-Identifier: MIT
#include <deque>
#include <vector>

#include "hal/naming.hpp"

namespace {

/// Parses `D;stop;;jog`: decode, label "stop" for 0, no label for 1, "jog" for 2.
struct Config {
    struct Label {
        std::string name;
        std::uint32_t value;
    };
    bool decode = false;
    std::vector<Label> labels;

    explicit Config(const std::string& text) {
        const auto refuse = [&](const char* why) {
            throw hal::ArgumentError("enums", "enums=" + text + " " + why);
        };
        const char kind = text.empty() ? '\0' : text[0];
        if ((kind != 'D' && kind != 'E') || text.size() < 2 || text[1] != ';') {
            refuse("does not begin with D; (decode) or E; (encode)");
        }
        decode = kind == 'D';
        std::uint32_t value = 0;
        for (std::size_t from = 2; from <= text.size(); ++value) {
            const std::size_t end = std::min(text.find(';', from), text.size());
            if (end > from) {
                labels.push_back({text.substr(from, end - from), value});
            }
            from = end + 1;
        }
        if (labels.empty()) {
            refuse("has no label; write it like D;stop;forward;;jog");
        }
    }
};

/// The pins of a label: its bit and its value.
template <class Bit>
struct Entry {
    Entry(hal::Component& component, const Config::Label& label, const char* suffix,
          const char* doc)
        : bit(component, (label.name + suffix).c_str(), doc),
          value(component, (label.name + "-val").c_str(), "value of this label",
                {.initial = label.value}) {}
    Bit bit;
    hal::In<std::uint32_t> value;
};

struct Enum : hal::Component {
    hal::TextArgument text{
        *this,
        "enums",
        "D;zero;one",
        "for each instance: D (decode) or E (encode), then a label per value, separated by ;",
        {.per_instance = true}};
    Config config{text.get()};
    hal::InstanceName name{*this, config.decode ? "enum-decode" : "enum-encode", 2};
    hal::Ins<std::uint32_t> input{*this, "input", config.decode ? 1 : 0, "value to decode"};
    hal::Outs<std::uint32_t> output{*this, "output", config.decode ? 0 : 1,
                                    "value of the last label whose input is TRUE; 0 if none is"};
    hal::Function run{*this, "", hal::step<&Enum::update>, "decodes or encodes"};

    explicit Enum(const hal_host* host) : Component(host) {
        for (const Config::Label& label : config.labels) {
            if (config.decode) {
                outs.emplace_back(*this, label, "-out",
                                  "TRUE while input equals the value of this label");
            } else {
                ins.emplace_back(*this, label, "-in",
                                 "TRUE sets output to the value of this label");
            }
        }
    }

    void update(hal::Cycle) noexcept {
        for (auto& entry : outs) {
            entry.bit = input[0] == entry.value;
        }
        std::uint32_t found = 0;
        for (const auto& entry : ins) {
            if (entry.bit) {
                found = entry.value;
            }
        }
        for (auto& pin : output) {
            pin = found;
        }
    }

private:
    std::deque<Entry<hal::Out<bool>>> outs;  // pins cannot move
    std::deque<Entry<hal::In<bool>>> ins;
};

}  // namespace

HAL_COMPONENT(Enum, "enum", "Converts between integers and named bits", R"(
For the status and control words of drives with codes such as 0 stop, 1 forward, 2 backward instead
of a bit for each state. For each instance, `enums` has `D` (decode: number to bits) or `E` (encode:
bits to number) and the labels of 0, 1, 2 …; leave the label of an unused value empty:

    loadrt enum enums=E;stop;forward;;;jog,D;ready;running;;fault

makes `enum-encode.00` with `stop-in` (0), `forward-in` (1), `jog-in` (4) and `output`, and
`enum-decode.01` with `input`, `ready-out` (0), `running-out` (1) and `fault-out` (3). The value of
each label is a pin that may be set: `jog-val`. `names=` sets other instance names. While no input
is TRUE `output` is 0, with or without a label for 0.

    loadrt enum enums=D;ready;running;;fault names=drive-state
    addf drive-state servo
    setp drive-state.fault-val 8
    net drive-word  => drive-state.input
    net drive-ready <= drive-state.ready-out
    net drive-fault <= drive-state.fault-out
)")
