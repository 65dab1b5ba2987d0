// SPDX-License-Identifier: MIT
// One function for all instances; arguments of every kind.
#include "hal/component.hpp"

namespace {

std::uint32_t turn = 0;  // of the shared function, over all instances

struct Shared : hal::Component {
    using Component::Component;
    hal::Argument kind{*this, "kind", -1, "a value per instance", {.per_instance = true}};
    hal::RealArgument gain{*this, "gain", 1.5, "one for all"};
    hal::Argument personality{
        *this, "personality", 0, "as halcompile knows it", {.min = 0, .max = 100}};
    hal::Function update{*this, "update", &Shared::run, "runs all instances", {.shared = true}};
    hal::Out<std::uint32_t> place{*this, update, "place",
                                  "when it ran, counted over all instances"};
    hal::Out<std::int32_t> kind_out{*this, update, "kind", "its kind"};
    hal::Out<double> gain_out{*this, update, "gain", "its gain"};
    hal::Out<std::int32_t> personality_out{*this, update, "personality", "its personality"};

    void run(hal::Cycle) noexcept {
        place = ++turn;
        kind_out = static_cast<std::int32_t>(kind);
        gain_out = gain;
        personality_out = static_cast<std::int32_t>(personality);
    }
};

}  // namespace

HAL_COMPONENT(Shared, "test-shared", "One function for all instances")
