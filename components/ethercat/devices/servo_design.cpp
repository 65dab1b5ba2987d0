// SPDX-License-Identifier: MIT
#include "ethercat/devices/servo.hpp"

#include <algorithm>
#include <map>
#include <type_traits>

#include "cia402/drive/axis_objects.hpp"

namespace hal::ethercat::devices {

namespace o402 = cia402::object;

namespace {

std::uint16_t rights_of(const cia402::ObjectRow& row) noexcept {
    namespace access = coe::access;
    std::uint16_t rights = 0;
    if (cia301::readable(row.access)) {
        rights |= access::read;
    }
    if (cia301::writable(row.access)) {
        rights |= access::write;
    }
    switch (row.pdo) {
    case cia402::ObjectRow::sent: return rights | access::tx_mappable;
    case cia402::ObjectRow::received: return rights | access::rx_mappable;
    case cia402::ObjectRow::both: return rights | access::rx_mappable | access::tx_mappable;
    case cia402::ObjectRow::no_pdo: break;
    }
    return rights;
}

/// Returns how many sub-indices each object of an axis has.
std::map<std::uint16_t, std::uint8_t> counts_of(cia402::AxisValues& values) {
    std::map<std::uint16_t, std::uint8_t> counts;
    cia402::each_object(values, [&](const cia402::ObjectRow& row, const auto&) {
        counts[row.index] = std::max(counts[row.index], row.sub);
    });
    return counts;
}

void add_axis(Dictionary& d, unsigned axis, const cia402::AxisSettings& settings,
              std::uint32_t modes) {
    cia402::AxisValues values(cia402::possible(settings));
    values.supported_modes &= modes;
    values.mode = 0;
    values.mode_display = 0;
    values.abort_connection_option =
        static_cast<std::int16_t>(cia402::AbortConnection::disable_voltage);
    values.homing_method = 37;
    values.following_error_window = cia402::no_window;
    values.following_error_timeout = 0;
    values.output_mask = 0xffffffff;
    const auto counts = counts_of(values);
    cia402::each_object(values, [&](const cia402::ObjectRow& row, const auto& value) {
        using T = std::remove_cvref_t<decltype(value)>;
        const std::uint16_t index = cia402::of_axis(row.index, axis);
        const std::uint16_t type = coe::type::index_of(cia301::type_for<T>());
        const auto initial = static_cast<std::uint64_t>(value);
        if (row.sub == 0) {
            d.variable(index, row.name, type, rights_of(row), initial);
        } else {
            if (row.sub == 1) {
                d.record(index, cia402::name_of_record(row.index), counts.at(row.index));
            }
            d.sub(row.sub, row.name, type, rights_of(row), initial);
        }
        if (row.low != 0 || row.high != 0) {
            d.limit(row.low, row.high);
        }
    });
}

void add_sync(Dictionary& d, std::uint16_t index, const char* name, bool output) {
    namespace t = coe::type;
    constexpr std::uint16_t ro = coe::access::read;
    constexpr std::uint16_t rw = coe::access::read_write;
    d.record(index, name, 0x20, coe::ObjectCode::record);
    d.sub(1, "Synchronisation type", t::u16, rw, output ? 1 : 0x22);

    d.sub(2, "Cycle time", t::u32, rw, 1'000'000);
    d.sub(4, "Synchronisation types supported", t::u16, ro, 0x0007);

    d.sub(5, "Minimum cycle time", t::u32, ro, 62'500);
    d.sub(6, "Calc and copy time", t::u32, ro, 10'000);
    d.sub(9, "Delay time", t::u32, ro, 0);
    d.sub(0x0b, "SM event missed", t::u16, ro);
    d.sub(0x0c, "Cycle time too small", t::u16, ro);

    d.sub(0x20, "Sync error", t::boolean, ro);
}

}  // namespace

cia402::MotorSettings servo_motor() {
    cia402::MotorSettings motor;
    motor.resolution = 10'000;
    motor.highest_speed = 12'000;
    motor.absolute_encoder = true;
    motor.endless();
    motor.home_from = 50'000;
    motor.home_to = 60'000;
    motor.probe_from = {75'000, 100'000};
    motor.probe_to = {75'250, 100'250};
    return motor;
}

namespace {

/// Adds the PDOs of an axis: one of each direction is assigned, the master can map and assign the
/// others.
void add_pdos(DesignBuilder& b, unsigned n, const std::string& axis) {
    constexpr unsigned max = 12;  // entries
    const auto at = [&](std::uint16_t index) { return cia402::of_axis(index, n); };
    const auto rx = static_cast<std::uint16_t>(coe::rx_pdo + 0x10 * n);
    const auto tx = static_cast<std::uint16_t>(coe::tx_pdo + 0x10 * n);
    const PdoEntry control{at(o402::controlword), 0, "Controlword"};
    const PdoEntry mode{at(o402::modes_of_operation), 0, "Modes of operation"};
    const PdoEntry position{at(o402::target_position), 0, "Target position"};
    const PdoEntry velocity{at(o402::target_velocity), 0, "Target velocity"};
    const PdoEntry torque{at(o402::target_torque), 0, "Target torque"};
    const PdoEntry status{at(o402::statusword), 0, "Statusword"};
    const PdoEntry actual{at(o402::position_actual), 0, "Position actual value"};
    const auto other = [](std::uint16_t first, unsigned number) {
        return static_cast<std::uint16_t>(first + number);
    };
    b.pdo(true, rx, "Outputs" + axis, {control, mode, position, velocity, torque}, true, max);
    b.pdo(true, other(rx, 1), "Position" + axis, {control, position}, false, max);
    b.pdo(true, other(rx, 2), "Velocity" + axis, {control, velocity}, false, max);
    b.pdo(true, other(rx, 3), "Torque" + axis, {control, torque}, false, max);
    b.pdo(false, tx, "Inputs" + axis,
          {status,
           {at(o402::modes_of_operation_display), 0, "Modes of operation display"},
           actual,
           {at(o402::velocity_actual), 0, "Velocity actual value"},
           {at(o402::torque_actual), 0, "Torque actual value"}},
          true, max);
    b.pdo(false, other(tx, 1), "Position" + axis, {status, actual}, false, max);
}

}  // namespace

Parts make_servo(const DeviceOptions& options) {
    const cia402::AxisSettings settings = cia402::possible({.motor = options.motor});
    DesignBuilder b("servo", 0x0402'0000 + options.axes);
    b.mailbox(256);
    auto& d = b.dictionary();
    d.variable(0x1000, "Device type", coe::type::u32, coe::access::read,
               cia402::servo_drive | cia402::profile_number);
    add_sync(d, 0x1c32, "SM output parameter", true);

    add_sync(d, 0x1c33, "SM input parameter", false);
    for (unsigned n = 0; n < options.axes; ++n) {
        add_axis(d, n, settings, options.modes);
    }
    for (unsigned n = 0; n < options.axes; ++n) {
        const std::string axis = options.axes == 1 ? "" : " axis " + std::to_string(n + 1);
        add_pdos(b, n, axis);
    }
    b.dc(options.dc_required);
    b.design().sii.general.ds402_channels = static_cast<std::uint8_t>(options.axes);
    auto design = b.finish(options.alias, options.serial, 40 * options.axes, 40 * options.axes);
    auto behaviour = std::make_unique<Servo>(design.dictionary, options.axes, settings);
    return {std::move(design), std::move(behaviour)};
}

}  // namespace hal::ethercat::devices
