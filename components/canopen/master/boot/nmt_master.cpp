// SPDX-License-Identifier: MIT
#include "nmt_master.hpp"

#include <algorithm>
#include <climits>
#include <stdexcept>

#include "boot_node.hpp"

namespace hal::canopen {

Master::Master(const MasterSetup& setup, FrameQueue& out, MasterEvents& events)
    : setup_(setup), out_(out), events_(events), network_(out, *this, setup.sdo) {
    if (const auto problems = problems_of(setup_); !problems.empty()) {
        throw std::invalid_argument(problems.front());
    }
    for (const auto& n : setup_.nodes) {
        nodes_.push_back(std::make_unique<Node>(n, network_.add(n.id), *this));
        by_id_[n.id] = nodes_.back().get();
        if (n.mandatory) {
            ++status_.mandatory;
        }
        if (n.keep_alive) {
            keeps_some_ = true;
        }
    }
    status_.nodes = static_cast<std::uint16_t>(nodes_.size());
    commands_.resize(4 * nodes_.size() + 16);
}
Master::~Master() = default;

const NodeStatus& Master::status(std::uint8_t id) const noexcept {
    static constexpr NodeStatus unknown{.result = BootResult::not_listed};
    return id < by_id_.size() && by_id_[id] != nullptr ? by_id_[id]->status : unknown;
}
const NodeSetup* Master::setup(std::uint8_t id) const noexcept {
    return id < by_id_.size() && by_id_[id] != nullptr ? &by_id_[id]->setup : nullptr;
}

std::size_t Master::max_task_memory() const noexcept {
    std::size_t used = 0;
    for (const auto& n : nodes_) {
        used = std::max(used, n->max_task_memory());
    }
    return used;
}

void Master::start(Time now) noexcept {
    now_ = now;
    status_.resets = 0;
    status_.begun = now;
    halted_ = false;
    for (auto& n : nodes_) {
        n->removed = false;
        n->status.result = BootResult::none;
    }
    boot_all(setup_.reset_at_start);
}

void Master::boot_all(bool reset) noexcept {
    auto how = reset ? BootStart::reset : BootStart::in_unknown_state;
    status_.operational_since = 0;
    started_together_ = false;
    was_operational_ = false;
    commands_waiting_ = 0;
    if (how == BootStart::reset && !keeps_some_) {
        send(NmtCommand::reset_communication, 0);
        how = BootStart::was_reset;
    }
    for (auto& n : nodes_) {
        if (!n->removed) {
            n->leave(Step::queued, Cause::none);
        }
    }
    set_state(NetworkState::booting, 0);
    own_state(NmtState::pre_operational);
    for (auto& n : nodes_) {
        if (!n->removed) {
            n->begin(how);
        }
    }
}

void Master::halt(NetworkState state, std::uint8_t because_of) noexcept {
    halted_ = true;
    commands_waiting_ = 0;
    send(NmtCommand::stop, 0);
    for (auto& n : nodes_) {
        if (!n->removed && n->setup.id != because_of) {
            n->leave(Step::stopped, because_of == 0 ? Cause::commanded : Cause::network);
        }
    }
    if (because_of != 0) {
        by_id_[because_of]->leave(Step::failed, Cause::none);
    }
    set_state(state, because_of);
    own_state(NmtState::pre_operational);
}

void Master::reset_all(std::uint8_t because_of) noexcept {
    if (status_.resets >= setup_.resets) return halt(NetworkState::failed, because_of);
    ++status_.resets;
    boot_all(true);
}

void Master::stop(Time now) noexcept {
    now_ = now;
    halt(NetworkState::stopped, 0);
}

void Master::stand_by(Time now) noexcept {
    now_ = now;
    halted_ = true;
    commands_waiting_ = 0;
    for (auto& n : nodes_) {
        n->leave(Step::off, Cause::none);
    }
    set_state(NetworkState::off, 0);
    if (dirty_) {
        update();
    }
}

bool Master::command(NmtCommand command, std::uint8_t id, Time now) noexcept {
    now_ = now;
    if (id != 0) {
        if (setup(id) == nullptr) return false;
        by_id_[id]->command(command, false);
        return true;
    }
    send(command, 0);
    halted_ = false;
    for (auto& n : nodes_) {
        if (!n->removed) {
            n->command(command, true);
        }
    }
    return true;
}

bool Master::restart(std::uint8_t id, Time now) noexcept {
    now_ = now;
    if (setup(id) == nullptr) return false;
    auto& node = *by_id_[id];
    node.removed = false;
    node.leave(Step::queued, Cause::none);
    node.begin(BootStart::reset);
    if (halted_) {
        halted_ = false;
        set_state(NetworkState::booting, 0);
    }
    dirty_ = true;
    return true;
}

bool Master::remove(std::uint8_t id, Time now) noexcept {
    now_ = now;
    if (setup(id) == nullptr) return false;
    auto& node = *by_id_[id];
    send(NmtCommand::stop, id);
    node.removed = true;
    node.leave(Step::off, Cause::commanded);
    dirty_ = true;
    return true;
}

bool Master::handle(const Frame& f, Time now) noexcept {
    now_ = now;
    if (!f.is_standard()) return false;
    if (f.id == 0) {
        if (f.remote) return false;
        if (f.length == 2) {
            on_foreign_command(f.data[0], f.data[1]);
        }
        return true;
    }
    auto* node = by_id_[f.id & 0x7f];
    if (node == nullptr) return network_.handle(f, now);
    const auto service = f.id >> 7;
    if (service == 0x580 >> 7) {
        node->on_sdo_frame(f);
        return network_.handle(f, now);
    }
    auto* remote = network_.node(node->setup.id);
    const auto wrong = remote->wrong_toggles();
    if (!network_.handle(f, now)) return false;
    node->refresh();
    if (service == 0x700 >> 7 && !f.remote && f.length >= 1 && remote->wrong_toggles() == wrong) {
        node->on_heartbeat(f.data[0] == 0);
    }
    return true;
}

void Master::on_foreign_command(std::uint8_t command, std::uint8_t id) noexcept {
    ++status_.foreign_commands;
    for (auto& n : nodes_) {
        if (id == 0 || n->setup.id == id) {
            n->on_foreign_command(command);
        }
    }
}

void Master::poll(Time now) noexcept {
    now_ = now;
    network_.poll(now);
    for (auto& n : nodes_) {
        n->poll();
    }
    schedule();
    if (dirty_) {
        update();
    }
    send_commands();
    polled_ = now;
}

void Master::on_node(std::uint8_t id, NodeEvent event, NmtState state, Time now) noexcept {
    events_.on_node(id, event, state, now);
    if (auto* n = by_id_[id & 0x7f]) {
        n->on_event(event);
    }
}
void Master::on_emergency(std::uint8_t id, const Emergency& e) noexcept {
    events_.on_emergency(id, e);
}

/// CiA 302-2, figure 2: starts the nodes that are ready.
void Master::schedule() noexcept {
    if (ready_ == 0) return;
    if (setup_.start_all_at_once && !started_together_) return start_together();
    unsigned lowest = UINT_MAX;  // lowest start order that is not settled
    for (auto& n : nodes_) {
        if (!n->settled()) {
            lowest = std::min(lowest, n->setup.start_order);
        }
    }
    for (auto& n : nodes_) {
        if (n->status.step == Step::ready && n->setup.start_order <= lowest) {
            n->start(false);
        }
    }
}

/// Starts all nodes that are ready as soon as no other node is waited for: by one command, unless
/// that would start a node that is not to be started.
void Master::start_together() noexcept {
    bool by_one_command = true;
    for (auto& n : nodes_) {
        if (n->removed) continue;
        const Step step = n->status.step;
        const bool is_ready = step == Step::ready;
        if (!is_ready && (n->setup.mandatory || n->booting() || step == Step::queued)) return;
        const bool may_be_started = is_ready ? n->setup.start : n->missing || step == Step::running;
        by_one_command = by_one_command && may_be_started;
    }
    started_together_ = true;
    if (by_one_command && !send(NmtCommand::start, 0)) return;
    for (auto& n : nodes_) {
        if (n->status.step == Step::ready) {
            n->start(by_one_command);
        }
    }
}

void Master::count_nodes() noexcept {
    const auto count = [](std::uint16_t& nodes, bool counts) {
        if (counts) {
            ++nodes;
        }
    };
    auto& s = status_;
    s.operational = s.mandatory_operational = s.booting = s.failed = s.mandatory = 0;
    for (auto& n : nodes_) {
        if (n->removed) continue;
        const bool operational = n->status.operational;
        const bool mandatory = n->setup.mandatory;
        count(s.operational, operational);
        count(s.booting, n->booting() || n->status.step == Step::queued);
        count(s.failed, n->has_failed());
        count(s.mandatory, mandatory);
        count(s.mandatory_operational, mandatory && operational);
    }
}

/// Returns the mandatory node that prevents the network from being operational: one that failed
/// before one that boots; 0: none.
std::uint8_t Master::find_culprit() const noexcept {
    std::uint8_t booting = 0;
    for (const auto& n : nodes_) {
        if (n->removed || !n->setup.mandatory || n->status.operational) continue;
        if (n->has_failed()) return n->status.id;
        if (booting == 0) {
            booting = n->status.id;
        }
    }
    return booting;
}

void Master::update() noexcept {
    dirty_ = false;
    count_nodes();
    if (halted_ || status_.state == NetworkState::off) return;
    if (status_.mandatory_operational != status_.mandatory) {
        return set_state(was_operational_ ? NetworkState::degraded : NetworkState::booting,
                         find_culprit());
    }
    if (status_.state != NetworkState::operational) {
        status_.operational_since = now_;
    }
    was_operational_ = true;
    set_state(NetworkState::operational, 0);
    own_state(NmtState::operational);
}

void Master::set_state(NetworkState state, std::uint8_t node) noexcept {
    status_.node = node;
    if (state == status_.state) return;
    status_.state = state;
    dirty_ = true;
    events_.on_network(status_);
}

void Master::own_state(NmtState state) noexcept {
    if (!setup_.start_self || state == own_state_) return;
    own_state_ = state;
    events_.on_own_state(state);
}

bool Master::send(NmtCommand command, std::uint8_t id) noexcept {
    if (commands_waiting_ == commands_.size()) return false;
    commands_[commands_waiting_++] = {command, id};
    send_commands();
    return true;
}

void Master::send_commands() noexcept {
    std::size_t sent = 0;
    while (sent < commands_waiting_ &&
           (!commanded_ || setup_.nmt_inhibit == 0 || now_ - last_command_ >= setup_.nmt_inhibit)) {
        if (!network_.command(commands_[sent].command, commands_[sent].id)) break;
        ++sent;
        commanded_ = true;
        last_command_ = now_;
    }
    if (sent == 0) return;
    std::copy(commands_.begin() + static_cast<std::ptrdiff_t>(sent),
              commands_.begin() + static_cast<std::ptrdiff_t>(commands_waiting_),
              commands_.begin());
    commands_waiting_ -= sent;
}

std::string Master::sentence(std::uint8_t id) const {
    const auto* n = setup(id);
    return n != nullptr ? canopen::sentence(*n, status(id))
                        : "node " + std::to_string(id) + " is not in the configuration";
}
std::string Master::sentence() const {
    return canopen::sentence(setup_, status_, status(status_.node));
}

}  // namespace hal::canopen
