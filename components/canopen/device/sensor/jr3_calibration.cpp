// SPDX-License-Identifier: MIT
#include "jr3_calibration.hpp"

#include <algorithm>
#include <cmath>

#include "canopen/protocol/numbers.hpp"

namespace hal::canopen::jr3 {

namespace {
constexpr double max_load = 1e12;  // keeps infinite loads finite; beyond any full scale
}  // namespace

Six Calibration::wrench(const std::array<std::int16_t, 6>& raw) const noexcept {
    Six out{};
    for (std::size_t row = 0; row < 6; ++row) {
        double sum = 0;
        for (std::size_t n = 0; n < 6; ++n) {
            sum += matrix[row][n] * raw[n];
        }
        out[row] = sum / full_scale_counts * full_scale[row];
    }
    return out;
}

std::array<std::int16_t, 6> Calibration::raw(const Six& wrench,
                                             const std::array<Six, 6>& inverse) const noexcept {
    std::array<std::int16_t, 6> out{};
    for (std::size_t row = 0; row < 6; ++row) {
        double sum = 0;
        for (std::size_t n = 0; n < 6; ++n) {
            const double applied = std::clamp(wrench[n], -max_load, max_load);
            sum += inverse[row][n] * applied / full_scale[n];
        }
        const double counts = sum * full_scale_counts;
        out[row] =
            std::isnan(counts)
                ? std::int16_t{32767}
                : static_cast<std::int16_t>(std::lround(std::clamp(counts, -32768.0, 32767.0)));
    }
    return out;
}

bool Calibration::invert(std::array<Six, 6>& inverse) const noexcept {
    auto a = matrix;
    for (std::size_t row = 0; row < 6; ++row) {
        for (std::size_t n = 0; n < 6; ++n) {
            inverse[row][n] = row == n ? 1.0 : 0.0;
        }
    }
    for (std::size_t n = 0; n < 6; ++n) {  // Gauss and Jordan, the largest pivot
        std::size_t best = n;
        for (std::size_t row = n + 1; row < 6; ++row) {
            if (std::abs(a[row][n]) > std::abs(a[best][n])) {
                best = row;
            }
        }
        if (!(std::abs(a[best][n]) > 1e-9)) return false;
        std::swap(a[n], a[best]);
        std::swap(inverse[n], inverse[best]);
        const double pivot = a[n][n];
        for (std::size_t k = 0; k < 6; ++k) {
            a[n][k] /= pivot;
            inverse[n][k] /= pivot;
        }
        for (std::size_t row = 0; row < 6; ++row) {
            const double factor = a[row][n];
            if (row == n || factor == 0.0) continue;
            for (std::size_t k = 0; k < 6; ++k) {
                a[row][k] -= factor * a[n][k];
                inverse[row][k] -= factor * inverse[n][k];
            }
        }
    }
    return true;
}

void Calibration::write(std::span<std::uint8_t, memory_size> to) const noexcept {
    std::fill(to.begin(), to.end(), std::uint8_t{0});
    std::copy(signature.begin(), signature.end(), to.begin());
    std::size_t at = signature.size();
    const auto put = [&](double value) {
        store(to.data() + at, static_cast<float>(value));
        at += 4;
    };
    for (const auto& row : matrix) {
        for (const double value : row) {
            put(value);
        }
    }
    for (const double value : full_scale) {
        put(value);
    }
    for (const double value : overload) {
        put(value);
    }
    store(to.data() + at, serial);
    store(to.data() + memory_size - 2, crc16(to.first(memory_size - 2)));
}

bool Calibration::read(std::span<const std::uint8_t, memory_size> from) noexcept {
    if (!std::equal(signature.begin(), signature.end(), from.begin())) return false;
    if (load<std::uint16_t>(from.data() + memory_size - 2) != crc16(from.first(memory_size - 2))) {
        return false;
    }
    Calibration c;
    std::size_t at = signature.size();
    bool good = true;
    const auto get = [&](double& value, bool positive) {
        value = load<float>(from.data() + at);
        at += 4;
        good = good && std::isfinite(value) && std::abs(value) < 1e9 && (!positive || value > 0.0);
    };
    for (auto& row : c.matrix) {
        for (double& value : row) {
            get(value, false);
        }
    }
    for (double& value : c.full_scale) {
        get(value, true);
    }
    for (double& value : c.overload) {
        get(value, true);
    }
    c.serial = load<std::uint32_t>(from.data() + at);
    if (good) {
        *this = c;
    }
    return good;
}

}  // namespace hal::canopen::jr3
