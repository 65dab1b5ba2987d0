// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>

#include <linux/capability.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace hal::bus {

/// Passes the capabilities of the program's file on to a program that is started while this exists:
/// raw frames, locked memory, real-time priority (capabilities(7), "ambient set"). Those that this
/// process does not have are left out. It calls the kernel directly, for the calling thread only.
/// [setup]
class AmbientCapabilities {
public:
    AmbientCapabilities() noexcept {
        if (syscall(SYS_capget, &header_, before_.data()) != 0) return;
        auto raised = before_;
        for (const unsigned one : passed_on) {
            raised[0].inheritable |= raised[0].permitted & bit(one);
        }
        is_raised_ = syscall(SYS_capset, &header_, raised.data()) == 0;
        for (const unsigned one : passed_on) {
            set_ambient(one, PR_CAP_AMBIENT_RAISE);
        }
    }
    ~AmbientCapabilities() {
        if (!is_raised_) return;
        for (const unsigned one : passed_on) {
            if ((before_[0].inheritable & bit(one)) == 0) {
                set_ambient(one, PR_CAP_AMBIENT_LOWER);
            }
        }
        syscall(SYS_capset, &header_, before_.data());
    }
    AmbientCapabilities(const AmbientCapabilities&) = delete;

private:
    static constexpr std::array passed_on = {13U, 14U, 23U};  // NET_RAW, IPC_LOCK, SYS_NICE

    static constexpr std::uint32_t bit(unsigned capability) noexcept {
        return std::uint32_t{1} << capability;
    }
    /// Fails without effect for one that is not permitted.
    void set_ambient(unsigned capability, int action) const noexcept {
        if (is_raised_) {
            prctl(PR_CAP_AMBIENT, static_cast<unsigned long>(action),
                  static_cast<unsigned long>(capability), 0UL, 0UL);
        }
    }

    __user_cap_header_struct header_{_LINUX_CAPABILITY_VERSION_3, 0};
    std::array<__user_cap_data_struct, _LINUX_CAPABILITY_U32S_3> before_{};
    bool is_raised_ = false;
};

}  // namespace hal::bus
