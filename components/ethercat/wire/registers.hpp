// SPDX-License-Identifier: MIT
// Registers of the EtherCAT slave controller (ETG.1000.4, clause 6; names as there).
#pragma once

#include <cstdint>

namespace hal::ethercat::registers {

inline constexpr std::uint16_t type = 0x0000;
inline constexpr std::uint16_t fmmus = 0x0004;
inline constexpr std::uint16_t sync_managers = 0x0005;

inline constexpr std::uint16_t ram_size = 0x0006;
inline constexpr std::uint16_t port_descriptor = 0x0007;
inline constexpr std::uint16_t features = 0x0008;

inline constexpr std::uint16_t station_address = 0x0010;
inline constexpr std::uint16_t station_alias = 0x0012;

inline constexpr std::uint16_t dl_control = 0x0100;
inline constexpr std::uint16_t loop_control = 0x0101;
inline constexpr std::uint16_t dl_alias_enable = 0x0103;

inline constexpr std::uint16_t dl_status = 0x0110;
inline constexpr std::uint16_t al_control = 0x0120;
inline constexpr std::uint16_t al_status = 0x0130;

inline constexpr std::uint16_t al_status_code = 0x0134;
inline constexpr std::uint16_t pdi_control = 0x0140;

inline constexpr std::uint16_t ecat_event_mask = 0x0200;
inline constexpr std::uint16_t al_event_mask = 0x0204;

inline constexpr std::uint16_t ecat_event = 0x0210;
inline constexpr std::uint16_t al_event = 0x0220;
inline constexpr std::uint16_t rx_errors = 0x0300;

inline constexpr std::uint16_t forwarded_errors = 0x0308;
inline constexpr std::uint16_t processing_unit_errors = 0x030c;

inline constexpr std::uint16_t pdi_errors = 0x030d;
inline constexpr std::uint16_t lost_links = 0x0310;
inline constexpr std::uint16_t watchdog_divider = 0x0400;

inline constexpr std::uint16_t pdi_watchdog = 0x0410;
inline constexpr std::uint16_t process_data_watchdog = 0x0420;

inline constexpr std::uint16_t watchdog_status = 0x0440;
inline constexpr std::uint16_t process_data_watchdog_counter = 0x0442;

inline constexpr std::uint16_t pdi_watchdog_counter = 0x0443;
inline constexpr std::uint16_t eeprom_configuration = 0x0500;

inline constexpr std::uint16_t eeprom_pdi_access = 0x0501;
inline constexpr std::uint16_t eeprom_control = 0x0502;

inline constexpr std::uint16_t eeprom_address = 0x0504;
inline constexpr std::uint16_t eeprom_data = 0x0508;

inline constexpr std::uint16_t fmmu = 0x0600;          ///< 16 bytes each

inline constexpr std::uint16_t sync_manager = 0x0800;  ///< 8 bytes each

inline constexpr std::uint16_t dc_receive_time = 0x0900;
inline constexpr std::uint16_t dc_system_time = 0x0910;
inline constexpr std::uint16_t dc_receive_time_unit = 0x0918;

inline constexpr std::uint16_t dc_system_time_offset = 0x0920;
inline constexpr std::uint16_t dc_system_time_delay = 0x0928;

inline constexpr std::uint16_t dc_system_time_difference = 0x092c;
inline constexpr std::uint16_t dc_speed_counter_start = 0x0930;

inline constexpr std::uint16_t dc_filter_depth = 0x0934;
inline constexpr std::uint16_t dc_cyclic_unit_control = 0x0980;

inline constexpr std::uint16_t dc_activation = 0x0981;
inline constexpr std::uint16_t dc_pulse_length = 0x0982;

inline constexpr std::uint16_t dc_sync0_status = 0x098e;
inline constexpr std::uint16_t dc_start_time = 0x0990;

inline constexpr std::uint16_t dc_sync0_cycle = 0x09a0;
inline constexpr std::uint16_t dc_sync1_cycle = 0x09a4;

inline constexpr std::uint16_t user_memory = 0x0f80;
inline constexpr std::uint16_t process_data_memory = 0x1000;

/// Features (0008h).
inline constexpr std::uint16_t fmmu_bytes_only = 0x0001;
inline constexpr std::uint16_t dc_supported = 0x0004;
inline constexpr std::uint16_t dc_64_bit = 0x0008;

inline constexpr std::uint16_t no_lrw = 0x0200;
inline constexpr std::uint16_t no_brw = 0x0400;

/// Returns the address of FMMU `n`. [any]
constexpr std::uint16_t fmmu_at(unsigned n) noexcept {
    return static_cast<std::uint16_t>(fmmu + 16 * n);
}
/// Returns the address of sync manager `n`. [any]
constexpr std::uint16_t sync_manager_at(unsigned n) noexcept {
    return static_cast<std::uint16_t>(sync_manager + 8 * n);
}

}  // namespace hal::ethercat::registers
