// SPDX-License-Identifier: MIT
#include "journal/machine_state.hpp"

#include <algorithm>
#include <cstring>
#include <fmt/core.h>
#include <functional>
#include <optional>
#include <utility>

#include "machine/session.hpp"

namespace hal {
namespace {

constexpr std::size_t word_bytes = sizeof(std::uint64_t);

/// Of a pointer: a word may consist of small values and, in its padding, of an old address.
constexpr std::uint64_t low_bytes = 0xff'ffff;

std::uint64_t address_of(const void* memory) { return reinterpret_cast<std::uint64_t>(memory); }

/// The sizes in a state that was written elsewhere are checked against these.
constexpr std::uint32_t max_history = 1u << 20;

/// Begins a state with the address of the memory of components. States before it begin with a
/// number of libraries.
constexpr std::uint32_t state_format = 0x5348'0003;

}  // namespace

MachineState::MachineState(Session& session, std::vector<Core*> cores)
    : session_(session), cores_(std::move(cores)) {
    add_regions(session);
    fixed_ = regions_.size();
}

bool MachineState::fail(std::string problem) {
    if (problem_.empty()) {
        problem_ = std::move(problem);
    }
    return false;
}

std::string MachineState::name_of(const Region& region) {
    if (!region.instance) return "the machine";
    return fmt::format("'{}' ({})", region.instance->name, region.instance->component->name);
}

std::string MachineState::function_named(std::uint32_t id) const {
    for (const auto& component : session_.model().components) {
        for (const auto& function : component->functions) {
            if (function->id == id) return fmt::format("'{}'", function->name);
        }
    }
    return "";
}

// --- the regions ---

void MachineState::add(const void* begin, std::size_t bytes, const Instance* instance) {
    if (!begin || bytes == 0 || component_heap::has(address_of(begin))) return;
    auto* const first = const_cast<char*>(static_cast<const char*>(begin));
    if (by_begin_.emplace(first, regions_.size()).second) {
        regions_.push_back({first, bytes, instance});
    }
}

void MachineState::add_regions(Session& session) {
    const Model& model = session.model();
    for (const auto& component : model.components) {
        for (const auto& instance : component->instances) {
            add_instance(*instance);
        }
        for (const auto& function : component->functions) {
            add(function->times.get(), sizeof *function->times);
        }
    }
    for (const auto& signal : model.signals) {
        add(&signal->value, sizeof signal->value);
        add(signal->cell.get(), sizeof *signal->cell);
        if (signal->port) {
            add(signal->port.get(), sizeof *signal->port);
            add(signal->port->data, signal->port->capacity);
        }
    }
    for (const auto& thread : model.threads) {
        for (const auto& pin : thread->pins) {
            add_pin(*pin);
        }
    }
    for (Core* const core : cores_) {
        if (const plan::Plan* const plan = core->plan()) {
            add(plan->image.get(), plan->image_size * sizeof(hal_value));
        }
    }
    for (Core* const core : cores_) {  // owners of faults that last
        add(core, sizeof *core);
        regions_.back().is_copied = false;
    }
    for (const plan::Memory& memory : session.threads().seen_by_components()) {
        add(memory.begin, memory.bytes);
    }
}

void MachineState::add_instance(const Instance& instance) {
    const hal_component* const plugin = instance.component->plugin;
    const bool is_module = instance.component->shares_pins || !instance.further.empty();
    if (is_module || instance.own_threads) {
        fail(fmt::format("'{}' ({}) has memory or threads that this program cannot copy",
                         instance.name, instance.component->name));
    }
    if (plugin) {
        add(instance.memory, plugin->instance_size, &instance);
        for (const MappedMemory::Range& part : memory_.variables_of(address_of(plugin))) {
            add(reinterpret_cast<const void*>(part.begin), part.end - part.begin, &instance);
        }
    }
    for (const Instance::Block& block : instance.blocks) {
        add(block.memory.get(), block.used, &instance);
    }
    for (const auto& pin : instance.pins) {
        add_pin(*pin);
    }
}

/// Pins of components are in the memory of their instance.
void MachineState::add_pin(const Pin& pin) {
    if (!region_of(reinterpret_cast<const char*>(pin.memory))) {
        add(pin.memory, sizeof *pin.memory, pin.instance);
    }
}

const MachineState::Region* MachineState::region_of(const char* byte) const {
    auto after = by_begin_.upper_bound(byte);
    if (after == by_begin_.begin()) return nullptr;
    const Region& region = regions_[(--after)->second];
    return byte < region.begin + region.bytes ? &region : nullptr;
}

void MachineState::add_segment(char* begin, const component_heap::Segment& segment) {
    regions_.push_back({.begin = begin,
                        .bytes = segment.used,
                        .is_grown = segment.number == component_heap::grown_segment});
}

/// Notes where the regions that exist in both processes have pointers to what is not copied.
void MachineState::note_own_pointers() {
    for (std::size_t i = 0; i < regions_.size(); ++i) {
        const Region& region = regions_[i];
        if (!region.is_copied || region.is_grown) continue;
        for (std::size_t at = 0; at + word_bytes <= region.bytes; at += word_bytes) {
            std::uint64_t word = 0;
            std::memcpy(&word, region.begin + at, sizeof word);
            Fixup fixup;
            if (fixup_of(word, fixup) && fixup.kind == own) {
                own_pointers_.try_emplace(word, static_cast<std::uint32_t>(i), at);
            }
        }
    }
}

/// Memory that was allocated in a cycle has no pointers of its own in the process that restores it.
/// Finds another one to the same object.
void MachineState::find_like(std::uint64_t word, Fixup& fixup) const {
    const auto found = own_pointers_.find(word);
    fixup.kind = none;
    if (found == own_pointers_.end()) return;
    fixup.kind = like;
    fixup.target = found->second.first;
    fixup.offset = found->second.second;
}

/// Returns false when the word is a plain number.
bool MachineState::fixup_of(std::uint64_t word, Fixup& fixup) const {
    if (component_heap::has(word) || !memory_.has(word)) return false;
    const auto* const byte = reinterpret_cast<const char*>(word);
    const Region* region = region_of(byte);
    if (!region && region_of(byte - 1)) {
        region = region_of(byte - 1);  // the end of an array
    }
    if (region) {
        fixup.kind = into_region;
        fixup.target = static_cast<std::uint32_t>(region - regions_.data());
        fixup.offset = static_cast<std::uint64_t>(byte - region->begin);
    } else if (const auto place = memory_.library_of(word)) {
        fixup.kind = into_library;
        fixup.target = static_cast<std::uint32_t>(place->library);
        fixup.offset = place->offset;
    } else {
        fixup.kind = own;
    }
    return true;
}

// --- writing ---

std::string MachineState::capture() {
    if (problem_.empty()) {
        problem_ = component_heap::problem([this](std::uint32_t id) { return function_named(id); });
    }
    if (!problem_.empty()) return "";
    const std::vector<component_heap::Segment> segments = component_heap::segments();
    for (const component_heap::Segment& segment : segments) {
        add_segment(segment.begin, segment);
    }
    note_own_pointers();
    std::string to;
    mcap::put(to, state_format);
    mcap::put(to, component_heap::heap_begin);
    const std::vector<std::string> libraries = memory_.libraries();
    mcap::put(to, static_cast<std::uint32_t>(libraries.size()));
    for (const std::string& name : libraries) {
        mcap::put_text(to, name);
    }
    mcap::put(to, static_cast<std::uint32_t>(fixed_));
    mcap::put(to, static_cast<std::uint32_t>(segments.size()));
    for (const component_heap::Segment& segment : segments) {
        mcap::put(to, segment.number);
        mcap::put(to, static_cast<std::uint64_t>(segment.used));
    }
    for (const Region& region : regions_) {
        put_region(to, region);
    }
    mcap::put(to, static_cast<std::uint32_t>(cores_.size()));
    for (Core* const core : cores_) {
        put_core(to, *core);
    }
    return to;
}

void MachineState::put_region(std::string& to, const Region& region) const {
    std::string content(region.begin, region.is_copied ? region.bytes : 0);
    std::string fixups;
    std::uint32_t count = 0;
    for (std::size_t at = 0; at + word_bytes <= content.size(); at += word_bytes) {
        std::uint64_t word = 0;
        std::memcpy(&word, &content[at], sizeof word);
        Fixup fixup{.word = static_cast<std::uint32_t>(at / word_bytes)};
        if (!fixup_of(word, fixup)) continue;
        if (fixup.kind == own && region.is_grown) {
            find_like(word, fixup);
        }
        word &= low_bytes;
        std::memcpy(&content[at], &word, sizeof word);
        mcap::put(fixups, fixup.word);
        mcap::put(fixups, static_cast<std::uint8_t>(fixup.kind));
        mcap::put(fixups, fixup.target);
        mcap::put(fixups, fixup.offset);
        ++count;
    }
    mcap::put_text(to, content);
    mcap::put(to, count);
    to += fixups;
}

void MachineState::put_core(std::string& to, Core& core) {
    const Core::Remains remains = core.remains();
    mcap::put(to, remains.writes);
    mcap::put(to, static_cast<std::uint64_t>(remains.sampled));
    for (const bool flag : {remains.safe, remains.in_budget, remains.passed, remains.stopped}) {
        mcap::put(to, static_cast<std::uint8_t>(flag));
    }
    mcap::put(to, remains.safe_number);
    mcap::put(to, static_cast<std::uint32_t>(remains.bad_outputs.size()));
    for (const bool bad : remains.bad_outputs) {
        mcap::put(to, static_cast<std::uint8_t>(bad));
    }
    const plan::Plan* const plan = core.plan();
    mcap::put(to, static_cast<std::uint32_t>(plan ? plan->imports.size() : 0));
    for (std::size_t i = 0; plan && i < plan->imports.size(); ++i) {
        const plan::Channel& channel = *plan->imports[i].channel;
        mcap::put(to, channel.published);
        const bool has_some = channel.history && !channel.history->entries.empty();
        mcap::put(to, static_cast<std::uint32_t>(has_some ? channel.history->entries.size() : 0));
        if (!has_some) continue;
        for (const auto& [sequence, values] : channel.history->entries) {
            mcap::put(to, sequence);
            mcap::put(to, static_cast<std::uint32_t>(values.size()));
            for (const hal_value& value : values) {
                mcap::put(to, value.raw);
            }
        }
    }
}

// --- reading ---

bool MachineState::restore(std::string_view bytes) {
    mcap::Fields from(bytes);
    const bool is_known = from.get<std::uint32_t>() == state_format &&
                          from.get<std::uint64_t>() == component_heap::heap_begin;
    if (!is_known) {
        return fail("another version of Halcyon has written it");
    }
    std::vector<std::string> libraries;
    for (auto count = from.get<std::uint32_t>(); count > 0 && from.good(); --count) {
        libraries.emplace_back(from.text());
    }
    const auto fixed = from.get<std::uint32_t>();
    if (!from.good() || fixed != fixed_) {
        return fail("it is of a machine with other instances or signals");
    }
    if (!problem_.empty() || !get_segments(from)) return false;
    for (const Region& region : regions_) {
        if (!get_region(from, region, libraries)) return false;
    }
    if (from.get<std::uint32_t>() != cores_.size()) {
        return fail("it is of a machine with other threads");
    }
    for (Core* const core : cores_) {
        if (!get_core(from, *core)) return false;
    }
    return from.good() || fail("it is damaged");
}

bool MachineState::get_segments(mcap::Fields& from) {
    for (auto count = from.get<std::uint32_t>(); count > 0 && from.good(); --count) {
        component_heap::Segment segment;
        segment.number = from.get<std::uint32_t>();
        segment.used = from.get<std::uint64_t>();
        char* const begin =
            segment.used <= from.left() ? component_heap::resized(segment) : nullptr;
        if (!begin) return fail("it is damaged, or there is not enough memory");
        add_segment(begin, segment);
    }
    return from.good() || fail("it is damaged");
}

bool MachineState::get_region(mcap::Fields& from, const Region& region,
                              const std::vector<std::string>& libraries) {
    std::string content(from.text());
    const std::size_t expected = region.is_copied ? region.bytes : 0;
    if (content.size() != expected) {
        return fail(fmt::format("{} has {} bytes in the place of {}", name_of(region), expected,
                                content.size()));
    }
    if (!set_pointers(from, region, content, libraries)) return false;
    std::memcpy(region.begin, content.data(), content.size());
    return true;
}

bool MachineState::set_pointers(mcap::Fields& from, const Region& region, std::string& content,
                                const std::vector<std::string>& libraries) {
    for (auto count = from.get<std::uint32_t>(); count > 0; --count) {
        const std::size_t at = from.get<std::uint32_t>() * word_bytes;
        const auto kind = from.get<std::uint8_t>();
        const auto target = from.get<std::uint32_t>();
        const auto offset = from.get<std::uint64_t>();
        if (!from.good() || at + word_bytes > content.size()) return fail("it is damaged");
        std::uint64_t before = 0;
        std::uint64_t stored = 0;
        std::memcpy(&before, region.begin + at, sizeof before);
        std::memcpy(&stored, &content[at], sizeof stored);
        const bool is_same = stored == (before & low_bytes) && !region.is_grown;
        if (is_same || kind == own) {  // as it was after the start
            std::memcpy(&content[at], &before, sizeof before);
            continue;
        }
        std::uint64_t word = 0;  // `none`
        if (kind == into_region) {
            const bool exists = target < regions_.size() && offset <= regions_[target].bytes;
            if (!exists) return fail("it is damaged");
            word = address_of(regions_[target].begin) + offset;
        } else if (kind == into_library && target < libraries.size()) {
            const std::uint64_t address = memory_.address_in(libraries[target], offset);
            word = address == 0 ? before : address;
        } else if (kind == like) {
            if (!has_word(target, offset)) return fail("it is damaged");
            std::memcpy(&word, regions_[target].begin + offset, sizeof word);
        }
        std::memcpy(&content[at], &word, sizeof word);
    }
    return true;
}

bool MachineState::has_word(std::uint32_t region, std::uint64_t offset) const {
    if (region >= regions_.size() || regions_[region].bytes < word_bytes) return false;
    return offset <= regions_[region].bytes - word_bytes;
}

bool MachineState::get_core(mcap::Fields& from, Core& core) {
    Core::Remains remains;
    remains.writes = from.get<std::uint64_t>();
    remains.sampled = from.get<std::uint64_t>();
    for (bool* const flag :
         {&remains.safe, &remains.in_budget, &remains.passed, &remains.stopped}) {
        *flag = from.get<std::uint8_t>() != 0;
    }
    remains.safe_number = from.get<std::uint64_t>();
    for (auto count = from.get<std::uint32_t>(); count > 0 && from.good(); --count) {
        remains.bad_outputs.push_back(from.get<std::uint8_t>() != 0);
    }
    core.set_remains(remains);
    plan::Plan* const plan = core.plan();
    const auto imports = from.get<std::uint32_t>();
    if (!from.good() || imports != (plan ? plan->imports.size() : 0)) {
        return fail("it is of a machine with other threads");
    }
    for (std::uint32_t i = 0; i < imports; ++i) {
        plan::Channel& channel = *plan->imports[i].channel;
        channel.published = from.get<std::uint64_t>();
        channel.history = std::make_unique<plan::Channel::History>();
        const auto entries = from.get<std::uint32_t>();
        if (entries > max_history) return fail("it is damaged");
        for (std::uint32_t k = 0; k < entries && from.good(); ++k) {
            const auto sequence = from.get<std::uint64_t>();
            if (from.get<std::uint32_t>() != channel.size) return fail("it is damaged");
            std::vector<hal_value> values(channel.size);
            for (hal_value& value : values) {
                value.raw = from.get<std::uint64_t>();
            }
            channel.history->entries.emplace_back(sequence, std::move(values));
        }
    }
    return true;
}

}  // namespace hal
