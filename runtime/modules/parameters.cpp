// SPDX-License-Identifier: MIT
// Parameters live twice (module.hpp): which function copies which, and the copying.
#include <algorithm>
#include <cstring>
#include <set>

#include "modules/module.hpp"

namespace hal::modules {
namespace {

template <class T>
T value_at(const void* place) noexcept {
    T value;
    std::memcpy(&value, place, sizeof value);
    return value;
}

/// Copies what was set from outside into the module's variable. Values are compared as bits: NaN
/// equals NaN.
template <class T>
void take(Parameter& p) noexcept {
    const std::uint64_t raw = __atomic_load_n(&p.pin.slot->raw, __ATOMIC_RELAXED);
    const T outside = value_at<T>(&raw);
    if (outside == value_at<T>(&p.last)) return;
    std::memcpy(const_cast<void*>(p.value), &outside, sizeof outside);
    p.last = hal_value{.raw = outside};
}
/// Shows what the module has changed.
template <class T>
void show(Parameter& p) noexcept {
    const T inside = value_at<T>(const_cast<const void*>(p.value));
    if (inside == value_at<T>(&p.last)) return;
    p.last = hal_value{.raw = inside};
    __atomic_store_n(&p.pin.slot->raw, p.last.raw, __ATOMIC_RELAXED);
}

void take_all(Parameter* const* first, std::size_t count) noexcept {
    for (std::size_t i = 0; i < count; ++i) {
        Parameter& p = *first[i];
        p.width == 8   ? take<std::uint64_t>(p)
        : p.width == 4 ? take<std::uint32_t>(p)
                       : take<std::uint8_t>(p);
    }
}
void show_all(Parameter* const* first, std::size_t count) noexcept {
    for (std::size_t i = 0; i < count; ++i) {
        Parameter& p = *first[i];
        p.width == 8   ? show<std::uint64_t>(p)
        : p.width == 4 ? show<std::uint32_t>(p)
                       : show<std::uint8_t>(p);
    }
}

}  // namespace

void Module::assign_parameters() {
    show_all(parameters.data(), parameters.size());
    const auto address = [](const Parameter* p) {
        return reinterpret_cast<std::uintptr_t>(p->value);
    };
    std::sort(parameters.begin(), parameters.end(),
              [&](const Parameter* a, const Parameter* b) { return address(a) < address(b); });
    std::set<std::uintptr_t> arguments;
    for (const Function* const function : declared) {
        arguments.insert(reinterpret_cast<std::uintptr_t>(function->arg));
    }
    std::vector<bool> taken(parameters.size());
    const auto below = [&](const Parameter* p, std::uintptr_t at) { return address(p) < at; };
    for (Function* const function : declared) {
        // its memory: from its argument to that of the next function in the same block, or to the
        // block's end
        const auto begin = reinterpret_cast<std::uintptr_t>(function->arg);
        std::uintptr_t end = end_of_block(function->arg);
        if (const auto next = arguments.upper_bound(begin); next != arguments.end()) {
            end = std::min(end, *next);
        }
        const auto first = std::lower_bound(parameters.begin(), parameters.end(), begin, below);
        const auto last = std::lower_bound(first, parameters.end(), end, below);
        function->own = parameters.data() + (first - parameters.begin());
        function->own_count = static_cast<std::size_t>(last - first);
        std::fill(taken.begin() + (first - parameters.begin()),
                  taken.begin() + (last - parameters.begin()), true);
    }
    for (std::size_t i = 0; i < parameters.size(); ++i) {
        if (!taken[i]) {
            shared_.push_back(parameters[i]);
        }
    }
}

void Module::take_parameters(const Function& function) noexcept {
    take_all(function.own, function.own_count);
    take_all(shared_.data(), shared_.size());
}

void Module::exchange_parameters() noexcept {
    if (!settled_.load(std::memory_order_acquire)) return;
    show_all(parameters.data(), parameters.size());
    take_all(parameters.data(), parameters.size());
}

void Module::show_parameters(Function& function) noexcept {
    show_all(function.own, function.own_count);
    show_all(shared_.data(), shared_.size());
    // those of other functions, one in 16 calls: what this function has changed of them is seen in
    // the end
    if (shared_.size() + function.own_count == parameters.size() || ++function.calls % 16 != 0) {
        return;
    }
    const std::size_t other = function.calls / 16 % parameters.size();
    take_all(parameters.data() + other, 1);
    show_all(parameters.data() + other, 1);
}

}  // namespace hal::modules
