// SPDX-License-Identifier: MIT
// The calibration memory of a force/torque sensor: how six raw readings become three forces and
// three torques. The layout is this project's own; the maker's is not public.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "jr3_stream.hpp"

namespace hal::canopen::jr3 {

using Six = std::array<double, 6>;

inline constexpr double full_scale_counts = 16384;
/// First bytes of the memory.
inline constexpr std::array<std::uint8_t, 8> signature{'J', 'R', '3', ' ', 'C', 'A', 'L', 1};

/// Contents of the memory.
struct Calibration {
    /// Wrench as parts of full scale = matrix · raw readings as parts of full_scale_counts. The
    /// default has some crosstalk.
    std::array<Six, 6> matrix{{{1.02, 0.012, -0.008, 0.004, 0.021, -0.003},
                               {-0.015, 0.97, 0.006, -0.018, 0.002, 0.005},
                               {0.007, -0.011, 1.01, 0.003, -0.006, 0.009},
                               {0.002, 0.024, -0.005, 0.99, 0.011, -0.007},
                               {-0.026, 0.004, 0.008, -0.009, 1.03, 0.006},
                               {0.005, -0.003, 0.013, 0.006, -0.012, 0.98}}};
    Six full_scale{100, 100, 200, 5, 5, 5};  ///< N and N·m
    /// overload limits of the sensor, N and N·m
    Six overload{471.4, 471.4, 1862.2, 20.31, 20.31, 15.8};
    std::uint32_t serial = 1;

    /// Returns the wrench of raw readings, N and N·m. [realtime]
    Six wrench(const std::array<std::int16_t, 6>& raw) const noexcept;
    /// Returns the raw readings of a wrench, by the inverse of `matrix`. [realtime]
    std::array<std::int16_t, 6> raw(const Six& wrench,
                                    const std::array<Six, 6>& inverse) const noexcept;
    /// Computes the inverse of `matrix`. Returns false when it is singular. [setup]
    bool invert(std::array<Six, 6>& inverse) const noexcept;

    /// Writes signature · matrix, full scales, overloads as REAL32 · serial · zeros · CRC-16 of all
    /// before. [any]
    void write(std::span<std::uint8_t, memory_size>) const noexcept;
    /// Reads the memory. Returns false and changes nothing when signature, CRC or a value is
    /// invalid. [realtime]
    bool read(std::span<const std::uint8_t, memory_size>) noexcept;
};

}  // namespace hal::canopen::jr3
