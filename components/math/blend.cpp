// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Blend : hal::Component {
    using Component::Component;
    hal::In<double>  in0{*this, "in0", "the output while select is 0"};
    hal::In<double>  in1{*this, "in1", "the output while select is 1"};
    hal::In<double>  select{*this, "select", "share of in1"};
    hal::Out<double> out{*this, "out", "between in0 and in1"};
    hal::Param<bool> open{*this, "open", "TRUE: select below 0 or above 1 leads beyond in0 and in1; FALSE: it is limited"};
    hal::Function    run{*this, "", hal::step<&Blend::update>, "computes out"};

    void update(hal::Cycle) noexcept {
        const double share = open ? select.get() : std::min(std::max(select.get(), 0.0), 1.0);
        out = (1.0 - share) * in0 + share * in1;
    }
};

}  // namespace

HAL_COMPONENT(Blend, "blend", "Interpolates between two values", R"(
`out = (1 - select) * in0 + select * in1`

    loadrt blend names=gain-schedule
    addf gain-schedule servo
    setp gain-schedule.in0 20
    setp gain-schedule.in1 35
    net load-share => gain-schedule.select
    net p-gain     <= gain-schedule.out
)")
