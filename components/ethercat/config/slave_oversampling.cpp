// SPDX-License-Identifier: MIT
#include "ethercat/config/slave_oversampling.hpp"

#include <algorithm>

namespace hal::ethercat::config {

namespace {

/// Returns whether SYNC0 of a mode has the cycle of the master: the samples divide it further.
bool is_variable(const esi::OpMode& mode) {
    const bool whole_cycle = mode.sync0_factor == 1 || mode.sync0_factor == -1;
    return mode.sync0_cycle_ns == 0 && whole_cycle && mode.samples() <= 1;
}

std::string microseconds(std::int64_t ns) {
    std::string text = std::to_string(ns / 1000);
    if (const std::int64_t rest = ns % 1000; rest != 0) {
        text += "." + std::to_string(1000 + rest).substr(1);
    }
    return text;
}

}  // namespace

/// Returns the numbers of samples of a mode: the one it names, or what the PDOs allow that it
/// assigns.
SlaveOversampling::Range SlaveOversampling::range_of(const esi::OpMode& mode) const {
    if (!is_variable(mode)) {
        const unsigned samples = mode.samples();
        const bool fits = samples > 1 && mode.sync0_factor == -static_cast<int>(samples);
        return fits ? Range{samples, samples} : Range{};
    }
    Range range;
    for (const auto* pdos : {&device_->rx, &device_->tx}) {
        for (const esi::Pdo& pdo : *pdos) {
            const auto is_it = [&](const esi::OpMode::Assigned& one) {
                return one.pdo == pdo.index;
            };
            const bool assigned = mode.assigned.empty() ? pdo.sync_manager.has_value()
                                                        : std::any_of(mode.assigned.begin(),
                                                                      mode.assigned.end(), is_it);
            if (!assigned || !pdo.oversampling) continue;
            const unsigned last = range.last == 0 ? pdo.oversampling.max : range.last;
            range.first = std::max(range.first, pdo.oversampling.min);
            range.last = std::min(last, pdo.oversampling.max);
        }
    }
    return range;
}

const esi::OpMode* SlaveOversampling::mode_with(unsigned samples) const {
    const auto at =
        std::find_if(device_->op_modes.begin(), device_->op_modes.end(),
                     [&](const esi::OpMode& mode) { return range_of(mode).contains(samples); });
    return at == device_->op_modes.end() ? nullptr : &*at;
}

/// Returns the numbers of samples that the modes offer, as in "1..100" or "2".
std::vector<std::string> SlaveOversampling::offered() const {
    std::vector<Range> ranges;
    for (const esi::OpMode& mode : device_->op_modes) {
        const Range range = range_of(mode);
        const bool known = std::any_of(ranges.begin(), ranges.end(), [&](const Range& other) {
            return other.contains(range.first) && other.contains(range.last);
        });
        if (range.first <= range.last && !known) {
            ranges.push_back(range);
        }
    }
    std::vector<std::string> texts;
    for (const Range& range : ranges) {
        std::string text = std::to_string(range.first);
        if (range.last != range.first) {
            text += ".." + std::to_string(range.last);
        }
        texts.push_back(std::move(text));
    }
    return texts;
}

/// Reports a cycle that has no equal parts of whole nanoseconds. Returns whether it has.
bool SlaveOversampling::check_cycle(const Line& line, unsigned samples) {
    constexpr std::int64_t us = 1000;
    const std::int64_t cycle = in_.bus.setup.cycle_ns;
    if (cycle % samples == 0) return true;
    const std::int64_t next = (cycle / us + samples) / samples * samples;
    in_.report.error(Topic::value, line.value.at,
                     "the cycle of " + microseconds(cycle) + " us cannot be divided into " +
                         std::to_string(samples) + " samples of whole nanoseconds",
                     "write another number of samples, or a multiple of it as the cycle: cycle = " +
                         std::to_string(next) + "us");
    return false;
}

const esi::OpMode* SlaveOversampling::read(const esi::OpMode* mode) {
    const Line* line = in_.keys.find("oversampling");
    const Line* dc = in_.keys.find("dc");
    if (line == nullptr) {  // a mode that names its number of samples
        const Range range = mode != nullptr ? range_of(*mode) : Range{};
        const bool fixed = range.first > 1 && range.first == range.last;
        if (fixed && check_cycle(*dc, range.first)) {
            in_.slave.oversampling = range.first;
        }
        return mode;
    }
    unsigned samples = 1;
    const auto get = [&](SlaveInput&) -> unsigned& { return samples; };
    if (!in_.keys.read("oversampling", bus::number(get, 1, esi::max_samples), in_)) return mode;
    if (device_ == nullptr) {
        in_.report.error(Topic::value, line->key.at,
                         "'oversampling' needs a description of the device",
                         "write esi = FILE, or list the objects of all samples and write the cycle "
                         "of SYNC0, as in dc = sync0 and sync0-cycle = 100us");
        return mode;
    }
    const auto texts = offered();
    if (texts.empty()) {
        in_.report.error(Topic::value, line->key.at, "'" + in_.info.type + "' has no oversampling",
                         "delete the line");
        return mode;
    }
    const std::string count = counted(samples, "sample") + " per cycle";
    const esi::OpMode* const with = mode != nullptr ? mode : mode_with(samples);
    if (with == nullptr || mode_with(samples) == nullptr) {
        in_.report.error(Topic::value, line->value.at,
                         "'" + in_.info.type + "' does not offer " + count,
                         "the numbers of samples are: " + listed(texts));
        return mode;
    }
    if (!range_of(*with).contains(samples)) {
        in_.report.error(Topic::value, line->value.at,
                         "operation mode '" + with->name + "' of '" + in_.info.type +
                             "' does not offer " + count,
                         "write dc = " + mode_with(samples)->name + ", or delete the line dc");
        return mode;
    }
    if (const Line* sync0 = in_.keys.find("sync0-cycle")) {
        in_.report.error(Topic::value, sync0->key.at,
                         "the cycle of SYNC0 follows from 'oversampling'", "delete the line");
    }
    if (check_cycle(*line, samples)) {
        in_.slave.oversampling = samples;
    }
    return with;
}

master::Dc SlaveOversampling::clocks_of(const esi::OpMode& mode, std::int64_t cycle_ns,
                                        unsigned samples) {
    master::Dc dc;
    dc.assign_activate = mode.assign_activate;
    if (samples > 1) {
        dc.sync0_cycle_ns = cycle_ns / samples;
    } else if (mode.sync0_cycle_ns != 0) {
        dc.sync0_cycle_ns = mode.sync0_cycle_ns;
    } else if (mode.sync0_factor > 1) {
        dc.sync0_cycle_ns = cycle_ns * mode.sync0_factor;
    } else if (mode.sync0_factor < -1) {
        dc.sync0_cycle_ns = cycle_ns / -std::int64_t{mode.sync0_factor};
    }
    // After a SYNC1 the next SYNC0 counts, so that a SYNC1 in every n-th cycle of SYNC0 follows
    // n - 1 cycles after its SYNC0 (09A4h).
    const std::int64_t sync0 = dc.sync0_cycle_ns != 0 ? dc.sync0_cycle_ns : cycle_ns;
    if (mode.sync1_cycle_ns != 0) {
        dc.sync1_cycle_ns = mode.sync1_cycle_ns;
    } else if (mode.sync1_factor > 0) {
        dc.sync1_cycle_ns = sync0 * (mode.sync1_factor - 1);
    } else if (mode.sync1_factor < 0) {
        const std::int64_t every = cycle_ns / -std::int64_t{mode.sync1_factor};
        dc.sync1_cycle_ns = std::max<std::int64_t>(every - sync0, 0);
    }
    dc.sync0_shift_ns = mode.sync0_shift_ns;
    dc.sync1_shift_ns = mode.sync1_shift_ns;
    return dc;
}

/// Returns the description of a PDO with samples; nullptr: it has none.
const esi::Pdo* SlaveOversampling::described(const master::Pdo& pdo) const {
    const esi::Pdo* found = device_ != nullptr ? device_->find_pdo(pdo.index) : nullptr;
    return found != nullptr && found->oversampling ? found : nullptr;
}

void SlaveOversampling::expand() {
    const unsigned samples = in_.slave.oversampling;
    if (samples < 2) return;
    bool found = false;
    for (master::SyncManager& sm : in_.slave.sync_managers) {
        for (master::Pdo& pdo : sm.pdos) {
            const esi::Pdo* const of = described(pdo);
            if (of == nullptr) continue;
            found = true;
            std::vector<master::Entry> entries;
            for (unsigned n = 0; n < samples; ++n) {
                for (master::Entry entry : pdo.entries) {
                    if (entry.index != 0) {
                        entry.index = static_cast<std::uint16_t>(
                            entry.index + n * of->oversampling.index_increment);
                        entry.sample = static_cast<std::uint16_t>(n);
                    }
                    entries.push_back(std::move(entry));
                }
            }
            pdo.entries = std::move(entries);
            pdo.write_mapping = false;  // the device derives the samples from the length
        }
    }
    if (found) return;
    const Line* const line = in_.keys.find("oversampling");
    in_.report.error(Topic::object,
                     line != nullptr ? line->value.at : in_.keys.find("dc")->value.at,
                     "no PDO with samples is assigned to '" + in_.slave.name + "'",
                     "delete the lines inputs and outputs, or name a PDO with samples");
}

}  // namespace hal::ethercat::config
