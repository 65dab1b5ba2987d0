// SPDX-License-Identifier: MIT
// The real-time guard of every build: while a cycle is open on a thread, allocating, locking or
// blocking ends the process with a line that names the call. Under HALCYON_RT_GUARD the real-time
// sanitizer does the same, with a stack.
#pragma once

namespace hal::test {

/// True when a guard works in this build: the other sanitizers need these calls for themselves.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool guarded = false;
#else
constexpr bool guarded = true;
#endif

}  // namespace hal::test
