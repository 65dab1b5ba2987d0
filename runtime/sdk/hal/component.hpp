// SPDX-License-Identifier: MIT
// What a component author includes: Component, pins (In Out Io Param), Function, Cycle,
// HAL_COMPONENT.
//
// A pin, a function or a load argument is a member of the component; its constructor declares it,
// once. Everything here is header-only glue over the C interface in hal/abi.h; nothing of it
// crosses that border.
#pragma once

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <concepts>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <new>
#include <optional>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>

#include "hal/abi.h"
#include "hal/pin_type.hpp"
#include "hal/plugin_entry.hpp"
#include "hal/rejection.hpp"

namespace hal {

/// One run of a function. Cheap to copy; valid during the call only. [realtime]
class Cycle {
public:
    explicit Cycle(const hal_cycle* cycle) noexcept : cycle_(cycle) {}
    double seconds() const noexcept { return cycle_->period_s; }           ///< nominal period, s
    std::int64_t period_ns() const noexcept { return cycle_->period_ns; }  ///< nominal period, ns
    /// when this cycle was due, runtime clock
    std::int64_t start_ns() const noexcept { return cycle_->start_ns; }
    /// cycles of the thread so far
    std::uint64_t number() const noexcept { return cycle_->number; }

private:
    const hal_cycle* cycle_;
};
static_assert(sizeof(Cycle) == sizeof(void*) && std::is_trivially_copyable_v<Cycle>,
              "passed in a register, like the pointer");

/// What may follow a pin's documentation.
template <PinType T>
struct PinOptions {
    T initial{};  ///< value before anything is linked or set
    const char* unit = "";  ///< "mm", "rad/s", "V" …
    /// outputs: written on stop, unload, a fault that stops the thread, end of process
    std::optional<T> safe = {};
    bool finite = false;  ///< float outputs: NaN or infinity here is a fault
};

/// What may follow a function's documentation.
struct FunctionOptions {
    /// one function per component that runs all instances (`encoder.update-counters`)
    bool shared = false;
    /// the other functions of the instance do not work without it: `hal check` warns when it is in
    /// no thread
    bool required = false;

    unsigned flags() const {
        return (shared ? unsigned{HAL_FUNCTION_SHARED} : 0U) |
               (required ? unsigned{HAL_FUNCTION_REQUIRED} : 0U);
    }
};

/// What may follow an argument's documentation.
struct ArgumentOptions {
    bool per_instance = false;  ///< a comma list with an element per instance (`step_type=0,2`)
    std::int64_t min = INT64_MIN;
    std::int64_t max = INT64_MAX;
};

namespace detail {
// A slot is written by one thread only, and that thread's pins read it by plain moves. Stores are
// atomic because the shell may look at a single value at any moment; loads of `Io` pins are,
// because several threads may share their cell. On every machine we run on the instruction is the
// same.
template <class T, bool Shared>
T load(const hal_value* slot) noexcept {
    if constexpr (std::same_as<T, Port>) {
        return Port{slot->port};
    } else if constexpr (Shared) {
        T v;
        __atomic_load(reinterpret_cast<const T*>(slot), &v, __ATOMIC_RELAXED);
        return v;
    } else {
        return *reinterpret_cast<const T*>(slot);
    }
}
template <class T>
void store(hal_value* slot, T v) noexcept {
    __atomic_store(reinterpret_cast<T*>(slot), &v, __ATOMIC_RELAXED);
}

// the host has recorded the reason already
[[noreturn]] inline void rejected() { throw std::runtime_error(""); }

template <class T>
void declare(hal_pin& pin, hal_dir dir, const char* name, const char* doc,
             const PinOptions<T>& options, const void* function) {
    hal_pin_decl decl{};
    decl.size = sizeof decl;
    decl.type = type_of<T>();
    decl.dir = dir;
    decl.flags = (options.finite ? unsigned{HAL_PIN_FINITE} : 0u) |
                 (options.safe ? unsigned{HAL_PIN_SAFE} : 0u);
    decl.name = name;
    decl.doc = doc;
    decl.unit = options.unit;
    decl.initial = to_value<T>(options.initial);
    if (options.safe) {
        decl.safe = to_value<T>(*options.safe);
    }
    decl.function = function;
    pin.own = decl.initial;
    pin.slot = &pin.own;
    if (!creating->pin(creating, &decl, &pin)) {
        rejected();
    }
}
}  // namespace detail

/// Base of every component: empty, so that instances stay small. Derived classes write `using
/// Component::Component;`.
class Component {
public:
    explicit Component(const hal_host* host) { detail::creating = host; }
    Component(const Component&) = delete;
    Component& operator=(const Component&) = delete;
};

namespace detail {
template <class B, auto step>
void run_row(const hal_call* call, const hal_call* last, const hal_cycle* cycle,
             const hal_call* volatile* current) noexcept {
    for (; call != last; ++call) {
        *current = call;
        (static_cast<B*>(call->self)->*step)(Cycle{cycle});
    }
}
}  // namespace detail

/// A member function as a constant: `Function run{*this, "", hal::step<&And2::update>, "computes
/// out"}`. Consecutive instances in a thread are run by one loop in the plugin, in which the
/// compiler can inline `update`: useful when the work is only a few instructions, comparable to the
/// cost of a call.
template <auto member>
struct Step {};
template <auto member>
inline constexpr Step<member> step{};

/// A function that can be added to a thread with `addf`. `step` must be a noexcept member taking a
/// hal::Cycle.
class Function {
public:
    template <std::derived_from<Component> C, class B>
        requires std::derived_from<C, B>
    Function(C& component, const char* name, void (B::*step)(Cycle) noexcept, const char* doc,
             FunctionOptions options = {}) {
        declare(static_cast<B*>(&component), name, entry(step), doc,
                options.flags());
    }
    template <std::derived_from<Component> C, class B, void (B::*step)(Cycle) noexcept>
        requires std::derived_from<C, B>
    Function(C& component, const char* name, Step<step>, const char* doc,
             FunctionOptions options = {}) {
        declare(static_cast<B*>(&component), name, entry(step), doc,
                options.flags(), detail::run_row<B, step>);
    }
    // The compiler shows this line where something else was given.
    // clang-format off
    template <std::derived_from<Component> C, class F>
    Function(C&, const char*, F, const char*, FunctionOptions = {}) = delete;  // must be: void NAME(hal::Cycle) noexcept
    // clang-format on
    Function(const Function&) = delete;
    Function& operator=(const Function&) = delete;

protected:
    Function() = default;

    // Itanium C++ ABI 2.3: a pointer to a non-virtual member function starts with the function's
    // address, and the member takes `this` and the one-pointer Cycle in the registers of a
    // hal_step's two arguments. Calling it directly saves a thunk per function and cycle.
    template <class B>
    static hal_step entry(void (B::*step)(Cycle) noexcept) {
        static_assert(sizeof step == 2 * sizeof(void*));
        std::uintptr_t words[2];
        std::memcpy(words, &step, sizeof step);
#if defined(__aarch64__) || defined(__arm__)
        const bool plain =
            words[1] ==
            0;  // ABI for ARM, 3.2.1: the mark of a virtual one is there; bit 0 of the address is Thumb's
#else
        const bool plain = (words[0] & 1) == 0 && words[1] == 0;
#endif
        if (!plain) throw std::logic_error("a component's function must not be virtual");
        return reinterpret_cast<hal_step>(words[0]);
    }
    void declare(void* self, const char* name, hal_step step, const char* doc, unsigned flags,
                 hal_row row = nullptr) {
        const hal_function_decl decl{sizeof decl, flags, name, doc, step, self, this, row};
        if (!detail::creating->function(detail::creating, &decl)) {
            detail::rejected();
        }
    }
};

/// What the host calls to make hardware outputs safe: on stop, unload, `delf` of the instance's
/// last function, a fault that stops the thread, the end of the process and in a crash handler.
/// Must be async-signal-safe: it may write to devices and must not allocate, lock or log.
class Emergency : Function {
public:
    template <std::derived_from<Component> C>
    Emergency(C& component, void (C::*step)(Cycle) noexcept, const char* doc) {
        declare(&component, "", entry(step), doc, HAL_FUNCTION_EMERGENCY);
    }
};

/// An integer load argument: `loadrt logic inputs=6`.
class Argument {
public:
    Argument(Component&, const char* name, std::int64_t fallback, const char* doc,
             ArgumentOptions options = {}) {
        const std::string text = ask(name, std::to_string(fallback).c_str(), doc, options);
        char* end = nullptr;
        errno = 0;
        value_ = std::strtoll(text.c_str(), &end, 0);
        if (text.empty() || *end != '\0' || errno != 0) {
            throw ArgumentError(name, std::string(name) + "=" + text + " is not a whole number");
        }
        if (value_ < options.min || value_ > options.max) {
            throw ArgumentError(name, std::string(name) + "=" + text + " is outside " +
                                          std::to_string(options.min) + ".." +
                                          std::to_string(options.max));
        }
    }
    operator std::int64_t() const noexcept { return value_; }

    static std::string ask(const char* name, const char* fallback, const char* doc,
                           const ArgumentOptions& options) {
        const hal_argument_decl decl{
            sizeof decl, options.per_instance ? unsigned{HAL_ARGUMENT_PER_INSTANCE} : 0u, name, doc,
            fallback};
        const char* text = detail::creating->argument(detail::creating, &decl);
        return text ? text : fallback;
    }

private:
    std::int64_t value_;
};

/// A text load argument: `loadrt sampler cfg=ffb`. Valid as long as the component.
class TextArgument {
public:
    TextArgument(Component&, const char* name, const char* fallback, const char* doc,
                 ArgumentOptions options = {})
        : text_(Argument::ask(name, fallback, doc, options)) {}
    const std::string& get() const noexcept { return text_; }

private:
    std::string text_;
};

/// A floating-point load argument: `loadrt furuta arm_length=0.2`.
class RealArgument {
public:
    RealArgument(Component&, const char* name, double fallback, const char* doc,
                 ArgumentOptions options = {}) {
        char shortest[32] = {};  // the shortest text that parses to the same number
        std::to_chars(shortest, shortest + sizeof shortest - 1, fallback);
        const std::string text = Argument::ask(name, shortest, doc, options);
        char* end = nullptr;
        value_ = std::strtod(text.c_str(), &end);
        if (text.empty() || *end != '\0' || !std::isfinite(value_)) {
            throw ArgumentError(name, std::string(name) + "=" + text + " is not a number");
        }
    }
    operator double() const noexcept { return value_; }

private:
    double value_;
};

namespace detail {
/// The type of a pin. Another one gives one message, and counts as double behind it.
template <class T>
struct PinOf {
    static_assert(is_pin_type<T>,
                  "a pin has one of the types bool, double, std::int32_t, std::uint32_t, "
                  "std::int64_t, std::uint64_t and hal::Port; write double in place of float");
    using type = std::conditional_t<is_pin_type<T>, T, double>;
};
template <class T>
using pin_of = typename PinOf<T>::type;

template <PinType T, hal_dir Dir>
class Pin {
public:
    Pin(Component&, const char* name, const char* doc, PinOptions<T> options = {}) {
        declare<T>(pin_, Dir, name, doc, options, nullptr);
    }
    Pin(Component&, const Function& function, const char* name, const char* doc,
        PinOptions<T> options = {}) {
        declare<T>(pin_, Dir, name, doc, options, &function);
    }
    Pin(const Pin&) = delete;

    T get() const noexcept { return detail::load < T, Dir == HAL_DIR_IO > (pin_.slot); }
    operator T() const noexcept { return get(); }
    /// True while a signal is connected. [realtime]
    bool linked() const noexcept { return pin_.slot != &pin_.own; }

protected:
    void put(T value) noexcept { detail::store<T>(pin_.slot, value); }

private:
    hal_pin pin_;
};
}  // namespace detail

/// An input: reads the signal it is linked to, or its own value (`setp`). Assigning to it does not
/// compile.
template <class T>
class In : public detail::Pin<detail::pin_of<T>, HAL_DIR_IN> {
public:
    using detail::Pin<detail::pin_of<T>, HAL_DIR_IN>::Pin;
    In& operator=(const In&) = delete;
    In& operator=(T) = delete;  // an input is only read; hal::Out and hal::Io can be written
};

/// A parameter: read by the component, set by `setp`, never linked.
template <class T>
class Param : public detail::Pin<detail::pin_of<T>, HAL_DIR_PARAM> {
public:
    using detail::Pin<detail::pin_of<T>, HAL_DIR_PARAM>::Pin;
    Param& operator=(const Param&) = delete;
    Param& operator=(T) = delete;  // a parameter is only read; setp sets it
};

/// An output. Reading it gives what was last written.
template <class T>
class Out : public detail::Pin<detail::pin_of<T>, HAL_DIR_OUT> {
public:
    using detail::Pin<detail::pin_of<T>, HAL_DIR_OUT>::Pin;
    Out& operator=(T value) noexcept {
        this->put(value);
        return *this;
    }
    Out& operator=(const Out& other) noexcept {
        this->put(other.get());
        return *this;
    }
};

/// Read and written by the component and by others (`index-enable`).
template <class T>
class Io : public detail::Pin<detail::pin_of<T>, HAL_DIR_IO> {
public:
    using detail::Pin<detail::pin_of<T>, HAL_DIR_IO>::Pin;
    Io& operator=(T value) noexcept {
        this->put(value);
        return *this;
    }
    Io& operator=(const Io& other) noexcept {
        this->put(other.get());
        return *this;
    }
};

/// An array of pins. In `name` and `doc` a block of `#` is replaced by the index, padded with zeros
/// to the width of the block.
template <class P, class T>
class Pins {
public:
    Pins(Component& component, const char* name, std::int64_t count, const char* doc,
         PinOptions<T> options = {}) {
        make(component, nullptr, name, count, doc, options, 0);
    }
    Pins(Component& component, const Function& function, const char* name, std::int64_t count,
         const char* doc, PinOptions<T> options = {}) {
        make(component, &function, name, count, doc, options, 0);
    }
    /// The same, counting from `first` (LinuxCNC numbers some arrays from 1).
    Pins(Component& component, const char* name, std::int64_t count, std::int64_t first,
         const char* doc, PinOptions<T> options = {}) {
        make(component, nullptr, name, count, doc, options, first);
    }
    std::size_t size() const noexcept { return size_; }
    P& operator[](std::size_t i) noexcept { return pins_[i]; }
    const P& operator[](std::size_t i) const noexcept { return pins_[i]; }
    P* begin() noexcept { return pins_; }
    P* end() noexcept { return pins_ + size_; }
    const P* begin() const noexcept { return pins_; }
    const P* end() const noexcept { return pins_ + size_; }

    /// `pattern` with its block of `#` replaced by `index`. [setup]
    static std::string numbered(const char* pattern, std::int64_t index) {
        std::string name = pattern;
        const auto at = name.find('#');
        if (at == std::string::npos) return name;
        const auto width = std::min(name.find_first_not_of('#', at), name.size()) - at;
        std::string digits = std::to_string(index);
        if (digits.size() < width) {
            digits.insert(0, width - digits.size(), '0');
        }
        return name.replace(at, width, digits);
    }

private:
    void make(Component& component, const Function* function, const char* name, std::int64_t count,
              const char* doc, const PinOptions<T>& options, std::int64_t first) {
        if (count < 0) {
            throw Rejection(
                HAL_SUBJECT_PIN, name,
                std::string("negative number of pins '") + name + "': " + std::to_string(count));
        }
        size_ = static_cast<std::size_t>(count);
        pins_ = static_cast<P*>(
            detail::creating->allocate(detail::creating, size_ * sizeof(P), alignof(P)));
        if (size_ != 0 && pins_ == nullptr) throw std::bad_alloc();
        for (std::size_t i = 0; i < size_; ++i) {
            const std::string pin = numbered(name, first + static_cast<std::int64_t>(i));

            const std::string text = numbered(doc, first + static_cast<std::int64_t>(i));
            if (function) {
                new (pins_ + i) P(component, *function, pin.c_str(), text.c_str(), options);
            } else {
                new (pins_ + i) P(component, pin.c_str(), text.c_str(), options);
            }
        }
    }
    P* pins_ = nullptr;
    std::size_t size_ = 0;
};
template <class T> using Ins = Pins<In<T>, detail::pin_of<T>>;
template <class T> using Outs = Pins<Out<T>, detail::pin_of<T>>;
template <class T> using Ios = Pins<Io<T>, detail::pin_of<T>>;
template <class T> using Params = Pins<Param<T>, detail::pin_of<T>>;

/// Returns an extension of the host interface, or nullptr. In constructor and start() only. [setup]
template <class Extension>
const Extension* extension(const char* id) {
    return static_cast<const Extension*>(detail::creating->extension(detail::creating, id));
}

}  // namespace hal

/// HAL_COMPONENT(Type, "name", "one line of summary") or with a fourth argument: the manual's text,
/// in Markdown.
#define HAL_COMPONENT(Type, ...)                               \
    extern "C" HAL_EXPORT constexpr hal_component hal_plugin = \
        ::hal::detail::component<Type>(__VA_ARGS__);
