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

/// One of the two kinds of names that these commands take.
struct NameKind {
    Code code;
    const char* text;
    NameGroup group;
    Absences::Kind absence;
    const char* other;  ///< the other kind
    const char* value_command;  ///< these two of the other kind
    const char* type_command;
};
constexpr NameKind pin_names{
    "no-such-pin", "pin or parameter", NameGroup::pins, Absences::Kind::pin, "signal", "gets",
    "stype"};
constexpr NameKind signal_names{
    "no-such-signal", "signal", NameGroup::signals, Absences::Kind::signal, "pin", "getp", "ptype"};

/// Reports that there is nothing of this name, unless that is known; `is_other`: the other kind has
/// one.
void report_unknown(Context& context, const NameKind& kind, bool is_other) {
    const std::string& name = context.argument(0);
    if (context.is_absent(name, kind.absence)) return;
    const std::string_view command = context.command.name.text;
    const bool wants_value = command == "getp" || command == "gets";
    const std::string help = std::string("it is a ") + kind.other + ": " +
                             (wants_value ? kind.value_command : kind.type_command) + " " + name;
    context.diagnostics.error(kind.code, context.span(0),
                              std::string("unknown ") + kind.text + " '" + name + "'",
                              unknown(context, name, kind.group), is_other ? help : "");
}

const Pin* pin_named(Context& context) {
    const Model& model = context.session.model();
    const Pin* const pin = model.find_pin(context.argument(0));
    if (pin == nullptr) {
        report_unknown(context, pin_names, model.find_signal(context.argument(0)) != nullptr);
    }
    return pin;
}

const Signal* signal_named(Context& context) {
    const Model& model = context.session.model();
    const Signal* const signal = model.find_signal(context.argument(0));
    if (signal == nullptr) {
        report_unknown(context, signal_names, model.find_pin(context.argument(0)) != nullptr);
    }
    return signal;
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
