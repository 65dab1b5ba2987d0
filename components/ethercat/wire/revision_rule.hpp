// SPDX-License-Identifier: MIT
// Which revisions of a device a description is valid for (ETG.2000, attribute CheckRevisionNo).
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "text/characters.hpp"

namespace hal::ethercat {

/// How the revision of a slave compares to an expected one; "low" and "high" are its halves of 16
/// bits.
enum class RevisionRule : std::uint8_t {
    any,
    equal,
    equal_or_higher,
    low_equal,
    low_equal_high_equal_or_higher,
    high_equal,
    high_equal_low_equal_or_higher,
};

/// Returns whether a slave of the revision `found` passes. [realtime]
constexpr bool accepts(RevisionRule rule, std::uint32_t expected, std::uint32_t found) noexcept {
    const bool same_low = (expected & 0xffff) == (found & 0xffff);
    const bool same_high = expected >> 16 == found >> 16;
    switch (rule) {
    case RevisionRule::any: return true;
    case RevisionRule::equal: return found == expected;
    case RevisionRule::equal_or_higher: return found >= expected;
    case RevisionRule::low_equal: return same_low;
    case RevisionRule::low_equal_high_equal_or_higher: return same_low && found >= expected;
    case RevisionRule::high_equal: return same_high;
    case RevisionRule::high_equal_low_equal_or_higher: return same_high && found >= expected;
    }
    return false;
}

/// Parses the value of CheckRevisionNo, as in "EQ_OR_G"; nullopt: unknown. [setup]
inline std::optional<RevisionRule> parse_revision_rule(std::string_view text) {
    struct Row {
        std::string_view text;
        RevisionRule rule;
    };
    constexpr Row rows[] = {
        {"NONE", RevisionRule::any},
        {"EQ", RevisionRule::equal},
        {"GE", RevisionRule::equal_or_higher},
        {"EQ_OR_G", RevisionRule::equal_or_higher},
        {"LW_EQ", RevisionRule::low_equal},
        {"LW_EQ_HW_GE", RevisionRule::low_equal_high_equal_or_higher},
        {"LW_EQ_HW_EQ_OR_G", RevisionRule::low_equal_high_equal_or_higher},
        {"HW_EQ", RevisionRule::high_equal},
        {"HW_EQ_LW_GE", RevisionRule::high_equal_low_equal_or_higher},
        {"HW_EQ_LW_EQ_OR_G", RevisionRule::high_equal_low_equal_or_higher},
    };
    for (const Row& row : rows) {
        if (same_word(row.text, text)) return row.rule;
    }
    return std::nullopt;
}

}  // namespace hal::ethercat
