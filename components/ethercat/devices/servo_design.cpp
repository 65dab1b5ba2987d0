// SPDX-License-Identifier: MIT
#include "ethercat/devices/servo.hpp"

#include <bit>

namespace hal::ethercat::devices {

namespace o402 = canopen::cia402::object;

namespace {

void add_axis(Dictionary& d, unsigned axis, std::uint32_t modes) {
    namespace t = coe::type;
    namespace access = coe::access;
    constexpr std::uint16_t ro = access::read | access::tx_mappable;
    constexpr std::uint16_t rw = access::read_write;

    constexpr std::uint16_t rx = rw | access::rx_mappable;
    constexpr std::uint16_t both = rx | access::tx_mappable;
    const auto at = [&](std::uint16_t index) { return canopen::cia402::of_axis(index, axis); };
    const auto add = [&](std::uint16_t index, const char* name, std::uint16_t type,
                         std::uint16_t rights, std::int64_t initial = 0) {
        d.variable(at(index), name, type, rights, static_cast<std::uint64_t>(initial));
    };
    add(o402::error_code, "Error code", t::u16, ro);
    add(o402::controlword, "Controlword", t::u16, rx);

    add(o402::statusword, "Statusword", t::u16, ro);
    add(o402::quick_stop_option, "Quick stop option code", t::s16, rw, 2);

    add(o402::halt_option, "Halt option code", t::s16, rw, 1);
    add(o402::fault_reaction_option, "Fault reaction option code", t::s16, rw, 2);
    add(o402::modes_of_operation, "Modes of operation", t::s8, rx);
    d.limit(0, std::bit_width(modes & 0x3a5U));
    add(o402::modes_of_operation_display, "Modes of operation display", t::s8, ro);
    add(o402::position_demand, "Position demand value", t::s32, ro);

    add(o402::position_actual, "Position actual value", t::s32, ro);
    add(o402::following_error_window, "Following error window", t::u32, rw, 0xffffffff);

    add(o402::following_error_timeout, "Following error timeout", t::u16, rw);
    add(o402::velocity_actual, "Velocity actual value", t::s32, ro);

    add(o402::target_torque, "Target torque", t::s16, rx);
    add(o402::max_torque, "Max torque", t::u16, rx, 3000);

    add(o402::motor_rated_torque, "Motor rated torque", t::u32, rw, 1000);
    add(o402::torque_actual, "Torque actual value", t::s16, ro);

    add(o402::target_position, "Target position", t::s32, both);
    add(o402::home_offset, "Home offset", t::s32, rw);
    d.record(at(o402::software_position_limit), "Software position limit", 2,
             coe::ObjectCode::array);
    d.sub(1, "Min position limit", t::s32, rw, 0);
    d.sub(2, "Max position limit", t::s32, rw, 0);
    add(o402::max_profile_velocity, "Max profile velocity", t::u32, rx, 2'000'000);
    add(o402::profile_velocity, "Profile velocity", t::u32, rx, 100'000);

    add(o402::profile_acceleration, "Profile acceleration", t::u32, rx, 1'000'000);
    add(o402::profile_deceleration, "Profile deceleration", t::u32, rx, 1'000'000);
    add(o402::quick_stop_deceleration, "Quick stop deceleration", t::u32, rw, 10'000'000);
    add(o402::motion_profile_type, "Motion profile type", t::s16, rw);

    add(o402::homing_method, "Homing method", t::s8, rx, 37);
    d.record(at(o402::homing_speeds), "Homing speeds", 2, coe::ObjectCode::array);
    d.sub(1, "Speed during search for switch", t::u32, rw, 50'000);

    d.sub(2, "Speed during search for zero", t::u32, rw, 5'000);
    add(o402::homing_acceleration, "Homing acceleration", t::u32, rw, 1'000'000);
    add(o402::position_offset, "Position offset", t::s32, rx);

    add(o402::velocity_offset, "Velocity offset", t::s32, rx);
    add(o402::torque_offset, "Torque offset", t::s16, rx);
    d.record(at(o402::interpolation_period), "Interpolation time period", 2);
    d.sub(1, "Interpolation time units", t::u8, rw, 1);

    d.sub(2, "Interpolation time index", t::s8, rw, 0xfd);
    add(o402::following_error_actual, "Following error actual value", t::s32, ro);

    add(o402::digital_inputs, "Digital inputs", t::u32, ro);
    d.record(at(o402::digital_outputs), "Digital outputs", 2);
    d.sub(1, "Physical outputs", t::u32, rx);
    d.sub(2, "Bit mask", t::u32, rw, 0xffffffff);
    add(o402::target_velocity, "Target velocity", t::s32, rx);
    add(o402::supported_modes, "Supported drive modes", t::u32, access::read, modes & 0x3a5U);
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

Parts make_servo(const DeviceOptions& options) {
    DesignBuilder b("servo", 0x0402'0000 + options.axes);
    b.mailbox(256, sii::coe);
    auto& d = b.dictionary();
    d.variable(0x1000, "Device type", coe::type::u32, coe::access::read,
               canopen::cia402::servo_drive | canopen::cia402::profile_number);
    add_sync(d, 0x1c32, "SM output parameter", true);

    add_sync(d, 0x1c33, "SM input parameter", false);
    for (unsigned n = 0; n < options.axes; ++n) {
        add_axis(d, n, options.modes);
    }
    for (unsigned n = 0; n < options.axes; ++n) {
        const auto at = [&](std::uint16_t index) { return canopen::cia402::of_axis(index, n); };
        const std::string axis = options.axes == 1 ? "" : " axis " + std::to_string(n + 1);
        b.pdo(true, static_cast<std::uint16_t>(coe::rx_pdo + 0x10 * n), "Outputs" + axis,
              {{at(o402::controlword), 0, "Controlword"},
               {at(o402::modes_of_operation), 0, "Modes of operation"},
               {at(o402::target_position), 0, "Target position"},
               {at(o402::target_velocity), 0, "Target velocity"},
               {at(o402::target_torque), 0, "Target torque"}},
              true, 12);
        b.pdo(false, static_cast<std::uint16_t>(coe::tx_pdo + 0x10 * n), "Inputs" + axis,
              {{at(o402::statusword), 0, "Statusword"},
               {at(o402::modes_of_operation_display), 0, "Modes of operation display"},
               {at(o402::position_actual), 0, "Position actual value"},
               {at(o402::velocity_actual), 0, "Velocity actual value"},
               {at(o402::torque_actual), 0, "Torque actual value"}},
              true, 12);
    }
    b.dc(options.dc_required);
    b.design().sii.general.ds402_channels = static_cast<std::uint8_t>(options.axes);
    auto design = b.finish(options.alias, options.serial, 40 * options.axes, 40 * options.axes);
    auto behaviour = std::make_unique<Servo>(design.dictionary, options.axes);
    return {std::move(design), std::move(behaviour)};
}

Servo::Servo(std::shared_ptr<Dictionary> dictionary, unsigned axes)
    : dictionary_(std::move(dictionary)) {
    for (unsigned n = 0; n < axes; ++n) {
        axes_.push_back(std::make_unique<ServoAxis>(*dictionary_, n));
    }
}

void Servo::power_on() noexcept {
    for (auto& a : axes_) {
        a->power_on();
    }
}

void Servo::step(Step& s) noexcept {
    for (auto& a : axes_) {
        a->step(s);
    }
}

}  // namespace hal::ethercat::devices
