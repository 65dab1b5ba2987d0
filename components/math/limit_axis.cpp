// SPDX-License-Identifier: MIT
#include "hal/component.hpp"
#include "hal/retained.hpp"

namespace {

struct LimitAxis : hal::Component {
    using Component::Component;
    hal::Argument count{*this, "personality", 2, "number of ranges", {.min = 1, .max = 10}};
    hal::In<double> fb{*this, "fb",
                       "value that selects the range, usually the position of another axis"};
    hal::Out<double> min_output{*this, "min-output", "lower limit of the current range"};
    hal::Out<double> max_output{*this, "max-output", "upper limit of the current range"};
    hal::Out<std::uint32_t> current{*this, "current-range", "number of the current range"};
    hal::Out<bool> no_range{*this, "error-no-range",
                            "TRUE: fb is in no enabled range; the limits are held"};
    hal::Out<bool> bad_limits{
        *this, "error-limits",
        "TRUE: the range's max-limit is below its min-limit; the limits are held"};
    hal::Ins<double> min_limit{*this, "min-limit-##", count, "lower limit of range #"};
    hal::Ins<double> max_limit{*this, "max-limit-##", count, "upper limit of range #"};
    hal::Ins<double> min_range{*this, "min-range-##", count, "lowest fb of range #"};
    hal::Ins<double> max_range{*this, "max-range-##", count, "highest fb of range #"};
    hal::Ins<bool> enable{*this, "enable-##", count, "FALSE disables range #", {.initial = true}};
    hal::Ins<bool> sticky{*this,
                          "sticky-##",
                          count,
                          "TRUE: range # remains the current one while fb is in it",
                          {.initial = true}};
    hal::Function run{*this, "", hal::step<&LimitAxis::update>, "selects the range"};

    void update(hal::Cycle) noexcept {
        std::size_t chosen = current_;
        if (!(sticky[current_] && holds(current_))) {
            chosen = 0;
            while (chosen < enable.size() && !holds(chosen)) {
                ++chosen;
            }
        }
        const bool none = chosen == enable.size();
        const bool bad = !none && !(max_limit[chosen] >= min_limit[chosen]);
        no_range = none;
        bad_limits = bad;
        if (none || bad) return;
        current_ = chosen;
        current = static_cast<std::uint32_t>(chosen);
        min_output = min_limit[chosen].get();
        max_output = max_limit[chosen].get();
    }

private:
    bool holds(std::size_t i) const noexcept {
        return enable[i] && fb >= min_range[i] && fb <= max_range[i];
    }

    std::size_t current_ = 0;
    hal::Retained retained_{*this, {{"current", current_}}};
};

}  // namespace

HAL_COMPONENT(LimitAxis, "limit_axis", "Limits of an axis that depend on another axis", R"(
The first enabled range with `min-range` <= `fb` <= `max-range` sets the limits. A sticky range
remains the current one while `fb` is in it, even if an earlier one contains `fb`, too. If no range
matches, or its limits are inverted, the outputs are held and an error output is TRUE: stop the axis
then. `personality` is the number of ranges, up to 10.

    # C may turn only a little while Z is above -10
    loadrt limit_axis names=c-limits personality=2
    addf c-limits servo
    setp c-limits.min-range-00 -10
    setp c-limits.max-range-00 0
    setp c-limits.min-limit-00 -5
    setp c-limits.max-limit-00 5
    setp c-limits.min-range-01 -40
    setp c-limits.max-range-01 -10
    setp c-limits.min-limit-01 -360
    setp c-limits.max-limit-01 360
    net z-position => c-limits.fb
    net c-min      <= c-limits.min-output
    net c-max      <= c-limits.max-output
    net c-stop     <= c-limits.error-no-range
)")
