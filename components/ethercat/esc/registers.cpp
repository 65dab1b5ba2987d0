// SPDX-License-Identifier: MIT
// What happens when a master reads and writes the registers of a controller.
#include <algorithm>
#include <cstring>

#include "ethercat/esc/controller.hpp"
#include "ethercat/wire/byte_order.hpp"
#include "ethercat/wire/registers.hpp"
#include "ethercat/wire/states.hpp"

namespace hal::ethercat::esc {

namespace register_facts {

struct Range {
    std::uint16_t first, length;
    bool touched(std::uint32_t address, std::size_t count) const noexcept {
        return address < first + std::uint32_t{length} && address + count > first;
    }
};
/// Registers that only keep what the master writes.
constexpr Range plain[]{
    {registers::station_address, 2},        {registers::dl_control, 4},
    {registers::ecat_event_mask, 2},        {registers::watchdog_divider, 2},
    {registers::pdi_watchdog, 2},           {registers::process_data_watchdog, 2},
    {registers::dc_system_time_offset, 8},  {registers::dc_system_time_delay, 4},
    {registers::dc_speed_counter_start, 2}, {registers::dc_filter_depth, 2},
    {registers::dc_cyclic_unit_control, 2}, {registers::dc_start_time, 8},
    {registers::dc_sync0_cycle, 8},         {0x09a8, 2}};
/// Counters that a write to any of their bytes clears.
constexpr Range counters[]{{registers::rx_errors, 12},
                           {registers::processing_unit_errors, 1},
                           {registers::pdi_errors, 1},
                           {registers::lost_links, 4},
                           {registers::process_data_watchdog_counter, 2}};
constexpr Range dl_control{registers::dl_control, 4};
constexpr Range dl_status{registers::dl_status, 2};

constexpr Range al_status{registers::al_status, 2};
constexpr Range al_control{registers::al_control, 2};

constexpr Range eeprom_block{registers::eeprom_configuration, 16};
constexpr Range eeprom_status{registers::eeprom_control, 2};

constexpr Range fmmus{registers::fmmu, 0x100};
constexpr Range sync_managers{registers::sync_manager, 0x80};

constexpr Range receive_time{registers::dc_receive_time, 1};
constexpr Range system_time{registers::dc_system_time, 8};

constexpr Range offset{registers::dc_system_time_offset, 12};
constexpr Range speed{registers::dc_speed_counter_start, 6};

constexpr Range activation{registers::dc_activation, 1};
constexpr Range dc{registers::dc_receive_time, 0x100};

constexpr std::uint32_t al_control_event = 0x01;
constexpr std::uint32_t activation_event = 0x10;
constexpr std::uint16_t dl_status_event = 0x0004;
constexpr std::uint16_t al_status_event = 0x0008;

}  // namespace register_facts

void Controller::reset_registers() noexcept {
    const auto at = [&](std::uint16_t address) { return &memory_[address]; };
    memory_[registers::type] = settings_.type;
    memory_[registers::type + 1] = settings_.revision;
    put(at(registers::type + 2), settings_.build);
    memory_[registers::fmmus] = static_cast<std::uint8_t>(settings_.fmmus);
    memory_[registers::sync_managers] = static_cast<std::uint8_t>(settings_.sync_managers);
    memory_[registers::ram_size] = static_cast<std::uint8_t>(settings_.ram_kb);
    for (unsigned p = 0; p < ports; ++p) {
        memory_[registers::port_descriptor] |=
            static_cast<std::uint8_t>(static_cast<unsigned>(settings_.port_kinds[p]) << 2 * p);
    }
    unsigned features =
        settings_.dc ? registers::dc_supported | (settings_.dc_64_bit ? registers::dc_64_bit : 0U)
                     : 0U;
    if (!settings_.bit_writes) {
        features |= registers::fmmu_bytes_only;
    }
    if (!settings_.lrw) {
        features |= registers::no_lrw;
    }
    if (!settings_.read_write) {
        features |= registers::no_brw;
    }
    put(at(registers::features), static_cast<std::uint16_t>(features));
    memory_[registers::dl_control] = 1;
    put(at(registers::al_status), static_cast<std::uint16_t>(State::init));
    put(at(registers::al_control), static_cast<std::uint16_t>(State::init));
    put(at(registers::watchdog_divider), std::uint16_t{0x09c2});
    put(at(registers::pdi_watchdog), std::uint16_t{0x03e8});
    put(at(registers::process_data_watchdog), std::uint16_t{0x03e8});
    memory_[registers::watchdog_status] = 1;
    if (settings_.dc) {
        put(at(registers::dc_speed_counter_start), std::uint16_t{0x1000});
        memory_[registers::dc_filter_depth] = 4;
        memory_[registers::dc_filter_depth + 1] = 12;
    }
}

void Controller::raise(std::uint32_t al_events) noexcept {
    put(&memory_[registers::al_event],
        get<std::uint32_t>(&memory_[registers::al_event]) | al_events);
}
void Controller::raise_ecat(std::uint16_t events) noexcept {
    put(&memory_[registers::ecat_event],
        static_cast<std::uint16_t>(get<std::uint16_t>(&memory_[registers::ecat_event]) | events));
}

void Controller::read_registers(std::uint16_t address, std::span<std::uint8_t> to) noexcept {
    const auto covers = [&](const register_facts::Range& range) {
        return range.touched(address, to.size());
    };
    const bool clock = covers(register_facts::dc);
    if (clock && covers(register_facts::system_time)) {
        dc_.show_system_time(now_ns_);
    }
    if (covers(register_facts::eeprom_status)) {
        eeprom_.show_status(now_ns_);
    }
    if (covers(register_facts::sync_managers)) {
        sms_.show_status();
    }
    std::memcpy(to.data(), &memory_[address], to.size());
    if (clock) {
        dc_.was_read(address, to.size());
    }
    if (covers(register_facts::dl_status)) {
        memory_[registers::ecat_event] &=
            static_cast<std::uint8_t>(~register_facts::dl_status_event);
    }
    if (covers(register_facts::al_status)) {
        memory_[registers::ecat_event] &=
            static_cast<std::uint8_t>(~register_facts::al_status_event);
    }
}

/// Keeps a write until the end of the frame shows that it is good.
void Controller::keep_write(std::uint16_t address, std::span<const std::uint8_t> from) noexcept {
    if (write_count_ == writes_.size() || written_bytes_ + from.size() > written_.size()) {
        return write_registers(address, from);
    }
    std::copy(from.begin(), from.end(),
              written_.begin() + static_cast<std::ptrdiff_t>(written_bytes_));
    writes_[write_count_++] = {address, static_cast<std::uint16_t>(from.size()),
                               static_cast<std::uint16_t>(written_bytes_)};
    written_bytes_ += from.size();
}

void Controller::write_registers(std::uint16_t address,
                                 std::span<const std::uint8_t> from) noexcept {
    using namespace register_facts;
    const auto covers = [&](const Range& range) { return range.touched(address, from.size()); };
    const auto byte = [&](unsigned reg) {
        return reg >= address && reg < address + from.size() ? from[reg - address] : memory_[reg];
    };
    // The part of the written bytes that falls into a range, and where it starts.
    struct Part {
        std::uint16_t address;
        std::span<const std::uint8_t> bytes;
    };
    const auto part = [&](const Range& range) {
        const std::size_t first = std::max<std::size_t>(range.first, address);
        const std::size_t end =
            std::min<std::size_t>(range.first + range.length, address + from.size());
        return Part{static_cast<std::uint16_t>(first), from.subspan(first - address, end - first)};
    };
    const auto keep = [&](const Range& range) {
        const Part p = part(range);
        std::memcpy(&memory_[p.address], p.bytes.data(), p.bytes.size());
    };
    if (covers(dc)) {
        if (!settings_.dc) return;
        if (covers(system_time)) {
            std::array<std::uint8_t, 8> time{};
            for (unsigned i = 0; i < time.size(); ++i) {
                time[i] = byte(registers::dc_system_time + i);
            }
            const Part p = part(system_time);
            if (p.address == registers::dc_system_time) {
                dc_.receive_system_time(get<std::uint64_t>(time.data()), p.bytes.size(), now_ns_);
            }
        }
        if (covers(receive_time)) {
            dc_.latch_receive_times(now_ns_, frame_number_);
        }
    }
    for (const Range& range : plain) {
        if (covers(range)) {
            keep(range);
        }
    }
    for (const Range& range : counters) {
        if (covers(range)) {
            std::fill_n(&memory_[range.first], range.length, std::uint8_t{0});
        }
    }
    if (covers(dl_control)) {
        if (covers({registers::loop_control, 1})) {
            lost_ = 0;  // closed ports open again
        }
        update_ports();
    }
    if (covers(al_control)) {
        request_state(byte(registers::al_control), byte(registers::al_control + 1));
    }
    if (covers(eeprom_block)) {
        const Part p = part(eeprom_block);
        eeprom_.write(p.address, p.bytes, now_ns_);
    }
    if (covers(fmmus)) {
        keep(fmmus);
        fmmus_.configure();
    }
    if (covers(sync_managers) && sms_.configure(address, from)) {
        raise(activation_event);
        if (!sms_.watched()) {
            watchdog_ns_ = INT64_MAX;
            memory_[registers::watchdog_status] |= 1;
        }
    }
    if (covers(offset)) {
        dc_.clock_changed(now_ns_);
    }
    if (covers(speed)) {
        dc_.clear_filters(now_ns_);
    }
    if (covers(activation)) {
        dc_.activate(now_ns_);
    }
}

void Controller::request_state(std::uint8_t low, std::uint8_t high) noexcept {
    using namespace register_facts;
    if (emulates_) {
        memory_[registers::al_control] = low;
        memory_[registers::al_control + 1] = high;
        put(&memory_[registers::al_status], static_cast<std::uint16_t>(low & 0x0f));
        return raise_ecat(al_status_event);
    }
    if (control_pending_) {
        return;  // the firmware has not read the request before
    }
    memory_[registers::al_control] = low;
    memory_[registers::al_control + 1] = high;
    control_pending_ = true;
    raise(al_control_event);
}

// Ports

void Controller::set_link(unsigned port, bool up) noexcept {
    const auto bit = static_cast<std::uint8_t>(1U << port);
    if (((link_ & bit) != 0) == up) return;
    link_ = static_cast<std::uint8_t>(link_ ^ bit);
    if (!powered_) return;
    const unsigned loop = memory_[registers::loop_control] >> 2 * port & 3U;
    if (!up && loop <= 1) {
        std::uint8_t& count = memory_[registers::lost_links + port];
        if (count < 0xff) {
            ++count;
        }
        if (loop == 1) {
            lost_ |= bit;
        }
    }
    update_ports();
}

void Controller::frame_at_closed_port(unsigned port) noexcept {
    if ((lost_ >> port & 1) == 0) return;
    lost_ = static_cast<std::uint8_t>(lost_ & ~(1U << port));
    update_ports();
}

void Controller::update_ports() noexcept {
    unsigned status = (eeprom_.loaded() ? 3U : 0U) | 4U | static_cast<unsigned>(link_) << 4;

    unsigned open = 0;
    for (unsigned p = 0; p < ports; ++p) {
        const bool there = settings_.port_kinds[p] >= PortKind::ebus;
        const bool link = (link_ >> p & 1) != 0;
        switch (memory_[registers::loop_control] >> 2 * p & 3U) {
        case 0: open |= there && link ? 1U << p : 0U; break;
        case 1: open |= there && link && (lost_ >> p & 1) == 0 ? 1U << p : 0U; break;
        case 2: open |= there ? 1U << p : 0U; break;
        default: break;
        }
    }
    if (open == 0) {
        open = 1;  // all closed: port 0 is taken as open
    }
    for (unsigned p = 0; p < ports; ++p) {
        if ((open >> p & 1) == 0) {
            status |= 0x100U << 2 * p;
        } else if ((link_ >> p & 1) != 0) {
            status |= 0x200U << 2 * p;
        }
    }
    open_ = static_cast<std::uint8_t>(open);
    if (get<std::uint16_t>(&memory_[registers::dl_status]) == status) return;
    put(&memory_[registers::dl_status], static_cast<std::uint16_t>(status));
    raise_ecat(register_facts::dl_status_event);
}

namespace register_facts {
void count_up(std::uint8_t& counter) noexcept {
    if (counter < 0xff) {
        ++counter;
    }
}
}  // namespace register_facts

void Controller::count_invalid(unsigned port) noexcept {
    register_facts::count_up(memory_[registers::rx_errors + 2 * port]);
}
void Controller::count_symbol_error(unsigned port) noexcept {
    register_facts::count_up(memory_[registers::rx_errors + 2 * port + 1]);
}
void Controller::count_forwarded(unsigned port) noexcept {
    register_facts::count_up(memory_[registers::forwarded_errors + port]);
}
void Controller::count_unit_error() noexcept {
    register_facts::count_up(memory_[registers::processing_unit_errors]);
}

}  // namespace hal::ethercat::esc
