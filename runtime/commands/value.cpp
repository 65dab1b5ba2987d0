// SPDX-License-Identifier: MIT
// getp, gets, ptype, stype: one value or type.
#include <algorithm>
#include <nlohmann/json.hpp>

#include "commands/json_text.hpp"
#include "commands/listing.hpp"
#include "commands/table.hpp"
#include "model/names.hpp"

namespace hal {
namespace {

UnknownName unknown(const Context& context, const std::string& name, NameGroup group) {
    return {.name = name,
            .group = static_cast<std::uint32_t>(group),
            .before = context.session.model().next_id};
}

const Pin* pin_named(Context& context) {
    const auto& name = context.argument(0);
    if (const Pin* const pin = context.session.model().find_pin(name)) return pin;
    if (context.is_absent(name, Absences::Kind::pin)) return nullptr;
    const bool signal = context.session.model().find_signal(name) != nullptr;
    const char* const other = context.command.name.text == "getp" ? "gets" : "stype";
    context.diagnostics.error("no-such-pin", context.span(0),
                              "unknown pin or parameter '" + name + "'",
                              unknown(context, name, NameGroup::pins),
                              signal ? "it is a signal: " + std::string(other) + " " + name : "");
    return nullptr;
}

const Signal* signal_named(Context& context) {
    const auto& name = context.argument(0);
    if (const Signal* const signal = context.session.model().find_signal(name)) return signal;
    if (context.is_absent(name, Absences::Kind::signal)) return nullptr;
    const bool pin = context.session.model().find_pin(name) != nullptr;
    const char* const other = context.command.name.text == "gets" ? "getp" : "ptype";
    context.diagnostics.error("no-such-signal", context.span(0), "unknown signal '" + name + "'",
                              unknown(context, name, NameGroup::signals),
                              pin ? "it is a pin: " + std::string(other) + " " + name : "");
    return nullptr;
}

void print_value(Context& context, hal_type type, const hal_value& value) {
    if (!context.options().json) return context.output.out(format_value(type, value) + "\n");
    context.output.out(json_text({{"name", context.argument(0)},
                                  {"type", name(type)},
                                  {"value", to_json(type, value)}}) +
                       "\n");
}

void print_type(Context& context, hal_type type) {
    if (!context.options().json) return context.output.out(std::string(name(type)) + "\n");
    context.output.out(json_text({{"type", name(type)}}) + "\n");
}

}  // namespace

void command_getp(Context& context) {
    const Pin* const pin = pin_named(context);
    if (pin && !context.checking()) {
        print_value(context, pin->type, context.session.values().read_pins({pin})[0]);
    }
}

void command_gets(Context& context) {
    const Signal* const signal = signal_named(context);
    if (signal && !context.checking()) {
        print_value(context, signal->type, context.session.values().read_signals({signal})[0]);
    }
}

void command_ptype(Context& context) {
    const Pin* const pin = pin_named(context);
    if (pin && !context.checking()) {
        print_type(context, pin->type);
    }
}

void command_stype(Context& context) {
    const Signal* const signal = signal_named(context);
    if (signal && !context.checking()) {
        print_type(context, signal->type);
    }
}

}  // namespace hal
