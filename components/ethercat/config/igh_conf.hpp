// SPDX-License-Identifier: MIT
// The file ethercat.conf of the IgH master, where users of LinuxCNC's lcec have the network
// interface of each master.
#pragma once

#include <string>
#include <string_view>

namespace hal::ethercat::config {

/// Returns the value of MASTER<index>_DEVICE or MASTER<index>_BACKUP, or an empty text. [setup]
std::string device_of(std::string_view text, unsigned index, bool backup);

/// Returns the link address of a device: "eth:enp3s0" for an interface or the MAC address of one,
/// other link addresses as they are. Returns an empty text if no interface in `interfaces` has the
/// MAC address. [setup]
std::string link_of_device(std::string_view device,
                           const std::string& interfaces = "/sys/class/net");

/// The link addresses of a master, and the file that has them.
struct IghLinks {
    std::string link, backup;  ///< empty: none
    std::string file;  ///< empty: no file has a device for this master
    std::string problem;  ///< of a device that is missing, or empty
};
/// Looks for the devices of a master in `folder`/ethercat.conf, then in /etc. [setup]
IghLinks find_igh_links(const std::string& folder, unsigned index);

}  // namespace hal::ethercat::config
