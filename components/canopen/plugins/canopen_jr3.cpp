// SPDX-License-Identifier: MIT
#include <cmath>

#include "canopen/device/component.hpp"
#include "canopen/device/sensor/jr3.hpp"

namespace {

using namespace hal::canopen;

struct CanopenJr3 final : NodeComponent {
    explicit CanopenJr3(const hal_host* host) : NodeComponent(host, 0x50) {}

    hal::Function run{
        *this, "update", &CanopenJr3::update,
        "advances and decodes the bit stream of the sensor, receives and sends frames"};

    hal::In<double> fx{*this, "fx", "force on the sensor in x", {.unit = "N"}};
    hal::In<double> fy{*this, "fy", "force on the sensor in y", {.unit = "N"}};
    hal::In<double> fz{*this, "fz", "force on the sensor in z", {.unit = "N"}};
    hal::In<double> mx{*this, "mx", "torque on the sensor about x", {.unit = "N*m"}};
    hal::In<double> my{*this, "my", "torque on the sensor about y", {.unit = "N*m"}};
    hal::In<double> mz{*this, "mz", "torque on the sensor about z", {.unit = "N*m"}};
    hal::In<double> supply{*this,
                           "supply",
                           "supply voltage as a fraction of full scale; valid range 0.7..0.8",
                           {.initial = 0.75}};
    hal::In<bool> cable{
        *this, "cable", "false: the sensor cable is disconnected", {.initial = true}};
    hal::Param<std::uint32_t> noise{
        *this, "noise", "amplitude of the noise on raw readings in counts; full scale is 16384"};

    hal::Outs<double> measured{
        *this, "measured-#", 6,
        "channel # of Fx Fy Fz Mx My Mz as the node measures it, in N and N*m"};
    hal::Out<bool> overload{*this, "overload", "a channel exceeds its limit (2103h)"};
    hal::Out<bool> calibrated{
        *this, "calibrated",
        "the node has received the calibration memory over the stream, which takes 1 s"};
    hal::Out<bool> led{*this, "led",
                       "status LED: off stopped, blinking pre-operational, on operational"};
    hal::Out<std::uint32_t> packets{*this, "packets", "decoded packets of the stream"};
    hal::Out<std::uint32_t> errors{*this, "errors", "framing errors in the stream"};

    void update(hal::Cycle cycle) noexcept {
        jr3_->set_wrench({fx, fy, fz, mx, my, mz});
        jr3_->set_supply(std::isfinite(supply.get()) ? supply.get() : 0.0);
        jr3_->set_noise(noise < 10000 ? noise.get() : 10000);
        jr3_->set_cable(cable);
        turn(cycle);
        for (std::size_t n = 0; n < 6; ++n) {
            measured[n] = jr3_->wrench()[n];
        }
        overload = (jr3_->status() & jr3_status::overload) != 0;
        calibrated = jr3_->calibrated();
        led = node().powered() && jr3_->led();
        packets = jr3_->decoder().packets();
        errors = jr3_->decoder().errors();
    }

private:
    Program& program() override {
        Jr3Settings settings;
        settings.serial = settings.calibration.serial = serial();
        settings.heartbeat_ms = heartbeat();
        jr3_ = std::make_unique<Jr3>(std::move(settings));
        return *jr3_;
    }
    std::unique_ptr<Jr3> jr3_;
};

}  // namespace

HAL_COMPONENT(CanopenJr3, "canopen_jr3", "Simulated CANopen force/torque node with a JR3 sensor",
              R"(
A six-axis force/torque sensor and the node that connects it to a CAN bus. The sensor sends its raw
readings, its supply voltage and its calibration memory as a stream of 20-bit packets at 2.2 MHz.
The node decodes the packets, decouples the readings with the 6 by 6 matrix of the calibration and
serves forces and torques as objects of CiA 404.

TPDO 1 and 2 carry the forces in 0.01 N, TPDO 3 and 4 the torques in 0.001 N*m: three INTEGER16
each, then a status byte and a sample counter. TPDO 2 and 4 are sent at each SYNC. TPDO 1 and 3 are
sent when a value changes; they are disabled until a master writes their COB-ID without bit 31 to
1800h:1 and 1802h:1.

A load beyond the range of a channel saturates it: its reading is full scale, and the node sets the
bits saturated and overload in 2201h and sends EMCY FF01h. A force or torque that is infinite is
such a load; one that is NaN saturates all channels, since each depends on all six.

    loadrt canopen_jr3 link=sim:arm id=0x50
    addf canopen-jr3.0.update servo
    setp canopen-jr3.0.fz -20
    start
)")
