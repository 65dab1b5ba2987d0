// SPDX-License-Identifier: MIT
#include "drive.hpp"

#include <algorithm>
#include <cmath>

#include "axis_binding.hpp"

namespace hal::canopen {

namespace {
DeviceEvents nobody;
constexpr double max_step = 0.001;
constexpr Time pause = 100 * millisecond;
}  // namespace

Drive::Drive(const DriveSettings& settings, const DeviceSettings& device, DeviceEvents* also)
    : Drive(drive_description(settings), settings, device, also) {}

Drive::Drive(const Description& description, const DriveSettings& settings,
             const DeviceSettings& device, DeviceEvents* also)
    : also_(also != nullptr ? *also : nobody), device_(description, device, *this) {
    for (unsigned n = 0; n < std::clamp(settings.axes, 1U, cia402::max_axes); ++n) {
        axes_.push_back(std::make_unique<AxisBinding>(n, settings.axis[n]));
        axes_[n]->attach(device_);
        axes_[n]->axis().power_up();
    }
    // Event-driven TPDOs of a drive are sent when what they carry changed.
    for (unsigned n = 1; n <= Pdos::max_pdos; ++n) {
        device_.pdos().send_on_change(n);
    }
}

Drive::~Drive() = default;

void Drive::start(Time now) noexcept {
    last_ = now;
    for (auto& a : axes_) {
        a->axis().power_up();
    }
    device_.start(now);
}

/// Calls `advance` for each axis and each step until `now`.
template <class Advance>
void Drive::advance_to(Time now, Advance advance) noexcept {
    const Time passed = now - last_;
    last_ = now;
    if (passed <= 0) return;
    const double dt = static_cast<double>(std::min(passed, pause)) / static_cast<double>(second);
    const int steps = std::max(1, static_cast<int>(std::ceil(dt / max_step * (1 - 1e-9))));
    for (int n = 0; n < steps; ++n) {
        for (auto& a : axes_) {
            advance(a->axis(), dt / steps);
        }
    }
}

void Drive::step(Time now) noexcept {
    advance_to(now, [](cia402::DriveAxis& axis, double dt) noexcept { axis.step(dt); });
}

void Drive::lose_power() noexcept {
    for (auto& a : axes_) {
        a->axis().power_down();
    }
}

void Drive::rest(Time now) noexcept {
    advance_to(now, [](cia402::DriveAxis& axis, double dt) noexcept { axis.coast(dt); });
}

cia402::AxisStatus Drive::status(unsigned axis) const noexcept {
    return axis < axes_.size() ? axes_[axis]->axis().status() : cia402::AxisStatus{};
}
void Drive::set_load_torque(unsigned axis, double torque) noexcept {
    if (axis < axes_.size()) {
        axes_[axis]->axis().set_load_torque(torque);
    }
}
void Drive::set_inputs(unsigned axis, std::uint32_t bits) noexcept {
    if (axis < axes_.size()) {
        axes_[axis]->axis().set_inputs(bits & 0xffff0000);
    }
}
void Drive::set_dc_link(unsigned axis, double volts) noexcept {
    if (axis < axes_.size()) {
        axes_[axis]->axis().set_dc_link(volts);
    }
}
void Drive::set_encoder_broken(unsigned axis, bool broken) noexcept {
    if (axis < axes_.size()) {
        axes_[axis]->axis().set_encoder_broken(broken);
    }
}

// The master is lost with the bus or its heartbeat, and when it stops the node or resets the
// communication.

void Drive::on_state(NmtState state) noexcept {
    if (state == NmtState::stopped) {
        for (auto& a : axes_) {
            a->axis().lose_connection();
        }
    }
    also_.on_state(state);
}
void Drive::on_reset(bool application) noexcept {
    for (auto& a : axes_) {
        application ? a->axis().power_up() : a->axis().lose_connection();
    }
    also_.on_reset(application);
}
void Drive::on_communication_error(Time now) noexcept {
    for (auto& a : axes_) {
        a->axis().lose_connection();
    }
    also_.on_communication_error(now);
}

// Events a drive does not use.

void Drive::on_sync(std::uint8_t counter, Time now) noexcept { also_.on_sync(counter, now); }
void Drive::on_sync_lost(Time now) noexcept { also_.on_sync_lost(now); }
void Drive::on_time(const TimeOfDay& time, Time now) noexcept { also_.on_time(time, now); }
void Drive::on_rpdo(unsigned number, Time now) noexcept { also_.on_rpdo(number, now); }
void Drive::on_rpdo_late(unsigned number, Time now) noexcept { also_.on_rpdo_late(number, now); }
void Drive::on_rpdo_short(unsigned number, unsigned bytes, Time now) noexcept {
    also_.on_rpdo_short(number, bytes, now);
}
void Drive::on_node(std::uint8_t node, NodeEvent event, NmtState state, Time now) noexcept {
    also_.on_node(node, event, state, now);
}
void Drive::on_emergency(std::uint8_t node, const Emergency& emergency) noexcept {
    also_.on_emergency(node, emergency);
}
void Drive::on_life_guarding(bool lost, Time now) noexcept { also_.on_life_guarding(lost, now); }
void Drive::on_id_collision(Time now) noexcept { also_.on_id_collision(now); }
Abort Drive::on_store(std::uint8_t sub) noexcept { return also_.on_store(sub); }
Abort Drive::on_restore(std::uint8_t sub) noexcept { return also_.on_restore(sub); }
bool Drive::on_lss_store(std::uint8_t node_id, std::uint32_t bit_rate) noexcept {
    return also_.on_lss_store(node_id, bit_rate);
}
bool Drive::on_lss_bit_rate(std::uint32_t bit_rate) noexcept {
    return also_.on_lss_bit_rate(bit_rate);
}
void Drive::on_lss_activate(std::uint32_t bit_rate, Time delay) noexcept {
    also_.on_lss_activate(bit_rate, delay);
}

}  // namespace hal::canopen
