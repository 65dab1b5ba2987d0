// SPDX-License-Identifier: MIT
// An axis of a CANopen drive: the simulated axis of `cia402/drive/`, bound to the object dictionary
// and the emergencies of a device.
#pragma once

#include "canopen/protocol/device.hpp"
#include "cia402/drive/drive_axis.hpp"

namespace hal::canopen {

/// The axis with its objects. [realtime] unless marked.
class AxisBinding final : private Handler, private cia402::AxisBus {
public:
    /// Creates axis `number`, counted from 0. [setup]
    AxisBinding(unsigned number, const cia402::AxisSettings&);
    /// Binds the values of the axis to the dictionary of a device, which must outlive the use of
    /// the axis. [setup]
    void attach(Device&);

    cia402::DriveAxis& axis() noexcept { return axis_; }

private:
    Abort writing(Entry&, std::span<const std::uint8_t>) noexcept override;
    void written(Entry&) noexcept override;
    void raise(std::uint16_t code, std::int32_t detail) noexcept override;
    void clear(std::uint16_t code) noexcept override;
    bool master_alive() const noexcept override;

    const unsigned number_;
    cia402::DriveAxis axis_;
    Device* device_ = nullptr;
};

}  // namespace hal::canopen
