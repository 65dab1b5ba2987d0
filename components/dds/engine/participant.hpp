// SPDX-License-Identifier: MIT
// What the DDS thread needs of the participants. Included by the engine only.
#pragma once

#include <cstdint>

#include "hal/message_log.hpp"

namespace hal::dds {

/// Lease of a participant: after this time without announcements others drop it.
constexpr std::int64_t participant_lease_ns = 5'000'000'000;

/// Re-creates all participants of the process, with their writers and readers, under new
/// identities: for a process that was suspended for longer than its lease. Returns false when that
/// failed and must be repeated. [the DDS thread]
bool announce_anew() noexcept;

/// Returns the log of the engine and of Fast DDS. The DDS thread flushes it.
hal::MessageLog& engine_log();

}  // namespace hal::dds
