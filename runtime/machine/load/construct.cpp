// SPDX-License-Identifier: MIT
#include "machine/load/construct.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <optional>
#include <set>
#include <utility>

#include "machine/load/component_memory.hpp"
#include "machine/load/construction.hpp"
#include "machine/load/setup_call.hpp"
#include "machine/load/thread_options.hpp"
#include "text/quoting.hpp"

namespace hal {

std::string dashed(std::string text) {
    std::replace(text.begin(), text.end(), '_', '-');
    return text;
}

namespace {

std::unique_ptr<char[]> memory_of(const LoadedComponent& component, std::size_t bytes) {
    const ComponentMemory scope(component.name.c_str());
    return std::make_unique<char[]>(bytes);
}

}  // namespace

void* allocate_for(Instance& instance, std::size_t bytes, std::size_t align) noexcept {
    if (bytes > std::min<std::uint64_t>(std::uint64_t{1} << 32, PTRDIFF_MAX - 4096) || align == 0 ||
        align > 4096) {
        return nullptr;
    }
    // What lies together is fetched into the caches together: blocks of growing size, aligned by
    // hand.
    constexpr std::size_t max = 64 * 1024;
    const auto take = [&](Instance::Block& block) -> void* {
        const auto begin = reinterpret_cast<std::uintptr_t>(block.memory.get());
        const std::uintptr_t at = (begin + block.used + align - 1) / align * align;
        if (at - begin + bytes > block.bytes) return nullptr;
        block.used = at - begin + bytes;
        return reinterpret_cast<void*>(at);
    };
    try {
        std::size_t next = 0;
        if (!instance.blocks.empty()) {
            if (void* const memory = take(instance.blocks.back())) return memory;
            next = std::min(max, std::max<std::size_t>(256, 2 * instance.blocks.back().bytes));
        }
        const std::size_t size = std::max(next, bytes + align);
        instance.blocks.push_back({memory_of(*instance.component, size), size, 0});
        return take(instance.blocks.back());
    } catch (const std::bad_alloc&) {
        return nullptr;
    }
}

namespace {

// A given argument that nothing asked for, and that is nearly one of those that were: more of the
// truth than what the constructor missed.
bool is_misspelled(const LoadedComponent& component, const LoadRequest& request,
                   const std::set<std::string>& asked, Diagnostics& diagnostics) {
    const std::vector<std::string> all(asked.begin(), asked.end());
    for (const auto& [name, given] : request.arguments) {
        if (const std::string hint = asked.contains(name) ? "" : did_you_mean(name, all);
            !hint.empty()) {
            diagnostics.error("unknown-argument", given.at,
                              "component '" + component.name + "' has no argument '" + name + "'",
                              hint);
            return true;
        }
    }
    return false;
}

// The invalid bytes of an argument; the whole argument where its text is not NAME=VALUE as the
// constructor got it.
Span span_of(const GivenArgument& given, const Failure& why, const Sources& sources) {
    const std::size_t before = why.name.size() + 1;
    if (why.begin >= why.end || why.end > given.value.size() ||
        sources.text(given.at) != why.name + "=" + given.value) {
        return given.at;
    }
    const auto first = static_cast<std::uint32_t>(given.at.begin + before);
    return {given.at.source, first + why.begin, first + why.end};
}

/// What to type when a module of LinuxCNC cannot be loaded for which there is a driver of ours; "":
/// nothing.
std::string own_driver(const LoadedComponent& component) {
    const bool is_module = (component.plugin->flags & HAL_COMPONENT_MODULE) != 0;
    if (!is_module || component.name != "hm2_eth") return "";
    return "Halcyon has a driver of its own: loadrt --native hm2_eth";
}

/// Reports why a constructor failed, at the argument that it rejects if there is one.
void report_failure(const LoadedComponent& component, const LoadRequest& request,
                    const Sources& sources, const Construction& c, Diagnostics& diagnostics) {
    const Failure& why = c.failure;
    const auto given = why.subject == HAL_SUBJECT_ARGUMENT ? request.arguments.find(why.name)
                                                           : request.arguments.end();
    if (given != request.arguments.end()) {
        diagnostics.error(
            failure_code(why.code, "bad-argument"), span_of(given->second, why, sources),
            "component '" + component.name + "': " + why.text, "",
            why.help.empty() ? "hal doc " + component.name + " lists its arguments" : why.help);
        return;
    }
    if (is_misspelled(component, request, c.asked, diagnostics)) return;
    diagnostics.error(failure_code(why.code, "construct-failed"), request.at,
                      "component '" + component.name + "' cannot make '" + c.instance.name +
                          "': " + (why.empty() ? "it gave no reason" : why.text),
                      "", why.help.empty() ? own_driver(component) : why.help);
}

/// Notes which of the arguments the constructor declares as lists or as the number of instances.
void note_uses(Load& load, const Construction& c) {
    for (const auto& [name, use] : c.uses) {
        const auto argument = load.arguments.find(name);
        if (argument != load.arguments.end()) {
            argument->second.use = use;
        }
    }
}

// One instance: memory, constructor, declarations into the model.
bool construct_one(Edit& edit, LoadedComponent& component, const LoadRequest& request,
                   Sources& sources, Diagnostics& diagnostics, std::unique_ptr<Instance> instance,
                   Construction& c) {
    Instance& made = *instance;
    c.sources = &sources;
    c.diagnostics = &diagnostics;
    c.edit = &edit;
    c.owned = &instance;
    const hal_host host = host_for(c);
    c.texts.reserve(request.arguments.size());  // pointers into it are handed out
    const auto create = [&] {
        const SetupCall call(made.name, component.name, "its constructor");
        return component.plugin->create(&host, made.memory);
    };
    if (!create()) {
        if (c.no_memory) throw std::bad_alloc();
        const bool is_explained = c.said_why || c.hardware_denied;
        if (is_explained && c.failure.empty()) return false;
        report_failure(component, request, sources, c, diagnostics);
        return false;
    }
    made.constructed = true;
    // whatever goes wrong from here, what was constructed is destroyed, until the model owns it
    struct Undo {
        std::unique_ptr<Instance>& instance;
        ~Undo() {
            if (instance) {
                destroy_instance(*instance);
            }
        }
    } const undo{instance};
    if (c.no_memory) throw std::bad_alloc();
    if (!c.failure.empty()) {
        diagnostics.error("construct-failed", request.at,
                          "component '" + component.name + "' cannot make '" + made.name +
                              "': " + c.failure.text);
        return false;
    }
    if (!enter_declared(c)) return false;
    for (const auto& [function, step] : c.extended) {
        edit.extend_function(*function, step, made);
    }
    note_uses(component.loads[made.load], c);
    return true;
}

}  // namespace

namespace {

// Threads that a LinuxCNC module makes. They outlive it, as in LinuxCNC.
bool add_threads(Construction& c) {
    for (const auto& [name, period_ns] : std::exchange(c.threads, {})) {
        NewThread thread;
        thread.name = name;
        thread.at = c.request.at;
        thread.options.period_ns = period_ns;
        fit_period(c.model, thread, *c.diagnostics);
        if (!c.edit->add_thread({thread.name, thread.at}, thread.options)) return false;
    }
    return true;
}

/// Returns the first pin with the name of one before it; nullptr without one.
const Pin* declared_twice(const Instance& instance) {
    std::vector<std::string_view> names;
    names.reserve(instance.pins.size());
    for (const auto& pin : instance.pins) {
        names.push_back(pin->name);
    }
    std::ranges::sort(names);
    if (std::ranges::adjacent_find(names) == names.end()) return nullptr;
    std::set<std::string_view> seen;
    for (const auto& pin : instance.pins) {
        if (!seen.insert(pin->name).second) return pin.get();
    }
    return nullptr;
}

}  // namespace

bool enter_declared(Construction& c) {
    Instance& instance = c.instance;
    LoadedComponent& component = *instance.component;
    std::vector<std::unique_ptr<LoadedFunction>> own;
    for (const DeclaredFunction& decl : std::exchange(c.functions, {})) {
        LoadedFunction* function = decl.shared ? c.model.find_function(decl.full) : nullptr;
        if (function && function->shared && function->component == &component) {
            c.extended.emplace_back(function, plan::Step{decl.step, decl.self});
        } else {
            auto made = std::make_unique<LoadedFunction>();
            function = made.get();
            function->name = decl.full;
            function->doc = c.model.keep(decl.doc);
            function->steps.push_back({decl.step, decl.self});
            function->row = {decl.row, decl.step};
            function->instances.push_back(&instance);
            function->component = &component;
            function->shared = decl.shared;
            function->required = decl.required;
            function->id = c.model.next_id++;
            c.edit->add_time_pins(*function);
            own.push_back(std::move(made));
        }
        c.by_identity[decl.identity] = function;
        if (*c.owned) {
            instance.functions.push_back(function);
        }
    }
    std::vector<std::unique_ptr<Pin>> later;
    instance.pins.reserve(instance.pins.size() + (*c.owned ? c.pins.size() : 0));
    for (auto& [pin, identity] : std::exchange(c.pins, {})) {
        if (identity) {
            pin->function = c.by_identity[identity];
        }
        if (pin->dir == HAL_DIR_OUT && (pin->flags & HAL_PIN_FINITE)) {
            instance.finite.push_back(pin.get());
        }
        (*c.owned ? instance.pins : later).push_back(std::move(pin));
    }
    if (!*c.owned) {
        return c.edit->add_declared(instance, std::move(later), std::move(own)) && add_threads(c);
    }
    if (const Pin* const pin = declared_twice(instance)) {
        c.diagnostics->error(
            "construct-failed", c.request.at,
            "component '" + component.name + "' declares pin '" + pin->name + "' twice");
        return false;
    }
    return c.edit->add_instance(component, *c.owned, std::move(own)) && add_threads(c);
}

namespace {

std::size_t stride_of(const hal_component& plugin) {
    return (plugin.instance_size + plugin.instance_align - 1) / plugin.instance_align *
           plugin.instance_align;
}

// Cleared memory for so many instances in a row.
std::shared_ptr<void> block_of(const hal_component& plugin, std::size_t count) {
    const std::align_val_t align{std::max<std::size_t>(plugin.instance_align, 64)};
    void* memory = nullptr;
    {
        const ComponentMemory scope(plugin.name);
        memory = ::operator new(count * stride_of(plugin), align);
    }
    std::memset(memory, 0, count * stride_of(plugin));
    return std::shared_ptr<void>(memory, [align](void* p) { ::operator delete(p, align); });
}

/// In the indices, for more instances like `one`: they grow once and not twenty times.
void make_room(Model& model, const Instance& one, std::size_t more) {
    std::size_t pins = one.pins.size();
    for (const LoadedFunction* const function : one.functions) {
        pins += function->pins.size();
    }
    model.instance.reserve(model.instance.size() + more);
    model.function.reserve(model.function.size() + more * one.functions.size());
    model.pin.reserve(model.pin.size() + more * pins);
}

}  // namespace

bool all_known(const LoadedComponent& component, const LoadRequest& request,
               const std::set<std::string>& asked, Diagnostics& diagnostics) {
    for (const auto& [name, given] : request.arguments) {
        if (asked.contains(name)) continue;
        std::vector<std::string> all(asked.begin(), asked.end());
        if (!(component.plugin->flags & HAL_COMPONENT_WHOLE_NAMES)) {
            all.insert(all.end(), {"names", "count", "personality"});
        }
        diagnostics.error("unknown-argument", given.at,
                          "component '" + component.name + "' has no argument '" + name + "'",
                          did_you_mean(name, all), "its arguments: " + listed(all));
        return false;
    }
    return true;
}

namespace {

/// The loads as they were given: a new version may declare their arguments otherwise.
std::vector<Load> without_uses(std::vector<Load> loads) {
    for (Load& load : loads) {
        for (auto& [name, argument] : load.arguments) {
            argument.use = LoadArgument::Use::common;
        }
    }
    return loads;
}

}  // namespace

bool construct_again(Model& beside, Edit& edit, const LoadedComponent& old, LoadedComponent& fresh,
                     Span at, const hal_faults* faults, Sources& sources,
                     Diagnostics& diagnostics) {
    edit.diagnostics = &diagnostics;
    const std::shared_ptr<void> storage = block_of(*fresh.plugin, old.instances.size());
    fresh.loads = without_uses(old.loads);
    for (std::size_t i = 0; i < old.instances.size(); ++i) {
        const Instance& before = *old.instances[i];
        const Load& load = old.loads[before.load];
        LoadRequest request;
        request.at = at;
        request.faults = faults;
        for (const auto& [name, argument] : load.arguments) {
            request.arguments.emplace(name, GivenArgument{argument.value, at});
        }
        auto instance = std::make_unique<Instance>();
        instance->component = &fresh;
        instance->loaded = before.loaded;
        instance->name = before.name;
        instance->load = before.load;
        instance->number = before.number;
        instance->memory = static_cast<char*>(storage.get()) + i * stride_of(*fresh.plugin);
        instance->storage = storage;
        const std::string personality =
            load.personalities.empty()
                ? ""
                : load.personalities[before.number % load.personalities.size()];
        Construction c{beside, request, *instance, before.number, personality};
        if (!construct_one(edit, fresh, request, sources, diagnostics, std::move(instance), c)) {
            return false;
        }
        if (!all_known(fresh, request, c.asked, diagnostics)) return false;
    }
    return true;
}

namespace {

/// Makes the instances of one loadrt line. Their number may be known only when the first one has
/// declared its arguments.
class InstanceRow {
public:
    InstanceRow(Model& model, Edit& edit, LoadedComponent& component, const LoadRequest& request,
                Sources& sources, Diagnostics& diagnostics)
        : model_(model),
          edit_(edit),
          component_(component),
          request_(request),
          sources_(sources),
          diagnostics_(diagnostics),
          plugin_(*component.plugin),
          singleton_(plugin_.flags & HAL_COMPONENT_SINGLETON) {}

    /// Makes the first instance, whose arguments give the number if the line does not, then the
    /// others. False after reporting.
    bool make() {
        if (singleton_ && (request_.names.size() > 1 || request_.count > 1)) {
            diagnostics_.error("bad-argument",
                               request_.count_at.known() ? request_.count_at : request_.at,
                               "component '" + component_.name + "' has one instance only");
            return false;
        }
        const std::optional<std::size_t> given = given_count();
        if (given == std::size_t{0}) return true;
        new_block(given.value_or(1));
        const std::optional<std::size_t> total = make_first(given);
        if (!total) return false;
        for (std::size_t i = 1; i < *total; ++i) {
            if (!make_one(i, [](const Construction&) { return true; })) return false;
        }
        return true;
    }

private:
    /// Returns the number that the line gives, or nothing.
    std::optional<std::size_t> given_count() const {
        if (singleton_) return 1;
        if (!request_.names.empty()) return request_.names.size();
        if (request_.count < 0) return std::nullopt;
        return static_cast<std::size_t>(request_.count);
    }

    /// Returns the number of instances, for which there is memory then; nothing after reporting.
    std::optional<std::size_t> make_first(std::optional<std::size_t> given) {
        std::size_t total = 0;
        const bool made = make_one(0, [&](const Construction& first) {
            if (!all_known(component_, request_, first.asked, diagnostics_)) return false;
            if (given && !fits_lists(first, *given)) return false;
            total = given.value_or(declared_count(first));
            note_short_lists(first, total);
            return true;
        });
        if (!made) return std::nullopt;
        if (total > 1) {
            if (!given) {
                new_block(total - 1);
            }
            make_room(model_, *component_.instances.back(), total - 1);
        }
        return total;
    }
    /// Makes an instance. `accept` checks what it has declared. False after reporting.
    template <class Accept>
    bool make_one(std::size_t i, Accept accept) {
        auto instance = new_instance(i);
        const std::string serial = name(*instance, i);
        const std::string personality = personality_of(i);
        Construction c{model_, request_, *instance, i, personality};
        c.serial = serial;
        return construct_one(edit_, component_, request_, sources_, diagnostics_,
                             std::move(instance), c) &&
               accept(c);
    }

    std::size_t declared_count(const Construction& first) const {
        if (first.declared_count > 0) return first.declared_count;
        return first.list_length > 0 ? first.list_length : plugin_.default_count;
    }

    void new_block(std::size_t count) {
        storage_ = block_of(plugin_, count);
        in_block_ = 0;
    }

    std::unique_ptr<Instance> new_instance(std::size_t i) {
        auto instance = std::make_unique<Instance>();
        instance->component = &component_;
        instance->loaded = request_.at;
        instance->memory = static_cast<char*>(storage_.get()) + in_block_++ * stride_of(plugin_);
        instance->storage = storage_;
        instance->load = component_.loads.size() - 1;
        instance->number = i;
        return instance;
    }

    /// Names the instance. Returns its serial number, "" when its name has none.
    std::string name(Instance& instance, std::size_t i) {
        if (!request_.names.empty()) {
            instance.name = request_.names[i];
            return "";
        }
        instance.name = dashed(component_.name);
        if (singleton_) return "";
        const std::string serial = std::to_string(edit_.take_number(component_));
        instance.name += "." + serial;
        return serial;
    }

    std::string personality_of(std::size_t i) const {
        if (request_.personalities.empty()) return "";
        return request_.personalities[i % request_.personalities.size()];
    }

    /// False after reporting an argument that lists more values than there are instances; a default
    /// may.
    bool fits_lists(const Construction& first, std::size_t total) {
        if (first.list_length <= total) return true;
        const auto list = request_.arguments.find(first.max_list);
        if (list == request_.arguments.end()) return true;
        diagnostics_.error("bad-argument", list->second.at,
                           "argument '" + list->first + "' lists " +
                               std::to_string(first.list_length) + " values for " +
                               counted(total, "instance"));
        return false;
    }

    /// The instances beyond the end of a list have the default, as in LinuxCNC's arrays.
    void note_short_lists(const Construction& first, std::size_t total) {
        for (const auto& [name, list] : first.lists) {
            const auto given = request_.arguments.find(name);
            if (list.length >= total || given == request_.arguments.end()) continue;
            const std::string others =
                list.fallback.empty() ? "no value" : "the default, " + list.fallback;
            diagnostics_.note("short-list", given->second.at,
                              "argument '" + name + "' lists " + counted(list.length, "value") +
                                  " for " + counted(total, "instance") + "; the others have " +
                                  others,
                              "", "list a value for each instance: " + name + "=VALUE,VALUE,...");
        }
    }

    Model& model_;
    Edit& edit_;
    LoadedComponent& component_;
    const LoadRequest& request_;
    Sources& sources_;
    Diagnostics& diagnostics_;
    const hal_component& plugin_;
    bool singleton_;
    std::shared_ptr<void> storage_;  // cleared, for the instances from in_block_ on
    std::size_t in_block_ = 0;
};

}  // namespace

bool construct(Model& model, Edit& edit, LoadedComponent& component, const LoadRequest& request,
               Sources& sources, Diagnostics& diagnostics) {
    return InstanceRow(model, edit, component, request, sources, diagnostics).make();
}

}  // namespace hal
