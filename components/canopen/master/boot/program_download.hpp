// SPDX-License-Identifier: MIT
// The program of a node with a boot loader: its check, and the download of another one.
#pragma once

#include "boot_channel.hpp"

namespace hal::canopen {

/// The result of check_program().
enum class ProgramCheck : std::uint8_t {
    failed,    ///< the boot has failed
    good,      ///< it is the configured one, or it is not checked
    replaced,  ///< the configured one was downloaded, and the node restarts with it
};

/// Compares the program of the node with the configured one (CiA 302-2, figure 8) and downloads a
/// different one (CiA 302-3, figure 3). `downloaded`: it was downloaded in this boot, which is not
/// done twice. [realtime]
Task<ProgramCheck> check_program(BootChannel&, bool downloaded) noexcept;

}  // namespace hal::canopen
