// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <stdexcept>

#include "ethercat/plugins/channels/analog_input.hpp"
#include "ethercat/plugins/channels/analog_output.hpp"
#include "ethercat/plugins/channels/counter.hpp"
#include "ethercat/plugins/channels/delta_servo.hpp"
#include "ethercat/plugins/channels/digital_input.hpp"
#include "ethercat/plugins/channels/digital_output.hpp"
#include "ethercat/plugins/channels/drive_modes.hpp"
#include "ethercat/plugins/channels/flag.hpp"
#include "ethercat/plugins/channels/frequency_output.hpp"
#include "ethercat/plugins/channels/inverter.hpp"
#include "ethercat/plugins/channels/inverter_voltage.hpp"
#include "ethercat/plugins/channels/motor_reset.hpp"
#include "ethercat/plugins/channels/number.hpp"
#include "ethercat/plugins/channels/object_param.hpp"
#include "ethercat/plugins/channels/object_pin.hpp"
#include "ethercat/plugins/channels/object_value.hpp"
#include "ethercat/plugins/channels/position_drive.hpp"
#include "ethercat/plugins/channels/power_values.hpp"
#include "ethercat/plugins/channels/pulse_axis.hpp"
#include "ethercat/plugins/channels/pulse_train.hpp"
#include "ethercat/plugins/channels/pwm_output.hpp"
#include "ethercat/plugins/channels/scaled_value.hpp"
#include "ethercat/plugins/channels/soe_drive.hpp"
#include "ethercat/plugins/channels/speed_drive.hpp"
#include "ethercat/plugins/channels/stepper_drive.hpp"
#include "ethercat/plugins/channels/velocity_drive.hpp"

namespace hal::ethercat {

/// Makes a channel of the kind that the table of lcec's devices names. [setup]
inline std::unique_ptr<Channel> make_channel(const ChannelPlan& plan) {
    using Make = std::unique_ptr<Channel> (*)(const ChannelPlan&);
    struct Kind {
        const char* name;
        Make make;
    };
    const auto of = []<class T>(std::type_identity<T>) -> Make {
        return [](const ChannelPlan& of_plan) -> std::unique_ptr<Channel> {
            return std::make_unique<T>(of_plan);
        };
    };
    const Kind kinds[] = {
        {"din", of(std::type_identity<DigitalInput>())},
        {"dout", of(std::type_identity<DigitalOutput>())},
        {"ain", of(std::type_identity<AnalogInput>())},
        {"aout", of(std::type_identity<AnalogOutput>())},
        {"counter", of(std::type_identity<Counter>())},
        {"velocity-drive", of(std::type_identity<VelocityDrive>())},
        {"object-value", of(std::type_identity<ObjectValue>())},
        {"object-pin", of(std::type_identity<ObjectPin>())},
        {"drive-modes", of(std::type_identity<DriveModes>())},
        {"number", of(std::type_identity<Number>())},
        {"flag", of(std::type_identity<Flag>())},
        {"power-values", of(std::type_identity<PowerValues>())},
        {"scaled", of(std::type_identity<ScaledValue>())},
        {"position-drive", of(std::type_identity<PositionDrive>())},
        {"inverter", of(std::type_identity<Inverter>())},
        {"delta-servo", of(std::type_identity<DeltaServo>())},
        {"stepper", of(std::type_identity<StepperDrive>())},
        {"motor-reset", of(std::type_identity<MotorReset>())},
        {"pulse-train", of(std::type_identity<PulseTrain>())},
        {"frequency-output", of(std::type_identity<FrequencyOutput>())},
        {"pwm-output", of(std::type_identity<PwmOutput>())},
        {"object-param", of(std::type_identity<ObjectParam>())},
        {"pulse-axis", of(std::type_identity<PulseAxis>())},
        {"inverter-voltage", of(std::type_identity<InverterVoltage>())},
        {"soe-drive", of(std::type_identity<SoeDrive>())},
        {"speed-drive", of(std::type_identity<SpeedDrive>())},
    };
    for (const Kind& kind : kinds) {
        if (plan.channel.kind == kind.name) return kind.make(plan);
    }
    throw std::logic_error("unknown kind of channel '" + plan.channel.kind + "'");
}

}  // namespace hal::ethercat
