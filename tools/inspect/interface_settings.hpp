// SPDX-License-Identifier: MIT
// The settings of a network interface that delay frames.
#pragma once

#include <string>
#include <vector>

#include "inspect/finding.hpp"
#include "inspect/setting_write.hpp"

namespace hal::tools {

/// A setting, its effect, and how to change it for control.
struct InterfaceSetting {
    Finding finding;
    /// what `--try` writes, and what restores the setting; empty: nothing to change
    std::vector<SettingWrite> change{};
    std::vector<SettingWrite> restore{};
};

/// An interface whose settings are examined.
struct ExaminedInterface {
    std::string name;
    std::vector<int> cpus{};   ///< of the threads that use it; empty: unknown
    bool has_address = false;  ///< other programs send on it by IP
    bool is_udp = false;       ///< what uses it sends by IP itself
};

/// Examines everything that delays frames: the driver and its bus, the link, and each setting that
/// it has. Needs no privilege. [setup]
std::vector<InterfaceSetting> examine(const ExaminedInterface&);

/// Returns true when the interface is up and has a carrier. [setup]
bool has_link(const std::string& interface);

/// Returns the CPUs of a list of the kernel: "0-2,5" is 0 1 2 5. [setup]
std::vector<int> cpus_of_list(const std::string& list);

}  // namespace hal::tools
