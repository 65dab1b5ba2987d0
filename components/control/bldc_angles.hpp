// SPDX-License-Identifier: MIT
// Electrical angles of a three-phase motor: Hall patterns and phase values. Angles are turns, 0 to
// 1.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>

namespace bldc {

/// The codes H1 H2 H3 (as 4 2 1) in the order of the excitations B-A C-A C-B A-B A-C B-C (source -
/// sink), per pattern. Excitation number s fits a rotor around (s + 1) / 6 of a turn.
inline constexpr std::uint32_t pattern_count = 48;
inline constexpr const char* patterns[pattern_count] = {
    "013764", "102675", "023754", "132645", "231546", "320457", "201576", "310467",
    "015762", "104673", "026751", "137640", "237540", "326451", "204573", "315462",
    "045732", "154623", "046731", "157620", "267510", "376401", "264513", "375402",
    "457320", "546231", "467310", "576201", "675102", "764013", "645132", "754023",
    "451326", "540237", "462315", "573204", "673104", "762015", "640137", "751026",
    "401376", "510267", "402375", "513264", "623154", "732045", "620157", "731046",
};

/// Returns `angle` (turns) without its whole turns, 0..1; 0 for NaN and infinity. [realtime]
inline double fraction(double angle) noexcept {
    const double rest = angle - std::floor(angle);
    return rest >= 0.0 && rest < 1.0 ? rest : 0.0;
}

inline const char* codes(std::uint32_t pattern) noexcept {
    return patterns[pattern < pattern_count ? pattern : 25];
}

/// Returns the number of the state with this code, 0..5, or -1 if the pattern does not contain it.
/// [realtime]
inline int state_of(unsigned code, std::uint32_t pattern) noexcept {
    for (int i = 0; i < 6; ++i) {
        if (static_cast<unsigned>(codes(pattern)[i] - '0') == code) return i;
    }
    return -1;
}

/// Returns the code of a motor with this pattern at the rotor angle `rotor` (turns). [realtime]
inline unsigned code_of(double rotor, std::uint32_t pattern) noexcept {
    const auto state = static_cast<std::size_t>(fraction(rotor - 1.0 / 12.0) * 6.0) % 6;
    return static_cast<unsigned>(codes(pattern)[state] - '0');
}

/// Returns the phase values A B C of a field at `phase` (turns), amplitude 1. [realtime]
inline std::array<double, 3> sine(double phase) noexcept {
    const double angle = 2.0 * std::numbers::pi * phase;
    const double third = 2.0 * std::numbers::pi / 3.0;
    return {std::cos(angle), std::cos(angle - third), std::cos(angle + third)};
}

/// Returns the pair of phases whose field is nearest to `phase` (turns). [realtime]
inline std::array<double, 3> trapezoid(double phase) noexcept {
    constexpr std::array<double, 3> pairs[6] = {{1, 0, -1}, {0, 1, -1}, {-1, 1, 0},
                                                {-1, 0, 1}, {0, -1, 1}, {1, -1, 0}};
    return pairs[static_cast<std::size_t>(fraction(phase) * 6.0) % 6];
}

}  // namespace bldc
