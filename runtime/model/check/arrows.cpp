// SPDX-License-Identifier: MIT
#include "model/check/check.hpp"

namespace hal {

void check_arrows(const Model& model, Diagnostics& diagnostics) {
    for (const auto& signal : model.signals) {
        for (const Pin* pin : signal->pins) {
            if (pin->dir == HAL_DIR_OUT && pin->arrow_in) {
                diagnostics.warning(
                    "wrong-arrow", pin->linked_at,
                    "wrong arrow: '" + pin->name + "' does not read '" + signal->name +
                        "', it is an output",
                    "writes the signal",
                    "write it before the arrow, or: " + signal->name + " <= " + pin->name);
            }
            if (pin->dir == HAL_DIR_IN && pin->arrow_out) {
                diagnostics.warning("wrong-arrow", pin->linked_at,
                                    "wrong arrow: '" + pin->name + "' does not write '" +
                                        signal->name + "', it is an input",
                                    "reads the signal",
                                    "write: " + signal->name + " => " + pin->name);
            }
        }
    }
}

}  // namespace hal
