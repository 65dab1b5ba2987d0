// SPDX-License-Identifier: MIT
// A host of the component interface for unit tests: loads a plugin, creates one instance, and lets
// a test play the netlist and the thread. Everything that goes wrong throws std::runtime_error with
// a sentence. One thread only.
#pragma once

#include <concepts>
#include <cstdint>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "hal/abi.h"
#include "hal/pin_type.hpp"

namespace hal::test {

/// Load arguments as a netlist gives them, for one instance: {{"cfg", "4"}}.
using Arguments = std::map<std::string, std::string>;

/// One instance of a component, created and started; stopped and destroyed with this object.
class Instance {
public:
    struct Pin {
        std::string name, doc, unit;
        hal_type type;
        hal_dir dir;
        std::uint32_t flags;
        hal_value initial, safe;
        const void* function;
        hal_pin* memory;
    };
    struct Function {
        std::string name, doc;
        std::uint32_t flags;
        hal_step step;
        void* self;
    };
    /// Extensions of the interface that the component may ask for, by id.
    using Extensions = std::map<std::string, const void*>;

    enum class Life { created, started };

    /// Creates and starts an instance of `component`, found in HALCYON_PLUGIN_PATH or the build
    /// tree; with Life::created it is left for start(). Throws the component's own reason when it
    /// rejects its arguments.
    explicit Instance(const std::string& component, Arguments arguments = {},
                      Extensions extensions = {}, Life life = Life::started);
    ~Instance();
    Instance(const Instance&) = delete;
    Instance& operator=(const Instance&) = delete;

    /// Value of a pin; `T` must be its exact type (bool, double, int32_t, uint32_t, int64_t,
    /// uint64_t).
    template <class T>
    T get(std::string_view pin) const {
        return *reinterpret_cast<const T*>(of_type(pin, detail::type_of<T>()).memory->slot);
    }
    /// Sets a pin of any direction, linked or not. Any number goes into a float pin; other types
    /// must match exactly, except that a non-negative or in-range int literal goes into any integer
    /// pin.
    template <class T>
    void set(std::string_view pin, T value) {
        const Pin& to = this->pin(pin);
        hal_value& slot = *to.memory->slot;
        if constexpr (std::same_as<T, bool>) {
            of_type(pin, HAL_TYPE_BIT).memory->slot->bit = value;
        } else if (to.type == HAL_TYPE_FLOAT) {
            slot.real = static_cast<double>(value);
        } else if constexpr (std::floating_point<T>) {
            of_type(pin, HAL_TYPE_FLOAT);
        } else if (to.type == HAL_TYPE_S32) {
            slot.s32 = in_range<std::int32_t>(pin, value);
        } else if (to.type == HAL_TYPE_U32) {
            slot.u32 = in_range<std::uint32_t>(pin, value);
        } else if (to.type == HAL_TYPE_S64) {
            slot.s64 = in_range<std::int64_t>(pin, value);
        } else if (to.type == HAL_TYPE_U64) {
            slot.u64 = in_range<std::uint64_t>(pin, value);
        } else {
            throw std::runtime_error("pin '" + std::string(pin) + "' does not take a number");
        }
    }

    /// Runs `cycles` cycles of a function ("" is the one named like the instance). The cycle number
    /// goes on from call to call; the start time is the sum of the periods.
    void run(std::string_view function = "", std::int64_t period_ns = 1'000'000,
             std::uint64_t cycles = 1);
    /// The same for the function named like the instance.
    void run(int cycles) { run("", 1'000'000, static_cast<std::uint64_t>(cycles)); }

    /// Gives `pin` a signal of its own, with the value it has; `linked()` is then true inside the
    /// component.
    void link(std::string_view pin);
    /// Puts `pin` and `other_pin` on one signal, which takes the value of `pin`.
    void link(std::string_view pin, Instance& other, std::string_view other_pin);
    /// Takes `pin` off its signal; it keeps the value.
    void unlink(std::string_view pin);

    void stop();  ///< calls the component's stop(), once
    void start();  ///< starts an instance that was only created, or again after stop()

    const hal_component& component() const { return *component_; }
    const std::vector<Pin>& pins() const { return pins_; }
    const std::vector<Function>& functions() const { return functions_; }
    bool has_pin(std::string_view name) const;
    const Pin& pin(std::string_view name) const;
    const Function& function(std::string_view name) const;

private:
    void release();
    template <class To, class From>
    static To in_range(std::string_view pin, From value) {
        if (!std::in_range<To>(value)) {
            throw std::runtime_error("value out of range for pin '" + std::string(pin) + "'");
        }
        return static_cast<To>(value);
    }
    const Pin& of_type(std::string_view pin, hal_type type) const;

    hal_host host_{};
    Arguments arguments_;
    Extensions extensions_;
    std::string reason_;  // why the component rejected its arguments
    void* library_ = nullptr;
    const hal_component* component_ = nullptr;
    void* self_ = nullptr;
    bool started_ = false;
    std::vector<Pin> pins_;
    std::map<std::string, std::size_t, std::less<>> index_;
    std::vector<Function> functions_;
    std::vector<std::pair<void*, std::size_t>> allocations_;  // memory and alignment
    std::map<hal_pin*, std::shared_ptr<hal_value>> signals_;
    hal_cycle cycle_{sizeof(hal_cycle), 0, 0, 0.0, 0, 0};
};

/// The file of a component's plugin, or an exception that names where it was looked for.
std::string plugin_file(const std::string& component);

}  // namespace hal::test
