// SPDX-License-Identifier: MIT
// The far end of a sampler's or streamer's FIFO: records to JSON and back. The session's lock must
// be held: it keeps the stream alive and makes its callers one.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "hal/abi.h"

namespace hal {

/// Appends `,"types":"bf","depth":N,"waiting":N,"lost":N` to a JSON object.
void describe_stream(const hal_stream& stream, std::string& to);
/// Takes at most so many records out and appends `,"numbers":[…],"records":[[…],…]`. False: `why`
/// it cannot be read.
bool pop_records(hal_stream& stream, std::uint64_t max, std::string& to, std::string& why);
/// Appends as many records as there is space for, and `,"taken":N` to the reply. On an error
/// returns false, appends none and sets `why`.
bool feed_records(hal_stream& stream, const std::vector<std::vector<std::string>>& records,
                  std::string& to, std::string& why);

}  // namespace hal
