// SPDX-License-Identifier: MIT
// The file descriptors without which the runtime is deaf: control socket, signals, wake-ups.
// Components run in the same process and can close or replace them, which no poll() reports.
#pragma once

namespace hal {

/// Names a descriptor that the runtime has opened: "the control socket". A literal. Descriptors
/// beyond the first 64 are not watched. [setup]
void list_descriptor(int descriptor, const char* name) noexcept;
/// Ends that. Called before the runtime closes the descriptor. [setup]
void unlist_descriptor(int descriptor) noexcept;
/// unlist_descriptor(), then close(). [setup]
void close_own(int descriptor) noexcept;
/// Returns the name of a descriptor of the runtime; nullptr: it is not listed. [any]
const char* own_descriptor(int descriptor) noexcept;
/// Returns the lowest listed descriptor within first..last; -1: none. [any]
int own_descriptor_within(unsigned first, unsigned last) noexcept;

/// A listed descriptor that is closed, or refers to another file than it did.
struct LostDescriptor {
    int number = -1;
    const char* name = nullptr;
    bool replaced = false;
};
/// Looks for one. Returns false when all are intact. [setup]
bool find_lost_descriptor(LostDescriptor& lost) noexcept;

/// Returns false when a listed descriptor is lost: its number may belong to another file by now.
/// [setup]
bool is_intact(int descriptor) noexcept;

/// In a child process that fork() has made: closes the copies of all listed descriptors and forgets
/// them. async-signal-safe
void drop_descriptors_of_parent() noexcept;

}  // namespace hal
