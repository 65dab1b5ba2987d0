// SPDX-License-Identifier: MIT
#include "model/check/check.hpp"

namespace hal {

void check_cross_thread_io(const Model& model, Diagnostics& diagnostics) {
    for (const auto& signal : model.signals) {
        const Pin* first = nullptr;
        for (const Pin* pin : signal->pins) {
            const Thread* const thread = pin->dir == HAL_DIR_IO ? thread_of(*pin) : nullptr;
            if (!thread) continue;
            if (!first) {
                first = pin;
            }
            if (thread == thread_of(*first)) continue;
            Diagnostic d{Severity::note,
                         "cross-thread-io",
                         "I/O pins of '" + signal->name + "' are in threads '" +
                             thread_of(*first)->name + "' and '" + thread->name +
                             "': its value may change within a cycle",
                         {{pin->linked_at, "in " + thread->name},
                          {first->linked_at, "in " + thread_of(*first)->name}},
                         {}};
            diagnostics.add(std::move(d));
            break;
        }
    }
}

}  // namespace hal
