// SPDX-License-Identifier: MIT
// Components, their memory, functions and threads.
#include <algorithm>
#include <cerrno>
#include <cstring>
#include <map>
#include <string>
#include <sys/mman.h>

#include "linuxcnc/binary/module.hpp"

char* hal_shmem_base = nullptr;

// guard/module_calls.cpp
extern "C" [[gnu::weak, gnu::visibility("default")]] void halcyon_guard_module_function(bool runs);

namespace hal::modules {
namespace {

constexpr std::size_t chunk_bytes = 1 << 20;

struct Component {
    std::string name;
    Module* module;
    bool ready;
};
std::map<int, Component> components;
int last_id = 0;
std::uint64_t clock_period = 0;  // that a module has set before there was a thread

/// Memory of hal_malloc(): cleared, never moved, and kept until no module is left, because modules
/// keep pointers into each other's.
struct Chunk {
    char* memory;
    std::size_t bytes, used;
};
std::vector<Chunk> chunks;
bool memory_kept = false;
std::map<std::uintptr_t, std::size_t> blocks;  // what hal_malloc() gave: address and size

bool add_chunk(std::size_t min) {
    const std::size_t bytes = (min + chunk_bytes - 1) / chunk_bytes * chunk_bytes;
    chunks.reserve(chunks.size() + 1);
    void* const memory =
        mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (memory == MAP_FAILED) return false;
    chunks.push_back({static_cast<char*>(memory), bytes, 0});
    return true;
}

int fail(const char* function, const char* name, const char* why) {
    rtapi_print_msg(RTAPI_MSG_ERR, "%s: '%s': %s\n", function, name ? name : "(null)", why);
    return -EINVAL;
}

void call(const Function& function, const hal_cycle& cycle) {
    in_cycle = true;
    cycle_now = &cycle;
    function.code(function.arg, static_cast<long>(cycle.period_ns));
    in_cycle = false;
}
[[gnu::noinline]] void call_with_more(Function& function, const hal_cycle& cycle) {
    Module& module = *function.module;
    // without the permission the access is a crash, which names the function
    if (module.accesses_ports) {
        permit_ports();
    }
    module.parameters.import(function);
    adjust_clock(module, cycle);
    call(function, cycle);
    module.parameters.show(function);
}
void call_function(void* self, const hal_cycle* cycle) {
    Function& function = *static_cast<Function*>(self);
    if (function.module->plain()) [[likely]] {
        call(function, *cycle);
    } else {
        call_with_more(function, *cycle);
    }
}
// In a program with the real-time guard; a weak symbol, so that nothing depends on it.
void call_under_guard(void* self, const hal_cycle* cycle) {
    halcyon_guard_module_function(true);
    call_function(self, cycle);
    halcyon_guard_module_function(false);
}

}  // namespace

bool prepare_memory() noexcept {
    return guarded([] {
        if (chunks.empty() && !add_chunk(chunk_bytes)) return -ENOMEM;
        hal_shmem_base = chunks.front().memory;
        return 0;
    }) == 0;
}

void release_components(Module& module) noexcept {
    for (const int id : module.components) {
        release_segments(id);
        components.erase(id);
    }
    module.components.clear();
    if (!Module::all_running().empty() || Module::current() || memory_kept) return;
    for (const Chunk& chunk : chunks) {
        munmap(chunk.memory, chunk.bytes);
    }
    chunks.clear();
    blocks.clear();
    clock_period = 0;
    hal_shmem_base = nullptr;
}

std::uint64_t clock_multiple(std::uint64_t period_ns) noexcept {
    if (clock_period == 0) return period_ns;
    return std::max<std::uint64_t>(1, (period_ns + clock_period / 2) / clock_period) * clock_period;
}

void keep_memory() noexcept { memory_kept = true; }

int new_id() noexcept { return ++last_id; }

bool is_id_of(const Module& module, int id) { return module.components.contains(id); }

std::uintptr_t end_of_block(const volatile void* address) noexcept {
    const auto at = reinterpret_cast<std::uintptr_t>(address);
    auto after = blocks.upper_bound(at);
    if (after == blocks.begin()) return 0;
    --after;
    return at < after->first + after->second ? after->first + after->second : 0;
}

/// Returns what is wrong with a name that a module gives, "" when nothing is.
static std::string name_problem(const char* name) {
    if (!name || !*name) return "the name is empty";
    return std::strlen(name) > longest_name() ? too_long() : std::string();
}

int declaring(const char* function, const char* name, int comp) {
    if (!Module::current()) {
        fail(function, name, "only while a module is loaded");
        return -EPERM;
    }
    const auto component = components.find(comp);
    if (component == components.end()) return fail(function, name, "unknown component");
    if (component->second.ready) return fail(function, name, "the component is ready already");
    const std::string problem = name_problem(name);
    return problem.empty() ? 0 : fail(function, name, problem.c_str());
}

std::size_t longest_name() noexcept {
    const Module* const module = Module::current();
    return module && module->interface() == Interface::v2_10 ? 55 : 47;
}
std::string too_long() {
    return "the name is longer than " + std::to_string(longest_name()) + " characters";
}

}  // namespace hal::modules

using namespace hal::modules;

extern "C" {

int hal_init(const char* name) {
    return guarded([&] {
        Module* const module = Module::current();
        if (!module) return fail("hal_init", name, "only while a module is loaded");
        const std::string problem = name_problem(name);
        if (!problem.empty()) return fail("hal_init", name, problem.c_str());
        for (const auto& [id, component] : components) {
            if (component.name == name) return fail("hal_init", name, "duplicate component name");
        }
        const int id = new_id();
        components[id] = {name, module, false};
        module->components.insert(id);
        return id;
    });
}

int hal_ready(int comp) {
    const auto component = components.find(comp);
    if (component == components.end() || component->second.ready) return -EINVAL;
    component->second.ready = true;
    return 0;
}

int hal_set_unready(int comp) {
    const auto component = components.find(comp);
    if (component == components.end() || !component->second.ready || !Module::current()) {
        return -EINVAL;
    }
    component->second.ready = false;
    return 0;
}

int hal_unready(int comp) { return hal_set_unready(comp); }

// LinuxCNC keeps the function for a command of its host that its halcmd does not have; so it is
// never called.
int hal_set_constructor(int comp, int (*make)(char*, char*)) {
    const auto component = components.find(comp);
    if (component == components.end() || !make) {
        return fail("hal_set_constructor", hal_comp_name(comp),
                    "unknown component, or no function");
    }
    return 0;
}

int hal_exit(int comp) {
    const auto component = components.find(comp);
    if (component == components.end()) return -EINVAL;
    components.erase(component);
    return 0;
}

void* hal_malloc(long bytes) {
    if (bytes <= 0 || in_cycle) return nullptr;
    const auto wanted = static_cast<std::size_t>(bytes);
    void* result = nullptr;
    guarded([&] {
        if (chunks.empty() || chunks.back().bytes - chunks.back().used < wanted + 16) {
            if (!add_chunk(wanted + 16)) return -ENOMEM;
        }
        Chunk& chunk = chunks.back();
        chunk.used = (chunk.used + 15) / 16 * 16;
        // touched now: no page fault in a cycle
        result = std::memset(chunk.memory + chunk.used, 0, wanted);
        chunk.used += wanted;
        blocks[reinterpret_cast<std::uintptr_t>(result)] = wanted;
        if (const Module* const module = Module::current()) {
            module->extension().memory(module->host(), result, wanted);
        }
        return 0;
    });
    return result;
}

char* hal_comp_name(int comp) {
    const auto component = components.find(comp);
    return component == components.end() ? nullptr : component->second.name.data();
}

int hal_export_funct(const char* name, void (*code)(void*, long), void* arg, int, int, int comp) {
    return guarded([&] {
        if (const int wrong = declaring("hal_export_funct", name, comp); wrong != 0) return wrong;
        if (!code) return fail("hal_export_funct", name, "no code");
        Module& module = *Module::current();
        if (!module.functions.insert(name).second) {
            return fail("hal_export_funct", name, "duplicate function name");
        }
        const hal_host* const host = module.host();
        void* const memory = host->allocate(host, sizeof(Function), alignof(Function));
        if (!memory) return -ENOMEM;
        Function* const function = new (memory) Function{code, arg, &module};
        module.declared.push_back(function);
        const hal_function_decl decl{
            sizeof decl,
            0,
            name,
            "",
            halcyon_guard_module_function ? call_under_guard : call_function,
            function,
            function,
            nullptr};
        return host->function(host, &decl) ? 0 : -EINVAL;
    });
}

int hal_create_thread(const char* name, unsigned long period_ns, int) {
    return guarded([&] {
        Module* const module = Module::current();
        if (!module) return fail("hal_create_thread", name, "only while a module is loaded");
        const std::string problem = name_problem(name);
        if (!problem.empty()) return fail("hal_create_thread", name, problem.c_str());
        if (period_ns == 0) return fail("hal_create_thread", name, "the period is 0");
        if (!module->extension().thread(module->host(), name,
                                        static_cast<std::int64_t>(clock_multiple(period_ns)))) {
            return fail("hal_create_thread", name, "the name is invalid or taken");
        }
        return new_id();  // LinuxCNC has a component per thread; nothing refers to it
    });
}

long rtapi_clock_set_period(long ns) {
    const Module* const module = Module::current();
    const auto base = module ? module->calls().base_period(module->host()) : 0;
    const long now = base > 0 ? static_cast<long>(base) : static_cast<long>(clock_period);
    if (ns == 0 && module) return now;
    if (!module) {
        fail("rtapi_clock_set_period", "clock", "only while a module is loaded");
        return -EPERM;
    }
    if (ns < 0 || now != 0) {
        return fail("rtapi_clock_set_period", "clock",
                    now != 0 ? "it runs already" : "the period is negative");
    }
    clock_period = static_cast<std::uint64_t>(ns);
    return ns;
}
}
