// SPDX-License-Identifier: MIT
#include "safe_io.hpp"

#include "canopen/protocol/srdo_description.hpp"

namespace hal::canopen {

Description safe_io_description(const SafeIoSettings& s) {
    Description d = basic_device({.device_type = 0,
                                  .vendor = example_vendor,
                                  .product = 0x304,
                                  .revision = 0x00010000,
                                  .serial = s.serial,
                                  .name = "Halcyon safe I/O",
                                  .heartbeat_ms = s.heartbeat_ms});
    add_storage(d);
    const std::pair<std::uint16_t, const char*> objects[] = {{0x2300, "Safety inputs"},
                                                             {0x2301, "Safety inputs inverted"},
                                                             {0x2310, "Safety outputs"},
                                                             {0x2311, "Safety outputs inverted"}};
    for (const auto& [index, name] : objects) {
        const bool input = index < 0x2310;
        const bool inverted = (index & 1) != 0;
        d.objects[index] = name;
        d.add(index, 0, Type::unsigned8, Access::constant, 1, "Highest sub-index");
        auto& e = d.add(index, 1, Type::unsigned8, input ? Access::read_only : Access::read_write,
                        inverted ? 0xff : 0, "Lines 0 to 7");
        (input ? e.tpdo : e.rpdo) = true;
    }
    const SrdoDescription srdos[] = {
        {.direction = SrdoDirection::sends,
         .cycle_ms = s.refresh_ms,
         .validation_ms = s.srvt_ms,
         .cob = s.inputs_cob,
         .mapping = {map_entry(0x2300, 1, 8), map_entry(0x2301, 1, 8)}},
        {.direction = s.outputs_cob != 0 ? SrdoDirection::receives : SrdoDirection::none,
         .cycle_ms = s.sct_ms,
         .validation_ms = s.srvt_ms,
         .cob = s.outputs_cob,
         .mapping = {map_entry(0x2310, 1, 8), map_entry(0x2311, 1, 8)}}};
    add_srdos(d, srdos);
    return d;
}

void SafeIo::attach(Device& device) {
    Program::attach(device);
    device.srdos().listen(*this);
    auto& dictionary = device.dictionary();
    dictionary.bind(0x2300, 1, inputs_);
    dictionary.bind(0x2301, 1, inverted_inputs_);
    dictionary.bind(0x2310, 1, outputs_);
    dictionary.bind(0x2311, 1, inverted_outputs_);
}

void SafeIo::set_input(unsigned n, bool on) noexcept {
    if (n >= 8 || ((inputs_ >> n & 1) != 0) == on) return;
    inputs_ = static_cast<std::uint8_t>(inputs_ ^ 1U << n);
    inverted_inputs_ = static_cast<std::uint8_t>(inverted_inputs_ ^ 1U << n);
    device_->srdos().trigger(1);
}

void SafeIo::acknowledge(Time now) noexcept {
    fault_ = SrdoFault::none;
    for (const unsigned n : {1U, 2U}) {
        device_->srdos().acknowledge(n, now);
    }
}

void SafeIo::step(Time now) noexcept {
    if (wants_acknowledge_) {
        wants_acknowledge_ = false;
        acknowledge(now);
    }
}

void SafeIo::on_srdo(unsigned number, Time) noexcept {
    if (number == 2) {
        terminals_ = outputs_;
    }
}

void SafeIo::on_srdo_fault(unsigned number, SrdoFault fault, Time) noexcept {
    if (number == 2) {
        terminals_ = 0;
    }
    fault_ = fault;
}

void SafeIo::on_state(NmtState state) noexcept {
    terminals_ = 0;
    if (state == NmtState::operational) {
        fault_ = SrdoFault::none;
    }
}

bool SafeIo::set(std::string_view name, double value) {
    if (name == "acknowledge") {
        wants_acknowledge_ = value != 0.0;
        return true;
    }
    if (name == "fail-safe") return value == 0.0 || send_fail_safe(), true;
    if (!name.starts_with("in-") || name.size() != 4 || name[3] < '0' || name[3] > '7') {
        return false;
    }
    set_input(static_cast<unsigned>(name[3] - '0'), value != 0.0);
    return true;
}

std::vector<std::string> SafeIo::settable() const {
    std::vector<std::string> names;
    for (unsigned n = 0; n < 8; ++n) {
        names.push_back("in-" + std::to_string(n));
    }
    names.insert(names.end(), {"acknowledge", "fail-safe"});
    return names;
}

std::string SafeIo::summary() const {
    const auto bits = [](std::uint8_t value) {
        std::string text;
        for (unsigned n = 8; n-- > 0;) {
            text += (value >> n & 1) != 0 ? '1' : '0';
        }
        return text;
    };
    std::string text = "inputs " + bits(inputs_) + ", outputs " + bits(terminals_);
    if (!device_->srdos().configuration_valid()) {
        text += ", SRDOs not configured";
    }
    if (fault_ != SrdoFault::none) {
        text += std::string(", outputs off: ") + to_string(fault_);
    }
    return text;
}

}  // namespace hal::canopen
