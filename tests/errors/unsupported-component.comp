// SPDX-License-Identifier: MIT
component unsupported_component "A trajectory planner for LinuxCNC's motion controller";
option tpmod;
license "MIT";
;;
