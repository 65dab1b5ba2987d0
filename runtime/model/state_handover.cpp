// SPDX-License-Identifier: MIT
#include "model/state_handover.hpp"

#include <cstring>
#include <map>
#include <string_view>
#include <utility>

namespace hal {
namespace {

using Variable = Instance::Variable;
/// A name, and how many variables of that name precede.
using Key = std::pair<std::string_view, std::size_t>;

std::map<Key, const Variable*> by_key(const Instance& instance) {
    std::map<std::string_view, std::size_t> count;
    std::map<Key, const Variable*> all;
    for (const Variable& variable : instance.variables) {
        all.emplace(Key{variable.name, count[variable.name]++}, &variable);
    }
    return all;
}

const Variable* counterpart(const std::map<Key, const Variable*>& in, const Key& key,
                            const Variable& of) {
    const auto found = in.find(key);
    if (found == in.end()) return nullptr;
    const Variable& other = *found->second;
    return other.type == of.type && other.bytes == of.bytes ? &other : nullptr;
}

std::vector<plan::Handover> copies(const Instance& from, const Instance& to) {
    std::vector<plan::Handover> all;
    const auto targets = by_key(to);
    for (const auto& [key, source] : by_key(from)) {
        // an array without elements has no memory, and memcpy() takes no null pointer
        if (source->bytes == 0) continue;
        if (const Variable* const target = counterpart(targets, key, *source)) {
            all.push_back({target->memory, source->memory, source->bytes});
        }
    }
    return all;
}

/// The other side of an instance that several reloads of one edit replaced: the version that the
/// threads know.
EditLog::Replaced::Pair* known_pair(EditLog& edit, const Instance& kept) {
    EditLog::Replaced::Pair* found = nullptr;
    for (EditLog::Replaced& one : edit.replaced()) {
        for (EditLog::Replaced::Pair& pair : one.pairs) {
            if (pair.kept != &kept) continue;
            if (!one.undone && found) continue;
            found = &pair;
        }
    }
    return found;
}

}  // namespace

std::vector<const Variable*> lost_variables(const Instance& old, const Instance& fresh) {
    std::vector<const Variable*> lost;
    const auto there = by_key(fresh);
    for (const auto& [key, variable] : by_key(old)) {
        if (!counterpart(there, key, *variable)) {
            lost.push_back(variable);
        }
    }
    return lost;
}

std::vector<StateHandover> state_handovers(EditLog& edit) {
    std::vector<StateHandover> all;
    for (EditLog::Replaced& one : edit.replaced()) {
        for (EditLog::Replaced::Pair& pair : one.pairs) {
            // a handover was made only to the version in the model, and is rolled back with it
            if (known_pair(edit, *pair.kept) != &pair || pair.handed != one.undone) continue;
            const bool is_kept = !one.undone;
            all.push_back({pair.kept, copies(*pair.other, *pair.kept), {&pair.handed, is_kept}});
        }
    }
    return all;
}

namespace {

/// A total order, so that threads that wait for each other's plans cannot form a circle.
bool is_faster(const Thread& a, const Thread& b) {
    const std::int64_t a_ns = a.options.period_ns;
    const std::int64_t b_ns = b.options.period_ns;
    return a_ns != b_ns ? a_ns < b_ns : a.name < b.name;
}

}  // namespace

std::unordered_set<const LoadedFunction*> late_functions(
    const std::vector<StateHandover>& handovers) {
    std::unordered_set<const LoadedFunction*> late;
    for (const StateHandover& one : handovers) {
        const Thread* fastest = nullptr;
        for (const LoadedFunction* const function : one.instance->functions) {
            const Thread* const thread = function->thread;
            if (thread && (!fastest || is_faster(*thread, *fastest))) {
                fastest = thread;
            }
        }
        for (const LoadedFunction* const function : one.instance->functions) {
            if (function->thread && function->thread != fastest) {
                late.insert(function);
            }
        }
    }
    return late;
}

void hand_over(const StateHandover& handover) {
    for (const plan::Handover& copy : handover.copies) {
        std::memcpy(copy.to, copy.from, copy.bytes);
    }
    *handover.handed.to = handover.handed.value;
}

}  // namespace hal
