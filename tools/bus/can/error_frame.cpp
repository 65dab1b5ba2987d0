// SPDX-License-Identifier: MIT
#include "bus/can/error_frame.hpp"

#include <fmt/core.h>
#include <utility>

#include "text/quoting.hpp"

namespace hal::tools {

std::string error_frame_text(const can::Frame& f) {
    constexpr std::pair<std::uint32_t, const char*> words[] = {
        {can::error_send_timeout, "send time-out"},
        {can::error_lost_arbitration, "arbitration lost"},
        {can::error_controller, "controller"},
        {can::error_protocol, "protocol violation"},
        {can::error_transceiver, "transceiver"},
        {can::error_no_acknowledge, "no acknowledgement"},
        {can::error_bus_off, "bus off"},
        {can::error_bus, "bus error"},
        {can::error_restarted, "restarted after bus off"},
    };
    std::string text;
    for (const auto& [bit, word] : words) {
        if ((f.id & bit) != 0) {
            append_item(text, word);
        }
    }
    if ((f.id & can::error_controller) != 0) {
        text += fmt::format("; send errors {}, receive errors {}", f.data[6], f.data[7]);
    }
    return text;
}

}  // namespace hal::tools
