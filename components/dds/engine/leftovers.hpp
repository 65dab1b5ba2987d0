// SPDX-License-Identifier: MIT
// What killed processes leave behind.
#pragma once

namespace hal::dds {

/// Removes from /dev/shm the segments of Fast DDS whose process is dead: a process that lives holds a lock on the file NAME_el beside
/// its segment NAME. Says how many they were. (Of the ports, the next process that wants one takes care.) [setup]
void remove_leftovers();

}  // namespace hal::dds
