// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Supply : hal::Component {
    using Component::Component;

    hal::Io<bool> d{*this, "d", "source of q and _q"};
    hal::Io<double> value{*this, "value", "source of variable and _variable"};
    hal::Out<bool> q{*this, "q", "d"};
    hal::Out<bool> not_q{*this, "_q", "inverse of d", {.initial = true}};
    hal::Out<double> variable{*this, "variable", "value"};
    hal::Out<double> negative{*this, "_variable", "-value"};

    hal::Function run{*this, "update", &Supply::update, "copies d and value to the outputs"};

    void update(hal::Cycle) noexcept {
        q = d;
        not_q = !d;
        variable = value;
        negative = -value;
    }
};

}  // namespace

HAL_COMPONENT(Supply, "supply", "Outputs with values set by the user", R"(
`setp supply.0.value 3` sets `variable` to 3 and `_variable` to -3; `setp supply.0.d 1` sets `q` and
clears `_q`. It exists for netlists that already use it: `setp` on an unlinked input and `sets` on a
signal without writer do the same.

    loadrt supply num_chan=1
    loadrt pid
    addf supply.0.update servo-thread
    addf pid.0.do-pid-calcs servo-thread
    net command  supply.0.variable => pid.0.command
)")
