// SPDX-License-Identifier: MIT
#include "linuxcnc/binary/parameters.hpp"

#include <algorithm>
#include <cstring>
#include <set>

#include "linuxcnc/binary/module.hpp"

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
void import(Parameter& p) noexcept {
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

void import_all(Parameter* const* first, std::size_t count) noexcept {
    for (std::size_t i = 0; i < count; ++i) {
        Parameter& p = *first[i];
        switch (p.width) {
        case 8: import <std::uint64_t>(p); break;
        case 4: import <std::uint32_t>(p); break;
        default: import <std::uint8_t>(p); break;
        }
    }
}
void show_all(Parameter* const* first, std::size_t count) noexcept {
    for (std::size_t i = 0; i < count; ++i) {
        Parameter& p = *first[i];
        switch (p.width) {
        case 8: show<std::uint64_t>(p); break;
        case 4: show<std::uint32_t>(p); break;
        default: show<std::uint8_t>(p); break;
        }
    }
}

}  // namespace

void ModuleParameters::add(const char* name, Parameter* parameter) {
    all_.push_back(parameter);
    names_.emplace(name, parameter);
}

Parameter* ModuleParameters::find(const std::string& name) const {
    const auto found = names_.find(name);
    return found == names_.end() ? nullptr : found->second;
}

void ModuleParameters::assign(const std::vector<Function*>& declared) {
    show_all(all_.data(), all_.size());
    const auto address = [](const Parameter* p) {
        return reinterpret_cast<std::uintptr_t>(p->value);
    };
    std::sort(all_.begin(), all_.end(),
              [&](const Parameter* a, const Parameter* b) { return address(a) < address(b); });
    std::set<std::uintptr_t> arguments;
    for (const Function* const function : declared) {
        arguments.insert(reinterpret_cast<std::uintptr_t>(function->arg));
    }
    std::vector<bool> taken(all_.size());
    const auto below = [&](const Parameter* p, std::uintptr_t at) { return address(p) < at; };
    for (Function* const function : declared) {
        // its memory: from its argument to that of the next function in the same block, or to the
        // block's end
        const auto begin = reinterpret_cast<std::uintptr_t>(function->arg);
        std::uintptr_t end = end_of_block(function->arg);
        if (const auto next = arguments.upper_bound(begin); next != arguments.end()) {
            end = std::min(end, *next);
        }
        const auto first = std::lower_bound(all_.begin(), all_.end(), begin, below);
        const auto last = std::lower_bound(first, all_.end(), end, below);
        function->own = all_.data() + (first - all_.begin());
        function->own_count = static_cast<std::size_t>(last - first);
        std::fill(taken.begin() + (first - all_.begin()), taken.begin() + (last - all_.begin()),
                  true);
    }
    for (std::size_t i = 0; i < all_.size(); ++i) {
        if (!taken[i]) {
            shared_.push_back(all_[i]);
        }
    }
}

void ModuleParameters::clear() {
    all_.clear();
    shared_.clear();
    names_.clear();
}

void ModuleParameters::import(const Function& function) noexcept {
    import_all(function.own, function.own_count);
    import_all(shared_.data(), shared_.size());
}

void ModuleParameters::exchange() noexcept {
    if (!settled_.load(std::memory_order_acquire)) return;
    show_all(all_.data(), all_.size());
    import_all(all_.data(), all_.size());
}

void ModuleParameters::show(Function& function) noexcept {
    show_all(function.own, function.own_count);
    show_all(shared_.data(), shared_.size());
    // those of other functions, one in 16 calls: what this function has changed of them is seen in
    // the end
    const bool has_others = shared_.size() + function.own_count != all_.size();
    if (!has_others || ++function.calls % 16 != 0) return;
    const std::size_t other = function.calls / 16 % all_.size();
    import_all(all_.data() + other, 1);
    show_all(all_.data() + other, 1);
}

}  // namespace hal::modules
