// SPDX-License-Identifier: MIT
// What to type when the kernel denies a program what it needs.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

#include <linux/capability.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace hal {

namespace privilege {
// CAP_NET_ADMIN, CAP_SYS_RAWIO
inline constexpr std::uint64_t net_admin = 1U << 12;
inline constexpr std::uint64_t raw_io = 1U << 17;
struct Extra {
    std::uint64_t bit;
    std::string_view name, option;
};
inline constexpr std::array extras{Extra{net_admin, "cap_net_admin", "NET_ADMIN"},
                                   Extra{raw_io, "cap_sys_rawio", "SYS_RAWIO"}};

/// Returns the permitted capabilities of this process as a bit set. Calls the kernel directly: with
/// libcap, every component would depend on it.
inline std::uint64_t permitted() {
    __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
    std::array<__user_cap_data_struct, _LINUX_CAPABILITY_U32S_3> sets{};
    if (syscall(SYS_capget, &header, sets.data()) != 0) return 0;
    return std::uint64_t{sets[1].permitted} << 32 | sets[0].permitted;
}

/// Returns true where no program may have the capabilities of real-time threads and raw frames, as
/// in a container that withholds them. The kernel does not even start a program whose file has
/// them.
inline bool withheld() {
    constexpr std::array needed = {13UL, 14UL, 23UL};  // CAP_NET_RAW, CAP_IPC_LOCK, CAP_SYS_NICE
    for (const unsigned long one : needed) {
        if (prctl(PR_CAPBSET_READ, one, 0UL, 0UL, 0UL) == 0) return true;
    }
    return false;
}

inline std::string program() {
    std::array<char, 4096> path{};
    const ssize_t size = readlink("/proc/self/exe", path.data(), path.size());
    std::string name = size > 0 ? std::string(path.data(), static_cast<std::size_t>(size)) : "hal";
    constexpr std::string_view deleted = " (deleted)";
    // `hal` passes its capabilities on to them
    constexpr std::array<std::string_view, 2> helpers = {"/hal-bus", "/hal-tools"};
    // rebuilt since it was started
    if (name.ends_with(deleted)) {
        name.resize(name.size() - deleted.size());
    }
    for (const std::string_view helper : helpers) {
        if (name.ends_with(helper)) {
            name.resize(name.size() - helper.size() + std::string_view("/hal").size());
        }
    }
    return name;
}

inline std::string shell_word(const std::string& word) {
    if (word.find_first_of(" \t\n'\"\\$`*?[]{}()<>|&;#~!") == std::string::npos) return word;
    std::string text = "'";
    for (const char c : word) {
        text += c == '\'' ? std::string("'\\''") : std::string(1, c);
    }
    return text + "'";
}

}  // namespace privilege

/// Returns the command that grants this program the capabilities of real-time threads and raw
/// frames, and those of privilege::extras that are in `more` or that it already has: `sudo setcap
/// ... /usr/local/bin/hal`. File capabilities are replaced as a whole, so it names all of them. In
/// a container that withholds them, returns what to add to the command that starts it. [setup]
inline std::string grant_command(std::uint64_t more = 0) {
    const std::uint64_t wanted = more | (geteuid() != 0 ? privilege::permitted() : 0);
    std::string names = "cap_sys_nice,cap_ipc_lock,cap_net_raw";
    std::string options = "--cap-add=SYS_NICE --cap-add=IPC_LOCK --cap-add=NET_RAW";
    for (const auto& [bit, name, option] : privilege::extras) {
        if ((wanted & bit) != 0) {
            names += "," + std::string(name);
        }
        if ((more & bit) != 0) {
            options += " --cap-add=" + std::string(option);
        }
    }
    if (privilege::withheld()) {
        return options + " in the command that starts this container, which withholds them";
    }
    return "sudo setcap " + names + "=ep " + privilege::shell_word(privilege::program());
}

}  // namespace hal
