// SPDX-License-Identifier: MIT
#include "cli/capabilities.hpp"

#include <linux/capability.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace hal::tools {

void pass_on_capabilities() {
    __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
    __user_cap_data_struct sets[2]{};
    if (::geteuid() == 0 || ::syscall(SYS_capget, &header, sets) != 0) return;
    for (auto& set : sets) set.inheritable |= set.permitted;
    if (::syscall(SYS_capset, &header, sets) != 0) return;
    for (unsigned long capability = 0; capability < 64; ++capability)
        if ((sets[capability / 32].permitted >> (capability % 32)) & 1U) ::prctl(PR_CAP_AMBIENT, PR_CAP_AMBIENT_RAISE, capability, 0UL, 0UL);
}

}  // namespace hal::tools
