// SPDX-License-Identifier: MIT
// A library without the one symbol a plugin has.
extern "C" int not_a_plugin() { return 0; }
