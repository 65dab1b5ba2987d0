// SPDX-License-Identifier: MIT
#include "ethercat/esc/controller.hpp"

#include <algorithm>
#include <cstring>

#include "ethercat/wire/byte_order.hpp"
#include "ethercat/wire/registers.hpp"
#include "ethercat/wire/states.hpp"

namespace hal::ethercat::esc {

namespace controller_facts {
constexpr std::size_t memory_bytes = 0x10000;
constexpr std::uint16_t first_memory = 0x0f00;  ///< from here on sync managers rule
constexpr std::int64_t idle_ns = 1'000'000;    ///< the application runs at least this often
/// without frames; SYNC pulses and idle work of more are skipped
constexpr std::int64_t max_pause_ns = 2'000'000'000;
/// and at frames that did not concern it, if it did not run for this long
constexpr std::int64_t bystander_ns = 200'000;
constexpr std::uint32_t watchdog_event = 0x40;
constexpr std::uint16_t al_status_event = 0x0008;
}  // namespace controller_facts

namespace register_facts {

struct Range {
    std::uint16_t first, length;
    bool touched(std::uint32_t address, std::size_t count) const noexcept {
        return address < first + std::uint32_t{length} && address + count > first;
    }
};
/// Registers that only keep what the master writes.
constexpr Range plain[]{{registers::station_address, 2}, {registers::dl_control, 4},
                        {registers::ecat_event_mask, 2}, {registers::watchdog_divider, 2},
                        {registers::pdi_watchdog, 2},    {registers::process_data_watchdog, 2}};
/// The same of the distributed clock.
constexpr Range plain_of_clock[]{
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

Controller::Controller(const Settings& settings, std::vector<std::uint8_t> sii,
                       Application* application)
    : settings_(settings),
      memory_(std::make_unique<std::uint8_t[]>(controller_facts::memory_bytes)),
      application_(application),
      unit_(*this, fmmus_) {
    settings_.fmmus = std::min(settings_.fmmus, Fmmus::max);
    settings_.sync_managers = std::min(settings_.sync_managers, SyncManagers::max);
    settings_.ram_kb = std::clamp(settings_.ram_kb, 1U, 60U);
    ram_end_ = registers::process_data_memory + settings_.ram_kb * 1024;
    eeprom_.connect(memory_.get(), std::move(sii), settings_.eeprom_read_ns,
                    settings_.eeprom_write_ns, settings_.eeprom_reads_8);
    sms_.connect(memory_.get(), settings_.sync_managers);
    fmmus_.connect(memory_.get(), settings_.fmmus);
    ports_.connect(memory_.get(), settings_.port_kinds);
    unit_.configure({settings_.lrw, settings_.read_write, settings_.bit_writes});
    dc_.connect(memory_.get(), settings_.dc, settings_.dc_64_bit);
    dc_.clock().set_drift(settings_.drift_ppm, 0);
}

void Controller::power_on(std::int64_t now_ns) noexcept {
    std::fill_n(memory_.get(), controller_facts::memory_bytes, std::uint8_t{0});
    sms_.reset();
    fmmus_.reset();
    dc_.reset(now_ns, settings_.clock_start_ns);
    powered_ = true;
    control_pending_ = false;
    ports_.open_lost();
    last_run_ns_ = now_ns;
    last_frame_ns_ = INT64_MIN;
    watchdog_ns_ = INT64_MAX;
    reset_registers();
    eeprom_.load(now_ns);
    emulates_ = settings_.device_emulation || (memory_[registers::pdi_control + 1] & 1) != 0;
    if (emulates_) {
        memory_[registers::pdi_control + 1] |= 1;
    }
    update_ports();
    if (application_ != nullptr) {
        application_->power_on(*this);
    }
    find_due();
    update_interest();
}

void Controller::execute(const Frame& frame, std::int64_t first_bit_ns) noexcept {
    const std::int64_t last_bit_ns = first_bit_ns + frame.length_ns;
    advance(first_bit_ns);
    now_ns_ = first_bit_ns;
    frame_number_ = frame.number;
    touched_ = false;
    const unsigned mask = get<std::uint16_t>(&memory_[registers::ecat_event_mask]);
    const auto events =
        static_cast<std::uint16_t>(get<std::uint16_t>(&memory_[registers::ecat_event]) & mask);
    for (const DatagramView& d : frame.datagrams) {
        const ProcessingUnit::Effect effect = unit_.execute(d);
        touched_ |= effect.touched || effect.process_data;
        if (effect.process_data) {
            last_frame_ns_ = now_ns_;
        }
        if (events != 0) {
            put(d.header + 8, static_cast<std::uint16_t>(d.event() | events));
        }
    }
    advance(last_bit_ns);
    commit(last_bit_ns);
    if (touched_ || last_bit_ns >= interest_->run_ns) {
        run_application(last_bit_ns);
    }
    find_due();
    update_interest();
}

/// Keeps what the line compares with its frames.
void Controller::update_interest() noexcept {
    FrameInterest& interest = *interest_;
    interest.follow(powered_, fmmus_.can_latch(), ports_.open());
    interest.station = station_address();
    const bool has_alias = (memory_[registers::dl_alias_enable] & 1) != 0;
    interest.alias =
        has_alias ? get<std::uint16_t>(&memory_[registers::station_alias]) : interest.station;
    interest.has_events = (get<std::uint16_t>(&memory_[registers::ecat_event_mask]) &
                           get<std::uint16_t>(&memory_[registers::ecat_event])) != 0;
    interest.first_logical = fmmus_.first_address();
    interest.end_logical = fmmus_.end_address();
    interest.due_ns = due_ns_;
    const bool waits = application_ != nullptr && application_->waits();
    interest.run_ns = waits ? last_run_ns_ + controller_facts::bystander_ns : INT64_MAX;
}

/// Takes over what the frame wrote: its check sequence is good.
void Controller::commit(std::int64_t now_ns) noexcept {
    for (std::size_t i = 0; i < write_count_; ++i) {
        const RegisterWrite& kept = writes_[i];
        write_registers(kept.address, {written_.data() + kept.offset, kept.length});
    }
    write_count_ = written_bytes_ = 0;
    if (!sms_.pending()) return;
    const auto done = sms_.commit();
    raise(done.written << 8 | done.read << 8);
    if (done.watchdog) {
        trigger_watchdog(now_ns);
    }
}

void Controller::power_off() noexcept {
    powered_ = false;
    if (application_ != nullptr) {
        application_->power_off();
    }
    update_interest();
}

void Controller::work_until(std::int64_t now_ns) noexcept {
    if (!powered_) {
        if (application_ != nullptr) {
            application_->rest(now_ns);
        }
        return;
    }
    if (now_ns - due_ns_ > controller_facts::max_pause_ns) {
        dc_.clock_changed(now_ns);
        last_run_ns_ = std::max(last_run_ns_, now_ns - controller_facts::idle_ns);
        find_due();
    }
    while (due_ns_ <= now_ns) {
        const std::int64_t at = due_ns_;
        if (dc_.next_pulse_ns() <= at) {
            raise(dc_.pulse());
        }
        if (at >= watchdog_ns_) {
            expire_watchdog();
        }
        run_application(at);
        find_due();
    }
    update_interest();
}

void Controller::run_application(std::int64_t now_ns) noexcept {
    last_run_ns_ = now_ns;
    // else the interface to it is not configured
    if (application_ != nullptr && eeprom_.loaded()) {
        application_->run(*this, now_ns);
    }
}

void Controller::find_due() noexcept {
    const std::int64_t idle =
        application_ != nullptr ? last_run_ns_ + controller_facts::idle_ns : INT64_MAX;
    due_ns_ = std::max(std::min({dc_.next_pulse_ns(), watchdog_ns_, idle}), last_run_ns_);
}

void Controller::trigger_watchdog(std::int64_t now_ns) noexcept {
    const std::int64_t unit_ns =
        (get<std::uint16_t>(&memory_[registers::watchdog_divider]) + 2) * std::int64_t{40};
    const auto time = get<std::uint16_t>(&memory_[registers::process_data_watchdog]);
    memory_[registers::watchdog_status] |= 1;
    watchdog_ns_ = time == 0 ? INT64_MAX : now_ns + unit_ns * time;
}

void Controller::expire_watchdog() noexcept {
    watchdog_ns_ = INT64_MAX;
    memory_[registers::watchdog_status] &= 0xfe;
    std::uint8_t& count = memory_[registers::process_data_watchdog_counter];
    if (count < 0xff) {
        ++count;
    }
    raise(controller_facts::watchdog_event);
}

void Controller::set_drift(double ppm, std::int64_t now_ns) noexcept {
    dc_.clock().set_drift(ppm, now_ns);
    dc_.clock_changed(now_ns);
    find_due();
    update_interest();
}

void Controller::jump_clock(std::int64_t ns, std::int64_t now_ns) noexcept {
    dc_.clock().shift(static_cast<double>(ns), now_ns);
    dc_.clock_changed(now_ns);
    find_due();
    update_interest();
}

std::optional<std::uint16_t> Controller::take_al_control() noexcept {
    if (!control_pending_) return std::nullopt;
    control_pending_ = false;
    memory_[registers::al_event] &= 0xfe;
    return get<std::uint16_t>(&memory_[registers::al_control]);
}

void Controller::set_al_status(std::uint16_t status, std::uint16_t code) noexcept {
    put(&memory_[registers::al_status_code], code);
    put(&memory_[registers::al_status], status);
    raise_ecat(controller_facts::al_status_event);
}

std::uint16_t Controller::al_status() const noexcept {
    return get<std::uint16_t>(&memory_[registers::al_status]);
}

std::size_t Controller::read_sync_manager(unsigned number, std::span<std::uint8_t> to) noexcept {
    const std::size_t count = sms_.pdi_read(number, to);
    if (count != 0) {
        put(&memory_[registers::al_event],
            get<std::uint32_t>(&memory_[registers::al_event]) & ~(0x100U << number));
    }
    return count;
}

bool Controller::write_sync_manager(unsigned number, std::span<const std::uint8_t> from) noexcept {
    if (!sms_.pdi_write(number, from)) return false;
    put(&memory_[registers::al_event],
        get<std::uint32_t>(&memory_[registers::al_event]) & ~(0x100U << number));
    if (number < 8) {
        raise_ecat(static_cast<std::uint16_t>(0x10U << number));
    }
    return true;
}

bool Controller::watchdog_expired() const noexcept {
    return (memory_[registers::watchdog_status] & 1) == 0;
}

// What a master does with registers and memory.

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
    unsigned features = 0;
    if (settings_.dc) {
        features |= registers::dc_supported;
    }
    if (settings_.dc && settings_.dc_64_bit) {
        features |= registers::dc_64_bit;
    }
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

void Controller::update_ports() noexcept {
    if (ports_.update(eeprom_.loaded())) {
        raise_ecat(register_facts::dl_status_event);
    }
}

void Controller::set_link(unsigned port, bool up) noexcept {
    if (ports_.set_link(port, up, powered_)) {
        update_ports();
        update_interest();
    }
}

void Controller::frame_at_closed_port(unsigned port) noexcept {
    if (ports_.frame_at_closed_port(port)) {
        update_ports();
        update_interest();
    }
}

std::uint16_t Controller::station_address() const noexcept {
    return get<std::uint16_t>(&memory_[registers::station_address]);
}

bool Controller::has_alias(std::uint16_t address) const noexcept {
    return (memory_[registers::dl_alias_enable] & 1) != 0 &&
           address == get<std::uint16_t>(&memory_[registers::station_alias]);
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
        sms_.show_status(address, to.size());
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

/// Bytes that the master writes with one datagram, and what they are to ranges of registers.
class Controller::WrittenRegisters {
public:
    WrittenRegisters(std::uint16_t address, std::span<const std::uint8_t> bytes) noexcept
        : address_(address), bytes_(bytes) {}

    bool covers(const register_facts::Range& range) const noexcept {
        return range.touched(address_, bytes_.size());
    }
    bool is_within(const register_facts::Range& range) const noexcept {
        return address_ >= range.first && address_ + bytes_.size() <= range.first + range.length;
    }
    /// Returns the part of the bytes that is in a range that they cover, and its address.
    WrittenRegisters part(const register_facts::Range& range) const noexcept {
        const std::size_t first = std::max<std::size_t>(range.first, address_);
        const std::size_t end =
            std::min<std::size_t>(range.first + range.length, address_ + bytes_.size());
        return {static_cast<std::uint16_t>(first), bytes_.subspan(first - address_, end - first)};
    }
    /// Returns the byte of a register as it is after the write; `memory`: all registers before it.
    std::uint8_t byte(unsigned reg, const std::uint8_t* memory) const noexcept {
        const bool is_written = reg >= address_ && reg < address_ + bytes_.size();
        return is_written ? bytes_[reg - address_] : memory[reg];
    }
    std::uint16_t address() const noexcept { return address_; }
    std::span<const std::uint8_t> bytes() const noexcept { return bytes_; }

private:
    std::uint16_t address_;
    std::span<const std::uint8_t> bytes_;
};

void Controller::write_registers(std::uint16_t address,
                                 std::span<const std::uint8_t> from) noexcept {
    using namespace register_facts;
    const WrittenRegisters write(address, from);
    if (write.covers(dc) && !settings_.dc) return;
    if (address < dc.first) {
        write_controller(write);
    }
    if (write.covers(dc)) {
        write_clock(write);
    }
}

/// Writes registers of the distributed clock. Most writes have the system time alone: one to all
/// slaves in each cycle.
void Controller::write_clock(const WrittenRegisters& write) noexcept {
    using namespace register_facts;
    latch_times(write);
    if (write.is_within(system_time)) return;
    keep_parts(write, plain_of_clock);
    adjust_clock(write);
}

/// Writes registers below those of the distributed clock.
void Controller::write_controller(const WrittenRegisters& write) noexcept {
    using namespace register_facts;
    keep_parts(write, plain);
    for (const Range& range : counters) {
        if (write.covers(range)) {
            std::fill_n(&memory_[range.first], range.length, std::uint8_t{0});
        }
    }
    if (write.covers(dl_control)) {
        if (write.covers({registers::loop_control, 1})) {
            ports_.open_lost();
        }
        update_ports();
    }
    if (write.covers(al_control)) {
        request_state(write.byte(registers::al_control, memory_.get()),
                      write.byte(registers::al_control + 1, memory_.get()));
    }
    if (write.covers(eeprom_block)) {
        const WrittenRegisters part = write.part(eeprom_block);
        eeprom_.write(part.address(), part.bytes(), now_ns_);
    }
    if (write.covers(fmmus)) {
        keep(write.part(fmmus));
        fmmus_.configure();
    }
    if (write.covers(sync_managers)) {
        write_sync_managers(write);
    }
}

void Controller::keep_parts(const WrittenRegisters& write,
                            std::span<const register_facts::Range> ranges) noexcept {
    for (const register_facts::Range& range : ranges) {
        if (write.covers(range)) {
            keep(write.part(range));
        }
    }
}

void Controller::keep(const WrittenRegisters& part) noexcept {
    std::memcpy(&memory_[part.address()], part.bytes().data(), part.bytes().size());
}

void Controller::latch_times(const WrittenRegisters& write) noexcept {
    using namespace register_facts;
    if (write.covers(system_time) && write.address() <= registers::dc_system_time) {
        // What is not written stays as it was read last.
        auto time = get<std::uint64_t>(&memory_[registers::dc_system_time]);
        const auto written = write.part(system_time).bytes();
        std::memcpy(&time, written.data(), written.size());
        dc_.receive_system_time(time, written.size(), now_ns_);
    }
    if (write.covers(receive_time)) {
        dc_.latch_receive_times(now_ns_, frame_number_);
    }
}

void Controller::write_sync_managers(const WrittenRegisters& write) noexcept {
    if (!sms_.configure(write.address(), write.bytes())) return;
    raise(register_facts::activation_event);
    if (!sms_.watched()) {
        watchdog_ns_ = INT64_MAX;
        memory_[registers::watchdog_status] |= 1;
    }
}

void Controller::adjust_clock(const WrittenRegisters& write) noexcept {
    using namespace register_facts;
    if (write.covers(offset)) {
        dc_.clock_changed(now_ns_);
    }
    if (write.covers(speed)) {
        dc_.clear_filters(now_ns_);
    }
    if (write.covers(activation)) {
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

bool Controller::read(std::uint32_t address, std::span<std::uint8_t> to) noexcept {
    bool accepted = false;
    if (address < controller_facts::first_memory) {
        const std::size_t count =
            std::min<std::size_t>(to.size(), controller_facts::first_memory - address);
        read_registers(static_cast<std::uint16_t>(address), to.first(count));
        accepted = true;
        to = to.subspan(count);
        address += static_cast<std::uint32_t>(count);
    }
    if (to.empty() || address >= ram_end_) return accepted;
    return sms_.read(static_cast<std::uint16_t>(address),
                     to.first(std::min<std::size_t>(to.size(), ram_end_ - address))) ||
           accepted;
}

bool Controller::write(std::uint32_t address, std::span<const std::uint8_t> from,
                       const std::uint8_t* mask) noexcept {
    bool accepted = false;
    // The time that is distributed to all slaves does not concern the application.
    const bool is_time = address >= registers::dc_system_time &&
                         address + from.size() <= registers::dc_system_time + 8U;
    touched_ |= !is_time;
    if (address < controller_facts::first_memory) {
        const std::size_t count =
            std::min<std::size_t>(from.size(), controller_facts::first_memory - address);
        keep_write(static_cast<std::uint16_t>(address), from.first(count));
        accepted = true;
        from = from.subspan(count);
        address += static_cast<std::uint32_t>(count);
        if (mask != nullptr) {
            mask += count;
        }
    }
    if (from.empty() || address >= ram_end_) return accepted;
    const std::size_t count = std::min<std::size_t>(from.size(), ram_end_ - address);
    return sms_.write(static_cast<std::uint16_t>(address), from.first(count), mask) || accepted;
}

}  // namespace hal::ethercat::esc
