// SPDX-License-Identifier: MIT
#include "ethercat/devices/voe_echo.hpp"

#include <algorithm>
#include <cstring>

namespace hal::ethercat::devices {

void VoeEcho::take(const MailboxMessage& message, State, Outbox& out) noexcept {
    const std::size_t n = std::min(message.payload.size(), out.mailbox() - mailbox_header_bytes);
    if (n != 0) {
        std::memcpy(out.payload(), message.payload.data(), n);
    }
    out.send(MailboxType::voe, n);
}

}  // namespace hal::ethercat::devices
