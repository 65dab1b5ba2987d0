// SPDX-License-Identifier: MIT
#include "commands/foreign_file.hpp"

#include <algorithm>

#include "text/characters.hpp"

namespace hal {
namespace {

/// A kind of file: what it is, and the help, in which {} is its path.
struct Kind {
    std::string_view what;
    std::string_view help;
};

constexpr Kind eds{"a CANopen device description", "check it with: hal can eds check {}"};
constexpr Kind esi{"an EtherCAT device description (ESI)",
                   "write a configuration and a netlist for its devices with: hal ethercat config "
                   "--esi {} NAME"};
constexpr Kind ethercat{"the configuration of an EtherCAT bus",
                        "check it with: hal ethercat check {}; a netlist loads it with: loadrt "
                        "ethercat config={}"};
constexpr Kind lcec{"a configuration of LinuxCNC's EtherCAT driver lcec",
                    "check it with: hal ethercat check {}; a netlist loads it with: loadusr -W "
                    "lcec_conf {}"};
constexpr Kind canopen{"the configuration of a CANopen network",
                       "check it with: hal canopen check {}; a netlist loads it with: loadrt "
                       "canopen config={}"};
constexpr Kind tdma{"the schedule of an Ethernet segment", "check it with: hal tdma plan {}"};
constexpr Kind scocan{"the schedule of a CAN bus", "check it with: hal scocan plan {}"};
constexpr Kind modbus{"the configuration of a Modbus line",
                      "check it with: hal modbus check {}; a netlist loads it with: loadrt modbus "
                      "config={}"};
constexpr Kind mesa{"the description of a Mesa card made of software",
                    "a netlist loads it with: loadrt mesa_card config={}"};
constexpr Kind component{"the source of a component", "compile it with: hal compile {}"};
constexpr Kind python{"a Python program", "a netlist starts it with: loadusr -W python3 {}"};
constexpr Kind recording{"a recording", "replay it with: hal replay {} NETLIST"};
constexpr Kind capture{"a capture of a bus",
                       "print it with: hal ethercat dump {}, or hal can dump replay:{}"};
constexpr Kind can_log{"a log of a CAN bus", "print it with: hal can dump replay:{}"};
constexpr Kind can_output{"the output of candump without times",
                          "record the bus with times, for `hal can dump replay:FILE`: candump -L"};
constexpr Kind panel{"a page of widgets", "show it with: hal panel {}"};
constexpr Kind pyvcp{"a panel of LinuxCNC's PyVCP", "show it with: hal panel {}"};
constexpr Kind xml{"an XML file", "name a netlist (.hal) or an INI file"};
constexpr Kind yaml{"a YAML file", "name a netlist (.hal) or an INI file"};

/// A kind and the extension that is enough to recognise it.
struct Extension {
    std::string_view extension;
    Kind kind;
};
constexpr Extension extensions[] = {
    {".eds", eds},           {".dcf", eds},         {".xdd", eds},        {".xdc", eds},
    {".ethercat", ethercat}, {".canopen", canopen}, {".tdma", tdma},      {".scocan", scocan},
    {".comp", component},    {".c", component},     {".cpp", component},  {".py", python},
    {".mcap", recording},    {".pcap", capture},    {".pcapng", capture}, {".panel", panel},
    {".yml", yaml},          {".yaml", yaml},       {".modbus", modbus},  {".mesa", mesa},
};

const Kind* by_extension(std::string_view path) {
    const std::size_t dot = path.rfind('.');
    if (dot == path.npos) return nullptr;
    const auto row = std::ranges::find_if(extensions, [&](const Extension& each) {
        return same_word(each.extension, path.substr(dot));
    });
    return row == std::end(extensions) ? nullptr : &row->kind;
}

const Kind& of_xml(std::string_view text) {
    if (text.find("<EtherCATInfo") != text.npos) return esi;
    if (text.find("<masters") != text.npos) return lcec;
    if (text.find("<pyvcp") != text.npos) return pyvcp;
    return text.find("ISO15745Profile") != text.npos ? eds : xml;
}

/// Returns whether a text begins as candump writes a log: "(1436509052.249713) can0 123#11".
bool is_can_log(std::string_view text) {
    const std::string_view stamp = text.substr(0, text.find(')'));
    return stamp.size() > 1 && stamp.size() < 32 && stamp.front() == '(' &&
           stamp.find_first_not_of("0123456789.", 1) == stamp.npos;
}

std::string_view next_word(std::string_view& line) {
    const std::size_t begin = std::min(line.find_first_not_of(" \t"), line.size());
    const std::size_t end = std::min(line.find_first_of(" \t", begin), line.size());
    const std::string_view word = line.substr(begin, end - begin);
    line.remove_prefix(end);
    return word;
}

/// Returns whether a text begins as candump prints frames in a terminal: "can0  123   [2]  11 22".
bool is_can_output(std::string_view text) {
    std::string_view line = text.substr(0, text.find_first_of("\r\n"));
    const std::string_view interface = next_word(line);
    const std::string_view id = next_word(line);
    const std::string_view size = next_word(line);
    return !interface.empty() && (id.size() == 3 || id.size() == 8) &&
           id.find_first_not_of("0123456789ABCDEFabcdef") == id.npos && size.size() >= 3 &&
           size.front() == '[' && size.back() == ']' &&
           size.find_first_not_of("0123456789", 1) == size.size() - 1;
}

const Kind* by_content(std::string_view text) {
    text.remove_prefix(std::min(text.find_first_not_of("\xef\xbb\xbf \t\r\n"), text.size()));
    if (text.starts_with('<')) return &of_xml(text);
    if (text.starts_with("[FileInfo]")) return &eds;
    if (text.starts_with("#!") && text.substr(0, text.find('\n')).find("python") != text.npos) {
        return &python;
    }
    if (is_can_output(text)) return &can_output;
    return is_can_log(text) ? &can_log : nullptr;
}

std::string with_path(std::string_view help, const std::string& path) {
    std::string out;
    for (std::size_t at = 0; at < help.size();) {
        const std::size_t mark = std::min(help.find("{}", at), help.size());
        out += help.substr(at, mark - at);
        if (mark == help.size()) break;
        out += path;
        at = mark + 2;
    }
    return out;
}

}  // namespace

std::optional<ForeignFile> foreign_file(const std::string& path, std::string_view text) {
    const Kind* kind = by_extension(path);
    if (kind == nullptr) {
        kind = by_content(text);
    }
    if (kind == nullptr) return std::nullopt;
    return ForeignFile{"'" + path + "' is not a netlist but " + std::string(kind->what),
                       with_path(kind->help, path)};
}

}  // namespace hal
