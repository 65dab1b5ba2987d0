// SPDX-License-Identifier: MIT
// Pins whose number and types are known at load time: the entries of a bus, the fields of a
// message, the columns of a record.
#pragma once

#include <cstddef>
#include <new>
#include <optional>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "hal/component.hpp"

namespace hal {

/// What may follow the data of such a pin; the values are of the pin's type.
struct AnyPinOptions {
    const char* unit = "";
    hal_value initial{};
    std::optional<hal_value> safe = {};  ///< see PinOptions
};

namespace detail {
template <hal_dir direction, PinType T>
using DirectedPin = std::conditional_t<
    direction == HAL_DIR_IN, In<T>,
    std::conditional_t<direction == HAL_DIR_OUT, Out<T>,
                       std::conditional_t<direction == HAL_DIR_IO, Io<T>, Param<T>>>>;

/// Pins of one type, each beside its data, in blocks of doubling size: another pin does not move
/// those before it. The memory is the instance's; an empty row has none.
template <class Pin, class Data>
class PinRow {
    static_assert(std::is_trivially_destructible_v<Data>,
                  "the memory of an instance is only freed");

public:
    /// Returns the data of the pin, whose address does not change.
    template <class... Arguments>
    Data& add(const Data& data, Arguments&&... of_pin) {
        if (blocks_.empty() || blocks_.back().size == blocks_.back().capacity) {
            grow(blocks_.empty() ? 4 : 2 * blocks_.back().capacity);
        }
        Block& last = blocks_.back();
        auto* const added =
            new (last.pins + last.size) Bound{Pin(std::forward<Arguments>(of_pin)...), data};
        ++last.size;
        return added->data;
    }
    template <class Action>
    void each(Action& action) const noexcept {
        for (const Block& block : blocks_) {
            for (std::size_t i = 0; i < block.size; ++i) {
                action(block.pins[i].pin, block.pins[i].data);
            }
        }
    }

private:
    struct Bound {
        Pin pin;
        Data data;
    };
    struct Block {
        Bound* pins;
        std::size_t size, capacity;
    };
    void grow(std::size_t capacity) {
        void* const memory = creating->allocate(creating, capacity * sizeof(Bound), alignof(Bound));
        if (memory == nullptr) throw std::bad_alloc();
        blocks_.push_back({static_cast<Bound*>(memory), 0, capacity});
    }
    std::vector<Block> blocks_;
};
}  // namespace detail

/// The pins of one direction, in an array per type, each beside the `Data` that its owner needs to
/// copy its value: a cycle runs one loop per type, without a branch per pin.
template <hal_dir direction, class Data>
class AnyPins {
public:
    /// Declares a pin in the constructor of the component. A pin without `function` belongs to all
    /// functions of the instance. Returns its data, whose address does not change. Throws when the
    /// host rejects the pin, when memory is exhausted, and for HAL_TYPE_PORT. [setup]
    Data& declare(Component& component, const Function* function, hal_type type,
                  const std::string& name, const std::string& doc, const Data& data,
                  const AnyPinOptions& options = {}) {
        return visit_type(type, [&]<class T>(std::type_identity<T>) -> Data& {
            PinOptions<T> own{.initial = value_as<T>(options.initial), .unit = options.unit};
            if (options.safe) {
                own.safe = value_as<T>(*options.safe);
            }
            auto& row = std::get<Row<T>>(rows_);
            if (function != nullptr) {
                return row.add(data, component, *function, name.c_str(), doc.c_str(), own);
            }
            return row.add(data, component, name.c_str(), doc.c_str(), own);
        });
    }
    /// Calls `action(pin, data)` for each pin, type by type, in the order of declaration within a
    /// type. [realtime]
    template <class Action>
    void each(Action&& action) const noexcept {
        std::apply([&](const auto&... row) { (row.each(action), ...); }, rows_);
    }

private:
    template <PinType T>
    using Row = detail::PinRow<detail::DirectedPin<direction, T>, Data>;

    std::tuple<Row<bool>, Row<std::int32_t>, Row<std::uint32_t>, Row<std::int64_t>,
               Row<std::uint64_t>, Row<double>>
        rows_;
};
template <class Data> using AnyIns = AnyPins<HAL_DIR_IN, Data>;
template <class Data> using AnyOuts = AnyPins<HAL_DIR_OUT, Data>;

}  // namespace hal
