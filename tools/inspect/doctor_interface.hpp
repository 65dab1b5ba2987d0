// SPDX-License-Identifier: MIT
// `hal doctor --interface NAME`: what delays frames on an interface.
#pragma once

#include "inspect/doctor.hpp"

namespace hal::tools {

/// Prints the findings about the interface, and the round trip on its segment, or tries the
/// changes. Returns the exit code. [setup]
int run_interface_doctor(const DoctorOptions&);

}  // namespace hal::tools
