// SPDX-License-Identifier: MIT
#include "ethercat/devices/firmware.hpp"

#include <algorithm>
#include <cstring>

namespace hal::ethercat::devices {

Firmware::Firmware(Design design, std::unique_ptr<Behaviour> behaviour)
    : design_(std::move(design)), behaviour_(std::move(behaviour)) {
    for (unsigned n = 0; n < design_.sii.sync_managers.size(); ++n) {
        const auto& sm = design_.sii.sync_managers[n];
        if (sm.type == sii::SmType::outputs) {
            sm_out_ = n;
            out_start_ = sm.start;
        }
        if (sm.type == sii::SmType::inputs) {
            sm_in_ = n;
            in_start_ = sm.start;
        }
    }
    auto& dictionary = *design_.dictionary;
    if (design_.coe) {
        coe_ = std::make_unique<CoeServer>(dictionary);
    }
    dictionary.guard_with(this);
    outputs_.attach(dictionary, static_cast<std::uint16_t>(coe::assignment + sm_out_), true,
                    design_.most_output_bytes);
    inputs_.attach(dictionary, static_cast<std::uint16_t>(coe::assignment + sm_in_), false,
                   design_.most_input_bytes);
    image_.resize(std::max({design_.most_output_bytes, design_.most_input_bytes, std::size_t{1}}));
    for (auto* v : {&mail_, &newest_, &previous_, &taken_}) {
        v->resize(largest_mailbox);
    }
}

std::uint32_t Firmware::check(const DictionaryObject& o, const DictionaryEntry& e,
                              std::span<const std::uint8_t> value) noexcept {
    if (const auto code = outputs_.check(o, e, value)) return code;
    return inputs_.check(o, e, value);
}

void Firmware::power_on(esc::Pdi& pdi) noexcept {
    design_.dictionary->power_on();
    behaviour_->power_on();
    state_ = target_ = State::init;
    error_ = received_ = mailbox_running_ = false;
    change_at_ns_ = -1;
    shown_.store(State::init, std::memory_order_relaxed);
    pdi.set_al_status(static_cast<std::uint16_t>(State::init), 0);
}

void Firmware::run(esc::Pdi& pdi, std::int64_t now_ns) noexcept {
    now_ns_ = now_ns;
    if (const auto control = pdi.take_al_control()) {
        take_control(pdi, *control);
    }
    if (change_at_ns_ >= 0 && now_ns >= change_at_ns_) {
        change_at_ns_ = -1;
        change(pdi, target_);
    }
    if (mailbox_running_) {
        run_mailbox(pdi);
    }
    if (state_ == State::safeop || state_ == State::op) {
        run_process_data(pdi);
        wait_for_op(pdi);
        if (state_ == State::op) {
            watch(pdi);
        }
    }
}

bool Firmware::read_outputs(esc::Pdi& pdi) noexcept {
    if (outputs_.bytes() == 0) return false;
    const std::size_t n = pdi.read_sync_manager(sm_out_, image_);
    if (n < outputs_.bytes()) return false;
    received_ = true;
    if (state_ == State::op) {
        outputs_.unpack({image_.data(), n});
    }
    return true;
}

void Firmware::run_process_data(esc::Pdi& pdi) noexcept {
    const auto sync = pdi.sync();
    if (sync.active) {
        if (sync.pulses == pulses_) return;
        const auto pulses = static_cast<std::int64_t>(sync.pulses - pulses_);
        pulses_ = sync.pulses;
        if (!read_outputs(pdi) && state_ == State::op && outputs_.bytes() != 0) {
            missed_.fetch_add(1, std::memory_order_relaxed);
            if (auto* count = design_.dictionary->at(0x1c32, 0x0b)) {
                put(count, static_cast<std::uint16_t>(get<std::uint16_t>(count) + 1));
            }
        }
        step(pdi, pulses * sync.sync0_cycle_ns, true);
    } else {
        read_outputs(pdi);
        if (now_ns_ > last_step_ns_) {
            step(pdi, now_ns_ - last_step_ns_, false);
        }
    }
}

void Firmware::step(esc::Pdi& pdi, std::int64_t dt_ns, bool synchronous) noexcept {
    Step s{now_ns_, dt_ns, state_ == State::op, synchronous, std::nullopt};
    behaviour_->step(s);
    last_step_ns_ = now_ns_;
    if (s.emergency && coe_) {
        CoeServer::emergency(*s.emergency, outbox_);
    }
    if (inputs_.bytes() == 0) return;
    std::memset(image_.data(), 0, inputs_.bytes());
    inputs_.pack({image_.data(), inputs_.bytes()});
    pdi.write_sync_manager(sm_in_, {image_.data(), inputs_.bytes()});
}

}  // namespace hal::ethercat::devices
