// SPDX-License-Identifier: MIT
#include "ethercat/devices/servo.hpp"

#include "cia301/values.hpp"
#include "cia402/drive/motor_options.hpp"
#include "tests/unit/cia402/drive_on_bus.hpp"
#include "tests/unit/ethercat/device_bench.hpp"

namespace drive_on_bus {

namespace {

namespace object = hal::cia402::object;
using namespace hal::ethercat;

/// An object of the process data of an axis.
struct Mapped {
    std::uint16_t index;
    std::size_t at, bytes;
};
constexpr Mapped mapped[] = {{object::controlword, 0, 2},
                             {object::modes_of_operation, 2, 1},
                             {object::target_position, 3, 4},
                             {object::target_velocity, 7, 4},
                             {object::target_torque, 11, 2}};
constexpr std::size_t bytes_per_axis = 13;

class EthercatDrive final : public Drive {
public:
    EthercatDrive(unsigned axes, const std::string& motor) : outputs_(bytes_per_axis * axes) {
        hal::ethercat::devices::DeviceOptions options{.axes = axes};
        EXPECT_EQ(hal::cia402::parse_motor(motor, options.motor), "");
        bench_.start("servo", options);
        bench_.w.gap_ns = 100;
        bench_.to_op(outputs_);
        run(1);
    }
    Abort write_by_sdo(std::uint16_t index, std::uint8_t sub, std::int64_t value) override {
        auto& dictionary = *bench_.device.firmware->design().dictionary;
        const auto* entry = dictionary.find(index, sub);
        if (entry == nullptr) return Abort::no_object;
        const auto command = coe::expedited_command(coe::command::download, entry->bytes());
        const coe::Sdo answer = transfer({command, index, sub, static_cast<std::uint32_t>(value)});
        return answer.is(coe::command::abort) ? static_cast<Abort>(answer.value) : Abort::none;
    }
    Abort command(std::uint16_t index, std::uint8_t sub, std::int64_t value) override {
        const unsigned axis = hal::cia402::axis_of(index);
        for (const Mapped& m : mapped) {
            if (m.index != hal::cia402::of_first_axis(index)) continue;
            std::memcpy(&outputs_[bytes_per_axis * axis + m.at], &value, m.bytes);
            return Abort::none;
        }
        return write_by_sdo(index, sub, value);
    }
    std::int64_t read(std::uint16_t index, std::uint8_t sub) override {
        auto& dictionary = *bench_.device.firmware->design().dictionary;
        const auto* entry = dictionary.find(index, sub);
        if (entry == nullptr) return -1;
        const std::uint32_t value = transfer({coe::command::upload, index, sub, 0}).value;
        std::uint8_t bytes[4];
        std::memcpy(bytes, &value, sizeof bytes);
        return hal::cia301::integer_of(static_cast<hal::cia301::Type>(entry->type),
                                       {bytes, entry->bytes()});
    }
    void run(int ms) override {
        for (int n = 0; n < ms; ++n) {
            bench_.w.now_ns += 1'000'000;
            bench_.outputs(outputs_);
            poll_mailbox();
        }
    }
    void stop_bus() override { bench_.request(State::safeop); }
    void start_bus() override {
        run(1);  // outputs, which OP waits for
        bench_.request(State::op);
    }
    void set_load_torque(unsigned n, double torque) override { axis(n).set_load_torque(torque); }
    void set_dc_link(unsigned n, double volts) override { axis(n).set_dc_link(volts); }
    void set_inputs(unsigned n, std::uint32_t bits) override { axis(n).set_inputs(bits); }
    void set_encoder_broken(unsigned n, bool broken) override {
        axis(n).set_encoder_broken(broken);
    }
    bool brake_closed(unsigned n) override { return axis(n).brake_closed(); }

private:
    devices::ServoAxis& axis(unsigned n) {
        return dynamic_cast<devices::Servo&>(bench_.device.firmware->behaviour()).axis(n);
    }
    /// Sends a request. Returns the answer; emergencies before it are kept.
    coe::Sdo transfer(const coe::Sdo& request) {
        esc_world::Bytes message(coe::sdo_bytes);
        coe::write_sdo(message.data(), coe::Service::sdo_request, request);
        poll_mailbox();
        bench_.post(MailboxType::coe, message);
        return coe::read_sdo(poll_mailbox()).value_or(coe::Sdo{});
    }
    /// Keeps the emergencies that wait in the mailbox. Returns the next other message; empty without
    /// one.
    esc_world::Bytes poll_mailbox() {
        for (;;) {
            auto payload = bench_.fetch(MailboxType::coe);
            if (payload.empty() || coe::service_of(payload.data()) != coe::Service::emergency) {
                return payload;
            }
            const auto emergency = coe::read_emergency(payload);
            emergencies_.push_back(
                {emergency->code, emergency->error_register, emergency->data[0]});
        }
    }

    esc_world::DeviceBench bench_;
    std::vector<std::uint8_t> outputs_;
};

}  // namespace

std::unique_ptr<Drive> make_ethercat_drive(unsigned axes, const std::string& motor) {
    return std::make_unique<EthercatDrive>(axes, motor);
}

}  // namespace drive_on_bus
