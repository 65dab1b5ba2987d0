// SPDX-License-Identifier: MIT
#include "ethercat/wire/al_status_codes.hpp"

#include "text/find_row.hpp"

namespace hal::ethercat {

namespace {

constexpr const char* see_manual = "see the manual of the device";
constexpr const char* power_cycle = "power-cycle the device";
constexpr const char* check_mapping = "compare its PDOs with the configuration";
constexpr const char* check_dc =
    "compare `dc` and the cycle with what the device supports (object 0x1C32)";

constexpr AlStatusCode al_status_rows[] = {
    {0x0001, "unspecified error", "the device gives no reason", see_manual},
    {0x0002, "no memory", "the firmware ran out of memory", "map fewer objects"},
    {0x0003, "invalid device setup", "settings in the device contradict each other", see_manual},
    {0x0006, "SII and firmware do not match", "the EEPROM belongs to another firmware",
     "write the SII image of this firmware"},
    {0x0007, "firmware update failed", "the update did not finish; the old firmware runs",
     "repeat the update"},
    {0x0011, "invalid requested state change", "the device does not go from its state to this one",
     "request INIT first"},
    {0x0012, "unknown requested state", "the device does not know this state", see_manual},
    {0x0013, "bootstrap not supported", "the device has no BOOT state",
     "update its firmware in PRE-OP"},
    {0x0014, "no valid firmware", "an update was interrupted", "write the firmware in BOOT"},
    {0x0015, "invalid mailbox configuration in BOOT",
     "sync managers 0 and 1 differ from the bootstrap mailbox of the SII", "check the SII"},
    {0x0016, "invalid mailbox configuration in PRE-OP",
     "sync managers 0 and 1 differ from the mailbox of the SII", "check the SII"},
    {0x0017, "invalid sync manager configuration",
     "a sync manager differs from what the device expects", check_mapping},
    {0x0018, "no valid inputs available", "the device cannot measure now", see_manual},
    {0x0019, "no valid outputs", "no valid output data arrived in time",
     "check that the thread runs and the functions of the bus are added to it"},
    {0x001a, "synchronisation error", "frames do not arrive in step with SYNC0",
     "let the thread follow the reference clock, or change the shift of `dc`"},
    {0x001b, "sync manager watchdog", "outputs stopped arriving",
     "check that the thread runs and the cables; the time is set by `watchdog`"},
    {0x001c, "invalid sync manager types",
     "the types of the sync managers are not those of the device", check_mapping},
    {0x001d, "invalid output configuration",
     "the length of the outputs differs from the PDO mapping", check_mapping},
    {0x001e, "invalid input configuration", "the length of the inputs differs from the PDO mapping",
     check_mapping},
    {0x001f, "invalid watchdog configuration", "the device does not accept the watchdog time",
     "change or remove `watchdog`"},
    {0x0020, "device needs a cold start", "a setting takes effect at power-on only", power_cycle},
    {0x0021, "device needs INIT", "a setting takes effect in INIT only",
     "take it to INIT, then start again"},
    {0x0022, "device needs PRE-OP", "a setting takes effect in PRE-OP only",
     "take it to PRE-OP, then start again"},
    {0x0023, "device needs SAFE-OP", "a setting takes effect in SAFE-OP only",
     "take it to SAFE-OP, then start again"},
    {0x0024, "invalid input mapping", "an object cannot be mapped to the inputs", check_mapping},
    {0x0025, "invalid output mapping", "an object cannot be mapped to the outputs", check_mapping},
    {0x0026, "inconsistent settings", "settings contradict each other", see_manual},
    {0x0027, "free run not supported", "the device runs with distributed clocks only",
     "add a `dc` line to its section"},
    {0x0028, "synchronisation not supported",
     "the device does not support this kind of synchronisation", check_dc},
    {0x0029, "free run needs three buffers", "the sync managers are in mailbox mode",
     check_mapping},
    {0x002a, "background watchdog", "the firmware of the device hangs", power_cycle},
    {0x002b, "no valid inputs and outputs", "neither inputs nor outputs are valid", check_mapping},
    {0x002c, "fatal synchronisation error", "SYNC0 stopped, or frames stopped",
     "check that the thread runs without missed cycles: show timing"},
    {0x002d, "no synchronisation", "the device saw no SYNC0", check_dc},
    {0x002e, "cycle time too small", "the device cannot work that fast", "use a longer cycle"},
    {0x0030, "invalid DC configuration", "the device does not accept the settings of its clock",
     check_dc},
    {0x0031, "invalid DC latch configuration",
     "the device does not accept the settings of its latches", see_manual},
    {0x0032, "PLL error", "the device could not lock to SYNC0",
     "let the thread follow the reference clock, and check `show timing` for missed cycles"},
    {0x0033, "DC synchronisation I/O error", "inputs or outputs missed SYNC0",
     "change the shift of `dc`"},
    {0x0034, "DC synchronisation time-out", "SYNC0 or frames came too late",
     "change the shift of `dc`, and check `show timing` for missed cycles"},
    {0x0035, "invalid DC cycle time", "the device does not support this cycle", check_dc},
    {0x0036, "invalid SYNC0 cycle time", "the device does not support this cycle of SYNC0",
     check_dc},
    {0x0037, "invalid SYNC1 cycle time", "the device does not support this cycle of SYNC1",
     check_dc},
    {0x0041, "AoE mailbox error", "an AoE message was invalid", see_manual},
    {0x0042, "EoE mailbox error", "an EoE message was invalid", see_manual},
    {0x0043, "CoE mailbox error", "a CoE message was invalid", see_manual},
    {0x0044, "FoE mailbox error", "an FoE message was invalid", see_manual},
    {0x0045, "SoE mailbox error", "an SoE message was invalid", see_manual},
    {0x004f, "VoE mailbox error", "a VoE message was invalid", see_manual},
    {0x0050, "no access to the EEPROM", "the EEPROM does not answer the firmware", power_cycle},
    {0x0051, "EEPROM error", "the content of the EEPROM is invalid", "write its SII image"},
    {0x0060, "device restarted", "the firmware restarted by itself",
     "check the supply of the device"},
    {0x0061, "device identification updated", "its identification switch was changed", power_cycle},
    {0x0070, "module list differs", "the modules behind the coupler are not those of 0xF030",
     "compare 0xF030 with 0xF050"},
    {0x00f0, "controller available", "the controller of the device is ready for a state change",
     "request the state again"},
};

}  // namespace

const AlStatusCode* al_status(std::uint16_t code) noexcept {
    return find_row(al_status_rows, code, &AlStatusCode::code);
}

}  // namespace hal::ethercat
