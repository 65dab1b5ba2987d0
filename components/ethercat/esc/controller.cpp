// SPDX-License-Identifier: MIT
#include "ethercat/esc/controller.hpp"

#include <algorithm>

#include "ethercat/wire/byte_order.hpp"
#include "ethercat/wire/registers.hpp"
#include "ethercat/wire/states.hpp"

namespace hal::ethercat::esc {

namespace controller_facts {
constexpr std::size_t memory_bytes = 0x10000;
constexpr std::int64_t idle_ns = 1'000'000;    ///< the application runs at least this often
/// without frames; SYNC pulses and idle work of more are skipped
constexpr std::int64_t longest_pause_ns = 2'000'000'000;
/// and at frames that did not concern it, if it did not run for this long
constexpr std::int64_t bystander_ns = 200'000;
constexpr std::uint32_t watchdog_event = 0x40;
constexpr std::uint16_t al_status_event = 0x0008;
}  // namespace controller_facts

Controller::Controller(const Settings& settings, std::vector<std::uint8_t> sii,
                       Application* application)
    : settings_(settings),
      memory_(std::make_unique<std::uint8_t[]>(controller_facts::memory_bytes)),
      application_(application) {
    settings_.fmmus = std::min(settings_.fmmus, Fmmus::most);
    settings_.sync_managers = std::min(settings_.sync_managers, SyncManagers::most);
    settings_.ram_kb = std::clamp(settings_.ram_kb, 1U, 60U);
    ram_end_ = registers::process_data_memory + settings_.ram_kb * 1024;
    eeprom_.connect(memory_.get(), std::move(sii), settings_.eeprom_read_ns,
                    settings_.eeprom_write_ns, settings_.eeprom_reads_8);
    sms_.connect(memory_.get(), settings_.sync_managers);
    fmmus_.connect(memory_.get(), settings_.fmmus);
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
    lost_ = 0;
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
        datagram(d);
        if (events != 0) {
            put(d.header + 8, static_cast<std::uint16_t>(d.event() | events));
        }
    }
    advance(last_bit_ns);
    commit(last_bit_ns);
    if (touched_ || last_bit_ns - last_run_ns_ >= controller_facts::bystander_ns) {
        run_application(last_bit_ns);
    }
    find_due();
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

void Controller::work_until(std::int64_t now_ns) noexcept {
    if (!powered_) return;
    if (now_ns - due_ns_ > controller_facts::longest_pause_ns) {
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
}

void Controller::jump_clock(std::int64_t ns, std::int64_t now_ns) noexcept {
    dc_.clock().shift(static_cast<double>(ns), now_ns);
    dc_.clock_changed(now_ns);
    find_due();
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

}  // namespace hal::ethercat::esc
