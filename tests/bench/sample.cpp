// SPDX-License-Identifier: MIT
#include "sample.hpp"

#include <algorithm>
#include <cmath>

namespace hal::bench {

double quantile(std::vector<double>& samples, double share) {
    if (samples.empty()) return 0.0;
    const auto at =
        static_cast<std::ptrdiff_t>(share * static_cast<double>(samples.size() - 1) + 0.5);
    std::nth_element(samples.begin(), samples.begin() + at, samples.end());
    return samples[static_cast<std::size_t>(at)];
}

double exponent(double small_size, double small_cost, double large_size, double large_cost) {
    return std::log(large_cost / small_cost) / std::log(large_size / small_size);
}

}  // namespace hal::bench
