// SPDX-License-Identifier: MIT
#include <array>
#include <cstdint>

#include "hal/component.hpp"
#include "run_time.hpp"

namespace {

constexpr std::int32_t most = 200;

struct Histobins : hal::Component {
    using Component::Component;
    hal::In<std::uint32_t> pintype{*this, "pintype", "input to use: 1 input-s32, 2 input-u32, 3 input-bit, otherwise input"};
    hal::In<double>        input{*this, "input", "value to count, of type float"};
    hal::In<std::int32_t>  input_s32{*this, "input-s32", "value to count, of type s32"};
    hal::In<std::uint32_t> input_u32{*this, "input-u32", "value to count, of type u32"};
    hal::In<bool>          input_bit{*this, "input-bit", "value to count, of type bit"};
    hal::In<std::uint32_t> nbins{*this, "nbins", "number of bins, 1..200", {.initial = 20}};
    hal::In<double>        binsize{*this, "binsize", "width of a bin, above 0", {.initial = 1.0}};
    hal::In<double>        minvalue{*this, "minvalue", "lower edge of the first bin"};
    hal::In<std::int32_t>  index{*this, "index", "bin to show"};
    hal::Out<std::int32_t> check{*this, "check", "the index that is shown"};
    hal::In<bool>          reset{*this, "reset", "TRUE clears the histogram"};
    hal::In<bool>          method{*this, "method", "no effect; LinuxCNC's two methods for the variance give the same result here"};
    hal::Out<bool>         input_error{*this, "input-error", "TRUE: invalid setting or value; nothing is counted"};
    hal::Out<double>       binvalue{*this, "binvalue", "number of values in this bin; -1: invalid index"};
    hal::Out<double>       pextra{*this, "pextra", "number of values above the last bin"};
    hal::Out<double>       nextra{*this, "nextra", "number of values below the first bin"};
    hal::Out<double>       input_min{*this, "input-min", "smallest value"};
    hal::Out<double>       input_max{*this, "input-max", "largest value"};
    hal::Out<std::uint32_t> nsamples{*this, "nsamples", "number of values"};
    hal::Out<double>       variance{*this, "variance", "variance of the values"};
    hal::Out<double>       mean{*this, "mean", "mean of the values"};
    hal::Out<std::int32_t> available{*this, "availablebins", "maximum number of bins", {.initial = most}};
    hal::Function          run{*this, "", &Histobins::update, "counts the value"};

    void update(hal::Cycle) noexcept {
        const double value = chosen();
        const bool bins = nbins >= 1 && nbins <= most && binsize > 0.0 && std::isfinite(binsize) && std::isfinite(minvalue);
        const bool valid = bins && std::fabs(value) <= 1e150;
        if (reset || has_new_bins()) clear();
        if (!reset && valid) count(value);
        input_error = !valid;
        const bool inside = index >= 0 && index < most && static_cast<std::uint32_t>(index) < nbins;
        check = index.get();
        binvalue = inside ? bins_[static_cast<std::size_t>(index)] : -1.0;
        pextra = above_;
        nextra = below_;
        input_min = smallest_;
        input_max = largest_;
        nsamples = static_cast<std::uint32_t>(statistics_.count());
        mean = statistics_.mean();
        variance = statistics_.variance();
        available = most;
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
    bool has_new_bins() noexcept {
        const bool changed = nbins != last_nbins_ || binsize != last_binsize_ || minvalue != last_minvalue_;
        last_nbins_ = nbins;
        last_binsize_ = binsize;
        last_minvalue_ = minvalue;
        return changed;
    }
    void clear() noexcept {
        bins_.fill(0.0);
        above_ = below_ = smallest_ = largest_ = 0.0;
        statistics_ = {};
    }
    void count(double value) noexcept {
        const bool first = statistics_.count() == 0;
        smallest_ = first ? value : std::min(smallest_, value);
        largest_ = first ? value : std::max(largest_, value);
        statistics_.add(value);
        const double bin = std::floor((value - minvalue) / binsize);
        if (bin < 0.0) below_ += 1.0;
        else if (bin >= static_cast<double>(nbins)) above_ += 1.0;
        else bins_[static_cast<std::size_t>(bin)] += 1.0;
    }
    measure::Statistics statistics_;
    std::array<double, most> bins_{};
    double above_ = 0.0, below_ = 0.0, smallest_ = 0.0, largest_ = 0.0;
    std::uint32_t last_nbins_ = 0;
    double last_binsize_ = 0.0, last_minvalue_ = 0.0;
};

}  // namespace

HAL_COMPONENT(Histobins, "histobins", "Histogram of a value", R"(
Counts the value of each cycle in one of `nbins` bins: bin i is from `minvalue` + i `binsize` up to, but not including, the next.
Set `index` and, once `check` is equal to it, read `binvalue`. A change of `nbins`, `binsize` or `minvalue` clears the histogram, as `reset` does. The
variance is the sample variance, with the divisor `nsamples` - 1.

**Differences from LinuxCNC:** the first value after a reset is counted like the others (LinuxCNC: in no bin, and as 0 in mean and variance), the
value during `reset` is not (LinuxCNC: in `nsamples`). A value at the upper edge of the last bin is above it (LinuxCNC writes beyond its
memory). Invalid values and a `binsize` of 0 or below set `input-error` (LinuxCNC: only an invalid `nbins`).

    loadrt histobins names=errors
    addf errors servo
    setp errors.minvalue -0.1
    setp errors.binsize 0.01
    net f-error => errors.input
    net spread <= errors.variance
)")
