// SPDX-License-Identifier: MIT
#include <array>
#include <cstdint>

#include "hal/component.hpp"
#include "hal/retained.hpp"
#include "run_time.hpp"

namespace {

constexpr std::int32_t max_bins = 200;

struct Histobins : hal::Component {
    using Component::Component;
    hal::In<std::uint32_t> pintype{*this, "pintype",
                                   "input to use: 0 input, 1 input-s32, 2 input-u32, 3 input-bit"};
    hal::In<double> input{*this, "input", "value to count, of type float"};
    hal::In<std::int32_t> input_s32{*this, "input-s32", "value to count, of type s32"};
    hal::In<std::uint32_t> input_u32{*this, "input-u32", "value to count, of type u32"};
    hal::In<bool> input_bit{*this, "input-bit", "value to count, of type bit"};
    hal::In<std::uint32_t> nbins{*this, "nbins", "number of bins, 1..200", {.initial = 20}};
    hal::In<double> binsize{*this, "binsize", "width of a bin, above 0", {.initial = 1.0}};
    hal::In<double> minvalue{*this, "minvalue", "lower edge of the first bin"};
    hal::In<std::int32_t> index{*this, "index", "bin to show"};
    hal::Out<std::int32_t> check{*this, "check", "the index that is shown"};
    hal::In<bool> reset{*this, "reset", "TRUE clears the histogram"};
    hal::In<bool> method{
        *this, "method",
        "no effect; LinuxCNC's two methods for the variance give the same result here"};
    hal::Out<bool> input_error{
        *this, "input-error",
        "TRUE: invalid setting or value; nothing is counted and the outputs are held"};
    hal::Out<double> binvalue{*this, "binvalue", "number of values in this bin; -1: invalid index"};
    hal::Out<double> pextra{*this, "pextra", "number of values above the last bin"};
    hal::Out<double> nextra{*this, "nextra", "number of values below the first bin"};
    hal::Out<double> input_min{*this, "input-min", "smallest value"};
    hal::Out<double> input_max{*this, "input-max", "largest value"};
    hal::Out<std::uint32_t> nsamples{*this, "nsamples", "number of values"};
    hal::Out<double> variance{*this, "variance", "variance of the values"};
    hal::Out<double> mean{*this, "mean", "mean of the values"};
    hal::Out<std::int32_t> available{
        *this, "availablebins", "maximum number of bins", {.initial = max_bins}};
    hal::Function run{*this, "", &Histobins::update, "counts the value"};

    void update(hal::Cycle) noexcept {
        check = index.get();
        available = max_bins;
        const double value = chosen();
        const bool bins = nbins >= 1 && nbins <= max_bins && binsize > 0.0 &&
                          std::isfinite(binsize) && std::isfinite(minvalue);
        constexpr double limit = 1e150;  // the square of a larger one is infinite
        input_error = !bins || !(std::fabs(value) <= limit);
        if (input_error) return;

        const bool changed = has_changed();
        if (reset || changed) {
            clear();
        } else {
            count(value);
        }
        smallest_ = std::min(smallest_, value);
        max_ = std::max(max_, value);
        statistics_.add(value);
        show();
    }

private:
    double chosen() const noexcept {
        switch (pintype) {
        case 1: return static_cast<double>(input_s32);
        case 2: return static_cast<double>(input_u32);
        case 3: return input_bit ? 1.0 : 0.0;
        default: return input;
        }
    }
    /// True in the first cycle and after a change of the bins.
    bool has_changed() noexcept {
        const bool same =
            nbins == counted_bins_ && binsize == counted_size_ && minvalue == counted_minimum_;
        counted_bins_ = nbins;
        counted_size_ = binsize;
        counted_minimum_ = minvalue;
        return !same;
    }
    void clear() noexcept {
        bins_.fill(0.0);
        above_ = 0.0;
        below_ = 0.0;
        smallest_ = 1e99;
        max_ = -1e99;
        statistics_ = {};
    }
    void count(double value) noexcept {
        if (value < minvalue) {
            below_ += 1.0;
        } else if (value > minvalue + nbins * binsize) {
            above_ += 1.0;
        } else {
            const auto bin = static_cast<std::size_t>((value - minvalue) / binsize);
            if (bin < nbins) {
                bins_[bin] += 1.0;
            }
        }
    }
    void show() noexcept {
        const bool inside = index >= 0 && static_cast<std::uint32_t>(index) < nbins;
        binvalue = inside ? bins_[static_cast<std::size_t>(index)] : -1.0;
        pextra = above_;
        nextra = below_;
        input_min = smallest_;
        input_max = max_;
        nsamples = static_cast<std::uint32_t>(statistics_.count());
        mean = statistics_.mean();
        variance = statistics_.variance();
    }
    measure::Statistics statistics_;
    std::array<double, max_bins> bins_{};
    double above_ = 0.0;
    double below_ = 0.0;
    double smallest_ = 0.0;
    double max_ = 0.0;
    std::uint32_t counted_bins_ = 0;  // settings of the bins at the last value; 0: none yet
    double counted_size_ = 0.0;
    double counted_minimum_ = 0.0;
    hal::Retained retained_{*this,
                            {{"statistics", statistics_},
                             {"bins", bins_},
                             {"above", above_},
                             {"below", below_},
                             {"smallest", smallest_},
                             {"largest", max_},
                             {"counted-bins", counted_bins_},
                             {"counted-size", counted_size_},
                             {"counted-minimum", counted_minimum_}}};
};

}  // namespace

HAL_COMPONENT(Histobins, "histobins", "Histogram of a value", R"(
Counts the value of each cycle in one of `nbins` bins: bin i is from `minvalue` + i `binsize` up to,
but not including, the next. Set `index` and, once `check` is equal to it, read `binvalue`. `reset`
and a change of the bins clear everything; the value of that cycle is the first of `nsamples`, but
not counted in a bin, and neither is a value at the upper edge of the last bin. The variance is the
sample variance, with the divisor `nsamples` - 1.

**Differences from LinuxCNC:** `mean` and `variance` include the first value (LinuxCNC divides by
its number and leaves it out). A `binsize` that is not above 0 and a value that is NaN or infinite
set `input-error` (LinuxCNC: writes outside of its memory). So does a value beyond ±1e150, because
its square is infinite (LinuxCNC counts it, and `variance` is infinite or NaN until a reset).

    loadrt histobins names=errors
    addf errors servo
    setp errors.minvalue -0.1
    setp errors.binsize 0.01
    net f-error => errors.input
    net spread <= errors.variance
)")
