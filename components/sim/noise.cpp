// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

#include "hal/component.hpp"
#include "hal/limit.hpp"
#include "hal/retained.hpp"

namespace {

/// xorshift64*: G. Marsaglia, *Xorshift RNGs*, Journal of Statistical Software 8 (2003); S. Vigna,
/// *An experimental exploration of Marsaglia's xorshift generators, scrambled*, ACM TOMS 42 (2016).
/// Its state must not be 0.
class Bits {
public:
    void seed(std::uint32_t from) noexcept {
        state_ = (std::uint64_t{from} + 1) * 0x9E3779B97F4A7C15u;
        for (int i = 0; i < 16; ++i) {
            next();  // seeds that differ by one bit go apart
        }
    }
    std::uint64_t next() noexcept {
        state_ ^= state_ >> 12;
        state_ ^= state_ << 25;
        state_ ^= state_ >> 27;
        return state_ * 0x2545F4914F6CDD1Du;
    }
    /// Evenly from -1 up to below 1.
    double even() noexcept { return static_cast<double>(next() >> 11) * 0x1p-52 - 1.0; }

private:
    std::uint64_t state_ = 1;
};

enum Type : std::uint32_t { uniform = 0, gauss = 1, pink = 2 };

struct Noise : hal::Component {
    using Component::Component;
    hal::In<std::uint32_t> type{*this, "type", "0 uniform; 1 Gaussian; 2 pink"};
    hal::In<double> amplitude{*this,
                              "amplitude",
                              "uniform: largest value; Gaussian and pink: standard deviation",
                              {.initial = 1.0}};
    hal::In<double> offset{*this, "offset", "added to it"};
    hal::In<double> in{*this, "in", "added to it: the signal that is to be noisy"};
    hal::In<bool> enable{*this, "enable", "FALSE: out is in + offset", {.initial = true}};
    hal::In<std::uint32_t> hold{*this, "hold", "cycles for which a value stays", {.initial = 1}};
    hal::OptionalLimit limit{*this, "limit", "largest noise; 0: none"};
    hal::Param<std::uint32_t> seed{*this, "seed",
                                   "where the sequence starts; a change starts it anew"};
    hal::In<bool> restart{*this, "restart", "a rising edge starts the sequence anew"};
    hal::Out<double> out{*this, "out", "in + offset + noise"};
    hal::Out<double> noise{*this, "noise", "the noise alone", {.finite = true}};
    hal::Function run{*this, "", &Noise::update, "gives the next value"};

    void update(hal::Cycle) noexcept {
        if (!started_ || seed != seed_ || (restart && !was_restart_)) {
            begin();
        }
        was_restart_ = restart;
        if (age_ == 0 || age_ >= hold) {
            value_ = draw();
            age_ = 0;
        }
        ++age_;
        const double size = std::fabs(amplitude) <= 1e300 ? amplitude.get() : 0.0;

        const double max = std::fabs(limit);
        const double wanted = size * value_;
        double shown = max > 0.0 ? std::clamp(wanted, -max, max) : wanted;
        if (!enable) {
            shown = 0.0;
        }
        noise = std::isfinite(shown) ? shown : 0.0;
        out = in + offset + noise;
    }

private:
    void begin() noexcept {
        seed_ = seed;
        bits_.seed(seed_);
        started_ = true;
        spare_known_ = false;
        age_ = 0;
        count_ = 0;
        for (double& row : rows_) {
            row = bits_.even();
        }
    }
    double draw() noexcept {
        switch (type) {
        case gauss: return normal();
        case pink: return rows();
        default: return bits_.even();
        }
    }
    /// G. Marsaglia, T. Bray, *A convenient method for generating normal variables*, SIAM Review 6
    /// (1964).
    double normal() noexcept {
        if (spare_known_) {
            spare_known_ = false;
            return spare_;
        }
        // one in five is rejected; 64 in a row do not occur
        for (int tries = 0; tries < 64; ++tries) {
            const double u = bits_.even();
            const double v = bits_.even();
            const double s = u * u + v * v;
            if (!(s > 0.0 && s < 1.0)) continue;
            const double factor = std::sqrt(-2 * std::log(s) / s);
            spare_ = v * factor;
            spare_known_ = true;
            return u * factor;
        }
        return 0.0;
    }
    /// Voss's sum of values that change every 1, 2, 4, 8 … draws, one at a time as McCartney
    /// arranged them (M. Gardner, *White and brown music, fractal curves and one-over-f
    /// fluctuations*, Scientific American, April 1978). Even values have the variance 1/3.
    double rows() noexcept {
        const auto row = static_cast<std::size_t>(std::countr_zero(++count_));
        if (row < rows_.size()) {
            rows_[row] = bits_.even();
        }
        double sum = bits_.even();
        for (const double x : rows_) {
            sum += x;
        }
        return sum * std::sqrt(3.0 / static_cast<double>(rows_.size() + 1));
    }

    Bits bits_;
    std::array<double, 20> rows_{};
    double value_ = 0.0;
    double spare_ = 0.0;
    std::uint64_t count_ = 0;
    std::uint32_t seed_ = 0;
    std::uint32_t age_ = 0;
    bool started_ = false;
    bool spare_known_ = false;
    bool was_restart_ = false;
    hal::Retained retained_{*this,
                            {{"bits", bits_},
                             {"rows", rows_},
                             {"value", value_},
                             {"spare", spare_},
                             {"count", count_},
                             {"seed", seed_},
                             {"age", age_},
                             {"started", started_},
                             {"spare-known", spare_known_},
                             {"was-restart", was_restart_}}};
};

}  // namespace

HAL_COMPONENT(Noise, "noise", "Seeded noise: uniform, Gaussian or pink", R"(
    out = in + offset + amplitude * random

| type | random |
| --- | --- |
| 0 | uniform from -1 to 1 (standard deviation 0.577) |
| 1 | Gaussian with standard deviation 1 (Marsaglia's polar method) |
| 2 | pink, power falling with 1/f over 20 octaves, standard deviation 1 (Voss, McCartney) |

The sequence is a function of `seed` alone: the same netlist gives the same values in every run, and
two instances with the same seed the same noise, so give each its own. A change of `seed` and a
rising edge of `restart` restart the sequence. `hold` n draws a value every n cycles; `limit` limits
its magnitude. A type above 2 counts as 0, a NaN amplitude as 0. The generator is xorshift64*, which
is not cryptographically secure.

    loadrt noise names=tacho-noise
    addf tacho-noise servo
    setp tacho-noise.seed 7
    setp tacho-noise.type 1
    setp tacho-noise.amplitude 0.02
    net tacho-true  => tacho-noise.in
    net tacho-noisy <= tacho-noise.out
)")
