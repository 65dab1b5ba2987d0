// SPDX-License-Identifier: MIT
// Conversion between frames of this library and of the kernel.
#pragma once

#include <linux/can.h>
#include <linux/can/error.h>

#include <cstring>

#include "link/can.hpp"

namespace hal::can::socketcan {

static_assert(error_send_timeout == CAN_ERR_TX_TIMEOUT && error_controller == CAN_ERR_CRTL &&
              error_bus_off == CAN_ERR_BUSOFF && error_no_acknowledge == CAN_ERR_ACK &&
              error_restarted == CAN_ERR_RESTARTED && error_bus == CAN_ERR_BUSERROR);

/// Converts a valid frame. Returns the number of bytes to write. [realtime]
inline std::size_t to_kernel(const Frame& f, canfd_frame& out) noexcept {
    out = {};
    out.can_id = f.id;
    if (f.extended) {
        out.can_id |= CAN_EFF_FLAG;
    }
    if (f.remote) {
        out.can_id |= CAN_RTR_FLAG;
    }
    out.len = f.length;
    if (f.fd) {
        out.flags = static_cast<__u8>((f.bit_rate_switch ? CANFD_BRS : 0) |
                                      (f.error_state ? CANFD_ESI : 0));
#ifdef CANFD_FDF
        out.flags |= CANFD_FDF;
#endif
    }
    if (!f.bytes().empty()) {
        std::memcpy(out.data, f.bytes().data(), f.bytes().size());
    }
    return f.fd ? CANFD_MTU : CAN_MTU;
}

/// Converts a frame of the kernel. Returns false when `size` is not that of a frame. [realtime]
inline bool from_kernel(const canfd_frame& in, std::size_t size, Frame& f) noexcept {
    if (size != CAN_MTU && size != CANFD_MTU) return false;
    f.fd = size == CANFD_MTU;
    f.error = (in.can_id & CAN_ERR_FLAG) != 0;
    f.extended = !f.error && (in.can_id & CAN_EFF_FLAG) != 0;
    f.remote = !f.error && !f.fd && (in.can_id & CAN_RTR_FLAG) != 0;
    f.id = in.can_id & (f.error || f.extended ? CAN_EFF_MASK : CAN_SFF_MASK);
    f.bit_rate_switch = f.fd && (in.flags & CANFD_BRS) != 0;
    f.error_state = f.fd && (in.flags & CANFD_ESI) != 0;
    const std::uint8_t max_length = f.fd ? 64 : 8;
    f.length = in.len < max_length ? in.len : max_length;
    f.own = false;
    if (!f.remote) {
        std::memcpy(f.data.data(), in.data, f.length);
    }
    return true;
}

}  // namespace hal::can::socketcan
