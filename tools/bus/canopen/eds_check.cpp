// SPDX-License-Identifier: MIT
// `hal can eds check FILE…`: checks device descriptions and prints every problem with its line.
#include "bus/canopen/eds_check.hpp"

#include <fmt/core.h>
#include <unistd.h>

#include "canopen/eds/eds.hpp"
#include "canopen/eds/xdd.hpp"
#include "cli/output.hpp"
#include "text/diagnostic.hpp"
#include "text/glyphs.hpp"
#include "text/quoting.hpp"

namespace hal::tools {

namespace {

namespace eds = canopen::eds;

Code code_of(eds::Topic topic) {
    constexpr Code codes[] = {"eds-unreadable", "eds-syntax", "eds-missing", "eds-count",
                              "eds-value",      "eds-object", "eds-value",   "eds-syntax",
                              "eds-missing",    "eds-syntax"};
    return codes[static_cast<std::size_t>(topic)];
}

Diagnostic worded(const eds::Message& message, std::uint32_t source) {
    const Severity severities[] = {Severity::note, Severity::warning, Severity::error};
    Diagnostic out{severities[static_cast<std::size_t>(message.severity)], code_of(message.topic),
                   message.sentence};
    out.labels.push_back(
        {Span{source, message.at.offset, message.at.offset + message.at.length}, ""});
    if (!message.help.empty()) {
        out.help.push_back(message.help);
    }
    return out;
}

/// "motor.eds: not reliable (2 problems); Motor by Maker; 52 objects, 238 entries, 4 RPDOs, 4
/// TPDOs; 1 warning, 0 notes"
std::string summary(const std::string& path, const eds::ReadResult& reading) {
    const eds::DeviceDescription& d = *reading.description;
    std::size_t receive = 0;
    std::size_t send = 0;
    for (const eds::Object& object : d.objects) {
        receive += object.index >= 0x1400 && object.index < 0x1600;
        send += object.index >= 0x1800 && object.index < 0x1A00;
    }
    std::string text = path + ": ";
    if (const std::size_t doubts = reading.doubts().size(); doubts != 0) {
        text += fmt::format("not reliable ({}); ", counted(doubts, "problem"));
    }
    if (d.commissioning) {
        text += fmt::format("configuration of node {}; ", d.commissioning->node_id);
    }
    if (!d.device.product_name.empty()) {
        text += d.device.product_name +
                (d.device.vendor_name.empty() ? "; " : " by " + d.device.vendor_name + "; ");
    }
    text += fmt::format("{}, {}, {}, {}", counted(d.objects.size(), "object"),
                        counted(d.entries(), "entry", "entries"), counted(receive, "RPDO"),
                        counted(send, "TPDO"));
    if (!d.modules.empty()) {
        text += ", " + counted(d.modules.size(), "module");
    }
    return text + fmt::format("; {}, {}", counted(reading.count(eds::Severity::warning), "warning"),
                              counted(reading.count(eds::Severity::note), "note"));
}

int check(const Options& options, const std::string& path) {
    std::string bytes;
    if (!read_file(path, bytes)) {
        return fail(options, fmt::format("cannot read '{}': {}", path, bytes));
    }
    const eds::ReadResult reading = eds::read_description(bytes);
    Sources sources;
    const std::uint32_t source = sources.add(path, reading.text);
    Diagnostics found;
    for (const eds::Message& message : reading.messages) {
        found.add(worded(message, source));
    }
    std::string text = render(found, sources, colours(STDERR_FILENO));
    if (!text.empty()) {
        text += "\n";
    }
    text += reading.description
                ? printable(summary(path, reading)) + "\n"
                : fmt::format("{}: rejected, not a usable device description\n", printable(path));
    write_all(STDERR_FILENO, text);
    return exit_code(reading.description && reading.doubts().empty());
}

}  // namespace

int run_can_eds_check(const EdsCheckOptions& options) {
    int status = 0;
    for (const std::string& path : options.words) {
        status |= check(options, path);
    }
    return status;
}

}  // namespace hal::tools
