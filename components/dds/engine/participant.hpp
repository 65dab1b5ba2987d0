// SPDX-License-Identifier: MIT
// What the DDS thread asks of the participants. Included by the engine only.
#pragma once

#include <cstdint>

#include "hal/message_log.hpp"

namespace hal::dds {

/// A participant that is not heard of for so long is forgotten.
constexpr std::int64_t participant_lease_ns = 5'000'000'000;

/// Makes all participants of the process again, with their writers and readers, under new identities: for a process that stood still for so
/// long that others have forgotten it, and may not find the old one again. False: it did not go; to be tried again. [the DDS thread]
bool announce_anew() noexcept;

/// What the engine and Fast DDS print. The DDS thread flushes it.
hal::MessageLog& engine_log();

}  // namespace hal::dds
