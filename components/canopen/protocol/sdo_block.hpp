// SPDX-License-Identifier: MIT
// The block sizes that the receiver of an SDO block transfer asks for; client and server use the
// same rule (CiA 301).
#pragma once

#include <cstdint>

namespace hal::canopen {

/// How the next block compares with this one: smaller after a lost segment, larger after a complete
/// block.
enum class BlockChange : std::uint8_t { smaller, same, larger };

/// Returns the size of the next block, 1..127 segments. `good` is the number of segments just
/// received in sequence, `acknowledged` that of the previous acknowledgement, `max` the configured
/// limit. After a loss the size differs from the size before and from `good`, so that two
/// successive acknowledgements are never equal and the sender can recognise a duplicate. [any]
constexpr std::uint8_t next_block_size(std::uint8_t size, BlockChange change, std::uint8_t good,
                                       std::uint8_t acknowledged, std::uint8_t max) noexcept {
    const unsigned limit = max < 1 ? 1 : max > 127 ? 127 : max;
    const auto after_loss = [&] {
        if (limit <= 2) return static_cast<std::uint8_t>(size * 2U > limit ? limit : size * 2U);
        unsigned next = size > 1 ? size / 2U : 2;
        while (next == good || next == size) {
            ++next;
        }
        return static_cast<std::uint8_t>(next);
    };
    auto next = size;
    if (change == BlockChange::smaller) {
        next = after_loss();
    } else if (change == BlockChange::larger) {
        next = static_cast<std::uint8_t>(size * 2U > limit ? limit : size * 2U);
    }
    return good == acknowledged && next == size && good != size ? after_loss() : next;
}

}  // namespace hal::canopen
