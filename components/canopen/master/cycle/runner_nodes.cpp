// SPDX-License-Identifier: MIT
// Opens and closes the process data of nodes, detects foreign senders, and serves the boot in slow
// threads.
#include <algorithm>
#include <utility>

#include "hal/clock.hpp"
#include "runner.hpp"

namespace hal::canopen {

/// CiA 302-2: no process data is sent to a node before it is configured, and its own PDOs have an
/// unknown mapping until then. After a loss its outputs get their safe values until it is reset.
void Runner::open_and_close() noexcept {
    if (!std::exchange(steps_changed_, false)) return;
    for (std::size_t n = 0; n < statuses_.size(); ++n) {
        const NodeStatus& s = *statuses_[n];
        if (s.step >= Step::watching && s.step <= Step::running) {
            open_[n] = 1;
        } else if (s.step < Step::watching || s.cause == Cause::boot_up) {
            open_[n] = 0;
        }
        // One that is kept alive may be operational before we know.
        const bool asked =
            s.step == Step::queued || s.step == Step::identifying || s.step == Step::checking_state;
        if (config_.nodes[n].setup.keep_alive && ever_operational_[n] == 0 && asked) {
            open_[n] = 1;
        }
    }
    for (Output& out : outputs_) {
        out.open = std::any_of(
            out.sent->parts.begin(), out.sent->parts.end(),
            [&](const Sent::Part& part) { return open_[slots_[part.placed].node] != 0; });
        device_.pdos().hold_tpdo(out.sent->number, !out.open);
    }
    for (const Received& r : own_.received) {
        device_.pdos().hold_rpdo(r.number, open_[r.node] == 0);
    }
}

bool Runner::mandatory_are_configured() const noexcept {
    for (std::size_t n = 0; n < statuses_.size(); ++n) {
        if (const Step step = statuses_[n]->step; statuses_[n]->mandatory && step != Step::off &&
                                                  (step < Step::ready || step > Step::running)) {
            return false;
        }
    }
    return true;
}

/// Reports a foreign sender when it begins, and once per second while it continues.
void Runner::note_foreign(const can::Frame& f, Time now) noexcept {
    if (f.extended || f.error || f.remote || f.id >= ours_.size() || !ours_[f.id] ||
        now < foreign_from_) {
        return;
    }
    ForeignCount& c = foreign_[f.id];
    const bool begins = c.last == 0 || now - c.last > second;
    c.frames = begins ? 1 : c.frames + 1;
    c.last = now;
    if (!begins && now - c.sent < second) return;
    RunnerEvents::Foreign what{
        .id = static_cast<std::uint16_t>(f.id), .frames = c.frames, .begins = begins};
    std::copy_n(f.data.begin(), 2, what.data.begin());
    what.sync = produces_ && f.id == sync_frame_.id;
    what.rpdo = ours_to_nodes_[f.id];
    c.sent = now;
    c.frames = 0;
    events_.on_foreign(what);
}

/// A request to a node is followed by the next when it was answered: one in a cycle, when only
/// cycles look for answers. While the network boots and no set-point counts yet, a slow thread
/// looks for them for up to a quarter of its period. Not in time slots: nothing leaves during the
/// wait, and afterwards the slot of this cycle may have passed.
void Runner::serve_boot(Time now, Time period) noexcept {
    constexpr Time slow = 2 * millisecond;
    constexpr Time longest_wait = millisecond;
    constexpr unsigned most_vain_waits = 5;
    const NetworkStatus& network = master_.status();
    if (period < slow || !active() || network.state != NetworkState::booting ||
        network.booting == 0 || vain_waits_ >= most_vain_waits || link_->description().simulated ||
        link_->description().in_slots) {
        return;
    }
    const Time begun = monotonic_ns();
    bool any = false;
    for (Time at = begun, heard = begun; at - begun < period / 4 && at - heard < longest_wait;
         at = monotonic_ns()) {
        const Time then = now + (at - begun);
        if (take_frames(then) == 0) continue;
        any = true;
        heard = at;
        master_.poll(then);
        open_and_close();
        send(then);
    }
    vain_waits_ = any ? 0 : vain_waits_ + 1;
}

}  // namespace hal::canopen
