// SPDX-License-Identifier: MIT
// The status that each instance publishes: one topic for all instances, one text of lines "KEY
// VALUE" each, twice a second, for `hal top` and for the nodes of a netlist. The first lines are
// the host's (hal/status.h), the others a component's.
#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "engine.hpp"
#include "hal/status.h"
#include "status_text.hpp"

namespace hal::dds {

constexpr std::int64_t status_period_ns = 500'000'000;

/// Returns the topic "halcyon/status", a string.
HAL_EXPORT TopicType status_topic();
/// Returns the QoS of that topic: reliable and transient-local, the newest status of each instance.
HAL_EXPORT Quality status_quality();

/// Publishes the status of this instance, once per participant, until its last owner releases it.
class Beacon {
public:
    virtual ~Beacon() = default;
    /// Replaces the lines that `owner` adds to the host's. [setup]
    virtual void add(const void* owner, const std::string& lines) = 0;
};
/// Returns the beacon of a participant. Without `host` it publishes only the added lines. [setup]
HAL_EXPORT std::shared_ptr<Beacon> beacon(const std::shared_ptr<Participant>&,
                                          const hal_status* host);

}  // namespace hal::dds

/// For `hal top`, which loads this library when it is installed: calls `heard` with each received
/// status, in a thread of the engine, until halcyon_status_close. `settings` are words KEY=VALUE as
/// for `hal run --dds`. Returns nullptr and sets `problem` (256 bytes) to the reason.
extern "C" {
HAL_EXPORT void* halcyon_status_open(const char* settings,
                                     void (*heard)(void* user, const char* text, size_t length),
                                     void* user, char* problem);
HAL_EXPORT void halcyon_status_close(void*);
}
