// SPDX-License-Identifier: MIT
#include "machine/run/running_model.hpp"

#include <algorithm>
#include <cstring>
#include <new>
#include <stdexcept>
#include <utility>

#include "base/keep.hpp"
#include "execute/process_setup.hpp"
#include "machine/load/construct.hpp"
#include "machine/report/crash.hpp"
#include "machine/run/acquisition.hpp"
#include "machine/run/state.hpp"

namespace hal {

namespace {

std::unique_ptr<Executor> make_executor(const SessionOptions& options) {
    if (options.schedule) return std::make_unique<Executor>(*options.schedule);
    return std::make_unique<Executor>(options.virtual_clock);
}

}  // namespace

SessionState::SessionState(SessionOptions o)
    : options(std::move(o)), plugins(options.plugin_path), executor(make_executor(options)) {
    if (options.sink) {
        executor->begin_journal();
    }
    if (options.sink || options.schedule) {
        setup.emplace(options.schedule);
    }
    if (!options.virtual_clock && !options.check_only) {
        refused = prepare_process();
    }
}

SessionState::~SessionState() = default;

void SessionState::offer_names(Diagnostics& diagnostics) {
    try {
        diagnostics.offer([this](std::uint32_t group) {
            return names.get(model, static_cast<NameGroup>(group), ending);
        });
    } catch (const std::bad_alloc&) {  // then no names are offered
    }
}

Failure SessionState::start(Instance& instance) {
    if (!options.sink) {
        return start_instance(instance, model, *executor, status, event_log.for_plugins());
    }
    const Acquisition acquisition;
    setup->begin_start(instance);
    Failure failure = start_instance(instance, model, *executor, status, event_log.for_plugins());
    OutsideWorld outside = acquisition.result();
    outside.streams = instance.streams.size();
    outside.remove_links(setup->take_acquired());
    outside.helpers = std::min(instance.helpers, outside.threads);
    outside.threads -= outside.helpers;
    if (failure.empty() && !outside.empty()) {
        options.sink->opened(instance.name, instance.component->name, outside);
    }
    return failure;
}

void SessionState::destroy(Instance& instance) {
    const auto raised = [this] {
        return executor ? executor->board().outside_cycle.load(std::memory_order_relaxed) : 0;
    };
    const std::uint64_t before = raised();
    destroy_instance(instance);
    if (raised() == before) return;
    failed_stops.push_back(instance.name);
}

void end_conditions(Executor& executor, const Instance& instance) {
    const auto* const first = static_cast<const char*>(instance.memory);
    const std::size_t size =
        instance.component->plugin ? instance.component->plugin->instance_size : 0;
    executor.board().end_all(first, first + size);
}

namespace {

/// hal_status::text; its data is the RunningModel.
std::size_t status_for_plugins(const hal_status* self, char* to, std::size_t capacity) {
    RunningModel& machine = *static_cast<RunningModel*>(self->data);
    const SessionLock lock = machine.try_lock();
    if (!lock) return 0;
    try {
        const std::string text = machine.reports().status_text();
        const std::size_t length = std::min(capacity, text.size());
        std::memcpy(to, text.data(), length);
        return length;
    } catch (const std::bad_alloc&) {
        return 0;
    }
}

}  // namespace

RunningModel::RunningModel(SessionOptions options)
    : state_(std::make_unique<SessionState>(std::move(options))),
      threads_(*state_),
      values_(*state_),
      reports_(state_->view, state_->faults, state_->options.name, state_->refused),
      host_(state_->model, state_->plugins) {
    state_->status.text = status_for_plugins;
    state_->status.data = this;
    state_->ending = end_token();
    if (state_->options.check_only) {
        watch_for_exits();
    } else {
        watch_for_crashes(state_->view);
    }
}

RunningModel::~RunningModel() {
    {
        const SessionLock held = lock();  // a thread of a component may read the status
        shut_down();
    }
    end_watch_for_crashes(state_->view);
    if (state_->life == SessionState::Life::abandoned) {
        keep_for_good(std::move(state_));
    } else if (ending()) {
        // The process ends: the kernel frees a hundred thousand objects at once.
        if (auto* const kept = new (std::nothrow) Model(std::move(state_->model))) {
            keep_for_good(std::unique_ptr<Model>(kept));
        }
    }
}

const SessionOptions& RunningModel::options() const { return state_->options; }
const Model& RunningModel::model() const { return state_->model; }
Probes& RunningModel::probes() { return state_->probes; }
EventLog& RunningModel::event_log() { return state_->event_log; }
Traces& RunningModel::traces() { return state_->traces; }
Absences& RunningModel::absences() { return state_->absences; }

Transaction RunningModel::begin() {
    state_->transaction.begin();
    return Transaction(*this);
}

void RunningModel::offer_names(Diagnostics& diagnostics) { state_->offer_names(diagnostics); }

void RunningModel::sweep_texts() noexcept {
    if (in_transaction() || state_->options.check_only || !sources.worth_sweeping()) return;
    try {
        std::vector<bool> in_use;
        state_->model.sweep(in_use);
        const std::uint32_t advance = threads().first_advance().source;
        if (advance >= in_use.size()) {
            in_use.resize(advance + 1);
        }
        in_use[advance] = true;
        sources.sweep(in_use);
    } catch (const std::bad_alloc&) {  // then it is done another time
    }
}

bool RunningModel::in_transaction() const { return state_->transaction.is_open(); }
void RunningModel::when_committed(std::function<void()> action) {
    if (in_transaction()) {
        state_->transaction.when_committed(std::move(action));
    }
}

const std::vector<std::string>& RunningModel::failed_stops() const { return state_->failed_stops; }

namespace {

/// Destroys all instances in the reverse order of their creation.
void destroy_instances(SessionState& state) {
    const auto& components = state.model.components;
    for (auto c = components.rbegin(); c != components.rend(); ++c) {
        for (auto i = (*c)->instances.rbegin(); i != (*c)->instances.rend(); ++i) {
            state.destroy(**i);
        }
    }
}

}  // namespace

void RunningModel::shut_down() {
    SessionState& s = *state_;
    if (s.life != SessionState::Life::running) return;
    s.life = SessionState::Life::shut;
    s.transaction.abandon();
    if (s.options.check_only) return destroy_instances(s);
    s.executor->end_rows();  // the cycles that follow compute nothing
    threads_.stop();
    // a function that hangs may still use its instance: leave everything as it is, and a watchdog
    // to its time-out
    if (!s.threads.end_all()) {
        s.life = SessionState::Life::abandoned;
        return;
    }
    threads_.disarm_watchdog();
    destroy_instances(s);
}

}  // namespace hal
