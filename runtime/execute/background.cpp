// SPDX-License-Identifier: MIT
#include "execute/background.hpp"

#include <new>
#include <type_traits>

namespace hal {

Background::Shared& Background::of(const hal_background* host) {
    static_assert(std::is_standard_layout_v<Shared>);
    return *reinterpret_cast<Shared*>(const_cast<hal_background*>(host));
}

Background::Background(bool virtual_clock) {
    shared_.host.size = sizeof shared_.host;
    shared_.host.is_virtual = virtual_clock;
    shared_.host.attach = [](const hal_background* b, void (*work)(void*, std::int64_t),
                             void* self) {
        if (b->is_virtual == 0) return false;
        try {
            of(b).works.push_back({work, self});
        } catch (const std::bad_alloc&) {
            return false;
        }
        return true;
    };
    shared_.host.detach = [](const hal_background* b, void* self) {
        std::erase_if(of(b).works, [self](const Work& w) { return w.self == self; });
    };
}

void Background::run(std::int64_t now_ns) {
    for (const Work& w : shared_.works) {
        w.work(w.self, now_ns);
    }
}

}  // namespace hal
