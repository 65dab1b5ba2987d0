// SPDX-License-Identifier: MIT
// The components' own sources, compiled into the bench with the flags of a plugin, so that the
// loops run the same code on the same structs; only the call through the plan is missing.
#include <limits>
#include <numbers>
#include <stdexcept>

#include "dispatch_loops.hpp"
#include "hal/component.hpp"
#include "hal/interruption.hpp"
#include "hal/limit.hpp"
#include "hal/retained.hpp"

#undef HAL_COMPONENT
#define HAL_COMPONENT(...)

namespace and2_source {
#include "components/logic/and2.cpp"
}
namespace sum2_source {
#include "components/math/sum2.cpp"
}
namespace mux2_source {
#include "components/logic/mux2.cpp"
}
namespace limit1_source {
#include "components/math/limit1.cpp"
}
namespace pid_source {
#include "components/control/pid.cpp"
}

namespace hal::bench {
namespace {

template <class C, auto Step>
void loop(void* const* instances, std::size_t count, const hal_cycle* cycle) {
    for (void* const* at = instances; at != instances + count; ++at) {
        (static_cast<C*>(*at)->*Step)(Cycle{cycle});
    }
}

void loop_mixed(void* const* instances, std::size_t count, const hal_cycle* cycle) {
    for (void* const* at = instances; at != instances + count; at += 4) {
        static_cast<and2_source::And2*>(at[0])->update(Cycle{cycle});
        static_cast<sum2_source::Sum2*>(at[1])->add(Cycle{cycle});
        static_cast<mux2_source::Mux2*>(at[2])->update(Cycle{cycle});
        static_cast<limit1_source::Limit1*>(at[3])->update(Cycle{cycle});
    }
}

}  // namespace

Loop loop_over(std::string_view component) {
    if (component == "and2") return loop<and2_source::And2, &and2_source::And2::update>;
    if (component == "sum2") return loop<sum2_source::Sum2, &sum2_source::Sum2::add>;
    if (component == "mux2") return loop<mux2_source::Mux2, &mux2_source::Mux2::update>;
    if (component == "limit1") return loop<limit1_source::Limit1, &limit1_source::Limit1::update>;
    if (component == "pid") return loop<pid_source::Pid, &pid_source::Pid::calculate>;
    if (component == "mixed") return loop_mixed;
    throw std::logic_error("no loop over " + std::string(component));
}

}  // namespace hal::bench
