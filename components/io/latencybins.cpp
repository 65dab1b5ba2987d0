// SPDX-License-Identifier: MIT
#include <array>
#include <cstdint>

#include "hal/component.hpp"
#include "hal/retained.hpp"
#include "run_time.hpp"

namespace {

constexpr std::int32_t max_bins = 1000;
using Bins = std::array<std::int32_t, max_bins + 1>;

struct Latencybins : hal::Component {
    using Component::Component;
    hal::In<std::int32_t> highest{*this,
                                  "maxbinnumber",
                                  "number of the last bin on either side, at most 1000",
                                  {.initial = max_bins}};
    hal::In<std::int32_t> index{*this, "index", "bin to show"};
    hal::In<bool> reset{*this, "reset", "TRUE clears the histogram"};
    hal::In<std::int32_t> size{*this,
                               "nsbinsize",
                               "width of a bin; nothing is counted while it is not positive",
                               {.unit = "ns"}};
    hal::Out<std::int32_t> check{*this, "check", "the index that is shown"};
    hal::Out<std::int32_t> latency{
        *this, "latency", "time since the last run minus the period", {.unit = "ns"}};
    hal::Out<std::int32_t> latency_max{
        *this, "latency-max", "largest latency so far", {.unit = "ns"}};
    hal::Out<std::int32_t> latency_min{
        *this, "latency-min", "smallest latency so far; negative", {.unit = "ns"}};
    hal::Out<std::int32_t> positive{*this, "pbinvalue", "runs in bin +index; -1: invalid index"};
    hal::Out<std::int32_t> negative{*this, "nbinvalue", "runs in bin -index; -1: invalid index"};
    hal::Out<std::int32_t> positive_extra{*this, "pextra", "runs later than the last bin"};
    hal::Out<std::int32_t> negative_extra{*this, "nextra", "runs earlier than the last bin"};
    hal::Out<std::int32_t> variance{*this, "variance", "variance of the latency, in ns^2"};
    hal::Out<std::int32_t> available{
        *this, "availablebins", "maximum number of bins", {.initial = max_bins}};
    hal::Function run{*this, "", &Latencybins::update, "counts this run"};

    void update(hal::Cycle cycle) noexcept {
        const std::int64_t since = time_.since_last(cycle);
        const std::int32_t last = std::clamp(highest.get(), 0, max_bins);
        if (reset) {
            clear();
        } else if (since >= 0) {
            count(since - cycle.period_ns(), last);
        }
        const bool inside = index >= 0 && index <= last;
        check = index.get();
        positive = inside ? above_[static_cast<std::size_t>(index)] : -1;
        negative = inside ? below_[static_cast<std::size_t>(index)] : -1;
        positive_extra = later_;
        negative_extra = earlier_;
        latency = now_;
        latency_max = latest_;
        latency_min = earliest_;
        variance = static_cast<std::int32_t>(std::min(statistics_.variance(), 2147483647.0));
        available = max_bins;
    }

private:
    void clear() noexcept {
        above_.fill(0);
        below_.fill(0);
        later_ = earlier_ = now_ = latest_ = earliest_ = 0;
        statistics_ = {};
    }
    void count(std::int64_t late, std::int32_t last) noexcept {
        now_ = measure::to_s32(late);
        if (size <= 0) return;
        statistics_.add(static_cast<double>(late));
        latest_ = std::max(latest_, now_);
        earliest_ = std::min(earliest_, now_);
        const std::int64_t bin = (late < 0 ? -late : late) / size;
        if (bin > last) {
            add(late < 0 ? earlier_ : later_);
        } else {
            add((late < 0 && bin > 0 ? below_ : above_)[static_cast<std::size_t>(bin)]);
        }
    }
    static void add(std::int32_t& count) noexcept {
        if (count < INT32_MAX) {
            ++count;
        }
    }
    measure::RunTime time_;
    measure::Statistics statistics_;
    Bins above_{};
    Bins below_{};
    std::int32_t later_ = 0;
    std::int32_t earlier_ = 0;
    std::int32_t now_ = 0;
    std::int32_t latest_ = 0;
    std::int32_t earliest_ = 0;
    hal::Retained retained_{*this,
                            {{"time", time_},
                             {"statistics", statistics_},
                             {"above", above_},
                             {"below", below_},
                             {"later", later_},
                             {"earlier", earlier_},
                             {"now", now_},
                             {"latest", latest_},
                             {"earliest", earliest_}}};
};

}  // namespace

HAL_COMPONENT(Latencybins, "latencybins", "Histogram of the latency of a thread", R"(
Counts each run in a bin by its latency, the time since the previous run minus the period. Bins go from -`maxbinnumber` to +`maxbinnumber`,
each `nsbinsize` wide; the two around 0 are combined as bin 0. Set `index` and, once `check` is equal to it, read `pbinvalue` and `nbinvalue`. On a
virtual clock the latency is 0.

    loadrt latencybins names=bins
    addf bins servo 1
    setp bins.nsbinsize 1000
    net late <= bins.latency-max
)")
