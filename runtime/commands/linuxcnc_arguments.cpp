// SPDX-License-Identifier: MIT
#include "commands/linuxcnc_arguments.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <string_view>
#include <vector>

#include "text/find_row.hpp"
#include "text/quoting.hpp"

namespace hal {

namespace {

/// How LinuxCNC's loader reads a value: numbers as strtol(3) does, lists are separated by commas.
enum class Reading : std::uint8_t { number, numbers, text, texts };

struct ModuleArgument {
    std::string_view module, name;
    Reading reading;
    std::size_t max_count = 1;
    std::int64_t min = INT64_MIN;
    std::int64_t max = INT64_MAX;
    bool required = false;
};

constexpr std::int64_t any = INT64_MAX;
constexpr bool required = true;

/// The parameters that the modules of LinuxCNC 2.9 declare. A row without range takes any value.
constexpr ModuleArgument module_arguments[] = {
    {"threads", "name1", Reading::text},
    {"threads", "period1", Reading::number},
    {"threads", "fp1", Reading::number},
    {"threads", "name2", Reading::text},
    {"threads", "period2", Reading::number},
    {"threads", "fp2", Reading::number},
    {"threads", "name3", Reading::text},
    {"threads", "period3", Reading::number},
    {"threads", "fp3", Reading::number},
    {"counter", "num_chan", Reading::number, 1, 1, 8},
    {"debounce", "cfg", Reading::numbers, 8, 1, 50, required},
    {"encoder", "num_chan", Reading::number, 1, 0, 8},
    {"encoder", "names", Reading::texts, 8},
    {"encoder_ratio", "num_chan", Reading::number, 1, 0, 8},
    {"encoder_ratio", "names", Reading::texts, 8},
    {"enum", "enums", Reading::texts, 256, 0, any, required},
    {"enum", "names", Reading::texts, 256},
    {"lcd", "fmt_strings", Reading::texts, 16, 0, any, required},
    {"matrix_kb", "config", Reading::texts, 8},
    {"matrix_kb", "names", Reading::texts, 8},
    {"modmath", "mod_dir", Reading::number, 1, 1, any, required},
    {"mux_generic", "config", Reading::texts, 100, 0, any, required},
    {"pid", "num_chan", Reading::number, 1, 0, 16},
    {"pid", "names", Reading::texts, 16},
    {"pid", "debug", Reading::number},
    {"pwmgen", "output_type", Reading::numbers, 8, 0, 2, required},
    {"sampler", "cfg", Reading::texts, 8, 0, any, required},
    {"sampler", "depth", Reading::numbers, 8, INT64_MIN, any, required},
    {"siggen", "num_chan", Reading::number, 1, 0, 16},
    {"siggen", "names", Reading::texts, 16},
    {"sim_encoder", "num_chan", Reading::number, 1, 0, 8},
    {"sim_encoder", "names", Reading::texts, 8},
    {"stepgen", "step_type", Reading::numbers, 16, 0, 15, required},
    {"stepgen", "ctrl_type", Reading::texts, 16},
    {"stepgen", "user_step_type", Reading::numbers, 18},
    {"streamer", "cfg", Reading::texts, 8, 0, any, required},
    {"streamer", "depth", Reading::numbers, 8, INT64_MIN, any, required},
    {"supply", "num_chan", Reading::number, 1, 1, 16},
    {"watchdog", "num_inputs", Reading::number, 1, 1, 32, required},
    {"weighted_sum", "wsum_sizes", Reading::numbers, 8, 1, any, required},
};

/// Functions without floating point, by component; `suffix` is the end of their names, "" any.
/// Those of the last rows use it as soon as their instance has a pin of type float.
struct IntegerFunction {
    std::string_view component, suffix;
    bool unless_float_pins = false;
};
constexpr IntegerFunction integer_functions[] = {
    {"abs_s32", ""},
    {"and2", ""},
    {"bin2gray", ""},
    {"bitslice", ""},
    {"bitwise", ""},
    {"charge_pump", ""},
    {"counter", "update-counters"},
    {"dbounce", ""},
    {"debounce", ""},
    {"edge", ""},
    {"encoder", "update-counters"},
    {"encoder_ratio", "sample"},
    {"enum", ""},
    {"estop_latch", ""},
    {"flipflop", ""},
    {"gray2bin", ""},
    {"latencybins", ""},
    {"logic", ""},
    {"lut5", ""},
    {"maj3", ""},
    {"match8", ""},
    {"message", ""},
    {"multiclick", ""},
    {"not", ""},
    {"or2", ""},
    {"pwmgen", "make-pulses"},
    {"sample_hold", ""},
    {"select8", ""},
    {"sim_encoder", "make-pulses"},
    {"sim_parport", ""},
    {"sphereprobe", ""},
    {"stepgen", "make-pulses"},
    {"threadtest", ""},
    {"timedelta", ""},
    {"toggle", ""},
    {"toggle2nist", ""},
    {"tristate_bit", ""},
    {"updown", ""},
    {"watchdog", "process"},
    {"xor2", ""},
    {"mux_generic", "", true},
    {"sampler", "", true},
    {"streamer", "", true},
};

/// NAME=VALUE; the quotes that the loader removes are not in the value.
struct Given {
    std::string name, value;
    Span at;
};

std::vector<Given> given_arguments(const Command& loadrt) {
    std::vector<Given> all;
    for (std::size_t i = 1; i < loadrt.args.size(); ++i) {
        const std::string& text = loadrt.args[i].text;
        const auto equals = text.find('=');
        if (equals == text.npos) continue;  // an error here, too
        std::string value = text.substr(equals + 1);
        std::erase(value, '"');
        all.push_back({text.substr(0, equals), std::move(value), loadrt.args[i].span});
    }
    return all;
}

std::vector<std::string> split(const std::string& list) {
    std::vector<std::string> parts;
    std::size_t from = 0;
    for (std::size_t at; (at = list.find(',', from)) != list.npos; from = at + 1) {
        parts.push_back(list.substr(from, at - from));
    }
    parts.push_back(list.substr(from));
    return parts;
}

/// As the loader does: decimal, 0x hexadecimal, 0 octal; nothing is 0.
std::optional<std::int64_t> parse_c_integer(const std::string& text) {
    char* end = nullptr;
    errno = 0;
    const long long number = std::strtoll(text.c_str(), &end, 0);
    if (*end != '\0' || errno != 0) return std::nullopt;
    return number;
}

bool is_list(const ModuleArgument& row) {
    return row.reading == Reading::numbers || row.reading == Reading::texts;
}

bool is_numeric(const ModuleArgument& row) {
    return row.reading == Reading::number || row.reading == Reading::numbers;
}

std::string range_text(const ModuleArgument& row) {
    if (row.max == any) return "at least " + std::to_string(row.min);
    return std::to_string(row.min) + ".." + std::to_string(row.max);
}

void check_number(const ModuleArgument& row, const std::string& text, Span at,
                  Diagnostics& diagnostics) {
    const std::string name(row.name);
    const auto number = parse_c_integer(text);
    if (!number) {
        diagnostics.error(
            "linuxcnc-argument", at,
            "LinuxCNC takes a whole number for " + name + ", not " + hal::quoted(text));
    } else if (*number < row.min || *number > row.max) {
        diagnostics.error("linuxcnc-argument", at,
                          "LinuxCNC's " + hal::quoted(row.module) + " rejects " + name + "=" + text,
                          "", "valid: " + range_text(row));
    }
}

void check_given(const ModuleArgument& row, const Given& given, Diagnostics& diagnostics) {
    const std::vector<std::string> values =
        is_list(row) ? split(given.value) : std::vector<std::string>{given.value};
    if (values.size() > row.max_count) {
        diagnostics.error("linuxcnc-argument", given.at,
                          "LinuxCNC's " + hal::quoted(row.module) + " takes at most " +
                              counted(row.max_count, "value") + " in " + std::string(row.name) +
                              "=, not " + std::to_string(values.size()));
        return;
    }
    if (!is_numeric(row)) return;
    for (const std::string& value : values) {
        check_number(row, value, given.at, diagnostics);
    }
}

std::vector<const ModuleArgument*> arguments_of(std::string_view module) {
    std::vector<const ModuleArgument*> all;
    for (const ModuleArgument& row : module_arguments) {
        if (row.module == module) {
            all.push_back(&row);
        }
    }
    return all;
}

/// Threads 2 and 3 have no defaults: LinuxCNC creates none without both arguments.
void check_threads(const std::vector<Given>& given, Diagnostics& diagnostics) {
    const auto find = [&](const std::string& name) {
        return std::find_if(given.begin(), given.end(),
                            [&](const Given& one) { return one.name == name; });
    };
    for (const std::string number : {"2", "3"}) {
        const auto name = find("name" + number);
        const auto period = find("period" + number);
        if ((name == given.end()) == (period == given.end())) continue;
        const Given& there = name == given.end() ? *period : *name;
        const std::string missing = (name == given.end() ? "name" : "period") + number + "=";
        diagnostics.error("linuxcnc-argument", there.at,
                          "LinuxCNC creates no thread of " + there.name + "= without " + missing,
                          "", "write both: name" + number + "=NAME period" + number + "=NS");
    }
}

const IntegerFunction* integer_function(const LoadedFunction& function) {
    return find_row_if(integer_functions, [&](const auto& row) {
        return row.component == function.component->name && function.name.ends_with(row.suffix);
    });
}

bool has_float_pins(const LoadedComponent& component, const LoadedFunction& function) {
    const auto is_float = [](const auto& pin) { return pin->type == HAL_TYPE_FLOAT; };
    return std::any_of(component.instances.begin(), component.instances.end(),
                       [&](const auto& instance) {
        const auto& own = instance->functions;
        return std::find(own.begin(), own.end(), &function) != own.end() &&
               std::any_of(instance->pins.begin(), instance->pins.end(), is_float);
    });
}

bool uses_floating_point(const LoadedFunction& function) {
    const IntegerFunction* const row = integer_function(function);
    return !row || (row->unless_float_pins && has_float_pins(*function.component, function));
}

}  // namespace

void check_linuxcnc_arguments(const Command& loadrt, Diagnostics& diagnostics) {
    if (loadrt.args.empty()) return;
    const std::string& module = loadrt.args[0].text;
    const auto rows = arguments_of(module);
    if (rows.empty()) return;
    const auto given = given_arguments(loadrt);
    for (const Given& one : given) {
        const auto row = std::find_if(rows.begin(), rows.end(),
                                      [&](const auto* r) { return r->name == one.name; });
        if (row != rows.end()) {
            check_given(**row, one, diagnostics);
            continue;
        }
        std::vector<std::string> names;
        for (const ModuleArgument* const known : rows) {
            names.emplace_back(known->name);
        }
        diagnostics.error(
            "linuxcnc-argument", one.at,
            "LinuxCNC's " + hal::quoted(module) + " has no argument " + hal::quoted(one.name), "",
            "its arguments: " + listed(names));
    }
    for (const ModuleArgument* const row : rows) {
        const bool is_given = std::any_of(given.begin(), given.end(), [&](const Given& one) {
            return one.name == row->name && !one.value.empty();
        });
        if (row->required && !is_given) {
            diagnostics.error(
                "linuxcnc-argument", loadrt.args[0].span,
                "LinuxCNC's " + hal::quoted(module) + " requires " + std::string(row->name) + "=");
        }
    }
    if (module == "threads") {
        check_threads(given, diagnostics);
    }
}

void LinuxcncFloatingPoint::load(const Command& loadrt) {
    if (loadrt.args.empty() || loadrt.args[0].text != "threads") return;
    const auto given = given_arguments(loadrt);
    for (const Given& one : given) {
        if (!one.name.starts_with("fp") || parse_c_integer(one.value) != 0) continue;
        const std::string number = one.name.substr(2);
        std::string thread = "thread" + number;
        for (const Given& other : given) {
            if (other.name == "name" + number) {
                thread = other.value;
            }
        }
        without_[thread] = one.at;
    }
}

void LinuxcncFloatingPoint::add(const Command& addf, const Model& model,
                                Diagnostics& diagnostics) const {
    if (addf.args.size() < 2) return;
    const auto thread = without_.find(addf.args[1].text);
    const LoadedFunction* const function = model.find_function(addf.args[0].text);
    if (thread == without_.end() || !function || !uses_floating_point(*function)) return;
    Diagnostic found{Severity::error,
                     "linuxcnc-argument",
                     "LinuxCNC up to 2.9.8 does not add " + hal::quoted(addf.args[0].text) +
                         ", which uses floating point, to a thread without it",
                     {{addf.args[0].span, ""}, {thread->second, "without floating point"}},
                     {"remove " + std::string("fpN=0 from loadrt threads")}};
    diagnostics.add(std::move(found));
}

}  // namespace hal
