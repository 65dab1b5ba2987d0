// SPDX-License-Identifier: MIT
// What a station notices.
#pragma once

#include <cstddef>
#include <cstdint>

namespace hal::demo {

enum class Event : std::uint8_t { device_online, device_offline };

/// Receives the events of a station, in its thread. [realtime]
class Events {
public:
    /// `device`: its index in the configuration. `silence_ns`: time since its last value.
    virtual void on_event(Event, std::uint32_t device, std::int64_t silence_ns) noexcept = 0;

protected:
    ~Events() = default;
};

}  // namespace hal::demo
