// SPDX-License-Identifier: MIT
// The pins of a topic, one array per type, so that a cycle runs six loops without a branch per pin.
#pragma once

#include <new>
#include <tuple>
#include <vector>

#include "hal/component.hpp"
#include "schema.hpp"

namespace hal::dds {

template <template <class> class P>
class FieldPins {
public:
    /// Declares the pins in the order of the fields. [setup]
    FieldPins(hal::Component& component, const hal::Function& function, const Schema& schema,
              const char* doc) {
        each([&](auto& row) { row.reserve(schema); });
        for (std::size_t i = 0; i < schema.fields.size(); ++i) {
            each([&](auto& row) { row.declare(component, function, schema, i, doc); });
        }
    }
    /// Stores all values into a sample. [realtime]
    void store(std::uint8_t* to) const noexcept {
        each([to](const auto& row) {
            for (std::size_t i = 0; i < row.size; ++i) {
                const auto value = row.pins[i].get();
                std::memcpy(to + row.at[i].offset, &value, sizeof value);
            }
        });
    }
    /// Sets all pins from an array of values, in the order of the fields. [realtime]
    void load(const hal_value* from) noexcept {
        each([from](auto& row) {
            for (std::size_t i = 0; i < row.size; ++i) {
                row.pins[i] = row.value(from[row.at[i].field]);
            }
        });
    }
    /// Sets the fields that have a safe value to it. [realtime]
    void make_safe() noexcept {
        each([](auto& row) {
            for (std::size_t i = 0; i < row.size; ++i) {
                if (row.at[i].has_safe) {
                    row.pins[i] = row.value(row.at[i].safe);
                }
            }
        });
    }

private:
    struct At {
        std::uint32_t offset, field;
        bool has_safe;
        hal_value safe;
    };
    template <class T>
    struct Row {
        P<T>* pins = nullptr;
        std::size_t size = 0;
        std::vector<At> at;

        static constexpr hal_type type = hal::detail::type_of<T>();
        static T value(const hal_value& v) noexcept {
            T to;
            std::memcpy(&to, &v, sizeof to);
            return to;
        }
        void reserve(const Schema& schema) {
            std::size_t count = 0;
            for (const Field& f : schema.fields) {
                count += f.type == type;
            }
            pins = static_cast<P<T>*>(hal::detail::creating->allocate(
                hal::detail::creating, count * sizeof(P<T>), alignof(P<T>)));
            if (count != 0 && pins == nullptr) throw std::bad_alloc();
            at.reserve(count);
        }
        void declare(hal::Component& c, const hal::Function& function, const Schema& schema,
                     std::size_t i, const char* doc) {
            const Field& f = schema.fields[i];
            if (f.type != type) return;
            hal::PinOptions<T> options;
            if (f.safe) {
                options.initial = value(*f.safe);
            }
            if constexpr (std::is_same_v<P<T>, hal::Out<T>>) {
                if (f.safe) {
                    options.safe = value(*f.safe);
                }
            }
            new (pins + size) P<T>(c, function, f.name.c_str(), doc, options);
            at.push_back({schema.places[i].offset, static_cast<std::uint32_t>(i),
                          f.safe.has_value(), f.safe.value_or(hal_value{0})});
            ++size;
        }
    };
    template <class F>
    void each(F&& f) {
        std::apply([&f](auto&... row) { (f(row), ...); }, rows_);
    }
    template <class F>
    void each(F&& f) const {
        std::apply([&f](const auto&... row) { (f(row), ...); }, rows_);
    }
    std::tuple<Row<double>, Row<bool>, Row<std::int32_t>, Row<std::uint32_t>, Row<std::int64_t>,
               Row<std::uint64_t>>
        rows_;
};

}  // namespace hal::dds
