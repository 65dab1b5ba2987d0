// SPDX-License-Identifier: MIT
// LinuxCNC's names for views of a running machine. They return the exit status of the view.
#pragma once

namespace hal::tools {

int halmeter(int argc, char** argv);  ///< hal meter
int halscope(int argc, char** argv);  ///< hal scope with names, else hal panel
int halshow(int argc, char** argv);   ///< hal panel

}  // namespace hal::tools
