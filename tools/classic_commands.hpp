// SPDX-License-Identifier: MIT
// LinuxCNC's programs for machines, with their option letters. They return the exit status.
#pragma once

namespace hal::tools {

int halcmd(int argc, char** argv);  ///< hal shell
int halrun(int argc, char** argv);  ///< hal run
/// The configuration program of LinuxCNC's EtherCAT component: hal ethercat lcec-conf.
int lcec_conf(int argc, char** argv);
int mb2hal(int argc, char** argv);

}  // namespace hal::tools
