// SPDX-License-Identifier: MIT
#include "machine/load/declared.hpp"

#include <algorithm>
#include <map>
#include <memory>
#include <new>

#include "hal/modules.h"
#include "linuxcnc/binary/module_host.hpp"

namespace hal {

namespace {

/// What the constructor declares.
struct Gathering {
    Declared& page;
    std::map<const void*, std::string> names;  // of functions, by their identity
    std::vector<std::unique_ptr<char[]>> blocks;
    std::string failure;
};

Gathering& of(const hal_host* host) { return *static_cast<Gathering*>(host->data); }
std::string text(const char* t) { return t ? t : ""; }

bool gather_pin(const hal_host* host, const hal_pin_decl* decl, hal_pin* memory) {
    Gathering& g = of(host);
    memory->own = decl->initial;
    memory->slot = &memory->own;
    if (decl->size >= sizeof *decl && decl->pointer) {
        *decl->pointer = memory->slot;
    }
    Declared::Pin pin;
    pin.name = text(decl->name);
    pin.doc = text(decl->doc);
    pin.unit = text(decl->unit);
    if (const auto user = g.names.find(decl->function); user != g.names.end()) {
        pin.function = user->second;
    }
    pin.type = decl->type;
    pin.dir = decl->dir;
    pin.initial = decl->initial;
    pin.safe = decl->safe;
    pin.has_safe = decl->flags & HAL_PIN_SAFE;
    pin.finite = decl->flags & HAL_PIN_FINITE;
    pin.read_only = decl->dir == HAL_DIR_PARAM && (decl->flags & HAL_PIN_READ_ONLY);
    g.page.pins.push_back(std::move(pin));
    return true;
}

bool gather_function(const hal_host* host, const hal_function_decl* decl) {
    Gathering& g = of(host);
    if (decl->flags & HAL_FUNCTION_EMERGENCY) return true;
    g.page.functions.push_back(
        {text(decl->name), text(decl->doc), (decl->flags & HAL_FUNCTION_SHARED) != 0});
    g.names[decl->identity] = g.page.full_name(g.page.functions.back());
    return true;
}

const char* gather_argument(const hal_host* host, const hal_argument_decl* decl) {
    auto& arguments = of(host).page.arguments;
    const std::string name = text(decl->name);
    // a list may be read once for the instance and once as a whole
    const bool is_known = std::any_of(arguments.begin(), arguments.end(),
                                      [&](const auto& one) { return one.name == name; });
    if (!is_known) {
        arguments.push_back({name, text(decl->doc), text(decl->fallback),
                             (decl->flags & HAL_ARGUMENT_PER_INSTANCE) != 0});
    }
    return decl->fallback;
}

void* gather_block(const hal_host* host, std::size_t bytes, std::size_t align) {
    auto& blocks = of(host).blocks;
    blocks.push_back(std::make_unique<char[]>(bytes + align));
    const auto address = reinterpret_cast<std::uintptr_t>(blocks.back().get());
    return reinterpret_cast<void*>((address + align - 1) / align * align);
}

void gather_failure(const hal_host* host, const char* reason) { of(host).failure = text(reason); }
void gather_rejection(const hal_host* host, const hal_rejection* rejection) {
    gather_failure(host, rejection->text);
}
const void* no_extension(const hal_host*, const char*) { return nullptr; }

}  // namespace

std::string Declared::instance() const { return singleton ? name : name + ".N"; }

std::string Declared::full_name(const Function& function) const {
    if (whole_names) return function.name;
    return (function.shared ? name : instance()) +
           (function.name.empty() ? "" : "." + function.name);
}

bool gather(const hal_component& component, Declared& page, std::string& problem,
            const std::function<void()>& before_destruction) {
    page.name = component.name;
    std::replace(page.name.begin(), page.name.end(), '_', '-');
    page.summary = component.summary;
    page.doc = component.doc;
    page.singleton = component.flags & HAL_COMPONENT_SINGLETON;
    page.whole_names = component.flags & HAL_COMPONENT_WHOLE_NAMES;
    page.default_count = component.default_count;
    if (component.flags & HAL_COMPONENT_MODULE) {  // not run: it may access hardware
        const auto& module = reinterpret_cast<const halcyon_module&>(component);
        for (std::size_t i = 0; i < module.parameter_count; ++i) {
            page.arguments.push_back(
                {module.parameters[i].name, text(module.parameters[i].doc), "", false});
        }
        return true;
    }
    Gathering gathering{page, {}, {}, {}};
    const hal_host host{sizeof host,     &gathering,      gather_pin,
                        gather_function, gather_argument, gather_block,
                        gather_failure,  no_extension,    gather_rejection};
    const std::align_val_t align{component.instance_align};
    const auto release = [align](void* memory) { ::operator delete(memory, align); };
    const std::unique_ptr<void, decltype(release)> memory(
        ::operator new(component.instance_size, align), release);
    std::fill_n(static_cast<char*>(memory.get()), component.instance_size, '\0');
    if (!component.create(&host, memory.get())) {
        problem = gathering.failure.empty() ? "its constructor failed without a reason"
                                            : gathering.failure;
        return false;
    }
    if (before_destruction) {
        before_destruction();
    }
    component.destroy(memory.get());
    return true;
}

}  // namespace hal
