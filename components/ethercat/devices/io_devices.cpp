// SPDX-License-Identifier: MIT
#include "ethercat/devices/io_devices.hpp"

namespace hal::ethercat::devices {

IoBehaviour::IoBehaviour(std::shared_ptr<Dictionary> dictionary, std::uint16_t index,
                         unsigned channels, bool output, bool digital)
    : dictionary_(std::move(dictionary)), channels_(channels), output_(output), digital_(digital) {
    for (unsigned n = 0; n < channels; ++n) {
        data_[n] = digital ? dictionary_->at(index, static_cast<std::uint8_t>(n + 1))
                           : dictionary_->at(static_cast<std::uint16_t>(index + 0x10 * n), 1);
    }
}

void IoBehaviour::power_on() noexcept {
    if (output_) {
        for (auto& v : values_) {
            v.store(0, std::memory_order_relaxed);
        }
    }
}

void IoBehaviour::step(Step& s) noexcept {
    for (unsigned n = 0; n < channels_; ++n) {
        auto& value = values_[n];
        if (output_) {
            const std::int32_t raw = digital_ ? (*data_[n] & 1) : get<std::int16_t>(data_[n]);
            value.store(s.outputs_valid ? raw : 0, std::memory_order_relaxed);
        } else if (digital_) {
            *data_[n] = value.load(std::memory_order_relaxed) != 0;
        } else {
            put(data_[n], static_cast<std::int16_t>(value.load(std::memory_order_relaxed)));
        }
    }
}

Parts make_coupler(const DeviceOptions& o) {
    DesignBuilder b("coupler", 0x0c00);
    return {b.finish(o.alias, o.serial), std::make_unique<Idle>()};
}

Parts make_digital(const DeviceOptions& o, bool output) {
    namespace access = coe::access;
    DesignBuilder b(output ? "digital_out" : "digital_in",
                    (output ? 0x0d0000U : 0x0d1000U) + o.bits);
    const std::uint16_t index = output ? 0x7000 : 0x6000;
    const auto rights = static_cast<std::uint16_t>(output ? access::read_write | access::rx_mappable
                                                          : access::read | access::tx_mappable);
    auto& d = b.dictionary();
    d.record(index, output ? "Outputs" : "Inputs", static_cast<std::uint8_t>(o.bits));
    std::vector<PdoEntry> entries;
    for (unsigned n = 1; n <= o.bits; ++n) {
        d.sub(static_cast<std::uint8_t>(n), (output ? "Output " : "Input ") + std::to_string(n),
              coe::type::boolean, rights);
        entries.push_back({index, static_cast<std::uint8_t>(n),
                           (output ? "Output " : "Input ") + std::to_string(n)});
    }
    const std::uint16_t pdo = output ? coe::rx_pdo : coe::tx_pdo;
    b.pdo(output, pdo, output ? "Outputs" : "Inputs", entries);
    auto design = b.finish(o.alias, o.serial);
    auto behaviour = std::make_unique<IoBehaviour>(design.dictionary, index, o.bits, output, true);
    return {std::move(design), std::move(behaviour)};
}

Parts make_analog(const DeviceOptions& o, bool output) {
    namespace access = coe::access;
    DesignBuilder b(output ? "analog_out" : "analog_in",
                    (output ? 0x0a0000U : 0x0a1000U) + o.channels);
    b.mailbox(128);
    const std::uint16_t base = output ? 0x7000 : 0x6000;
    const auto rights = static_cast<std::uint16_t>(output ? access::read_write | access::rx_mappable
                                                          : access::read | access::tx_mappable);
    auto& d = b.dictionary();
    for (unsigned n = 0; n < o.channels; ++n) {
        d.record(static_cast<std::uint16_t>(base + 0x10 * n), "Channel " + std::to_string(n + 1),
                 1);
        d.sub(1, "Value", coe::type::s16, rights);
    }
    for (unsigned n = 0; n < o.channels; ++n) {
        b.pdo(output, static_cast<std::uint16_t>((output ? coe::rx_pdo : coe::tx_pdo) + n),
              "Channel " + std::to_string(n + 1),
              {{static_cast<std::uint16_t>(base + 0x10 * n), 1, "Value"}});
    }
    b.dc(false);
    auto design = b.finish(o.alias, o.serial);
    auto behaviour =
        std::make_unique<IoBehaviour>(design.dictionary, base, o.channels, output, false);
    return {std::move(design), std::move(behaviour)};
}

}  // namespace hal::ethercat::devices
