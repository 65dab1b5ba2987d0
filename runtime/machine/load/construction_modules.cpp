// SPDX-License-Identifier: MIT
// What the constructor of a LinuxCNC module may do beside what every component does: create threads
// and alias pins.
#include <algorithm>

#include "machine/load/construction.hpp"

namespace hal {
namespace {

const hal_component* component_of(const hal_host* host) {
    return construction_of(host).instance.component->plugin;
}

bool arguments_known(const hal_host* host) {
    Construction& c = construction_of(host);
    return guarded(c, false, [&] {
        if (all_known(*c.instance.component, c.request, c.asked, *c.diagnostics)) return true;
        c.said_why = true;
        return false;
    });
}

bool take_thread(const hal_host* host, const char* name, int64_t period_ns) {
    Construction& c = construction_of(host);
    return guarded(c, false, [&] {
        // it may have survived the module's last unloading
        if (const Thread* const there =
                c.thread_names.contains(name) ? nullptr : c.model.find_thread(name)) {
            return there->options.period_ns == period_ns;
        }
        if (!c.thread_names.insert(name).second) return false;
        c.threads.push_back({name, period_ns});
        return true;
    });
}

bool take_alias(const hal_host* host, const char* name, const char* alias) {
    Construction& c = construction_of(host);
    return guarded(c, false, [&] {
        const auto pin = std::find_if(c.pins.begin(), c.pins.end(),
                                      [&](const auto& one) { return one.first->name == name; });
        if (pin == c.pins.end()) return false;
        pin->first->alias = alias ? alias : "";
        return true;
    });
}

void note_memory(const hal_host* host, const void* begin, std::size_t bytes) {
    Construction& c = construction_of(host);
    guarded(c, false, [&] {
        auto& further = c.instance.further;
        constexpr std::uintptr_t gap = 64;
        const auto at = reinterpret_cast<std::uintptr_t>(begin);
        const std::uintptr_t end =
            further.empty()
                ? 0
                : reinterpret_cast<std::uintptr_t>(further.back().begin) + further.back().bytes;
        if (!further.empty() && at >= end && at - end < gap) {
            further.back().bytes += at - end + bytes;
        } else {
            further.push_back({begin, bytes});
        }
        return true;
    });
}

}  // namespace

const hal_modules modules_extension{
    sizeof modules_extension, component_of, arguments_known, take_thread, take_alias, note_memory};

}  // namespace hal
