// SPDX-License-Identifier: MIT
#include "hal/component.hpp"
#include "hal/corrected.hpp"
#include "hal/retained.hpp"

namespace {

struct Debounce : hal::Component {
    hal::Argument size{*this,
                       "cfg",
                       4,
                       "number of filters, for each group",
                       {.per_instance = true, .min = 1, .max = 100'000}};
    hal::Ins<bool> in{*this, "#.in", size, "noisy input of filter #"};
    hal::Outs<bool> out{*this, "#.out", size, "debounced input of filter #"};
    hal::CorrectedParam<std::int32_t> delay{
        *this,
        "delay",
        "cycles for which an input must be stable after a change; 0 copies it to its output",
        {.initial = 5}};
    hal::Function run{*this, "", hal::step<&Debounce::update>, "samples all inputs of the group"};

    explicit Debounce(const hal_host* host)
        : Component(host),
          counts_(static_cast<std::int32_t*>(
              host->allocate(host, in.size() * sizeof(std::int32_t), alignof(std::int32_t)))) {
        if (counts_ == nullptr) throw std::bad_alloc();
    }

    void update(hal::Cycle) noexcept {
        if (delay < 0) {
            delay.correct(1);
        }
        for (std::size_t i = 0; i < in.size(); ++i) {
            const bool level = in[i];
            std::int32_t& count = counts_[i];
            const bool settled = level ? count >= delay : count <= 0;
            if (settled) {
                out[i] = level;
            } else {
                count += level ? 1 : -1;
            }
        }
    }

private:
    std::int32_t* counts_;  // one per filter, from 0 to delay
    hal::Retained retained_{*this, {{"counts", counts_, in.size()}}};
};

}  // namespace

HAL_COMPONENT(Debounce, "debounce", "Filters groups of noisy digital inputs", R"(
A filter counts up while its input is TRUE and down while it is FALSE, between 0 and `delay`. An input that is TRUE with the count at
`delay` sets the output, one that is FALSE with the count at 0 clears it; so the output follows `delay` cycles after a clean change. A
negative `delay` is set to 1. `cfg=2,3` creates two groups, `debounce.0` with two filters
and `debounce.1` with three; a group has one function and one `delay`.

    loadrt debounce cfg=2
    addf debounce.0 servo
    setp debounce.0.delay 10
    net home-raw     => debounce.0.0.in
    net home-switch  <= debounce.0.0.out
    net limit-raw    => debounce.0.1.in
    net limit-switch <= debounce.0.1.out
)")
