// SPDX-License-Identifier: MIT
// Registers of the EtherCAT slave controller (ETG.1000.4, clause 6; names as there).
#pragma once

#include <cstdint>

namespace hal::ethercat::registers {

inline constexpr std::uint16_t type = 0x0000, fmmus = 0x0004, sync_managers = 0x0005, ram_size = 0x0006, port_descriptor = 0x0007,
                               features = 0x0008, station_address = 0x0010, station_alias = 0x0012, dl_control = 0x0100,
                               loop_control = 0x0101, dl_alias_enable = 0x0103, dl_status = 0x0110, al_control = 0x0120, al_status = 0x0130,
                               al_status_code = 0x0134, pdi_control = 0x0140, ecat_event_mask = 0x0200, al_event_mask = 0x0204,
                               ecat_event = 0x0210, al_event = 0x0220, rx_errors = 0x0300, forwarded_errors = 0x0308,
                               processing_unit_errors = 0x030c, pdi_errors = 0x030d, lost_links = 0x0310, watchdog_divider = 0x0400,
                               pdi_watchdog = 0x0410, process_data_watchdog = 0x0420, watchdog_status = 0x0440,
                               process_data_watchdog_counter = 0x0442, pdi_watchdog_counter = 0x0443, eeprom_configuration = 0x0500,
                               eeprom_pdi_access = 0x0501, eeprom_control = 0x0502, eeprom_address = 0x0504, eeprom_data = 0x0508,
                               fmmu = 0x0600,          ///< 16 bytes each
    sync_manager = 0x0800,  ///< 8 bytes each
    dc_receive_time = 0x0900, dc_system_time = 0x0910, dc_receive_time_unit = 0x0918, dc_system_time_offset = 0x0920,
                               dc_system_time_delay = 0x0928, dc_system_time_difference = 0x092c, dc_speed_counter_start = 0x0930,
                               dc_filter_depth = 0x0934, dc_cyclic_unit_control = 0x0980, dc_activation = 0x0981, dc_pulse_length = 0x0982,
                               dc_sync0_status = 0x098e, dc_start_time = 0x0990, dc_sync0_cycle = 0x09a0, dc_sync1_cycle = 0x09a4,
                               user_memory = 0x0f80, process_data_memory = 0x1000;

/// Features (0008h).
inline constexpr std::uint16_t fmmu_bytes_only = 0x0001, dc_supported = 0x0004, dc_64_bit = 0x0008, no_lrw = 0x0200, no_brw = 0x0400;

/// Returns the address of FMMU `n`. [any]
constexpr std::uint16_t fmmu_at(unsigned n) noexcept { return static_cast<std::uint16_t>(fmmu + 16 * n); }
/// Returns the address of sync manager `n`. [any]
constexpr std::uint16_t sync_manager_at(unsigned n) noexcept { return static_cast<std::uint16_t>(sync_manager + 8 * n); }

}  // namespace hal::ethercat::registers
