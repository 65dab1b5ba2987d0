// SPDX-License-Identifier: MIT
#include "model/link_edit.hpp"

#include <algorithm>

#include "model/namesakes.hpp"
#include "text/netlist_name.hpp"
#include "text/quoting.hpp"

namespace hal {
namespace {

template <class T>
std::vector<std::string> names(const NameTable<T>& index) {
    std::vector<std::string> all;
    all.reserve(index.size());
    for (const auto& [name, object] : index) {
        all.emplace_back(name);
    }
    return all;
}

// "inputs of pos (pid): enable, command" for a name that begins with an instance's
std::string pins_of_instance(const Model& model, std::string_view name) {
    for (auto dot = name.rfind('.'); dot != std::string_view::npos && dot != 0;
         dot = name.rfind('.', dot - 1)) {
        const Instance* const instance = model.find_instance(name.substr(0, dot));
        if (!instance) continue;
        std::vector<std::string> pins;
        for (const auto& pin : instance->pins) {
            pins.push_back(pin->name.substr(dot + 1));
        }
        return "pins of " + instance->name + " (" + instance->component->name +
               "): " + listed(pins, 16);
    }
    return {};
}

hal_value load(const hal_value& slot) {
    return {.raw = __atomic_load_n(&slot.raw, __ATOMIC_RELAXED)};
}

/// The pin is among those of the signal.
void count(Pin& pin, Signal& signal) {
    pin.signal = &signal;
    if (pin.dir == HAL_DIR_OUT) {
        signal.writer = &pin;
    } else if (pin.dir == HAL_DIR_IN) {
        ++signal.readers;
    } else if (pin.dir == HAL_DIR_IO) {
        ++signal.ios;
    }
}

/// The opposite of count().
void uncount(Pin& pin, Signal& signal) {
    pin.signal = nullptr;
    if (pin.dir == HAL_DIR_OUT) {
        signal.writer = nullptr;
    } else if (pin.dir == HAL_DIR_IN) {
        --signal.readers;
    } else if (pin.dir == HAL_DIR_IO) {
        --signal.ios;
    }
}

/// Returns the arrow of `net` that a text like `->` stands for; empty for any other text.
std::string_view meant_arrow(std::string_view text) {
    constexpr std::pair<std::string_view, std::string_view> others[] = {
        {"\u2192", "=>"}, {"\u21d2", "=>"},  {"\u2190", "<="},
        {"\u21d0", "<="}, {"\u2194", "<=>"}, {"\u21d4", "<=>"}};
    for (const auto& [other, arrow] : others) {
        if (text == other) return arrow;
    }
    if (text.find_first_not_of("-=<>") != text.npos) return {};
    const bool left = text.find('<') != text.npos;
    const bool right = text.find('>') != text.npos;
    if (left && right) return "<=>";
    if (left) return "<=";
    return right ? "=>" : "";
}

/// Returns what to write in place of another arrow; empty for any other text.
std::string arrow_help(std::string_view text) {
    if (text == "=") return "delete it, or write one of the arrows =>, <= and <=>";
    const std::string_view arrow = meant_arrow(text);
    if (arrow.empty()) return {};
    return "write " + hal::quoted(arrow) + "; arrows may also be left out";
}

std::string nothing_yet(std::string_view kind) { return "no " + std::string(kind) + "s exist yet"; }

/// What to type where an output and an I/O pin meet.
std::string io_help(hal_type type, const std::string& command) {
    std::string help =
        "I/O pins can share a signal only with other I/O pins and inputs; " + command;
    if (type == HAL_TYPE_FLOAT) {
        help += "; or copy the output in each cycle: loadrt lincurve, whose out-io is an I/O pin";
    }
    return help;
}

}  // namespace

std::string conversion(hal_type from, hal_type to) {
    if (from == to || !row(from).number || !row(to).number) {
        return {};
    }
    if (from == HAL_TYPE_BIT || to != HAL_TYPE_BIT || from == HAL_TYPE_S32 ||
        from == HAL_TYPE_U32) {
        return std::string("conv_") + name(from) + "_" + name(to);
    }
    return {};
}

void LinkEdit::unknown_name(Code code, Word name, const char* what, NameGroup group,
                            std::string help) {
    UnknownName unknown{.name = std::string(name.text),
                        .group = static_cast<std::uint32_t>(group),
                        .before = model_.next_id};
    diagnostics->error(code, name.span,
                       std::string("unknown ") + what + " " + hal::quoted(name.text),
                       std::move(unknown), std::move(help));
}

Pin* LinkEdit::pin(Word name) {
    if (Pin* const found = model_.find_pin(name.text)) return found;
    if (is_absent(name.text, Absences::Kind::pin)) return nullptr;
    std::string help = arrow_help(name.text);
    if (help.empty()) {
        help = namesake_help(model_, name.text);
    }
    if (help.empty()) {
        help = pins_of_instance(model_, name.text);
    }
    if (model_.find_signal(name.text)) {
        help = hal::quoted(name.text) +
               " is a signal; gets and sets take signals, net takes one signal and then pins";
    }
    if (help.empty() && model_.pin.empty()) {
        help = nothing_yet("pin") + "; loadrt creates instances with pins";
    }
    unknown_name("no-such-pin", name, "pin", NameGroup::pins, std::move(help));
    return nullptr;
}

Signal* LinkEdit::signal(Word name) {
    if (Signal* const found = model_.find_signal(name.text)) return found;
    if (is_absent(name.text, Absences::Kind::signal)) return nullptr;
    std::string help;
    if (model_.find_pin(name.text)) {
        help = hal::quoted(name.text) + " is a pin; getp, setp and unlinkp take pins";
    } else if (model_.signal.empty()) {
        help = nothing_yet("signal") + "; net creates signals";
    }
    unknown_name("no-such-signal", name, "signal", NameGroup::signals, std::move(help));
    return nullptr;
}

LoadedFunction* LinkEdit::function(Word name) {
    if (LoadedFunction* const found = model_.find_function(name.text)) return found;
    if (is_absent(name.text, Absences::Kind::function)) return nullptr;
    std::string help;
    if (const Instance* const instance = model_.find_instance(name.text)) {
        std::vector<std::string> own;
        for (const LoadedFunction* function : instance->functions) {
            own.push_back(function->name);
        }
        if (!own.empty()) {
            help = "functions of " + instance->name + ": " + listed(own);
        }
    }
    unknown_name("no-such-function", name, "function", NameGroup::functions, std::move(help));
    return nullptr;
}

Thread* LinkEdit::thread(Word name) {
    if (Thread* const found = model_.find_thread(name.text)) return found;
    if (is_absent(name.text, Absences::Kind::thread)) return nullptr;
    const std::string help =
        model_.threads.empty()
            ? "create one first: loadrt threads name1=servo-thread period1=1000000"
            : "threads: " + listed(names(model_.thread));
    fail("no-such-thread", name.span, "unknown thread " + hal::quoted(name.text),
         did_you_mean(name.text, names(model_.thread)), help);
    return nullptr;
}

bool LinkEdit::check_name(const char* kind, Word name) {
    const std::string problem = name_problem(name.text);
    if (problem.empty()) return true;
    return fail("invalid-name", name.span,
                "a netlist cannot contain the " + std::string(kind) + " name " +
                    hal::quoted(shown_name(name.text)) + ": " + problem,
                "", "use letters, digits and - _ . :");
}

Signal* LinkEdit::add_signal(Word name, hal_type type, Span typed_at) {
    if (!check_name("signal", name)) return nullptr;
    if (const Signal* const there = model_.find_signal(name.text)) {
        fail("name-taken", name.span, "signal " + hal::quoted(name.text) + " already exists",
             "second time", Other{there->made, "created here"});
        return nullptr;
    }
    if (model_.find_pin(name.text)) {
        fail("signal-named-like-pin", name.span,
             "signal name " + hal::quoted(name.text) + " is the name of a pin", "a pin",
             "write the signal's name first: net SIGNAL " + std::string(name.text));
        return nullptr;
    }
    auto owned = std::make_unique<Signal>();
    Signal* const made = owned.get();
    made->name = name.text;
    made->type = type;
    made->made = name.span;
    made->typed = typed_at.known() ? typed_at : name.span;
    made->slot = &made->value;
    made->index = model_.signals.size();
    made->id = model_.next_id++;
    make_room(model_.signals);
    on_undo([this, made] {
        model_.signal.erase(made->name);
        std::swap(model_.signals[made->index], model_.signals.back());
        model_.signals[made->index]->index = made->index;
        // a thread may know its buffer
        removed_.signals.push_back(std::move(model_.signals.back()));
        model_.signals.pop_back();
    });
    model_.signals.push_back(std::move(owned));
    model_.signal.emplace(made->name, made);
    return made;
}

bool LinkEdit::remove_signal(Word name) {
    Signal* const leaving = signal(name);
    if (!leaving) return false;
    while (!leaving->pins.empty()) {
        unlink(*leaving->pins.back());
    }
    make_room(removed_.signals);
    on_undo([this, leaving] {
        auto at = std::find_if(removed_.signals.begin(), removed_.signals.end(),
                               [&](const auto& s) { return s.get() == leaving; });
        leaving->index = model_.signals.size();
        model_.signals.push_back(std::move(*at));
        removed_.signals.erase(at);
        model_.signal.emplace(leaving->name, leaving);
    });
    model_.signal.erase(leaving->name);
    std::swap(model_.signals[leaving->index], model_.signals.back());
    model_.signals[leaving->index]->index = leaving->index;
    removed_.signals.push_back(std::move(model_.signals.back()));
    model_.signals.pop_back();
    signal_values.erase(leaving);
    inherited.erase(leaving);
    structural_ = true;
    return true;
}

bool LinkEdit::remove_all_signals() {
    while (!model_.signals.empty()) {
        remove_signal({model_.signals.back()->name, {}});
    }
    return true;
}

/// The rules about one pin and one signal. False after reporting.
bool LinkEdit::check_link(const Pin& pin, const Signal& signal, Word word) {
    const std::string pin_name(word.text);
    if (pin.dir == HAL_DIR_PARAM) {
        return fail("parameter-link", word.span,
                    hal::quoted(pin_name) + " is a parameter and cannot be linked", "parameter",
                    "set it: setp " + pin_name + " VALUE");
    }
    if (pin.signal) {
        return fail("pin-linked", word.span,
                    "pin " + hal::quoted(pin_name) + " is already linked to signal " +
                        hal::quoted(pin.signal->name),
                    "second signal", Other{pin.linked_at, "first signal"},
                    "unlink it first: unlinkp " + pin_name);
    }
    if (pin.type != signal.type) {
        const bool writes = pin.dir == HAL_DIR_OUT;
        const std::string convert =
            writes ? conversion(pin.type, signal.type) : conversion(signal.type, pin.type);
        std::string help;
        if (!convert.empty()) {
            help = "convert with " + convert + ": loadrt " + convert + " names=" + signal.name +
                   "-conv";
        }
        return fail(
            "type-mismatch", word.span,
            "signal " + hal::quoted(signal.name) + " carries " + name(signal.type) + ", pin " +
                hal::quoted(pin_name) + " is " + name(pin.type),
            name(pin.type),
            Other{signal.typed, "the signal became " + std::string(name(signal.type)) + " here"},
            std::move(help));
    }
    return check_writers(pin, signal, word);
}

/// The rules about all pins of a signal. False after reporting.
bool LinkEdit::check_writers(const Pin& pin, const Signal& signal, Word word) {
    const std::string of_signal = "signal " + hal::quoted(signal.name);
    const auto first = [&](hal_dir dir) {
        return (*std::ranges::find(signal.pins, dir, &Pin::dir))->linked_at;
    };
    const bool is_output = pin.dir == HAL_DIR_OUT;
    if (is_output && signal.writer) {
        return fail("two-writers", word.span, of_signal + " already has a writer", "second output",
                    Other{signal.writer->linked_at, "first output"},
                    "a signal has one output pin; join two sources with sum2, or2 or mux2");
    }
    if (is_output && signal.ios != 0) {
        return fail(
            "two-writers", word.span,
            of_signal + " already has I/O pins, so it cannot have an output", "output",
            Other{first(HAL_DIR_IO), "I/O pin"},
            io_help(pin.type, "set its I/O pins by a command: sets " + signal.name + " VALUE"));
    }
    if (pin.dir == HAL_DIR_IO && signal.writer) {
        return fail("two-writers", word.span,
                    of_signal + " already has a writer, so it cannot have an I/O pin", "I/O pin",
                    Other{signal.writer->linked_at, "output"},
                    io_help(pin.type, "leave the pin unlinked and set it: setp " +
                                          std::string(word.text) + " VALUE"));
    }
    if (pin.type == HAL_TYPE_PORT && pin.dir == HAL_DIR_IN && signal.readers != 0) {
        return fail("two-readers", word.span, "port " + of_signal + " already has a reader",
                    "second reader", Other{first(HAL_DIR_IN), "first reader"},
                    "a byte stream has one writer and one reader");
    }
    return true;
}

bool LinkEdit::link(Pin& pin, Signal& signal, Word word, Arrow arrow) {
    if (pin.signal == &signal) return true;
    if (!check_link(pin, signal, word)) return false;

    // LinuxCNC: the first reader, or a writer of a signal without readers, hands its own value to the
    // signal.
    const bool unwritten = !signal.writer && signal.ios == 0;
    const bool hands_value = pin.dir != HAL_DIR_IN || signal.readers == 0;
    if (pin.type != HAL_TYPE_PORT && unwritten && hands_value) {
        signal_values.erase(&signal);
        inherited[&signal] = &pin;
    }
    make_room(signal.pins);
    on_undo([&pin, &signal, linked_before = pin.linked_at, in_before = pin.arrow_in,
             out_before = pin.arrow_out] {
        signal.pins.erase(std::find(signal.pins.rbegin(), signal.pins.rend(), &pin).base() - 1);
        uncount(pin, signal);
        pin.linked_at = linked_before;
        pin.arrow_in = in_before;
        pin.arrow_out = out_before;
    });
    signal.pins.push_back(&pin);
    count(pin, signal);
    pin.linked_at = word.span;
    pin.arrow_in = arrow == Arrow::to_pin;
    pin.arrow_out = arrow == Arrow::from_pin;
    structural_ = true;
    return true;
}

/// The pin keeps the signal's value, which may be one that this very transaction set or let it
/// inherit.
void LinkEdit::keep_signal_value(Pin& pin, const Signal& signal) {
    if (pin.type == HAL_TYPE_PORT) return;
    if (const auto set = signal_values.find(&signal); set != signal_values.end()) {
        pin_values[&pin] = set->second;
        return;
    }
    if (const auto given = inherited.find(&signal);
        given != inherited.end() && given->second != &pin) {
        Pin& giver = *given->second;
        const auto own = pin_values.find(&giver);
        const hal_value value = own != pin_values.end() ? own->second : load(*present(giver).slot);
        pin_values[&pin] = value;
        return;
    }
    // of no thread: it has no slot where the value is
    if (!pin.home && (signal.home || signal.cell)) {
        pin_values[&pin] = load(*signal.slot);
    }
}

void LinkEdit::unlink(Pin& pin) {
    Signal* const signal = pin.signal;
    if (!signal) return;
    // a signal with many pins loses them from either end
    const auto at = signal->pins.back() == &pin
                        ? signal->pins.end() - 1
                        : std::find(signal->pins.begin(), signal->pins.end(), &pin);
    keep_signal_value(pin, *signal);
    on_undo([signal, &pin, position = at - signal->pins.begin()] {
        signal->pins.insert(signal->pins.begin() + position, &pin);
        count(pin, *signal);
    });
    signal->pins.erase(at);
    uncount(pin, *signal);
    structural_ = true;
}

void LinkEdit::keep_value(Pin& pin) {
    const hal_value before = *pin.memory->slot;
    on_undo([&pin, before] { *pin.memory->slot = before; });
}

void LinkEdit::warn_of_wrap(Word value, hal_type type, const Parsed& parsed) {
    if (parsed.warning.empty()) return;
    const std::string result = format_value(type, parsed.value);
    diagnostics->add(
        {Severity::warning,
         "value-wraps",
         parsed.warning + ": " + result + " is set",
         {{value.span, "keeps its low 32 bits"}},
         {"LinuxCNC 2.9 does the same, 2.10 rejects it; write " + result + " if that is meant"}});
}

/// The rules about a pin whose value is set. False after reporting.
bool LinkEdit::check_settable(const Pin& target, Word name, Word value) {
    if (target.dir == HAL_DIR_OUT) {
        return fail("output-set", name.span,
                    "pin " + hal::quoted(name.text) + " is an output: only its component writes it",
                    "output");
    }
    if (target.read_only()) {
        return fail(
            "output-set", name.span,
            "parameter " + hal::quoted(name.text) + " is read-only: only its component sets it",
            "read-only");
    }
    if (const Signal* const signal = target.signal) {
        const std::string help =
            signal->writer ? "the value comes from '" + signal->writer->name +
                                 "'; to set it by hand: unlinkp " + std::string(name.text)
                           : "set the signal: sets " + signal->name + " " + std::string(value.text);
        return fail("linked-set", name.span,
                    "pin " + hal::quoted(name.text) + " takes its value from signal " +
                        hal::quoted(signal->name),
                    "linked", Other{target.linked_at, "linked here"}, help);
    }
    if (target.type == HAL_TYPE_PORT) {
        return fail("bad-value", value.span, "a port pin has no value to set", "",
                    "link it and allocate the buffer of the signal: sets SIGNAL BYTES");
    }
    return true;
}

bool LinkEdit::set_pin(Word name, Word value) {
    Pin* const target = pin(name);
    if (!target || !check_settable(*target, name, value)) return false;
    const Parsed parsed = parse_wrapping(target->type, value.text);
    if (!parsed.problem.empty()) {
        const char* const kind = target->dir == HAL_DIR_PARAM ? "parameter " : "pin ";
        return fail("bad-value", value.span, parsed.problem,
                    kind + hal::quoted(name.text) + " is " + hal::name(target->type));
    }
    warn_of_wrap(value, target->type, parsed);
    if (target->home) {
        pin_values[target] = parsed.value;
    } else {
        keep_value(*target);
        *target->memory->slot = parsed.value;
        pin_values.erase(target);
    }
    return true;
}

/// Gives a port signal its buffer. False after reporting.
bool LinkEdit::allocate_port(Signal& target, Word name, Word value) {
    constexpr std::uint32_t max_size = 1u << 30;
    const Parsed bytes = parse_value(HAL_TYPE_U32, value.text);
    if (!bytes.problem.empty() || bytes.value.u32 == 0 || bytes.value.u32 > max_size) {
        return fail("bad-value", value.span,
                    hal::quoted(value.text) + " is not a buffer size in bytes (1 to 1073741824)",
                    "port signal");
    }
    if (target.port) {
        return fail("port-sized", name.span,
                    "port signal " + hal::quoted(name.text) + " already has a buffer", "",
                    "its size is fixed once set");
    }
    auto buffer = std::make_unique<std::uint8_t[]>(bytes.value.u32);
    auto made = std::make_unique<hal_port>(hal_port{bytes.value.u32, 0, 0, 0, buffer.get()});
    signal_values[&target] = hal_value{.port = made.get()};
    on_undo([this, &target] {
        removed_.ports.push_back(std::move(target.port));  // a thread may know it
        target.value.port = nullptr;
    });
    buffer.release();
    target.port = {made.release(), [](hal_port* p) {
        delete[] p->data;
        delete p;
    }};
    target.value.port = target.port.get();
    structural_ = true;
    return true;
}

bool LinkEdit::set_signal(Word name, Word value) {
    Signal* const target = signal(name);
    if (!target) return false;
    if (target->type == HAL_TYPE_PORT) return allocate_port(*target, name, value);
    if (const Pin* const writer = target->writer) {
        return fail(
            "writer-set", name.span,
            "signal " + hal::quoted(name.text) + " is written by " + hal::quoted(writer->name),
            "has a writer", Other{writer->linked_at, "linked here"},
            "to set it by hand, unlink the writer first: unlinkp " + writer->name);
    }
    const Parsed parsed = parse_wrapping(target->type, value.text);
    if (!parsed.problem.empty()) {
        return fail("bad-value", value.span, parsed.problem,
                    "signal " + hal::quoted(name.text) + " is " + hal::name(target->type));
    }
    warn_of_wrap(value, target->type, parsed);
    signal_values[target] = parsed.value;
    inherited.erase(target);
    return true;
}

/// Sets or clears the alias of a pin, and the index with it.
void LinkEdit::change_alias(Pin& pin, std::string alias) {
    on_undo([this, &pin, before = pin.alias] {
        if (!pin.alias.empty()) {
            model_.pin.erase(pin.alias);
        }
        pin.alias = before;
        if (!pin.alias.empty()) {
            model_.pin.emplace(pin.alias, &pin);
        }
    });
    if (!pin.alias.empty()) {
        model_.pin.erase(pin.alias);
    }
    pin.alias = std::move(alias);
    if (!pin.alias.empty()) {
        model_.pin.emplace(pin.alias, &pin);
    }
    ++model_.next_id;  // similar names are looked up among those that existed
}

bool LinkEdit::alias(Word name, Word second) {
    Pin* const target = pin(name);
    if (!target || !check_name("alias", second)) return false;
    if (model_.find_pin(second.text)) {
        return fail("name-taken", second.span,
                    "pin or alias " + hal::quoted(second.text) + " already exists");
    }
    if (model_.find_signal(second.text)) {
        return fail("name-taken", second.span,
                    "signal " + hal::quoted(second.text) + " already exists");
    }
    change_alias(*target, std::string(second.text));
    return true;
}

bool LinkEdit::unalias(Word name) {
    Pin* const target = pin(name);
    if (!target) return false;
    if (!target->alias.empty()) {
        change_alias(*target, {});
    }
    return true;
}

}  // namespace hal
