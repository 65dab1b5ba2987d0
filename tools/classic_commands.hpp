// SPDX-License-Identifier: MIT
// LinuxCNC's programs for machines, with their option letters. They return the exit status.
#pragma once

namespace hal::tools {

int halcmd(int argc, char** argv);  ///< hal shell
int halrun(int argc, char** argv);  ///< hal run
/// The configuration program of LinuxCNC's EtherCAT component: hal ethercat lcec-conf.
int lcec_conf(int argc, char** argv);
int mb2hal(int argc, char** argv);
/// Prints what can follow $COMP_LINE in the running machine, one word per line, as bash's
/// `complete -C` wants it. Fails without a running machine.
int complete_word();

}  // namespace hal::tools
