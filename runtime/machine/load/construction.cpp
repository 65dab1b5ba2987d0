// SPDX-License-Identifier: MIT
#include "machine/load/construction.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "base/types.hpp"
#include "machine/load/elaborate.hpp"

namespace hal {
namespace {

std::vector<std::string> split(const std::string& text, char by) {
    std::vector<std::string> parts;
    std::size_t from = 0;
    for (std::size_t at; (at = text.find(by, from)) != std::string::npos; from = at + 1) {
        parts.push_back(text.substr(from, at - from));
    }
    parts.push_back(text.substr(from));
    return parts;
}

bool whole_names(const Instance& instance) {
    return instance.component->plugin->flags & HAL_COMPONENT_WHOLE_NAMES;
}

/// By character: whether a name may contain it. Netlists, the shell or a file name would read the
/// others otherwise.
constexpr std::array<bool, 256> valid_in_names = [] {
    std::array<bool, 256> valid{};
    std::fill(valid.begin() + ' ' + 1, valid.end(), true);
    valid[0x7f] = false;
    for (const char c : std::string_view("\"'`#$\\=,[](){}<>|&;*?")) {
        valid[static_cast<unsigned char>(c)] = false;
    }
    return valid;
}();

bool good_name(std::string_view name) {
    return std::all_of(name.begin(), name.end(),
                       [](char c) { return valid_in_names[static_cast<unsigned char>(c)]; });
}

/// Why the safe value of a pin is invalid, or "". Infinity is valid where it means something, as for
/// an age.
std::string safe_value_problem(const hal_pin_decl& decl) {
    if (!(decl.flags & HAL_PIN_SAFE) || decl.type != HAL_TYPE_FLOAT) return "";
    if (std::isfinite(decl.safe.real)) return "";
    const std::string value = "declares the safe value " + format_value(HAL_TYPE_FLOAT, decl.safe);
    if (std::isnan(decl.safe.real)) return value + "; it must be a number";
    return decl.flags & HAL_PIN_FINITE ? value + ", although it is declared finite" : "";
}

bool take_pin(const hal_host* host, const hal_pin_decl* decl, hal_pin* memory) {
    Construction& c = construction_of(host);
    if (decl->size < HAL_PIN_DECL_SIZE_1_0 || !decl->name || !*decl->name || !memory ||
        decl->type < HAL_TYPE_BIT || decl->type > HAL_TYPE_PORT || decl->dir < HAL_DIR_IN ||
        decl->dir > HAL_DIR_PARAM) {
        return refuse(
            c,
            "invalid pin declaration: name, memory, type or direction is missing or out of range");
    }
    if (!good_name(decl->name)) {
        return refuse(c, "it declares a pin with the invalid name '" + std::string(decl->name) +
                             "': letters, digits and - _ . : are valid");
    }
    if (const std::string problem = safe_value_problem(*decl); !problem.empty()) {
        return refuse(c, "pin '" + std::string(decl->name) + "' " + problem);
    }
    auto pin = std::make_unique<Pin>();
    const bool whole = c.whole_pin_names || whole_names(c.instance);
    pin->name = whole ? decl->name : c.instance.name + "." + decl->name;
    pin->type = decl->type;
    pin->dir = decl->dir;
    pin->flags = decl->flags;
    pin->doc = c.model.keep(decl->doc ? decl->doc : "");
    pin->unit = c.model.keep(decl->unit ? decl->unit : "");
    pin->initial = decl->initial;
    pin->safe = decl->safe;
    pin->memory = memory;
    pin->instance = &c.instance;
    pin->id = c.model.next_id++;
    memory->own = decl->initial;
    memory->slot = &memory->own;
    if (decl->size >= sizeof *decl && decl->pointer) {
        pin->pointer = decl->pointer;
        *decl->pointer = memory->slot;
    }
    if (decl->function && std::none_of(c.functions.begin(), c.functions.end(), [&](const auto& f) {
        return f.identity == decl->function;
    })) {
        return refuse(c, "pin '" + std::string(decl->name) +
                             "' uses a function that is declared below it; move that member up");
    }
    c.pins.emplace_back(std::move(pin), decl->function);
    return true;
}

bool take_function(const hal_host* host, const hal_function_decl* decl) {
    Construction& c = construction_of(host);
    if (decl->size < HAL_FUNCTION_DECL_SIZE_1_0 || !decl->name || !decl->step) {
        return refuse(c, "invalid function declaration: name or step is null");
    }
    if (decl->flags & HAL_FUNCTION_EMERGENCY) {
        c.instance.emergency.push_back({decl->step, decl->self});
        return true;
    }
    if (!good_name(decl->name)) {
        return refuse(c, "it declares a function with the invalid name '" +
                             std::string(decl->name) + "': letters, digits and - _ . : are valid");
    }
    const bool shared = decl->flags & HAL_FUNCTION_SHARED;
    const bool whole = c.whole_function_names || whole_names(c.instance);
    std::string full = decl->name;
    if (!whole) {
        full = shared ? dashed(c.instance.component->name) : c.instance.name;
    }
    if (*decl->name && !whole) {
        full += std::string(".") + decl->name;
    }
    if (std::any_of(c.functions.begin(), c.functions.end(),
                    [&](const auto& other) { return other.full == full; })) {
        return refuse(c, "it declares function '" + full +
                             "' twice; only one of them could be added to a thread");
    }
    c.functions.push_back({std::move(full), decl->doc ? decl->doc : "", decl->step,
                           decl->size >= sizeof *decl ? decl->row : nullptr, decl->self,
                           decl->identity, shared, (decl->flags & HAL_FUNCTION_REQUIRED) != 0});
    return true;
}

void note_list(Construction& c, const char* argument, std::size_t length) {
    if (length <= c.list_length) return;
    c.list_length = length;
    c.max_list = argument;
}

const char* find_argument(const hal_host* host, const hal_argument_decl* decl) {
    Construction& c = construction_of(host);
    c.asked.insert(decl->name);
    if (std::strcmp(decl->name, "personality") == 0 && !c.personality.empty()) {
        return c.personality.c_str();
    }
    const auto given = c.request.arguments.find(decl->name);
    if (given == c.request.arguments.end()) return decl->fallback;
    if (!(decl->flags & HAL_ARGUMENT_PER_INSTANCE)) return given->second.value.c_str();
    const auto elements = split(given->second.value, ',');
    c.uses[decl->name] = LoadArgument::Use::per_instance;
    note_list(c, decl->name, elements.size());
    c.lists[decl->name] = {elements.size(), decl->fallback ? decl->fallback : ""};
    if (c.number >= elements.size()) return decl->fallback;
    c.texts.push_back(elements[c.number]);
    return c.texts.back().c_str();
}

bool declare_pin(const hal_host* host, const hal_pin_decl* decl, hal_pin* memory) {
    return guarded(construction_of(host), false, [&] { return take_pin(host, decl, memory); });
}
bool declare_function(const hal_host* host, const hal_function_decl* decl) {
    return guarded(construction_of(host), false, [&] { return take_function(host, decl); });
}
const char* give_argument(const hal_host* host, const hal_argument_decl* decl) {
    return guarded(construction_of(host), decl->fallback,
                   [&] { return find_argument(host, decl); });
}
void* allocate(const hal_host* host, std::size_t bytes, std::size_t align) {
    void* const memory = allocate_for(construction_of(host).instance, bytes, align);
    construction_of(host).no_memory = construction_of(host).no_memory || !memory;
    return memory;
}
void record_failure(const hal_host* host, const char* reason) {
    guarded(construction_of(host), false,
            [&] { return refuse(construction_of(host), std::string(reason ? reason : "")); });
}
void record_rejection(const hal_host* host, const hal_rejection* rejection) {
    Construction& c = construction_of(host);
    guarded(c, false, [&] {
        if (rejection->size < sizeof *rejection) {
            return refuse(c, "unsupported hal_rejection of " + std::to_string(rejection->size) +
                                 " bytes; rebuild the component");
        }
        return refuse(c, copy_of(*rejection));
    });
}

// Names that LinuxCNC makes otherwise than COMPONENT.N.
void name_instance(const hal_host* host, const char* prefix, unsigned digits) {
    Construction& c = construction_of(host);
    guarded(c, false, [&] {
        if (!c.pins.empty() || !c.functions.empty()) {
            return refuse(c, "an instance is named before its first pin");
        }
        if (c.serial.empty()) {
            return true;  // it has a name of its own
        }
        std::string number = c.serial;
        if (number.size() < digits) {
            number.insert(0, digits - number.size(), '0');
        }
        c.instance.name = std::string(prefix) + "." + number;
        return true;
    });
}
constexpr hal_pin_names pin_names_extension{
    sizeof pin_names_extension,
    [](const hal_host* host, bool whole) { construction_of(host).whole_pin_names = whole; }};

bool declare_variable(const hal_host* host, const hal_variable* variable) {
    Construction& c = construction_of(host);
    return guarded(c, false, [&] {
        if (variable->size < sizeof *variable) {
            return refuse(c, "unsupported hal_variable of " + std::to_string(variable->size) +
                                 " bytes; rebuild the component");
        }
        c.instance.variables.push_back(
            {variable->name, variable->type, variable->memory, variable->bytes});
        return true;
    });
}
constexpr hal_retained retained_extension{sizeof retained_extension, 0, declare_variable};

bool is_assumed(const hal_host* host, const char* name) {
    const Construction& c = construction_of(host);
    return c.edit != nullptr && c.edit->absences().is_assumed(name);
}

const char* argument_of_program(const hal_host* host, const char* program) {
    const Construction& c = construction_of(host);
    const std::string* const argument =
        c.edit != nullptr ? c.edit->absences().argument_of(program) : nullptr;
    return argument ? argument->c_str() : nullptr;
}

bool request_hardware(const hal_host* host) {
    Construction& c = construction_of(host);
    c.hardware_denied = c.request.on != nullptr && !c.request.on->hardware_allowed;
    return !c.hardware_denied;
}

constexpr hal_hardware hardware_extension{sizeof hardware_extension, request_hardware};
constexpr hal_assumed assumed_extension{sizeof assumed_extension, is_assumed};
constexpr hal_unstarted unstarted_extension{sizeof unstarted_extension, argument_of_program};

const void* extension_of(const hal_host* host, const char* id) {
    if (std::strcmp(id, "hal.faults/1") == 0) return construction_of(host).request.faults;
    if (std::strcmp(id, HAL_NAMING) == 0) return &naming_extension;
    if (std::strcmp(id, HAL_PIN_NAMES) == 0) return &pin_names_extension;
    if (std::strcmp(id, HAL_ASSUMED) == 0) return &assumed_extension;
    if (std::strcmp(id, HAL_HARDWARE) == 0) return &hardware_extension;
    if (std::strcmp(id, HAL_UNSTARTED) == 0) return &unstarted_extension;
    if (std::strcmp(id, HAL_RETAINED) == 0) return &retained_extension;
    if (std::strcmp(id, HAL_MODULES) == 0) return &modules_extension;
    if (std::strcmp(id, HAL_MODULE_CALLS) == 0) return &module_calls_extension;
    return std::strcmp(id, HAL_TEXTS) == 0 ? &texts_extension : nullptr;
}

}  // namespace

Code failure_code(std::string_view given, Code usual) {
    const std::optional<Code> known = Code::named(given);
    return known.value_or(usual);
}

Failure copy_of(const hal_rejection& rejection) {
    const auto text = [](const char* t) { return t ? t : ""; };
    return {text(rejection.text), text(rejection.name), text(rejection.code), text(rejection.help),
            rejection.subject,    rejection.begin,      rejection.end};
}

bool refuse(Construction& c, std::string why) { return refuse(c, Failure{.text = std::move(why)}); }

bool refuse(Construction& c, Failure failure) {
    if (c.failure.empty()) {
        c.failure = std::move(failure);
    }
    return false;
}

constexpr hal_naming naming_extension{sizeof naming_extension, name_instance,
                                      [](const hal_host* host) {
    construction_of(host).whole_function_names = true;
}, [](const hal_host* host, const char* argument, uint64_t instances) {
    Construction& c = construction_of(host);
    c.declared_count = static_cast<std::size_t>(instances);
    guarded(c, false, [&] {
        note_list(c, argument, c.declared_count);
        return c.uses.emplace(argument, LoadArgument::Use::count).second;
    });
}, [](const hal_host* host) { return construction_of(host).instance.name.c_str(); }};

hal_host host_for(Construction& c) {
    return {sizeof(hal_host), &c,       declare_pin,    declare_function,
            give_argument,    allocate, record_failure, extension_of,
            record_rejection};
}

}  // namespace hal
