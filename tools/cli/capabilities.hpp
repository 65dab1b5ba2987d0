// SPDX-License-Identifier: MIT
#pragma once

namespace hal::tools {

/// What capabilities the program file gave this process the program it becomes has, too: hal-bus then needs no `setcap` of its own.
void pass_on_capabilities();

}  // namespace hal::tools
