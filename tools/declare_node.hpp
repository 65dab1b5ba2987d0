// SPDX-License-Identifier: MIT
// The options of `hal node KIND`, and one that several commands take.
#pragma once

namespace CLI {
class App;
}

namespace hal::tools {

struct Options;

/// --for TIME.
void for_how_long(CLI::App&, Options&, const char* what);

void declare_node(CLI::App&, Options&);  ///< what every kind takes
void declare_node_drive(CLI::App&, Options&);
void declare_node_io(CLI::App&, Options&);
void declare_node_axis_io(CLI::App&, Options&);
void declare_node_jr3(CLI::App&, Options&);
void declare_node_bootloader(CLI::App&, Options&);
void declare_node_faults(CLI::App&, Options&);

}  // namespace hal::tools
