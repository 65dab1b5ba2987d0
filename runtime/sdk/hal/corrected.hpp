// SPDX-License-Identifier: MIT
// Inputs and parameters that their component may correct, so that `getp` shows the value in use.
#pragma once

#include "hal/component.hpp"

namespace hal {

/// A parameter that its component may correct: stepgen rounds its times up to whole periods.
template <PinType T>
class CorrectedParam : public Param<T> {
public:
    using Param<T>::Param;
    /// Sets the parameter. [realtime]
    void correct(T value) noexcept {
        if (this->get() != value) {
            this->put(value);
        }
    }
};

/// An input that its component may correct: siggen limits its frequency.
template <PinType T>
class CorrectedIn : public In<T> {
public:
    using In<T>::In;
    /// Sets the input while it is unlinked; a signal keeps the value of its writer. [realtime]
    void correct(T value) noexcept {
        if (!this->linked() && this->get() != value) {
            this->put(value);
        }
    }
};

}  // namespace hal
