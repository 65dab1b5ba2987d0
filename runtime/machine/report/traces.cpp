// SPDX-License-Identifier: MIT
#include "machine/report/traces.hpp"

#include "execute/executor.hpp"
#include "machine/report/fault_log.hpp"
#include "machine/report/machine_view.hpp"
#include "model/model.hpp"

namespace hal {

std::string Traces::begin() {
    if (on_) return "another client traces this instance; wait for its end";
    if (machine_.executor.is_virtual()) {
        return "this instance runs on a virtual clock, whose cycles take no time; trace an "
               "instance of: hal run";
    }
    on_ = true;
    named_.clear();
    for (const auto& [thread, core] : machine_.cores) {
        start(*core);
    }
    return "";
}

void Traces::end() {
    if (!on_) return;
    on_ = false;
    for (const auto& [thread, core] : machine_.cores) {
        core->trace(nullptr);
    }
}

// A core that was made at the address of a removed one uses its ring: the old thread has ended.
void Traces::start(Core& core) {
    Ring*& ring = of_[&core];
    if (!ring) {
        ring = rings_.emplace_back(std::make_unique<Ring>()).get();
    }
    for (TraceEvent event; ring->ring.take(event);) {
    }  // of an earlier trace
    ring->lost = ring->ring.lost();
    core.trace(&ring->ring);
}

TraceBatch Traces::take(std::size_t max) {
    TraceBatch batch;
    if (!on_) return batch;
    for (const auto& owned : machine_.model.threads) {
        Core* const core = machine_.core(owned.get());
        if (!core) continue;
        if (!core->traced()) {
            start(*core);
        }
        Ring& ring = *of_.at(core);
        TraceBatch::Part part;
        for (TraceEvent event; part.events.size() < max && ring.ring.take(event);) {
            part.events.push_back(event);
            if (event.kind != TraceEvent::function || !named_.insert(event.id).second) continue;
            if (const LoadedFunction* const function = function_with_id(machine_.model, event.id)) {
                batch.names.emplace(event.id, function->name);
            }
        }
        const std::uint64_t lost = ring.ring.lost();
        part.lost = lost - ring.lost;
        ring.lost = lost;
        if (part.events.empty() && part.lost == 0) continue;
        part.thread = {owned->name, owned->options.period_ns, machine_.executor.tid(*core),
                       machine_.executor.granted(*core).cpu};
        batch.parts.push_back(std::move(part));
    }
    return batch;
}

}  // namespace hal
