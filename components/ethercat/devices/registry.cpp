// SPDX-License-Identifier: MIT
#include "ethercat/devices/registry.hpp"

#include <algorithm>
#include <optional>

#include "cia402/drive/motor_options.hpp"
#include "ethercat/devices/device_words.hpp"
#include "ethercat/devices/esi_device.hpp"
#include "ethercat/devices/mailbox_device.hpp"
#include "ethercat/devices/servo.hpp"
#include "ethercat/esi/lookup.hpp"
#include "hal/read_file.hpp"
#include "text/find_row.hpp"
#include "text/numbers.hpp"

namespace hal::ethercat::devices {
namespace {

struct DeviceRow {
    std::string_view name, options;
    Parts (*make)(const DeviceOptions&);
};
constexpr DeviceRow device_rows[] = {
    {"coupler", "", make_coupler},
    {"digital_in", "bits", [](const DeviceOptions& o) { return make_digital(o, false); }},
    {"digital_out", "bits", [](const DeviceOptions& o) { return make_digital(o, true); }},
    {"analog_in", "channels", [](const DeviceOptions& o) { return make_analog(o, false); }},
    {"analog_out", "channels", [](const DeviceOptions& o) { return make_analog(o, true); }},
    {"servo", "axes dc modes motor", make_servo},
    {"mailbox_device", "", make_mailbox_device},
    {"esi", "file device revision modules", make_esi_device},
};

const DeviceRow* device_row(std::string_view name) {
    return find_row(device_rows, name, &DeviceRow::name);
}

bool offers(const DeviceRow& row, std::string_view option) {
    return option == "alias" || option == "serial" ||
           (" " + std::string(row.options) + " ").find(" " + std::string(option) + " ") !=
               std::string::npos;
}

std::string list_of(const std::vector<std::string>& names) {
    std::string out;
    for (const std::string& name : names) {
        out += (out.empty() ? "" : ", ") + name;
    }
    return out;
}

std::string list_of_names() {
    std::string out;
    for (const auto& row : device_rows) {
        out += (out.empty() ? "" : ", ") + std::string(row.name);
    }
    return out;
}

/// Parses a number from `min` to `max`. Returns what is wrong with it, or an empty text.
template <class T>
std::string parse_number(std::string_view key, std::string_view value, std::uint64_t min,
                         std::uint64_t max, T& to) {
    const auto number = parse_natural(value);
    if (!number || *number < min || *number > max) {
        return "invalid value '" + std::string(value) + "' of " + std::string(key) + "; use " +
               std::to_string(min) + ".." + std::to_string(max);
    }
    to = static_cast<T>(*number);
    return {};
}

std::string parse_dc(std::string_view value, bool& required) {
    if (value != "required" && value != "optional") {
        return "invalid value '" + std::string(value) + "' of dc; use required or optional";
    }
    required = value == "required";
    return {};
}

std::string parse_text(std::string_view key, std::string_view value, std::string_view example,
                       std::string& to) {
    if (value.empty()) {
        return "option '" + std::string(key) + "' has no value; write " + std::string(key) + "=" +
               std::string(example);
    }
    to = value;
    return {};
}

/// An option, and how its value is parsed: the function returns what is wrong, or an empty text.
struct OptionRow {
    std::string_view name;
    std::string (*parse)(std::string_view key, std::string_view value, DeviceOptions&);
};
using Text = std::string_view;
constexpr OptionRow option_rows[] = {
    {"bits", [](Text k, Text v, DeviceOptions& o) { return parse_number(k, v, 1, 64, o.bits); }},
    {"channels",
     [](Text k, Text v, DeviceOptions& o) { return parse_number(k, v, 1, 16, o.channels); }},
    {"axes", [](Text k, Text v, DeviceOptions& o) { return parse_number(k, v, 1, 8, o.axes); }},
    {"modes",
     [](Text k, Text v, DeviceOptions& o) { return parse_number(k, v, 1, 0x3ff, o.modes); }},
    {"alias",
     [](Text k, Text v, DeviceOptions& o) { return parse_number(k, v, 0, 0xffff, o.alias); }},
    {"revision",
     [](Text k, Text v, DeviceOptions& o) {
    return parse_number(k, v, 0, 0xffffffff, o.revision.emplace());
}},
    {"serial",
     [](Text k, Text v, DeviceOptions& o) { return parse_number(k, v, 0, 0xffffffff, o.serial); }},
    {"dc", [](Text, Text v, DeviceOptions& o) { return parse_dc(v, o.dc_required); }},
    {"file", [](Text k, Text v, DeviceOptions& o) { return parse_text(k, v, "FILE.xml", o.file); }},
    {"device", [](Text k, Text v, DeviceOptions& o) { return parse_text(k, v, "NAME", o.device); }},
    {"modules",
     [](Text k, Text v, DeviceOptions& o) { return parse_text(k, v, "NAME,NAME", o.modules); }},
    {"motor", [](Text, Text v, DeviceOptions& o) { return cia402::parse_motor(v, o.motor); }},
};

/// Returns an option that a device offers; nullptr: unknown.
const OptionRow* option_row(const DeviceRow& device, std::string_view key) {
    for (const OptionRow& row : option_rows) {
        if (row.name == key && offers(device, key)) return &row;
    }
    return nullptr;
}

/// Parses an option of a device, as in "axes=2". Returns what is wrong with it, or an empty text.
std::string parse_option(const DeviceRow& device, std::string_view word, DeviceOptions& options) {
    const auto equals = word.find('=');
    const std::string key(word.substr(0, equals));
    if (equals == word.npos && device_row(word) != nullptr) {
        return "'" + key + "' is a device of its own; write it on the next line, or after a comma";
    }
    if (equals == word.npos) return "option '" + key + "' has no value; write " + key + "=VALUE";
    const OptionRow* option = option_row(device, key);
    if (option == nullptr) return "unknown option '" + key + "' of " + std::string(device.name);
    return option->parse(key, word.substr(equals + 1), options);
}

/// Finds the modules of an esi device. Returns what is wrong, or an empty text.
std::string read_modules(DeviceOptions& o, const esi::File& file, const esi::Device& device,
                         std::string& help) {
    o.module_idents = esi::default_modules(device);
    if (o.modules.empty()) return {};
    o.module_idents.clear();
    for (const std::string& name : device_list(o.modules)) {
        const auto ident = esi::find_module(file, name);
        if (!ident) {
            std::vector<std::string> types;
            for (const esi::Module& m : file.modules) {
                types.push_back(m.type);
            }
            help = types.empty() ? "leave out modules=" : "the modules are: " + list_of(types);
            return "unknown module '" + name + "'";
        }
        o.module_idents.push_back(*ident);
    }
    if (o.module_idents.size() <= std::max<std::size_t>(device.slots.size(), 1)) return {};
    help = "leave out some of them";
    return std::to_string(o.module_idents.size()) + " modules, but '" + device.order + "' has " +
           std::to_string(device.slots.size()) + " slots";
}

/// Reads the description of an esi device. Returns what is wrong, or an empty text; `help` has what
/// to write.
std::string read_description(DeviceOptions& o, const FindFile& find, std::string& help) {
    help = "write esi file=FILE.xml device=NAME, with the order code or product code of the device";
    if (o.file.empty()) return "an esi device needs the description of its maker";
    const std::string path = find ? find(o.file) : o.file;
    std::string bytes;
    if (!read_regular_file(path, 64'000'000, bytes)) return "cannot read '" + path + "': " + bytes;
    esi::File file = esi::read(bytes);
    for (const esi::Message& m : file.messages) {
        if (m.severity == Severity::error) {
            help = m.help;
            return "'" + path + "', line " + std::to_string(m.at.line) + ": " + m.sentence;
        }
    }
    auto description = std::make_shared<const esi::File>(std::move(file));
    const esi::Match match = esi::look_up(*description, {.name = o.device, .revision = o.revision});
    if (match.device == nullptr) {
        help = "write device=NAME with one of: " + list_of(match.choices);
        return "'" + path + "' " + match.problem;
    }
    if (match.revision == esi::Match::Revision::other) {
        help = "write revision= with one of: " +
               list_of(esi::revisions_of(*description, *match.device));
        return "'" + path + "' does not describe revision " + esi::number_text(*o.revision) +
               " of '" + match.device->order + "'";
    }
    if (std::string why = read_modules(o, *description, *match.device, help); !why.empty()) {
        return why;
    }
    o.description = std::move(description);
    o.described = match.device;
    return {};
}

}  // namespace

std::vector<std::string_view> names() {
    std::vector<std::string_view> out;
    for (const auto& row : device_rows) {
        out.push_back(row.name);
    }
    return out;
}

std::optional<Device> make(std::string_view name, const DeviceOptions& options) {
    const auto* row = device_row(name);
    if (row == nullptr || (row->make == make_esi_device && options.described == nullptr)) {
        return std::nullopt;
    }
    Parts parts = row->make(options);
    Device device;
    device.name = std::string(name);
    device.sii = sii::build(parts.design.sii);
    device.dc = parts.design.dc;
    device.firmware =
        std::make_unique<Firmware>(std::move(parts.design), std::move(parts.behaviour));
    return device;
}

FindFile beside(const std::string& path) {
    const std::string folder =
        path.find('/') == std::string::npos ? "" : path.substr(0, path.rfind('/') + 1);
    return
        [folder](const std::string& name) { return name.starts_with('/') ? name : folder + name; };
}

LineDescription read_line(std::string_view text, const FindFile& find) {
    LineDescription out;
    text::Messages<LineTopic> messages;
    for (text::Lines lines(text); auto line = lines.next();) {
        const auto words = device_words(*line);
        const auto* row = device_row(words[0].text);
        if (row == nullptr) {
            messages.error(LineTopic::device, words[0].at, "unknown device '" + words[0].text + "'",
                           "use one of: " + list_of_names());
            continue;
        }
        LineDescription::Slave slave{words[0].text, {}, words[0].at};
        bool good = true;
        for (std::size_t n = 1; n < words.size(); ++n) {
            const std::string problem = parse_option(*row, words[n].text, slave.options);
            if (problem.empty()) continue;
            good = false;
            messages.error(LineTopic::option, words[n].at, problem,
                           "options of " + words[0].text + ": " + std::string(row->options) +
                               (row->options.empty() ? "" : " ") + "alias serial");
        }
        std::string help;
        if (good && row->make == make_esi_device) {
            if (const std::string problem = read_description(slave.options, find, help);
                !problem.empty()) {
                good = false;
                messages.error(LineTopic::option, words[0].at, problem, help);
            }
        }
        if (good) {
            out.slaves.push_back(std::move(slave));
        }
    }
    if (out.slaves.empty() && !messages.failed()) {
        messages.error(LineTopic::device, {}, "the line has no device",
                       "write one device per line");
    }
    for (std::size_t i = 0; i < out.slaves.size(); ++i) {
        for (std::size_t k = 0; k < i; ++k) {
            if (out.slaves[i].options.alias != 0 &&
                out.slaves[i].options.alias == out.slaves[k].options.alias) {
                messages.warning(LineTopic::option, out.slaves[i].at,
                                 "duplicate alias " + std::to_string(out.slaves[i].options.alias),
                                 "give each device its own alias, unless the fault is wanted");
            }
        }
    }
    out.messages = std::move(messages.all);
    return out;
}

std::vector<Device> make_line(const LineDescription& line) {
    std::vector<Device> out;
    for (const auto& slave : line.slaves) {
        if (auto device = make(slave.device, slave.options)) {
            out.push_back(std::move(*device));
        }
    }
    return out;
}

}  // namespace hal::ethercat::devices
