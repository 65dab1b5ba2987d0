// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Blend : hal::Component {
    using Component::Component;
    hal::In<double> in1{*this, "in1", "output for select 1"};
    hal::In<double> in2{*this, "in2", "output for select 0"};
    hal::In<double> select{*this, "select", "fraction of in1, 0..1"};
    hal::Out<double> out{*this, "out", "interpolation between in2 and in1"};
    hal::Param<bool> open{
        *this, "open",
        "TRUE extrapolates for select below 0 or above 1; FALSE limits select to 0..1"};
    hal::Function run{*this, "", hal::step<&Blend::update>, "computes out"};

    void update(hal::Cycle) noexcept {
        const double share = open ? select.get() : std::min(std::max(select.get(), 0.0), 1.0);
        out = share * in1 + (1.0 - share) * in2;
    }
};

}  // namespace

HAL_COMPONENT(Blend, "blend", "Interpolates between two values", R"(
`out = select * in1 + (1 - select) * in2`

    loadrt blend names=gain-schedule
    addf gain-schedule servo
    setp gain-schedule.in1 35
    setp gain-schedule.in2 20
    net load-share => gain-schedule.select
    net p-gain     <= gain-schedule.out
)")
