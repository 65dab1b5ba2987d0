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
/// the restart of a CAN controller, raw frames, locked memory, real-time priority (capabilities(7),
/// "ambient set"). Those that this process does not have are left out. It calls the kernel directly,
/// for the calling thread only.
///
/// The destructor lowers exactly what the constructor has raised, however far that came. Lowering
/// needs no privilege. [setup]
class AmbientCapabilities {
public:
    AmbientCapabilities() noexcept {
        Sets sets{};
        if (!read(sets)) return;
        for (const unsigned one : passed_on) {
            const std::uint32_t permitted = sets[0].permitted & bit(one);
            inherited_ |= permitted & ~sets[0].inheritable;
            sets[0].inheritable |= permitted;
        }
        if (!write(sets)) {
            inherited_ = 0;
            return;
        }
        for (const unsigned one : passed_on) {
            if (!is_ambient(one) && control(PR_CAP_AMBIENT_RAISE, one) == 0) {
                raised_ |= bit(one);
            }
        }
    }
    ~AmbientCapabilities() {
        for (const unsigned one : passed_on) {
            if ((raised_ & bit(one)) != 0) {
                control(PR_CAP_AMBIENT_LOWER, one);
            }
        }
        Sets sets{};
        if (inherited_ == 0 || !read(sets)) return;
        sets[0].inheritable &= ~inherited_;
        write(sets);
    }
    AmbientCapabilities(const AmbientCapabilities&) = delete;

private:
    using Sets = std::array<__user_cap_data_struct, _LINUX_CAPABILITY_U32S_3>;
    // NET_ADMIN, NET_RAW, IPC_LOCK, SYS_NICE
    static constexpr std::array passed_on = {12U, 13U, 14U, 23U};

    static constexpr std::uint32_t bit(unsigned capability) noexcept {
        return std::uint32_t{1} << capability;
    }
    static bool read(Sets& sets) noexcept {
        __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
        return syscall(SYS_capget, &header, sets.data()) == 0;
    }
    static bool write(const Sets& sets) noexcept {
        __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
        return syscall(SYS_capset, &header, sets.data()) == 0;
    }
    /// Fails without effect for one that is not permitted or not inheritable.
    static int control(int action, unsigned capability) noexcept {
        return prctl(PR_CAP_AMBIENT, static_cast<unsigned long>(action),
                     static_cast<unsigned long>(capability), 0UL, 0UL);
    }
    static bool is_ambient(unsigned capability) noexcept {
        return control(PR_CAP_AMBIENT_IS_SET, capability) == 1;
    }

    std::uint32_t inherited_ = 0;  // bits of capabilities that were made inheritable
    std::uint32_t raised_ = 0;  // and of those that were raised
};

}  // namespace hal::bus
