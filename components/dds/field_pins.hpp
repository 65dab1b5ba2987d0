// SPDX-License-Identifier: MIT
// The pins of a topic.
#pragma once

#include <cmath>
#include <cstring>
#include <type_traits>

#include "hal/any_pin.hpp"
#include "schema.hpp"

namespace hal::dds {

template <hal_dir direction>
class FieldPins {
public:
    /// Declares the pins in the order of the fields. [setup]
    FieldPins(hal::Component& component, const hal::Function& function, const Schema& schema,
              const char* doc) {
        for (std::uint32_t i = 0; i < schema.fields.size(); ++i) {
            const Field& f = schema.fields[i];
            const hal_value safe = f.safe.value_or(hal_value{});
            hal::AnyPinOptions options{.initial = safe};
            if (direction == HAL_DIR_OUT) {
                options.safe = f.safe;
            }
            pins_.declare(component, &function, f.type, f.name, doc,
                          {schema.places[i].offset, i, f.safe.has_value(), safe}, options);
        }
    }
    /// Stores all values into a sample. [realtime]
    void store(std::uint8_t* to) const noexcept {
        pins_.each([to](const auto& pin, const At& at) {
            const auto value = pin.get();
            std::memcpy(to + at.offset, &value, sizeof value);
        });
    }
    /// Returns whether all floating-point values of an array, in the order of the fields, are
    /// finite. [realtime]
    bool are_finite(const hal_value* from) const noexcept {
        bool finite = true;
        pins_.each([&]<class T>(const Out<T>&, const At& at) {
            if constexpr (std::is_same_v<T, double>) {
                finite = finite && std::isfinite(from[at.field].real);
            }
        });
        return finite;
    }
    /// Sets all pins from an array of values, in the order of the fields. [realtime]
    void load(const hal_value* from) noexcept {
        pins_.each(
            [from]<class T>(Out<T>& pin, const At& at) { pin = value_as<T>(from[at.field]); });
    }
    /// Sets the fields that have a safe value to it. [realtime]
    void make_safe() noexcept {
        pins_.each([]<class T>(Out<T>& pin, const At& at) {
            if (at.has_safe) {
                pin = value_as<T>(at.safe);
            }
        });
    }

private:
    struct At {
        std::uint32_t offset, field;
        bool has_safe;
        hal_value safe;
    };
    hal::AnyPins<direction, At> pins_;
};

}  // namespace hal::dds
