// SPDX-License-Identifier: MIT
// The fields of a CAN message as pins.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "hal/any_pin.hpp"
#include "hal/pin_codec.hpp"

namespace hal::messages {

/// One pin per field: inputs of the sender, or outputs of a receiver.
template <hal_dir direction>
class FieldPins {
public:
    /// Declares the pin of a field that begins with a byte of the message. [setup]
    void declare(Component& component, const Function* function, const std::string& name,
                 const std::string& doc, std::size_t byte, PinCodec codec) {
        pins_.declare(component, function, codec.pin_type(), name, doc, {8 * byte, codec});
    }
    /// Stores the values; those out of a field's range are limited to it. [realtime]
    void store(std::span<std::uint8_t> data) const noexcept {
        pins_.each([data](const auto& pin, const Place& p) noexcept {
            write_bits(data, p.at, p.codec.bits(), p.codec.encode(pin.get()));
        });
    }
    /// Sets the pins from data that are long enough. [realtime]
    void load(std::span<const std::uint8_t> data) noexcept {
        pins_.each([data]<class T>(Out<T>& pin, const Place& p) noexcept {
            pin = p.codec.template decode<T>(read_bits(data, p.at, p.codec.bits()));
        });
    }

private:
    struct Place {
        std::size_t at;  ///< in bits
        PinCodec codec;
    };
    AnyPins<direction, Place> pins_;
};

}  // namespace hal::messages
