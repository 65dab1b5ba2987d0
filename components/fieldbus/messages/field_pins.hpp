// SPDX-License-Identifier: MIT
// The fields of a CAN message as pins.
#pragma once

#include <cmath>
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
        pins_.declare(component, function, codec.pin_type(), name, doc, {8 * byte, codec, 0.0});
        has_reals_ = has_reals_ || codec.pin_type() == HAL_TYPE_FLOAT;
    }
    /// Whether a field can be NaN or infinite. [setup]
    bool has_reals() const noexcept { return has_reals_; }
    /// Copies the pins to the data of a message, limited to the range of each field. Returns
    /// whether a pin is not finite: its field has the last finite value, 0 before there is one. [realtime]
    bool transmit(std::span<std::uint8_t> data) noexcept {
        bool is_invalid = false;
        pins_.each([data, &is_invalid](const auto& pin, Place& p) noexcept {
            const auto value = pin.get();
            if constexpr (std::same_as<std::remove_const_t<decltype(value)>, double>) {
                if (std::isfinite(value)) {
                    p.last = value;
                } else {
                    is_invalid = true;
                }
                write_bits(data, p.at, p.codec.bits(), p.codec.encode(p.last));
            } else {
                write_bits(data, p.at, p.codec.bits(), p.codec.encode(value));
            }
        });
        return is_invalid;
    }
    /// Sets the pins from the data of a message, which are long enough. Returns whether a value is
    /// not finite: its pin keeps the one before. [realtime]
    bool show(std::span<const std::uint8_t> data) noexcept {
        bool is_invalid = false;
        pins_.each([data, &is_invalid]<class T>(Out<T>& pin, const Place& p) noexcept {
            const T value = p.codec.template decode<T>(read_bits(data, p.at, p.codec.bits()));
            if constexpr (std::same_as<T, double>) {
                if (!std::isfinite(value)) {
                    is_invalid = true;
                    return;
                }
            }
            pin = value;
        });
        return is_invalid;
    }

private:
    struct Place {
        std::size_t at;  ///< in bits
        PinCodec codec;
        double last;  ///< the last finite value of a real field that was transmitted
    };
    AnyPins<direction, Place> pins_;
    bool has_reals_ = false;
};

}  // namespace hal::messages
