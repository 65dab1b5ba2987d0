// SPDX-License-Identifier: MIT
#pragma once

namespace hal::tools {

/// Makes the permitted capabilities of this process ambient, so that the next exec() keeps them:
/// hal-bus needs no `setcap` of its own. [setup]
void pass_on_capabilities();

}  // namespace hal::tools
