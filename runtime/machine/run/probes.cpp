// SPDX-License-Identifier: MIT
#include "machine/run/probes.hpp"

#include <algorithm>
#include <map>
#include <unordered_map>
#include <utility>

#include "hal/clock.hpp"
#include "machine/run/state.hpp"
#include "text/suggest.hpp"

namespace hal {

/// A group with its ring; without a thread it has none.
struct RingGroup {
    const Thread* thread = nullptr;
    std::vector<std::size_t> columns;
    std::shared_ptr<plan::ProbeRing> ring;
    // of a group without a thread:
    std::vector<std::uint64_t> first = {};  ///< the values when the probe was attached, until taken
    std::vector<std::uint64_t> last = {};  ///< the values of its newest row
    std::int64_t last_ns = 0;  ///< time of that row, or of `first`
    std::uint64_t reported = 0;  ///< lost rows that results have named
};

struct LiveProbe {
    ProbeRequest request;
    std::vector<ProbeColumn> columns;
    ProbeLayout layout;
    std::vector<RingGroup> groups;
    struct Ended {
        ProbeLayout layout;
        std::vector<RingGroup> groups;
    };
    /// layouts before this one, until their rows have been taken
    std::vector<Ended> ended;
    std::uint64_t announced = 1;  ///< the newest layout that a result has had
    std::uint64_t lost = 0;  ///< in rings that are gone
    std::int64_t until_ns = 0;
};

namespace {

constexpr std::int64_t patience_ns = 100'000'000;  // for a thread that does not finish its cycle

struct Place {
    const hal_value* from;
    const Thread* thread;  // nullptr: the session's own
};

// Where values are, or will be once all threads have taken their plans.
class Places {
public:
    Places(const Model& model, const Compiled* compiled) : model_(model), compiled_(compiled) {
        if (!compiled) return;
        for (const auto& [pin, thread] : compiled->homes) {
            homes_[pin] = thread;
        }
    }

    std::optional<Place> find(const ProbeColumn& column) const {
        if (const Pin* const pin = model_.find_pin(column.name)) {
            if (pin->type != column.type) return std::nullopt;
            if (pin->signal) return of(*pin->signal, home(*pin));
            return Place{compiled_ ? &pin->memory->own : pin->memory->slot, home(*pin)};
        }
        const Signal* const signal = model_.find_signal(column.name);
        if (!signal || signal->type != column.type) return std::nullopt;
        return of(*signal, nullptr);
    }

private:
    const Thread* home(const Pin& pin) const {
        const auto moved = homes_.find(&pin);
        return moved == homes_.end() ? pin.home : moved->second;
    }

    const Thread* fastest_thread() const {
        return model_.threads.empty() ? nullptr : model_.threads.front().get();
    }

    // The writer's slot; without a writer in a thread, a slot that a thread reads; a cell is seen
    // from any thread.
    Place of(const Signal& signal, const Thread* reader) const {
        const Compiled::Place* const next = compiled_ ? &compiled_->places[signal.index] : nullptr;
        const Thread* const owner = next ? next->home : signal.home;
        if (owner) {
            return {next ? next->slot : signal.slot, owner};
        }
        const auto& copies = next ? next->copies : signal.copies;
        if (const auto& cell = next ? next->cell : signal.cell) {
            if (reader) return {cell.get(), reader};
            return {cell.get(), copies.empty() ? fastest_thread() : copies.front().first};
        }
        if (!copies.empty()) {
            return {copies.front().second, copies.front().first};
        }
        return {&signal.value, nullptr};
    }

    const Model& model_;
    const Compiled* const compiled_;
    std::unordered_map<const Pin*, const Thread*> homes_;
};

// A bit's slot may hold anything in its other bytes.
std::uint64_t word(hal_type type, std::uint64_t raw) {
    switch (type) {
    case HAL_TYPE_BIT: return (raw & 0xff) != 0;
    case HAL_TYPE_S32:
        return static_cast<std::uint64_t>(std::int64_t{static_cast<std::int32_t>(raw)});
    case HAL_TYPE_U32: return raw & 0xffffffff;
    default: return raw;
    }
}

void append(std::string& bytes, std::uint64_t value) {
    for (int i = 0; i < 8; ++i) {
        bytes += static_cast<char>(value >> (8 * i));
    }
}

std::uint64_t lost_in(const std::vector<RingGroup>& groups) {
    std::uint64_t sum = 0;
    for (const RingGroup& group : groups) {
        if (group.ring) {
            sum += group.ring->lost();
        }
    }
    return sum;
}

std::size_t rows_for(const ProbeRequest& request, const Thread& thread) {
    if (request.buffer_rows > 0) return request.buffer_rows;
    const std::int64_t period = thread.options.period_ns * request.every;
    return static_cast<std::size_t>(
        std::max<std::int64_t>(request.buffer_ns / std::max<std::int64_t>(period, 1), 16));
}

struct Found {
    std::vector<RingGroup> groups;
    std::vector<std::vector<const hal_value*>> from;  // of each group
};

Found resolve(const Model& model, const Compiled* compiled, const LiveProbe& probe) {
    const Places places(model, compiled);
    Found found;
    std::map<const Thread*, std::size_t> at;
    for (std::size_t i = 0; i < probe.columns.size(); ++i) {
        const auto place = places.find(probe.columns[i]);
        if (!place) continue;
        const auto [entry, made] = at.try_emplace(place->thread, found.groups.size());
        if (made) {
            found.groups.emplace_back().thread = place->thread;
            found.from.emplace_back();
        }
        found.groups[entry->second].columns.push_back(i);
        found.from[entry->second].push_back(place->from);
    }
    return found;
}

ProbeLayout described(const LiveProbe& probe, std::uint64_t number) {
    ProbeLayout layout{number, {}};
    for (const RingGroup& group : probe.groups) {
        layout.groups.push_back(
            {group.thread ? group.thread->name : "",
             group.thread ? group.thread->options.period_ns * probe.request.every : 0,
             group.columns});
    }
    return layout;
}

bool same_groups(const std::vector<RingGroup>& a, const std::vector<RingGroup>& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                      [](const RingGroup& x, const RingGroup& y) {
        return x.thread == y.thread && x.columns == y.columns;
    });
}

// While threads and columns stay, so do the rings: an edit elsewhere costs no row.
void adopt(LiveProbe& probe, Found& found) {
    if (probe.layout.number != 0) {
        if (same_groups(probe.groups, found.groups)) return;
        probe.ended.push_back({std::move(probe.layout), std::move(probe.groups)});
    }
    for (RingGroup& group : found.groups) {
        if (group.thread) {
            group.ring = std::make_shared<plan::ProbeRing>(
                group.columns.size(), rows_for(probe.request, *group.thread), probe.request.every);
        }
    }
    const std::uint64_t number = probe.layout.number + 1;
    probe.groups = std::move(found.groups);
    probe.layout = described(probe, number);
}

}  // namespace

Probes::Probes(SessionState& state) : state_(state) {}
Probes::~Probes() = default;

const std::vector<ProbeColumn>& Probes::columns(const LiveProbe& probe) { return probe.columns; }
const ProbeLayout& Probes::layout(const LiveProbe& probe) { return probe.layout; }
std::uint64_t Probes::lost(const LiveProbe& probe) {
    std::uint64_t sum = probe.lost + lost_in(probe.groups);
    for (const auto& ended : probe.ended) {
        sum += lost_in(ended.groups);
    }
    return sum;
}

std::shared_ptr<LiveProbe> Probes::attach(const ProbeRequest& request, std::string& problem) {
    const Model& model = state_.model;
    const auto reject = [&](std::string sentence) {
        problem = std::move(sentence);
        return nullptr;
    };
    if (request.names.empty()) return reject("a probe needs at least one name");
    if (request.names.size() > max_names) {
        return reject(std::to_string(request.names.size()) + " values are more than the " +
                      std::to_string(max_names) + " that a probe can sample; name fewer");
    }
    auto probe = std::make_shared<LiveProbe>();
    probe->request = request;
    for (const std::string& name : request.names) {
        const Pin* const pin = model.find_pin(name);
        const Signal* const signal = pin ? nullptr : model.find_signal(name);
        if (!pin && !signal) {
            std::vector<std::string> all;
            for (const auto& [known, unused] : model.pin) {
                all.emplace_back(known);
            }
            for (const auto& [known, unused] : model.signal) {
                all.emplace_back(known);
            }
            std::sort(all.begin(), all.end());
            const std::string hint = did_you_mean(name, all);
            return reject("unknown pin, parameter or signal '" + name.substr(0, 60) + "'" +
                          (hint.empty() ? "" : "; " + hint));
        }
        const hal_type type = pin ? pin->type : signal->type;
        if (type == HAL_TYPE_PORT) {
            return reject("'" + name + "' is a port: a probe samples values, not bytes");
        }
        const Pin* const source = pin ? pin : signal->writer;
        probe->columns.push_back({name, type, source ? source->unit : ""});
    }
    Found found = resolve(model, nullptr, *probe);
    std::size_t bytes = 0;
    for (const RingGroup& group : found.groups) {
        if (group.thread) {
            bytes += 2 * rows_for(request, *group.thread) * (group.columns.size() + 2) *
                     8;  // rounded up to a power of two
        }
    }
    if (bytes > max_bytes) {
        return reject("the probe needs up to " + std::to_string(bytes >> 20) +
                      " MiB of memory, more than " + std::to_string(max_bytes >> 20) + "; " +
                      request.advice);
    }
    adopt(*probe, found);
    probe->until_ns = state_.executor->now_ns();
    for (RingGroup& group : probe->groups) {
        if (group.ring) continue;
        group.first = look_at(*probe, group);
        group.last_ns = probe->until_ns;
    }
    live_.push_back(probe);
    offer();
    return probe;
}

void Probes::detach(const std::shared_ptr<LiveProbe>& probe) {
    if (std::erase(live_, probe) != 0) {
        offer();
    }
}

// Between two plans: each thread takes a new set of probes.
void Probes::offer() {
    std::unordered_map<const Thread*, std::unique_ptr<plan::ProbeSet>> sets;
    for (const auto& [thread, plan] : state_.threads.plans()) {
        if (!plan || !state_.threads.core(thread)) continue;
        auto set = std::make_unique<plan::ProbeSet>();
        set->epoch = ++epoch_;
        sets[thread] = std::move(set);
    }
    for (const auto& probe : live_) {
        const Found found = resolve(state_.model, nullptr, *probe);
        // after an edit that a hung thread did not take
        if (probe->groups.empty() || !same_groups(probe->groups, found.groups)) continue;
        for (std::size_t i = 0; i < found.groups.size(); ++i) {
            if (const auto set = sets.find(found.groups[i].thread); set != sets.end()) {
                set->second->probes.push_back({probe->groups[i].ring, found.from[i]});
            }
        }
    }
    std::vector<std::pair<Core*, plan::ProbeSet*>> offers;
    for (const auto& [thread, set] : sets) {
        if (!set->probes.empty() || state_.threads.plans().at(thread)->probes) {
            offers.emplace_back(state_.threads.core(thread), set.get());
        }
    }
    const std::vector<Core*> silent = state_.executor->swap(offers, answer_timeout_ns);
    for (auto& [thread, set] : sets) {
        // it hangs and keeps the old one
        if (std::find(silent.begin(), silent.end(), state_.threads.core(thread)) != silent.end())
            continue;
        auto& kept = state_.threads.plans().at(thread)->probes;
        if (!set->probes.empty()) {
            kept = std::move(set);
        } else if (kept) {
            kept.reset();
        }
    }
}

void Probes::enter(Compiled& compiled) {
    if (live_.empty()) return;
    for (const auto& probe : live_) {
        Found found = resolve(state_.model, &compiled, *probe);
        adopt(*probe, found);
        for (std::size_t i = 0; i < probe->groups.size(); ++i) {
            const auto plan =
                std::find_if(compiled.plans.begin(), compiled.plans.end(),
                             [&](const auto& one) { return one.first == probe->groups[i].thread; });
            if (plan == compiled.plans.end()) continue;
            auto& set = plan->second->probes;
            if (!set) {
                set = std::make_unique<plan::ProbeSet>();
            }
            set->probes.push_back({probe->groups[i].ring, found.from[i]});
        }
    }
}

namespace {

// Appends the rows before `until_ns`, as many as fit.
std::size_t move_rows(const LiveProbe& probe, RingGroup& group, std::int64_t until_ns,
                      std::size_t max, std::string& bytes) {
    plan::ProbeRing& ring = *group.ring;
    const std::size_t size = ring.size();
    std::size_t rows = 0;
    for (; rows < size && bytes.size() < max; ++rows) {
        const std::uint64_t* const row = ring.row(rows);
        if (static_cast<std::int64_t>(row[1]) >= until_ns) break;
        append(bytes, row[0]);
        append(bytes, row[1]);
        for (std::size_t i = 2; i < ring.width; ++i) {
            append(bytes, word(probe.columns[group.columns[i - 2]].type, row[i]));
        }
    }
    ring.drop(rows);
    return rows;
}

// Appends the rows of all groups before `until_ns`, as many as fit. Returns the time before which no
// row remains.
std::int64_t collect(const LiveProbe& probe, std::vector<RingGroup>& groups, ProbeRows& to,
                     std::int64_t until_ns, std::size_t max) {
    std::int64_t reached_ns = until_ns;
    for (std::size_t i = 0; i < groups.size(); ++i) {
        RingGroup& group = groups[i];
        if (!group.ring) continue;
        // before the rows: a loss is named with or before the row after it
        const std::uint64_t lost = group.ring->lost();
        const std::size_t rows = move_rows(probe, group, until_ns, max, to.bytes);
        if (rows > 0 || lost > group.reported) {
            to.parts.push_back({i, rows, lost - std::exchange(group.reported, lost)});
        }
        if (group.ring->size() > 0) {
            reached_ns = std::min(reached_ns, static_cast<std::int64_t>(group.ring->row(0)[1]));
        }
    }
    return reached_ns;
}

// No rows before their layout, also of one that an edit has made and ended at once.
void announce(LiveProbe& probe, const ProbeLayout& layout, ProbeRows& rows) {
    rows.layout_number = layout.number;
    if (probe.announced == layout.number) return;
    rows.layout = layout;
    probe.announced = layout.number;
}

// Takes the rows of layouts before the present one. Returns whether all were taken.
bool take_ended(LiveProbe& probe, std::size_t max, std::vector<ProbeRows>& results) {
    while (!probe.ended.empty()) {
        LiveProbe::Ended& ended = probe.ended.front();
        ProbeRows rows;
        rows.until_ns = probe.until_ns;
        const bool all = collect(probe, ended.groups, rows, INT64_MAX, max) == INT64_MAX;
        if (!rows.parts.empty()) {
            announce(probe, ended.layout, rows);
            results.push_back(std::move(rows));
        }
        if (!all) return false;
        probe.lost += lost_in(ended.groups);
        probe.ended.erase(probe.ended.begin());
    }
    return true;
}

// Returns the time before which every thread has finished its cycles.
std::int64_t finished_until(const LiveProbe& probe, std::int64_t now_ns) {
    std::int64_t until_ns = INT64_MAX;
    for (const RingGroup& group : probe.groups) {
        if (group.ring) {
            until_ns = std::min(until_ns, std::max(group.ring->reached_ns(), now_ns - patience_ns));
        }
    }
    return until_ns == INT64_MAX ? now_ns : until_ns;
}

}  // namespace

std::vector<ProbeRows> Probes::take(LiveProbe& probe, std::size_t max, Rest rest) {
    std::vector<ProbeRows> results;
    const std::int64_t now_ns = state_.executor->now_ns();
    if (!take_ended(probe, max, results)) return results;
    ProbeRows rows;
    announce(probe, probe.layout, rows);
    const std::int64_t until_ns =
        rest == Rest::taken ? INT64_MAX : std::max(finished_until(probe, now_ns), probe.until_ns);
    const std::int64_t reached_ns = collect(probe, probe.groups, rows, until_ns, max);
    probe.until_ns = std::max(probe.until_ns, reached_ns == INT64_MAX ? now_ns : reached_ns);
    rows.until_ns = probe.until_ns;
    for (std::size_t i = 0; i < probe.groups.size(); ++i) {
        if (!probe.groups[i].ring) {
            take_values(probe, i, rows);
        }
    }
    results.push_back(std::move(rows));
    return results;
}

// A row for what the values were when the probe was attached, and one when they have changed.
void Probes::take_values(LiveProbe& probe, std::size_t number, ProbeRows& to) const {
    RingGroup& group = probe.groups[number];
    std::size_t rows = 0;
    const auto add = [&](std::vector<std::uint64_t> values, std::int64_t time_ns) {
        if (values.empty() || values == group.last) return;
        append(to.bytes, 0);
        append(to.bytes, static_cast<std::uint64_t>(time_ns));
        for (const std::uint64_t value : values) {
            append(to.bytes, value);
        }
        group.last = std::move(values);
        group.last_ns = time_ns;
        ++rows;
    };
    add(std::exchange(group.first, {}), group.last_ns);
    add(look_at(probe, group), std::max(to.until_ns - 1, group.last_ns));
    if (rows > 0) {
        to.parts.push_back({number, rows, 0});
    }
}

std::vector<std::uint64_t> Probes::look_at(const LiveProbe& probe, const RingGroup& group) const {
    std::vector<std::string> names;
    for (const std::size_t column : group.columns) {
        names.push_back(probe.columns[column].name);
    }
    const auto readings = LiveValues(state_).read(names);
    std::vector<std::uint64_t> values;
    for (std::size_t i = 0; i < names.size(); ++i) {
        const hal_type type = probe.columns[group.columns[i]].type;
        values.push_back(readings[i] ? word(type, readings[i]->value.raw) : 0);
    }
    return values;
}

}  // namespace hal
