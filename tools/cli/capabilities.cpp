// SPDX-License-Identifier: MIT
#include "cli/capabilities.hpp"

#include <memory>
#include <type_traits>

#include <sys/capability.h>
#include <unistd.h>

namespace hal::tools {

void pass_on_capabilities() {
    if (::geteuid() == 0) return;
    const std::unique_ptr<std::remove_pointer_t<cap_t>, int (*)(void*)> set(::cap_get_proc(),
                                                                            &::cap_free);
    if (!set) return;
    for (cap_value_t capability = 0; capability < ::cap_max_bits(); ++capability) {
        cap_flag_value_t permitted = CAP_CLEAR;
        if (::cap_get_flag(set.get(), capability, CAP_PERMITTED, &permitted) == 0 &&
            permitted == CAP_SET) {
            ::cap_set_flag(set.get(), CAP_INHERITABLE, 1, &capability, CAP_SET);
        }
    }
    if (::cap_set_proc(set.get()) != 0) return;
    for (cap_value_t capability = 0; capability < ::cap_max_bits(); ++capability) {
        ::cap_set_ambient(capability,
                          CAP_SET);  // fails for a capability that is not permitted, without effect
    }
}

}  // namespace hal::tools
