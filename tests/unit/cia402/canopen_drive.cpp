// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include "canopen/device/drive/drive.hpp"
#include "cia402/drive/motor_options.hpp"
#include "tests/unit/canopen/bus.hpp"
#include "tests/unit/cia402/drive_on_bus.hpp"

namespace drive_on_bus {

namespace {

using namespace hal::canopen;
namespace cia402 = hal::cia402;

class CanopenDrive final : public Drive {
public:
    CanopenDrive(unsigned axes, const std::string& motor)
        : drive_(settings(axes, motor), DeviceSettings{.node_id = 5}) {
        drive_.start(now_);
        drive_.device().command(NmtCommand::start, now_);
        run(1);
    }
    Abort write_by_sdo(std::uint16_t index, std::uint8_t sub, std::int64_t value) override {
        const auto* entry = drive_.device().dictionary().find(index, sub);
        if (entry == nullptr) return Abort::no_object;
        std::uint8_t bytes[8];
        store(bytes, value);
        return drive_.device().dictionary().write(index, sub, {bytes, entry->size});
    }
    Abort command(std::uint16_t index, std::uint8_t sub, std::int64_t value) override {
        return write_by_sdo(index, sub, value);
    }
    std::int64_t read(std::uint16_t index, std::uint8_t sub) override {
        std::uint8_t bytes[8] = {};
        const auto* entry = drive_.device().dictionary().find(index, sub);
        if (entry == nullptr) return -1;
        std::size_t length = 0;
        drive_.device().dictionary().read(index, sub, bytes, length);
        return hal::cia301::integer_of(entry->type, {bytes, entry->size});
    }
    void run(int ms) override {
        for (int n = 0; n < ms; ++n) {
            now_ += millisecond;
            drive_.step(now_);
            drive_.device().poll(now_);
            for (Frame f; drive_.device().out().pop(f);) {
                if (f.id != 0x85) continue;
                const auto emergency = EmcyConsumer::read(f, 0);
                emergencies_.push_back(
                    {emergency.code, emergency.error_register, emergency.manufacturer[0]});
            }
        }
    }
    void stop_bus() override { drive_.device().command(NmtCommand::stop, now_); }
    void start_bus() override { drive_.device().command(NmtCommand::start, now_); }
    void set_load_torque(unsigned axis, double torque) override {
        drive_.set_load_torque(axis, torque);
    }
    void set_dc_link(unsigned axis, double volts) override { drive_.set_dc_link(axis, volts); }
    void set_inputs(unsigned axis, std::uint32_t bits) override { drive_.set_inputs(axis, bits); }
    void set_encoder_broken(unsigned axis, bool broken) override {
        drive_.set_encoder_broken(axis, broken);
    }
    bool brake_closed(unsigned axis) override { return drive_.status(axis).brake_closed; }

private:
    static hal::canopen::DriveSettings settings(unsigned axes, const std::string& motor) {
        hal::canopen::DriveSettings result;
        result.axes = axes;
        for (auto& axis : result.axis) {
            EXPECT_EQ(cia402::parse_motor(motor, axis.motor), "");
        }
        return result;
    }
    Time now_ = 0;
    hal::canopen::Drive drive_;
};

}  // namespace

std::unique_ptr<Drive> make_canopen_drive(unsigned axes, const std::string& motor) {
    return std::make_unique<CanopenDrive>(axes, motor);
}

}  // namespace drive_on_bus
