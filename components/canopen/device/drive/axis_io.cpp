// SPDX-License-Identifier: MIT
#include "axis_io.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "cia402/drive_profile.hpp"

namespace hal::canopen {

namespace {

namespace object {
using namespace cia402::object;
constexpr std::uint16_t set_point = 0x2100;
constexpr std::uint16_t count = 0x2101;
constexpr std::uint16_t second_count = 0x2102;
constexpr std::uint16_t outputs = 0x2103;

constexpr std::uint16_t inputs = 0x2104;
constexpr std::uint16_t current = 0x2105;
constexpr std::uint16_t missed_syncs = 0x2110;

constexpr std::uint16_t input_stops = 0x2111;
}  // namespace object

constexpr std::uint16_t encoder_lost = 0x7305;
constexpr std::uint16_t input_opened = 0x9000;
constexpr std::uint16_t sync_missing = 0x8700;

constexpr std::uint16_t heartbeat_lost = 0x8130;
// a process suspended for longer does not make the plant jump
constexpr Time max_step = 20 * millisecond;

std::uint8_t register_bits(std::uint16_t code) noexcept {
    if (code == heartbeat_lost || code == sync_missing) return error_communication;
    if (code == encoder_lost) return error_profile;
    return error_manufacturer;
}

}  // namespace

const char* to_string(AxisIo::State state) noexcept {
    constexpr const char* words[] = {"stopped", "ready", "on", "fault"};
    return words[static_cast<std::size_t>(state)];
}

Description axis_io_description(const AxisIoSettings& settings) {
    Description d = basic_device({.device_type = cia402::servo_drive | cia402::profile_number,
                                  .vendor = example_vendor,
                                  .product = 7,
                                  .revision = 0x00010000,
                                  .serial = settings.serial,
                                  .name = "axis-io",
                                  .heartbeat_ms = settings.heartbeat_ms});
    add_storage(d);
    using enum Type;
    using enum Access;
    d.add(object::error_code, 0, unsigned16, read_only, 0, "Error code").sent();
    d.add(object::controlword, 0, unsigned16, read_write, 0, "Controlword").mappable();
    d.add(object::statusword, 0, unsigned16, read_only, 0, "Statusword").sent();
    d.add(object::modes_of_operation, 0, integer8, read_write, 4, "Modes of operation")
        .limited(4, 4);
    d.add(object::modes_of_operation_display, 0, integer8, read_only, 4,
          "Modes of operation display")
        .sent();
    d.add(object::supported_modes, 0, unsigned32, constant, 1U << 3, "Supported drive modes");
    d.add(object::set_point, 0, integer16, read_write, 0, "PWM set-point").mappable();
    d.add(object::count, 0, integer16, read_only, 0, "Encoder count").sent();
    d.add(object::second_count, 0, integer16, read_only, 0, "Second encoder count").sent();
    d.add(object::outputs, 0, unsigned8, read_write, 0, "Outputs").mappable();
    d.add(object::inputs, 0, unsigned8, read_only, 0, "Inputs").sent();
    d.add(object::current, 0, integer16, read_only, 0, "Motor current").sent();
    d.add(object::missed_syncs, 0, unsigned8, read_write, 3, "SYNC periods until the motor is off");
    d.add(object::input_stops, 0, unsigned8, read_write, settings.input_stops ? 1 : 0,
          "Open input is a fault")
        .limited(0, 1);
    add_rpdo(d, 1,
             {.mapping = {map_entry(object::controlword, 0, 16),
                          map_entry(object::set_point, 0, 16), map_entry(object::outputs, 0, 8)}});
    add_tpdo(
        d, 1,
        {.transmission = 1,
         .mapping = {map_entry(object::statusword, 0, 16), map_entry(object::count, 0, 16),
                     map_entry(object::second_count, 0, 16), map_entry(object::inputs, 0, 8)}});
    add_tpdo(
        d, 2,
        {.cob = cob_invalid | 0x280,
         .plus_node_id = true,
         .mapping = {map_entry(object::current, 0, 16), map_entry(object::error_code, 0, 16)}});
    return d;
}

AxisIo::AxisIo(const AxisIoSettings& settings, std::unique_ptr<Plant> plant)
    : settings_(settings), plant_(std::move(plant)) {}

void AxisIo::attach(Device& device) {
    Program::attach(device);
    auto& d = device.dictionary();
    d.bind(object::error_code, 0, error_code_);
    d.bind(object::controlword, 0, controlword_);

    d.bind(object::statusword, 0, statusword_);
    statusword_ = disabled;
    d.bind(object::modes_of_operation, 0, mode_);

    d.bind(object::modes_of_operation_display, 0, mode_shown_);
    d.bind(object::set_point, 0, set_point_);
    d.bind(object::count, 0, count_);

    d.bind(object::second_count, 0, second_count_);
    d.bind(object::outputs, 0, outputs_);
    d.bind(object::inputs, 0, inputs_);

    d.bind(object::current, 0, current_ma_);
    d.bind(object::missed_syncs, 0, missed_syncs_);
    d.bind(object::input_stops, 0, input_stops_);
    Program::watch(object::controlword);
}

AxisIo::State AxisIo::state() const noexcept {
    switch (statusword_) {
    case enabled: return State::on;
    case failed: return State::fault;
    case ready_to_switch_on:
    case switched_on: return State::ready;
    default: return State::stopped;
    }
}

double AxisIo::duty() const noexcept {
    return statusword_ == enabled ? std::max(-1.0, set_point_ / 32767.0) : 0.0;
}

/// The state machine of CiA 402-2, 6.2, without ramps: a motor that is not commanded carries no
/// current.
void AxisIo::take_controlword() noexcept {
    using namespace cia402::control;
    const auto now = controlword_;
    const bool reset = (now & ~control_before_ & fault_reset) != 0;
    control_before_ = now;
    if (statusword_ == failed) {
        if (!reset || encoder_broken_ || (input_stops_ != 0 && !plant_->input())) return;
        device_->emcy().clear(error_code_);
        error_code_ = 0;
        statusword_ = disabled;
        return;
    }
    const bool voltage = (now & enable_voltage) != 0 && (now & not_quick_stop) != 0;
    if (!voltage || !online()) {
        statusword_ = disabled;
    } else if ((now & switch_on) == 0) {
        statusword_ = ready_to_switch_on;
    } else if (statusword_ == ready_to_switch_on || (now & enable_operation) == 0) {
        if (statusword_ != disabled) {
            statusword_ = switched_on;
        }
    } else if (statusword_ == switched_on) {
        statusword_ = enabled;
    }
}

void AxisIo::stop_for(std::uint16_t code) noexcept {
    if (statusword_ == failed) return;
    error_code_ = code;
    statusword_ = failed;
    set_point_ = 0;
    outputs_ = 0;
    device_->emcy().raise(code, register_bits(code));
}

/// Samples the counters.
void AxisIo::sample(Time now) noexcept {
    if (stepped_once_ && now > stepped_) {
        plant_->step(duty(), statusword_ == enabled, std::min(now - stepped_, max_step));
    }
    stepped_ = now;
    stepped_once_ = true;
    count_ = encoder_broken_ ? broken_at_ : static_cast<std::int16_t>(plant_->count());
    second_count_ = static_cast<std::int16_t>(plant_->second_count());
    inputs_ = plant_->input() ? 1 : 0;
    current_ma_ =
        static_cast<std::int16_t>(std::clamp(plant_->current() * 1000.0, -32767.0, 32767.0));
}

/// Switches the motor off when SYNCs or set-points fail to arrive.
void AxisIo::watch(Time now) noexcept {
    if (statusword_ == failed) return;
    if (encoder_broken_) return stop_for(encoder_lost);
    if (input_stops_ != 0 && inputs_ == 0) return stop_for(input_opened);
    const Time period = device_->sync().period();
    if (statusword_ != enabled || period <= 0 || missed_syncs_ == 0) return;
    if (now - std::min(synced_, commanded_) > period * missed_syncs_ + period / 2) {
        stop_for(sync_missing);
    }
}

void AxisIo::on_sync(std::uint8_t, Time now) noexcept {
    synced_ = now;
    sample(now);
}

void AxisIo::on_state(NmtState state) noexcept {
    if (state == NmtState::operational) return;
    if (statusword_ != failed) {
        statusword_ = disabled;
    }
    set_point_ = 0;
    outputs_ = 0;
}

void AxisIo::on_reset(bool application) noexcept {
    if (!application) return;
    statusword_ = disabled;
    control_before_ = error_code_ = 0;
}

void AxisIo::step(Time now) noexcept {
    sample(now);
    watch(now);
}

void AxisIo::break_encoder(bool broken) noexcept {
    if (broken && !encoder_broken_) {
        broken_at_ = count_;
    }
    encoder_broken_ = broken;
}

bool AxisIo::set(std::string_view name, double value) {
    if (name == "encoder-broken") {
        break_encoder(value != 0.0);
        return true;
    }
    const auto all = plant_->influences();
    for (std::size_t n = 0; n < all.size(); ++n) {
        if (name == all[n].name) {
            plant_->put(n, value);
            return true;
        }
    }
    return false;
}

std::vector<std::string> AxisIo::settable() const {
    std::vector<std::string> names;
    for (const auto& row : plant_->influences()) {
        names.emplace_back(row.name);
    }
    names.emplace_back("encoder-broken");
    return names;
}

std::string AxisIo::news() const {
    std::string text = to_string(state());
    if (error_code_ != 0) {
        text += std::string(", error ") + emergency_text(error_code_);
    }
    text += ", outputs ";
    for (unsigned n = 4; n-- > 0;) {
        text += output(n) ? '1' : '0';
    }
    return text + (plant_->input() ? ", input closed" : ", input open");
}

std::string AxisIo::summary() const {
    return news() + ", counts " + std::to_string(plant_->count()) + " and " +
           std::to_string(plant_->second_count());
}

}  // namespace hal::canopen
