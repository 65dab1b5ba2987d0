// SPDX-License-Identifier: MIT
// Figures from many samples, and the clock they are taken with.
#pragma once

#include <chrono>
#include <cstddef>
#include <ctime>
#include <vector>

namespace hal::bench {

/// The value that `share` (0 to 1) of the samples do not exceed; 0 of none. Reorders the samples.
double quantile(std::vector<double>& samples, double share);
inline double median(std::vector<double>& samples) { return quantile(samples, 0.5); }

/// Exponent b of a cost ~ size^b between two measurements: 1 is linear, 2 quadratic.
double exponent(double small_size, double small_cost, double large_size, double large_cost);

class Stopwatch {
public:
    double ms() const {
        return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin_)
            .count();
    }

private:
    std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

/// Processor time of the calling thread: what a machine shared with others does not change much.
class CpuStopwatch {
public:
    double ms() const { return now_ms() - begin_; }

private:
    static double now_ms() {
        timespec t;
        clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
        return static_cast<double>(t.tv_sec) * 1e3 + static_cast<double>(t.tv_nsec) * 1e-6;
    }
    double begin_ = now_ms();
};

}  // namespace hal::bench
