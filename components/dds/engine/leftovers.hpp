// SPDX-License-Identifier: MIT
// Shared memory of killed processes.
#pragma once

namespace hal::dds {

/// Removes from /dev/shm the segments of Fast DDS whose process is dead, and prints their number: a
/// running process holds a lock on the file NAME_el next to its segment NAME. (Ports are reused by
/// the next process.) [setup]
void remove_leftovers();

}  // namespace hal::dds
