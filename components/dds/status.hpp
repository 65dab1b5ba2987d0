// SPDX-License-Identifier: MIT
// What an instance tells the network of itself: one topic of all instances, one text of lines "KEY VALUE" each, twice a second, for
// `hal top` and for the nodes of a netlist. The first lines are the host's (hal/status.h), the others a component's.
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
#include "words.hpp"

namespace hal::dds {

constexpr std::int64_t status_period_ns = 500'000'000;

/// "halcyon/status", a string.
HAL_EXPORT TopicType status_topic();
/// A reader may be slow: newest of each.
HAL_EXPORT Quality status_quality();

/// Publishes the status of this instance, once per participant, as long as somebody holds it.
class Beacon {
public:
    virtual ~Beacon() = default;
    /// Lines added to the host's, in place of those this owner added before.
    virtual void add(const void* owner, const std::string& lines) = 0;
};
/// `host` may be null: then it says only that it is there. [setup]
HAL_EXPORT std::shared_ptr<Beacon> beacon(const std::shared_ptr<Participant>&, const hal_status* host);

}  // namespace hal::dds

/// For `hal top`, which finds this library when it is there: calls `heard` with each status that comes, in a thread of the engine, until
/// halcyon_status_close. `settings` are words KEY=VALUE, as of `hal run --dds`. nullptr: `problem` (256 bytes) says why.
extern "C" {
HAL_EXPORT void* halcyon_status_open(const char* settings, void (*heard)(void* user, const char* text, size_t length), void* user,
                                     char* problem);
HAL_EXPORT void  halcyon_status_close(void*);
}
