// SPDX-License-Identifier: MIT
#include "session/construct.hpp"

#include <algorithm>
#include <cstring>
#include <deque>
#include <filesystem>
#include <set>

#include "execute/executor.hpp"
#include "hal/naming.h"
#include "hal/texts.h"
#include "hal/way.h"

namespace hal {

std::string dashed(std::string text) {
    std::replace(text.begin(), text.end(), '_', '-');
    return text;
}

namespace {

std::vector<std::string> split(const std::string& text, char by) {
    std::vector<std::string> parts;
    std::size_t from = 0;
    for (std::size_t at; (at = text.find(by, from)) != std::string::npos; from = at + 1) parts.push_back(text.substr(from, at - from));
    parts.push_back(text.substr(from));
    return parts;
}

struct DeclaredFunction {
    std::string full, doc;
    hal_step step;
    hal_row row;
    void* self;
    const void* identity;
    bool shared;
};

/// What one constructor says while it runs.
struct Construction {
    Model& model;
    const LoadRequest& request;
    Instance& instance;
    std::size_t number;                 // of this instance in the request
    std::string personality;
    std::vector<std::pair<std::unique_ptr<Pin>, const void*>> pins;  // with the identity of their function
    std::vector<DeclaredFunction> functions;
    std::set<std::string> asked, lists;  // arguments it asked for; those that are per instance
    std::size_t list_length = 0;
    std::vector<std::string> texts;      // keeps what argument() gave
    std::string failure;
    bool no_memory = false;
    std::string serial = {};             // of an instance that is named after its component
    bool whole_function_names = false;
    Sources* sources = nullptr;
    Diagnostics* diagnostics = nullptr;
    std::string text_name = {}, text = {};  // what it reads
    std::uint32_t text_source = 0;          // 0: nothing was said of it yet
    bool said_why = false;                  // an error was
    std::deque<std::string> found = {};     // what find_text() gave
};

bool whole_names(const Instance& instance) { return instance.component->plugin->flags & HAL_COMPONENT_WHOLE_NAMES; }

Construction& of(const hal_host* host) { return *static_cast<Construction*>(host->data); }

bool refuse(Construction& c, std::string why) {
    if (c.failure.empty()) c.failure = std::move(why);
    return false;
}

// What a plugin calls must not throw into it: its frames may be C.
template <class Result, class Action>
Result guarded(Construction& c, Result otherwise, Action action) noexcept {
    try {
        return action();
    } catch (const std::bad_alloc&) {
        c.no_memory = true;
        return otherwise;
    }
}

bool take_pin(const hal_host* host, const hal_pin_decl* decl, hal_pin* memory) {
    Construction& c = of(host);
    if (decl->size < HAL_PIN_DECL_SIZE_1_0 || !decl->name || !*decl->name || !memory || decl->type < HAL_TYPE_BIT ||
        decl->type > HAL_TYPE_PORT || decl->dir < HAL_DIR_IN || decl->dir > HAL_DIR_PARAM)
        return refuse(c, "it declares a pin that is none");
    auto pin = std::make_unique<Pin>();
    pin->name = whole_names(c.instance) ? decl->name : c.instance.name + "." + decl->name;
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
    if (decl->function && std::none_of(c.functions.begin(), c.functions.end(), [&](const auto& f) { return f.identity == decl->function; }))
        return refuse(c, "pin '" + std::string(decl->name) + "' uses a function that is declared below it; move that member up");
    c.pins.emplace_back(std::move(pin), decl->function);
    return true;
}

bool take_function(const hal_host* host, const hal_function_decl* decl) {
    Construction& c = of(host);
    if (decl->size < HAL_FUNCTION_DECL_SIZE_1_0 || !decl->name || !decl->step) return refuse(c, "it declares a function that is none");
    if (decl->flags & HAL_FUNCTION_EMERGENCY) {
        c.instance.emergency.push_back({decl->step, decl->self});
        return true;
    }
    const bool shared = decl->flags & HAL_FUNCTION_SHARED;
    const bool whole = c.whole_function_names || whole_names(c.instance);
    std::string full = whole ? decl->name : shared ? dashed(c.instance.component->name) : c.instance.name;
    if (*decl->name && !whole) full += std::string(".") + decl->name;
    c.functions.push_back({std::move(full), decl->doc ? decl->doc : "", decl->step,
                           decl->size >= sizeof *decl ? decl->row : nullptr, decl->self, decl->identity, shared});
    return true;
}

const char* find_argument(const hal_host* host, const hal_argument_decl* decl) {
    Construction& c = of(host);
    c.asked.insert(decl->name);
    if (std::strcmp(decl->name, "personality") == 0 && !c.personality.empty()) return c.personality.c_str();
    const auto given = c.request.arguments.find(decl->name);
    if (given == c.request.arguments.end()) return decl->fallback;
    if (!(decl->flags & HAL_ARGUMENT_PER_INSTANCE)) return given->second.value.c_str();
    const auto elements = split(given->second.value, ',');
    c.lists.insert(decl->name);
    c.list_length = std::max(c.list_length, elements.size());
    if (c.number >= elements.size()) return decl->fallback;
    c.texts.push_back(elements[c.number]);
    return c.texts.back().c_str();
}

void* allocate_for(Instance& instance, std::size_t bytes, std::size_t align) noexcept {
    if (bytes > (std::size_t{1} << 32) || align == 0 || align > 4096) return nullptr;
    try {
        // room to align by hand: arrays of char are aligned for any ordinary type only
        instance.allocations.push_back(std::make_unique<char[]>(bytes + align));
    } catch (const std::bad_alloc&) {
        return nullptr;
    }
    const auto address = reinterpret_cast<std::uintptr_t>(instance.allocations.back().get());
    return reinterpret_cast<void*>((address + align - 1) / align * align);
}

bool declare_pin(const hal_host* host, const hal_pin_decl* decl, hal_pin* memory) {
    return guarded(of(host), false, [&] { return take_pin(host, decl, memory); });
}
bool declare_function(const hal_host* host, const hal_function_decl* decl) {
    return guarded(of(host), false, [&] { return take_function(host, decl); });
}
const char* give_argument(const hal_host* host, const hal_argument_decl* decl) {
    return guarded(of(host), decl->fallback, [&] { return find_argument(host, decl); });
}
void* allocate(const hal_host* host, std::size_t bytes, std::size_t align) {
    void* const memory = allocate_for(of(host).instance, bytes, align);
    of(host).no_memory = of(host).no_memory || !memory;
    return memory;
}
void record_failure(const hal_host* host, const char* reason) {
    guarded(of(host), false, [&] { return refuse(of(host), reason ? reason : ""); });
}

// Names that LinuxCNC makes otherwise than COMPONENT.N.
void name_instance(const hal_host* host, const char* prefix, unsigned digits) {
    Construction& c = of(host);
    guarded(c, false, [&] {
        if (!c.pins.empty() || !c.functions.empty()) return refuse(c, "an instance is named before its first pin");
        if (c.serial.empty()) return true;  // it has a name of its own
        std::string number = c.serial;
        if (number.size() < digits) number.insert(0, digits - number.size(), '0');
        c.instance.name = std::string(prefix) + "." + number;
        return true;
    });
}
constexpr hal_naming naming{sizeof naming, name_instance, [](const hal_host* host) { of(host).whole_function_names = true; },
                            [](const hal_host* host, const char* argument, uint64_t instances) {
                                Construction& c = of(host);
                                guarded(c, false, [&] { return c.lists.insert(argument).second; });
                                c.list_length = std::max(c.list_length, static_cast<std::size_t>(instances));
                            },
                            [](const hal_host* host) { return of(host).instance.name.c_str(); }};

// Files a component reads.
const char* find_text(const hal_host* host, const char* file) {
    Construction& c = of(host);
    return guarded(c, file, [&] {
        const std::string& netlist = c.request.at.known() ? c.sources->get(c.request.at.source).name : "";
        const auto slash = netlist.rfind('/');
        if (*file == '/' || slash == std::string::npos) return file;
        std::error_code none;
        const std::string beside = netlist.substr(0, slash + 1) + file;
        if (!std::filesystem::exists(beside, none) && std::filesystem::exists(file, none)) return file;
        c.found.push_back(beside);
        return c.found.back().c_str();
    });
}

void begin_text(const hal_host* host, const char* name, const char* text, std::size_t bytes) {
    Construction& c = of(host);
    guarded(c, false, [&] {
        c.text_name = name;
        c.text.assign(text, bytes);
        c.text_source = 0;
        return true;
    });
}

void say_of_text(const hal_host* host, const hal_text_message* message) {
    Construction& c = of(host);
    guarded(c, false, [&] {
        if (message->size < sizeof *message) return refuse(c, "it says something in a form that is not known here");
        if (c.text_source == 0) c.text_source = c.sources->add(c.text_name, c.text);
        const auto size = static_cast<std::uint32_t>(c.text.size());
        const std::uint32_t begin = std::min(message->begin, size), end = std::clamp(message->end, begin, size);
        const Severity severity = message->severity == HAL_SEVERITY_ERROR     ? Severity::error
                                  : message->severity == HAL_SEVERITY_WARNING ? Severity::warning
                                                                              : Severity::note;
        Diagnostic d{severity,
                     Code::named(message->code).value_or(Code("construct-failed")),
                     message->sentence,
                     {{{c.text_source, begin, end}, message->label}}};
        if (*message->help) d.help.emplace_back(message->help);
        c.diagnostics->add(std::move(d));
        c.said_why = c.said_why || severity == Severity::error;
        return true;
    });
}
constexpr hal_texts texts{sizeof texts, find_text, begin_text, say_of_text};

const void* extension_of(const hal_host*, const char* id) {
    if (std::strcmp(id, HAL_NAMING) == 0) return &naming;
    return std::strcmp(id, HAL_TEXTS) == 0 ? &texts : nullptr;
}

// A given argument that nothing asked for, and that is nearly one of those that were: more of the truth than what the constructor missed.
bool is_misspelled(const LoadedComponent& component, const LoadRequest& request, const std::set<std::string>& asked,
                   Diagnostics& diagnostics) {
    const std::vector<std::string> all(asked.begin(), asked.end());
    for (const auto& [name, given] : request.arguments)
        if (const std::string hint = asked.contains(name) ? "" : did_you_mean(name, all); !hint.empty()) {
            diagnostics.error("unknown-argument", given.at, "component '" + component.name + "' has no argument '" + name + "'", hint);
            return true;
        }
    return false;
}

// One instance: memory, constructor, declarations into the model.
bool construct_one(Edit& edit, LoadedComponent& component, const LoadRequest& request, Sources& sources, Diagnostics& diagnostics,
                   std::unique_ptr<Instance> instance, Construction& c) {
    c.sources = &sources;
    c.diagnostics = &diagnostics;
    const hal_host host{sizeof host, &c, declare_pin, declare_function, give_argument, allocate, record_failure, extension_of};
    c.texts.reserve(request.arguments.size());  // pointers into it are handed out
    if (!component.plugin->create(&host, instance->memory)) {
        if (c.no_memory) throw std::bad_alloc();
        if (c.said_why && c.failure.empty()) return false;
        const std::string why = c.failure.empty() ? "it gave no reason" : c.failure;
        for (const auto& [name, given] : request.arguments)
            if (why.starts_with(name + "=")) {
                diagnostics.error("bad-argument", given.at, "component '" + component.name + "': " + why, "",
                                  "hal doc " + component.name + " lists its arguments");
                return false;
            }
        if (is_misspelled(component, request, c.asked, diagnostics)) return false;
        diagnostics.error("construct-failed", request.at,
                          "component '" + component.name + "' cannot make '" + instance->name + "': " + why);
        return false;
    }
    instance->constructed = true;
    // whatever goes wrong from here, what was constructed is destroyed, until the model owns it
    struct Undo {
        std::unique_ptr<Instance>& instance;
        ~Undo() { if (instance) destroy_instance(*instance); }
    } const undo{instance};
    if (c.no_memory) throw std::bad_alloc();
    if (!c.failure.empty()) {
        diagnostics.error("construct-failed", request.at,
                          "component '" + component.name + "' cannot make '" + instance->name + "': " + c.failure);
        return false;
    }
    std::vector<std::unique_ptr<LoadedFunction>> own;
    std::vector<std::pair<LoadedFunction*, plan::Step>> extended;
    std::map<const void*, LoadedFunction*> by_identity;
    for (const DeclaredFunction& decl : c.functions) {
        LoadedFunction* function = decl.shared ? c.model.find_function(decl.full) : nullptr;
        if (function && function->shared && function->component == &component) {
            extended.emplace_back(function, plan::Step{decl.step, decl.self});
        } else {
            auto made = std::make_unique<LoadedFunction>();
            function = made.get();
            function->name = decl.full;
            function->doc = c.model.keep(decl.doc);
            function->steps.push_back({decl.step, decl.self});
            function->row = {decl.row, decl.step};
            function->instances.push_back(instance.get());
            function->component = &component;
            function->shared = decl.shared;
            function->id = c.model.next_id++;
            edit.add_time_pins(*function);
            own.push_back(std::move(made));
        }
        by_identity[decl.identity] = function;
        instance->functions.push_back(function);
    }
    for (auto& [pin, identity] : c.pins) {
        if (identity) pin->function = by_identity[identity];
        if (pin->dir == HAL_DIR_OUT && (pin->flags & HAL_PIN_FINITE)) instance->finite.push_back(pin.get());
        instance->pins.push_back(std::move(pin));
    }
    std::set<std::string_view> names;
    for (const auto& pin : instance->pins)
        if (!names.insert(pin->name).second) {
            diagnostics.error("construct-failed", request.at, "component '" + component.name + "' declares pin '" + pin->name + "' twice");
            return false;
        }
    Instance& made = *instance;
    if (!edit.add_instance(component, instance, std::move(own))) return false;
    for (const auto& [function, step] : extended) edit.extend_function(*function, step, made);
    return true;
}

}  // namespace

namespace {

std::size_t stride_of(const hal_component& plugin) {
    return (plugin.instance_size + plugin.instance_align - 1) / plugin.instance_align * plugin.instance_align;
}

// Cleared memory for so many instances in a row.
std::shared_ptr<void> block_of(const hal_component& plugin, std::size_t count) {
    const std::align_val_t align{std::max<std::size_t>(plugin.instance_align, 64)};
    void* const memory = ::operator new(count * stride_of(plugin), align);
    std::memset(memory, 0, count * stride_of(plugin));
    return std::shared_ptr<void>(memory, [align](void* p) { ::operator delete(p, align); });
}

bool all_known(const LoadedComponent& component, const LoadRequest& request, const std::set<std::string>& asked, Diagnostics& diagnostics) {
    for (const auto& [name, given] : request.arguments) {
        if (asked.contains(name)) continue;
        std::vector<std::string> all(asked.begin(), asked.end());
        all.insert(all.end(), {"names", "count", "personality"});
        diagnostics.error("unknown-argument", given.at, "component '" + component.name + "' has no argument '" + name + "'",
                          did_you_mean(name, all), "its arguments: " + listed(all));
        return false;
    }
    return true;
}

}  // namespace

bool construct_again(Model& beside, Edit& edit, const LoadedComponent& old, LoadedComponent& fresh, Span at, Sources& sources,
                     Diagnostics& diagnostics) {
    edit.diagnostics = &diagnostics;
    const std::shared_ptr<void> storage = block_of(*fresh.plugin, old.instances.size());
    for (std::size_t i = 0; i < old.instances.size(); ++i) {
        const Instance& before = *old.instances[i];
        const Load& load = old.loads[before.load];
        LoadRequest request;
        request.at = at;
        for (const auto& [name, value] : load.arguments) request.arguments.emplace(name, GivenArgument{value, at});
        auto instance = std::make_unique<Instance>();
        instance->component = &fresh;
        instance->loaded = before.loaded;
        instance->name = before.name;
        instance->load = before.load;
        instance->number = before.number;
        instance->memory = static_cast<char*>(storage.get()) + i * stride_of(*fresh.plugin);
        instance->storage = storage;
        const std::string personality = load.personalities.empty() ? "" : load.personalities[before.number % load.personalities.size()];
        Construction c{beside, request, *instance, before.number, personality, {}, {}, {}, {}, 0, {}, {}};
        if (!construct_one(edit, fresh, request, sources, diagnostics, std::move(instance), c)) return false;
        if (!all_known(fresh, request, c.asked, diagnostics)) return false;
    }
    return true;
}

bool construct(Model& model, Edit& edit, LoadedComponent& component, const LoadRequest& request, Sources& sources,
               Diagnostics& diagnostics) {
    const hal_component& plugin = *component.plugin;
    const bool singleton = plugin.flags & HAL_COMPONENT_SINGLETON;
    const std::size_t stride = stride_of(plugin);
    const auto block = [&](std::size_t count) { return block_of(plugin, count); };
    bool known = singleton || !request.names.empty() || request.count >= 0;
    std::size_t total = singleton                ? 1
                        : !request.names.empty() ? request.names.size()
                                                 : static_cast<std::size_t>(std::max<std::int64_t>(request.count, 0));
    if (singleton && (request.names.size() > 1 || request.count > 1)) {
        diagnostics.error("bad-argument", request.count_at.known() ? request.count_at : request.at,
                          "component '" + component.name + "' has one instance only");
        return false;
    }
    std::shared_ptr<void> storage = known ? block(std::max<std::size_t>(total, 1)) : block(1);
    std::size_t in_block = 0;
    std::set<std::string> asked;
    for (std::size_t i = 0; !known || i < total; ++i) {
        auto instance = std::make_unique<Instance>();
        instance->component = &component;
        instance->loaded = request.at;
        const std::string serial = !request.names.empty() || singleton ? "" : std::to_string(edit.take_number(component));
        instance->name = !request.names.empty() ? request.names[i]
                         : singleton            ? dashed(component.name)
                                                : dashed(component.name) + "." + serial;
        instance->memory = static_cast<char*>(storage.get()) + in_block++ * stride;
        instance->storage = storage;
        instance->load = component.loads.empty() ? 0 : component.loads.size() - 1;
        instance->number = i;
        const std::string personality = request.personalities.empty() ? "" : request.personalities[i % request.personalities.size()];
        Construction c{model, request, *instance, i, personality, {}, {}, {}, {}, 0, {}, {}};
        c.serial = serial;
        if (!construct_one(edit, component, request, sources, diagnostics, std::move(instance), c)) return false;
        asked.insert(c.asked.begin(), c.asked.end());
        if (i == 0) {
            if (!all_known(component, request, c.asked, diagnostics)) return false;
            if (!known) {
                known = true;
                total = c.list_length > 0 ? c.list_length : plugin.default_count;
                if (total > 1) storage = block(total - 1);
                in_block = 0;
            } else if (const auto list = c.list_length > total ? request.arguments.find(*c.lists.begin()) : request.arguments.end();
                       list != request.arguments.end()) {  // a default may say more instances than are wanted
                diagnostics.error("bad-argument", list->second.at,
                                  "argument '" + list->first + "' lists " + std::to_string(c.list_length) + " values for " +
                                      std::to_string(total) + (total == 1 ? " instance" : " instances"));
                return false;
            }
        }
    }
    return true;
}

namespace {
struct Starting {
    Instance& instance;
    const Model& model;
    Executor& executor;
    const hal_status& status;
    std::string failure;

    bool fail(const char* reason) noexcept {
        try {
            if (failure.empty()) failure = reason;
        } catch (const std::bad_alloc&) {}  // then it gives no reason
        return false;
    }
};

bool publish_stream(const hal_host* host, const char* name, hal_stream* stream) {
    Starting& starting = *static_cast<Starting*>(host->data);
    try {
        Instance& instance = starting.instance;
        instance.streams.emplace_back(*name ? instance.name + "." + name : instance.name, stream);
        return true;
    } catch (const std::bad_alloc&) {
        return starting.fail("there is no memory left for its stream");
    }
}
constexpr hal_stream_host stream_host{sizeof stream_host, publish_stream};

bool tell_way(const hal_way*, const hal_host* host, const char* pin, const char* far, std::uint32_t cycles, std::uint32_t round_trip,
              std::int64_t worst_ns) {
    Instance& instance = static_cast<Starting*>(host->data)->instance;
    try {
        const std::string name = instance.name + "." + pin;
        for (const auto& one : instance.pins)
            if (one->name == name) instance.ways.push_back({one.get(), far, cycles, round_trip, worst_ns});
        return true;
    } catch (const std::bad_alloc&) {
        return false;
    }
}
constexpr hal_way way_host{sizeof way_host, tell_way};

bool claim_clock(const hal_clock*, const hal_host* host) {
    Starting& starting = *static_cast<Starting*>(host->data);
    if (const Instance* const other = clock_leader(starting.model); other && other != &starting.instance) {
        try {
            return starting.fail(("the threads follow the beat of '" + other->name + "' (" + other->component->name +
                                  "), and they can follow only one: let this one not follow, or unload '" + other->name + "' first")
                                     .c_str());
        } catch (const std::bad_alloc&) {
            return starting.fail("the threads follow the beat of another instance, and they can follow only one");
        }
    }
    starting.instance.leads_clock = true;
    starting.executor.lead();
    return true;
}
}  // namespace

const Instance* clock_leader(const Model& model) {
    for (const auto& component : model.components)
        for (const auto& instance : component->instances)
            if (instance->leads_clock) return instance.get();
    return nullptr;
}

std::string start_instance(Instance& instance, const Model& model, Executor& executor, const hal_status& status) {
    Starting starting{instance, model, executor, status, {}};
    executor.clock().claim = claim_clock;
    const hal_host host{
        sizeof host, &starting,
        [](const hal_host* h, const hal_pin_decl*, hal_pin*) {
            return static_cast<Starting*>(h->data)->fail("pins are declared in the constructor, not in start");
        },
        [](const hal_host* h, const hal_function_decl*) {
            return static_cast<Starting*>(h->data)->fail("functions are declared in the constructor, not in start");
        },
        [](const hal_host*, const hal_argument_decl* decl) { return decl->fallback; },
        [](const hal_host* h, std::size_t bytes, std::size_t align) {
            return allocate_for(static_cast<Starting*>(h->data)->instance, bytes, align);
        },
        [](const hal_host* h, const char* reason) { static_cast<Starting*>(h->data)->fail(reason ? reason : ""); },
        [](const hal_host* h, const char* id) -> const void* {
            if (std::strcmp(id, "hal.stream/1") == 0) return &stream_host;
            if (std::strcmp(id, "hal.faults/1") == 0) return &static_cast<Starting*>(h->data)->executor.board().shared;
            if (std::strcmp(id, HAL_STATUS) == 0) return &static_cast<Starting*>(h->data)->status;
            if (std::strcmp(id, "hal.clock/1") == 0) return &static_cast<Starting*>(h->data)->executor.clock();
            if (std::strcmp(id, HAL_WAY) == 0) return &way_host;
            if (std::strcmp(id, HAL_BACKGROUND) == 0) return &static_cast<Starting*>(h->data)->executor.background();
            return nullptr;
        }};
    instance.started = instance.component->plugin->start(instance.memory, &host);
    if (instance.started) return {};
    instance.streams.clear();
    instance.ways.clear();
    instance.leads_clock = false;
    return starting.failure.empty() ? "it gave no reason" : starting.failure;
}

void stop_instance(Instance& instance) noexcept {
    if (!instance.started) return;
    const hal_cycle none{.size = sizeof none, .pad = 0, .period_ns = 0, .period_s = 0.0, .start_ns = 0, .number = 0};
    for (const plan::Step& step : instance.emergency) step.step(step.self, &none);
    instance.component->plugin->stop(instance.memory);
    instance.streams.clear();
    instance.ways.clear();
    instance.leads_clock = false;
    instance.started = false;
}

void destroy_instance(Instance& instance) noexcept {
    stop_instance(instance);
    if (instance.constructed) instance.component->plugin->destroy(instance.memory);
    instance.constructed = false;
}

}  // namespace hal
