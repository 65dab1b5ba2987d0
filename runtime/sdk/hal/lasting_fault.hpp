// SPDX-License-Identifier: MIT
// A fault whose condition lasts: a node that is offline, a link without carrier. `fault clear` does
// not acknowledge it before it is over.
#pragma once

#include <limits>
#include <utility>

#include "hal/lasting_faults.h"

namespace hal {

/// One condition of an instance, with the reason it has now: of one node, of one link. It belongs
/// to one thread at a time.
class LastingFault {
public:
    /// Raises a fault that lasts until end(). A condition that lasts already is raised again, with
    /// the new reason. `reason`: as in hal_faults::raise. Does nothing without a record. [realtime]
    void begin(const hal_faults* record, const void* self, const char* reason,
               double detail = std::numeric_limits<double>::quiet_NaN()) noexcept {
        if (record == nullptr) return;
        end(record, self);
        if (record->size >= sizeof(hal_lasting_faults)) {
            reason_ = reason;
            set(record, self, reason, true);
        }
        record->raise(record, self, reason, detail);
    }
    /// The condition is over: `fault clear` acknowledges its faults from now on. [realtime]
    void end(const hal_faults* record, const void* self) noexcept {
        if (reason_ != nullptr && record != nullptr) {
            set(record, self, std::exchange(reason_, nullptr), false);
        }
    }
    /// Returns true from begin() to end(), unless the host does not know lasting faults. [realtime]
    bool lasts() const noexcept { return reason_ != nullptr; }

private:
    static void set(const hal_faults* record, const void* self, const char* reason,
                    bool lasts) noexcept {
        reinterpret_cast<const hal_lasting_faults*>(record)->lasts(record, self, reason, lasts);
    }

    const char* reason_ = nullptr;
};

}  // namespace hal
