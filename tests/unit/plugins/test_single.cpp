// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Single : hal::Component {
    using Component::Component;
    static constexpr hal::Traits traits{.singleton = true};
    hal::Out<std::uint32_t> runs{*this, "runs", "how often"};
    hal::Function run{*this, "", &Single::count, "counts"};
    void count(hal::Cycle) noexcept { runs = runs + 1; }
};

}  // namespace

HAL_COMPONENT(Single, "test-single", "Exists once")
