// SPDX-License-Identifier: MIT
// Extension "hal.texts": the files a component reads while it is constructed, and the diagnostics
// about them.
#include <algorithm>
#include <filesystem>

#include "machine/load/construction.hpp"

namespace hal {
namespace {

const char* find_text(const hal_host* host, const char* file) {
    Construction& c = construction_of(host);
    return guarded(c, file, [&] {
        // of the line that loaded the instance: a reload may be typed in another folder
        const Span& at = c.instance.loaded;
        const std::string& netlist = at.known() ? c.sources->get(at.source).name : "";
        const auto slash = netlist.rfind('/');
        if (*file == '/' || slash == std::string::npos) return file;
        std::error_code none;
        const std::string beside = netlist.substr(0, slash + 1) + file;
        if (!std::filesystem::exists(beside, none) && std::filesystem::exists(file, none)) {
            return file;
        }
        c.found.push_back(beside);
        return c.found.back().c_str();
    });
}

void begin_text(const hal_host* host, const char* name, const char* text, std::size_t bytes) {
    Construction& c = construction_of(host);
    guarded(c, false, [&] {
        c.text_name = name;
        c.text.assign(text, bytes);
        c.text_source = 0;
        c.said = 0;
        return true;
    });
}

Severity severity_of(const hal_text_message& message) {
    switch (message.severity) {
    case HAL_SEVERITY_ERROR: return Severity::error;
    case HAL_SEVERITY_WARNING: return Severity::warning;
    default: return Severity::note;
    }
}

void report_in_text(const hal_host* host, const hal_text_message* message) {
    Construction& c = construction_of(host);
    guarded(c, false, [&] {
        if (message->size < sizeof *message) {
            return refuse(c, "unsupported hal_text_message of " + std::to_string(message->size) +
                                 " bytes; rebuild the component");
        }
        if (c.text_source == 0 && !c.text_name.empty()) {
            c.text_source = c.sources->add(c.text_name, c.text);
        }
        const auto size = static_cast<std::uint32_t>(c.text.size());
        const std::uint32_t begin = std::min(message->begin, size);
        const std::uint32_t end = std::clamp(message->end, begin, size);
        const Span at = c.text_source == 0 ? c.request.at : Span{c.text_source, begin, end};
        constexpr std::size_t max = 99;  // with the sentence behind them as many as are rendered
        if (++c.said > max) {
            if (c.said == max + 1) {
                c.diagnostics->error("construct-failed", at,
                                     "there are more errors in '" + c.text_name + "' than the " +
                                         std::to_string(max) + " shown; fix these first");
            }
            c.said_why = true;
            return true;
        }
        const Severity severity = severity_of(*message);
        Diagnostic d{severity,
                     failure_code(message->code, "construct-failed"),
                     message->sentence,
                     {{at, message->label}}};
        if (*message->help) {
            d.help.emplace_back(message->help);
        }
        c.diagnostics->add(std::move(d));
        c.said_why = c.said_why || severity == Severity::error;
        return true;
    });
}

}  // namespace

constexpr hal_texts texts_extension{sizeof texts_extension, find_text, begin_text, report_in_text};

}  // namespace hal
