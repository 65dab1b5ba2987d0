// SPDX-License-Identifier: MIT
#include "lsp/hover_text.hpp"

#include <fmt/format.h>

#include "base/types.hpp"
#include "commands/listing.hpp"
#include "commands/table.hpp"
#include "doc/page.hpp"
#include "text/numbers.hpp"
#include "text/quoting.hpp"

namespace hal::tools {

namespace {

std::string code_block(const std::string& text) { return "```hal\n" + text + "\n```\n"; }

/// Returns the first paragraph of a component's manual.
std::string component_line(const LoadedComponent& component) {
    const char* const summary = component.plugin ? component.plugin->summary : "";
    return fmt::format("`{}`: {}", component.name, summary);
}

std::string pin_text(const Pin& pin) {
    std::string text =
        code_block(fmt::format("{} {} {}", pin.name, name(pin.type), direction_text(pin)));
    if (*pin.doc) {
        text += pin.doc;
        text += "\n\n";
    }
    if (*pin.unit) {
        text += fmt::format("unit: {}\n\n", pin.unit);
    }
    if (!pin.alias.empty()) {
        text += fmt::format("alias: `{}`\n\n", pin.alias);
    }
    if (pin.signal) {
        text += fmt::format("signal: {} `{}`\n\n", arrow_of_pin(pin), pin.signal->name);
    } else if (pin.dir != HAL_DIR_OUT) {
        text += fmt::format("default: {}\n\n", saved_value(pin.type, pin.initial));
    }
    if (pin.safe_output()) {
        text += fmt::format("safe value: {}\n\n", saved_value(pin.type, pin.safe));
    }
    if (pin.instance && pin.instance->component) {
        text += component_line(*pin.instance->component);
    }
    return text;
}

std::string signal_text(const Signal& signal) {
    std::string text = code_block(fmt::format("{} {}", signal.name, name(signal.type)));
    constexpr std::size_t max_pins = 20;
    std::size_t shown = 0;
    for (const Pin* const pin : signal.pins) {
        if (++shown > max_pins) break;
        const char* const unit = *pin->unit ? pin->unit : "";
        text += fmt::format("- {} `{}` {}\n", arrow_of_signal(*pin), pin->name, unit);
    }
    if (signal.pins.size() > max_pins) {
        text += fmt::format("- {} more\n", signal.pins.size() - max_pins);
    }
    if (!signal.writer && signal.ios == 0) {
        text += "\nno pin writes it\n";
    }
    return text;
}

std::string function_text(const LoadedFunction& function) {
    std::string text = code_block(function.name);
    if (*function.doc) {
        text += function.doc;
        text += "\n\n";
    }
    text += function.thread ? fmt::format("thread: `{}`\n\n", function.thread->name)
                            : std::string("in no thread\n\n");
    return function.component ? text + component_line(*function.component) : text;
}

std::string thread_text(const Thread& thread) {
    std::string text = code_block(fmt::format(
        "{} {}", thread.name, format_duration(static_cast<double>(thread.options.period_ns))));
    text += counted(thread.functions.size(), "function") + ":\n\n";
    constexpr std::size_t max_functions = 50;
    for (std::size_t i = 0; i < thread.functions.size() && i < max_functions; ++i) {
        text += fmt::format("{}. `{}`\n", i + 1, thread.functions[i]->name);
    }
    return text;
}

std::string component_text(CheckedNetlist& model, const std::string& name) {
    if (name == "threads") return as_markdown(threads_page());
    const auto declared = model.sessions().front()->host().declared(name);
    return declared ? as_markdown(*declared) : "";
}

std::string command_text(const std::string& name) {
    const CommandRow* const row = find_command(name);
    if (!row) return "";
    std::string text = code_block(to_string(row->usage())) + row->summary + "\n";
    if (*row->help) {
        text += std::string("\n") + row->help + "\n";
    }
    return text;
}

}  // namespace

std::string hover_text(const NetlistIndex& index, CheckedNetlist& model, const NamedThing& thing) {
    switch (thing.kind) {
    case NameKind::command: return command_text(thing.name);
    case NameKind::component: return component_text(model, thing.name);
    case NameKind::pin:
        if (const Pin* const pin = index.find_pin(thing.name)) return pin_text(*pin);
        return "";
    case NameKind::signal:
        if (const Signal* const signal = index.find_signal(thing.name)) return signal_text(*signal);
        return "";
    case NameKind::function:
        if (const auto* const function = index.find_function(thing.name)) {
            return function_text(*function);
        }
        return "";
    case NameKind::thread:
        if (const Thread* const thread = index.find_thread(thing.name)) return thread_text(*thread);
        return "";
    case NameKind::instance:
        if (const Instance* const instance = index.find_instance(thing.name)) {
            return code_block(instance->name) + component_line(*instance->component) + "\n\n" +
                   counted(instance->pins.size(), "pin");
        }
        return "";
    case NameKind::file:
    case NameKind::value: return "";
    }
    return "";
}

}  // namespace hal::tools
