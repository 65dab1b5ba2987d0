// SPDX-License-Identifier: MIT
// LinuxCNC's programs for streams. They return the exit status.
#pragma once

namespace hal::tools {

int halsampler(int argc, char** argv);   ///< hal record
int halstreamer(int argc, char** argv);  ///< hal play

}  // namespace hal::tools
