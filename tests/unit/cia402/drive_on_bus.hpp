// SPDX-License-Identifier: MIT
// A drive of CiA 402 on a bus, as a master sees it. The tests do not know which bus: CANopen writes
// the object dictionary of a node, EtherCAT the process data and CoE of a slave in OP. One step is
// 1 ms.
#pragma once

#include <cstdint>
#include <memory>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

#include "cia301/abort.hpp"
#include "cia402/drive_profile.hpp"

namespace drive_on_bus {

using hal::cia301::Abort;

struct Emergency {
    std::uint16_t code = 0;
    std::uint8_t error_register = 0;
    std::uint8_t axis = 0;
};

class Drive {
public:
    virtual ~Drive() = default;
    /// Writes an object of an axis by an SDO.
    virtual Abort write_by_sdo(std::uint16_t index, std::uint8_t sub, std::int64_t value) = 0;
    /// Writes an object the way a master commands it in every cycle.
    virtual Abort command(std::uint16_t index, std::uint8_t sub, std::int64_t value) = 0;
    virtual std::int64_t read(std::uint16_t index, std::uint8_t sub) = 0;
    virtual void run(int ms) = 0;
    /// Ends the operation of the drive as a master does that stops.
    virtual void stop_bus() = 0;
    /// Makes the drive operational again.
    virtual void start_bus() = 0;
    /// Returns the emergencies since the last call.
    std::vector<Emergency> emergencies() { return std::exchange(emergencies_, {}); }

    // The machine around an axis.
    virtual void set_load_torque(unsigned axis, double torque) = 0;
    virtual void set_dc_link(unsigned axis, double volts) = 0;
    virtual void set_inputs(unsigned axis, std::uint32_t bits) = 0;
    virtual void set_encoder_broken(unsigned axis, bool broken) = 0;
    virtual bool brake_closed(unsigned axis) = 0;

protected:
    std::vector<Emergency> emergencies_;
};

enum class Bus { canopen, ethercat };
inline std::ostream& operator<<(std::ostream& out, Bus bus) {
    return out << (bus == Bus::canopen ? "canopen" : "ethercat");
}
/// Returns a drive that is operational on its bus; `motor` as in parse_motor().
std::unique_ptr<Drive> make_drive(Bus, unsigned axes, const std::string& motor);

std::unique_ptr<Drive> make_canopen_drive(unsigned axes, const std::string& motor);
std::unique_ptr<Drive> make_ethercat_drive(unsigned axes, const std::string& motor);

}  // namespace drive_on_bus
