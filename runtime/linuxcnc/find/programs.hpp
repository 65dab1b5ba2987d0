// SPDX-License-Identifier: MIT
#pragma once

#include <string>

namespace hal {

/// Returns the folder of liblinuxcnchal.so.0 (runtime/linuxcnc/programs), by which LinuxCNC's
/// programs connect to us, or "". Its `bin` has our programs under LinuxCNC's names. Both come
/// before LinuxCNC's own in the environment of what is started. [setup]
std::string linuxcnc_folder();

}  // namespace hal
