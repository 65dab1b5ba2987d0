// SPDX-License-Identifier: MIT
#include "page.hpp"

#include <algorithm>
#include <map>
#include <memory>
#include <new>

namespace hal::tools {

namespace {

/// What the constructor says while it runs.
struct Gathering {
    Page& page;
    std::map<const void*, std::string> names;  // of functions, by their identity
    std::vector<std::unique_ptr<char[]>> blocks;
    std::string failure;
};

Gathering& of(const hal_host* host) { return *static_cast<Gathering*>(host->data); }
std::string text(const char* t) { return t ? t : ""; }

bool take_pin(const hal_host* host, const hal_pin_decl* decl, hal_pin* memory) {
    Gathering& g = of(host);
    memory->own = decl->initial;
    memory->slot = &memory->own;
    Page::Pin pin;
    pin.name = text(decl->name);
    pin.doc = text(decl->doc);
    pin.unit = text(decl->unit);
    if (const auto user = g.names.find(decl->function); user != g.names.end()) pin.function = user->second;
    pin.type = decl->type;
    pin.dir = decl->dir;
    pin.initial = decl->initial;
    pin.safe = decl->safe;
    pin.has_safe = decl->flags & HAL_PIN_SAFE;
    pin.finite = decl->flags & HAL_PIN_FINITE;
    g.page.pins.push_back(std::move(pin));
    return true;
}

bool take_function(const hal_host* host, const hal_function_decl* decl) {
    Gathering& g = of(host);
    if (decl->flags & HAL_FUNCTION_EMERGENCY) return true;
    g.page.functions.push_back({text(decl->name), text(decl->doc), (decl->flags & HAL_FUNCTION_SHARED) != 0});
    g.names[decl->identity] = g.page.full_name(g.page.functions.back());
    return true;
}

const char* take_argument(const hal_host* host, const hal_argument_decl* decl) {
    of(host).page.arguments.push_back(
        {text(decl->name), text(decl->doc), text(decl->fallback), (decl->flags & HAL_ARGUMENT_PER_INSTANCE) != 0});
    return decl->fallback;
}

void* allocate(const hal_host* host, std::size_t bytes, std::size_t align) {
    auto& blocks = of(host).blocks;
    blocks.push_back(std::make_unique<char[]>(bytes + align));
    const auto address = reinterpret_cast<std::uintptr_t>(blocks.back().get());
    return reinterpret_cast<void*>((address + align - 1) / align * align);
}

void take_failure(const hal_host* host, const char* reason) { of(host).failure = text(reason); }
const void* no_extension(const hal_host*, const char*) { return nullptr; }

}  // namespace

std::string Page::instance() const { return singleton ? name : name + ".N"; }

std::string Page::full_name(const Function& function) const {
    return (function.shared ? name : instance()) + (function.name.empty() ? "" : "." + function.name);
}

bool gather(const hal_component& component, Page& page, std::string& problem) {
    page.name = component.name;
    std::replace(page.name.begin(), page.name.end(), '_', '-');
    page.summary = component.summary;
    page.doc = component.doc;
    page.singleton = component.flags & HAL_COMPONENT_SINGLETON;
    page.default_count = component.default_count;
    Gathering gathering{page, {}, {}, {}};
    const hal_host host{sizeof host, &gathering, take_pin, take_function, take_argument, allocate, take_failure, no_extension};
    const std::align_val_t align{component.instance_align};
    const auto release = [align](void* memory) { ::operator delete(memory, align); };
    const std::unique_ptr<void, decltype(release)> memory(::operator new(component.instance_size, align), release);
    std::fill_n(static_cast<char*>(memory.get()), component.instance_size, '\0');
    if (!component.create(&host, memory.get())) {
        problem = gathering.failure.empty() ? "its constructor fails and does not say why" : gathering.failure;
        return false;
    }
    component.destroy(memory.get());
    return true;
}

Page threads_page() {
    Page page;
    page.name = "threads";
    page.summary = "Makes up to three real-time threads";
    page.doc =
        "Fastest first; a slower thread's period is a whole multiple of the fastest one's. `newthread NAME PERIOD` makes any number of "
        "threads, "
        "one by one, with more options.\n\n"
        "Each thread has pins of its own: `NAME.time` and `NAME.tmax` (ns), `NAME.tmax-increased`, `NAME.threadbeat` (cycles), and what "
        "`show thread NAME` prints.\n";
    page.singleton = page.built_in = true;
    for (const char* n : {"1", "2", "3"}) {
        page.arguments.push_back({std::string("name") + n, std::string("name of thread ") + n, "", false});
        page.arguments.push_back({std::string("period") + n, "its period in ns", "", false});
        page.arguments.push_back({std::string("fp") + n, "accepted and ignored: every thread may use floating point", "1", false});
    }
    return page;
}

}  // namespace hal::tools
