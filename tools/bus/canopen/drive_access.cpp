// SPDX-License-Identifier: MIT
#include "bus/canopen/drive_access.hpp"

#include <cstring>
#include <fmt/core.h>

#include "canopen/protocol/emcy.hpp"
#include "cia402/error_words.hpp"
#include "cli/output.hpp"
#include "text/quoting.hpp"

namespace hal::tools {

using namespace cia402;
using canopen::SdoRequest;

namespace {

constexpr std::int64_t standstill_ns = 100'000'000;  // without a count: at standstill

std::int64_t sign_extended(std::uint64_t bits, std::size_t bytes) {
    const unsigned unused = 64 - 8 * static_cast<unsigned>(bytes);
    if (unused >= 64) return 0;
    return static_cast<std::int64_t>(bits << unused) >> unused;
}

bool is_value_rejected(const SdoRequest& request) {
    using canopen::Abort;
    if (!request.aborted_by_server) return false;
    return request.abort == Abort::value || request.abort == Abort::too_high ||
           request.abort == Abort::too_low;
}

bool is_object_missing(const SdoRequest& request) {
    using canopen::Abort;
    return request.aborted_by_server &&
           (request.abort == Abort::no_object || request.abort == Abort::no_sub);
}

}  // namespace

AxisAccess::AxisAccess(const Options& options, NodeClient& station, std::uint8_t node,
                       unsigned axis)
    : options_(options), station_(station), node_(node), axis_(axis) {
    forget_emergencies();
}

bool AxisAccess::refuse(const std::string& sentence) const {
    std::string text = fmt::format("{}: {}", letter(), sentence);
    canopen::RemoteNode& node = station_.network.add(node_);
    if (node.emergencies() > emergencies_) {
        const std::uint16_t code = node.emergency(0).code;
        text += fmt::format("; last EMCY 0x{:04X}: {}", code, error_word(code));
    }
    fail(options_, text);
    return false;
}

bool AxisAccess::read(std::uint16_t index, std::uint8_t sub, std::int64_t& value, bool is_signed,
                      bool* missing) {
    std::uint8_t buffer[8] = {};
    const std::uint16_t object_index = of_axis(index, axis_);
    SdoRequest request{.index = object_index, .sub = sub, .upload = true, .buffer = buffer};
    if (!station_.transfer(node_, request)) {
        if (missing && is_object_missing(request)) {
            *missing = true;
            return false;
        }
        station_.fail_transfer(node_, request, fmt::format("{:04X}:{}", object_index, sub));
        return false;
    }
    std::uint64_t bits = 0;
    std::memcpy(&bits, buffer, request.size);
    value = is_signed ? sign_extended(bits, request.size) : static_cast<std::int64_t>(bits);
    return true;
}

bool AxisAccess::write(std::uint16_t index, std::uint8_t sub, std::int64_t value, unsigned bytes) {
    std::uint8_t data[8];
    std::memcpy(data, &value, sizeof data);
    const std::uint16_t object_index = of_axis(index, axis_);
    SdoRequest request{.index = object_index, .sub = sub, .data = std::span(data, bytes)};
    if (station_.transfer(node_, request)) return true;
    station_.fail_transfer(node_, request, fmt::format("{:04X}:{}", object_index, sub));
    return false;
}

/// Reads an object that a drive need not have. Clears `available` when it has none; `value` is
/// unchanged then. Returns false when the bus failed.
bool AxisAccess::read_optional(bool& available, std::uint16_t index, std::int64_t& value) {
    if (!available) return true;
    bool missing = false;
    if (read(index, 0, value, true, &missing)) return true;
    if (!missing) return false;
    available = false;
    return true;
}

bool AxisAccess::look() {
    std::int64_t value = 0;
    bool missing = false;
    if (!read(object::statusword, 0, value, false, &missing)) {
        return missing && refuse(fmt::format("node {} has no such axis: object {:04X} is missing",
                                             node_, of_axis(object::statusword, axis_)));
    }
    feedback_.statusword = static_cast<std::uint16_t>(value);
    std::int64_t mode = static_cast<std::int64_t>(feedback_.mode);
    if (!read_optional(feedback_.has_mode, object::modes_of_operation_display, mode)) return false;
    feedback_.mode = static_cast<Mode>(mode);
    std::int64_t velocity = feedback_.velocity;
    if (!read_optional(feedback_.has_velocity, object::velocity_actual, velocity)) return false;
    feedback_.velocity = static_cast<std::int32_t>(velocity);
    std::int64_t torque = feedback_.torque;
    if (!read_optional(has_torque_object_, object::torque_actual, torque)) return false;
    feedback_.torque = static_cast<std::int16_t>(torque);
    if (!read(object::position_actual, 0, value, true)) return false;
    feedback_.position = static_cast<std::int32_t>(value);
    feedback_.error_code = 0;
    if (in_fault() && read(object::error_code, 0, value, false, &missing)) {
        feedback_.error_code = static_cast<std::uint16_t>(value);
    }
    if (feedback_.position != rest_position_ || rest_since_ == 0) {
        restart_standstill();
    }
    rest_position_ = feedback_.position;
    return true;
}

bool AxisAccess::standing() const { return monotonic_ns() - rest_since_ >= standstill_ns; }

bool AxisAccess::in_fault() const {
    return state() == State::fault || state() == State::fault_reaction_active;
}

bool AxisAccess::has_torque() const {
    return state() == State::operation_enabled || state() == State::quick_stop_active;
}

/// Returns the homing methods of 60E3h, separated by commas. Empty with `missing`: no such object.
/// Empty without: the bus failed.
std::string AxisAccess::homing_methods(bool& missing) {
    std::int64_t count = 0;
    if (!read(object::supported_homing_methods, 0, count, false, &missing)) return {};
    std::string methods;
    for (unsigned sub = 1; sub <= count && sub < 255; ++sub) {
        std::int64_t method = 0;
        if (!read(object::supported_homing_methods, static_cast<std::uint8_t>(sub), method, true,
                  &missing)) {
            break;
        }
        append_item(methods, std::to_string(method));
    }
    return methods;
}

/// Checks that the drive supports a homing method, by 60E3h if it exists.
bool AxisAccess::choose_homing(int method) {
    const auto data = static_cast<std::uint8_t>(method);
    const std::uint16_t index = of_axis(object::homing_method, axis_);
    SdoRequest request{.index = index, .data = std::span(&data, 1)};
    if (station_.transfer(node_, request)) return true;
    if (!is_value_rejected(request)) {
        station_.fail_transfer(node_, request, fmt::format("{:04X}:0", index));
        return false;
    }
    bool missing = false;
    const std::string methods = homing_methods(missing);
    if (methods.empty() && !missing) {
        return false;  // the bus failed
    }
    return refuse(fmt::format(
        "the drive does not support homing method {}; {}", method,
        methods.empty() ? "see its manual for those it supports" : "it supports " + methods));
}

void AxisAccess::send_stop() {
    const std::uint16_t index = of_axis(object::controlword, axis_);
    for (const std::uint16_t order : {command::quick_stop, command::disable_voltage}) {
        can::Frame frame(0x600U + node_, {0x2b, static_cast<std::uint8_t>(index & 0xff),
                                          static_cast<std::uint8_t>(index >> 8), 0,
                                          static_cast<std::uint8_t>(order), 0, 0, 0});
        station_.out.push(frame);
        station_.until([] { return false; }, 10 * pause_ns);
    }
}

/// Brakes by quick stop, until the drive has no torque, is at standstill or takes too long.
bool AxisAccess::brake() {
    if (!write(object::controlword, 0, command::quick_stop, 2)) return false;
    restart_standstill();
    const std::int64_t end = monotonic_ns() + rules.limits.stop;
    while (has_torque() && monotonic_ns() < end) {
        station_.until([] { return false; }, pause_ns);
        if (!look()) return false;
        // 605Ah may keep it in this state
        if (state() == State::quick_stop_active && standing()) break;
    }
    return true;
}

/// Works without the state machine of the commands, which may have failed, and in every state.
bool AxisAccess::stop_and_disable(std::string& what) {
    if (!look()) {  // the response may be lost although the command arrives
        send_stop();
        what = "quick stop and disable sent, no response";
        return false;
    }
    const bool had_torque = has_torque();
    if (had_torque && !brake()) return false;
    if (!in_fault() && state() != State::switch_on_disabled &&
        !write(object::controlword, 0, command::disable_voltage, 2)) {
        return false;
    }
    if (!look()) return false;
    if (!had_torque) return true;
    if (has_torque()) {
        what =
            fmt::format("not stopped within {:g} s", static_cast<double>(rules.limits.stop) / 1e9);
        return false;
    }
    if (in_fault()) {
        what = fmt::format("in fault (error 0x{:04X}: {}), off, at {:.10g}", feedback_.error_code,
                           error_word(feedback_.error_code), position());
        return true;
    }
    what = fmt::format("stopped and off, at {:.10g}", position());
    return true;
}

}  // namespace hal::tools
