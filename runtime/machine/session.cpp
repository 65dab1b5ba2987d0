// SPDX-License-Identifier: MIT
#include "machine/session.hpp"

#include <algorithm>
#include <cstring>
#include <new>
#include <stdexcept>
#include <utility>

#include "base/keep.hpp"
#include "execute/process_setup.hpp"
#include "machine/construct.hpp"
#include "machine/crash.hpp"
#include "machine/programs.hpp"
#include "machine/state.hpp"

namespace hal {

SessionState::SessionState(SessionOptions o)
    : options(std::move(o)),
      plugins(options.plugin_path),
      executor(std::make_unique<Executor>(options.virtual_clock)) {
    if (!options.virtual_clock && !options.check_only) {
        refused = prepare_process();
    }
}

SessionState::~SessionState() = default;

namespace {

/// hal_status::text; its data is the Session.
std::size_t status_for_plugins(const hal_status* self, char* to, std::size_t room) {
    Session& session = *static_cast<Session*>(self->data);
    const SessionLock lock = session.try_lock();
    if (!lock) return 0;
    try {
        const std::string text = session.reports().status_text();
        const std::size_t length = std::min(room, text.size());
        std::memcpy(to, text.data(), length);
        return length;
    } catch (const std::bad_alloc&) {
        return 0;
    }
}

}  // namespace

Session::Session(SessionOptions options)
    : state_(std::make_unique<SessionState>(std::move(options))),
      threads_(*state_),
      values_(*state_),
      reports_(*state_),
      host_(*state_),
      programs_(std::make_unique<Programs>(*this, *state_)) {
    state_->status.text = status_for_plugins;
    state_->status.data = this;
    state_->ending = end_token();
    if (state_->options.check_only) {
        watch_for_exits();
    } else {
        watch_for_crashes(state_.get());
    }
}

Session::~Session() {
    programs_.reset();
    shut_down();
    end_watch_for_crashes(state_.get());
    if (state_->abandoned) {
        keep_for_good(std::move(state_));
    } else if (ending()) {
        // The process ends: the kernel frees a hundred thousand objects at once.
        if (auto* const kept = new (std::nothrow) Model(std::move(state_->model))) {
            keep_for_good(std::unique_ptr<Model>(kept));
        }
    }
}

const SessionOptions& Session::options() const { return state_->options; }
const Model& Session::model() const { return state_->model; }
Probes& Session::probes() { return state_->probes; }
Journal& Session::journal() { return state_->journal; }
Traces& Session::traces() { return state_->traces; }
Absences& Session::absences() { return state_->absences; }

Transaction Session::begin() {
    if (state_->open) throw std::logic_error("a transaction is open already");
    state_->open = true;
    state_->commands = 0;
    return Transaction(*this);
}

void Session::offer_names(Diagnostics& diagnostics) { state_->offer_names(diagnostics); }

void Session::sweep_texts() noexcept {
    if (state_->open || state_->options.check_only || !sources.worth_sweeping()) return;
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

bool Session::in_transaction() const { return state_->open; }
void Session::when_committed(std::function<void()> action) {
    if (state_->open) {
        state_->when_committed.push_back(std::move(action));
    }
}

void Session::shut_down() {
    SessionState& s = *state_;
    if (s.shut) return;
    s.shut = true;
    s.when_committed.clear();
    s.needs_threads = false;
    if (s.edit) {
        s.withdraw();
    }
    if (s.options.check_only) {
        for (auto c = s.model.components.rbegin(); c != s.model.components.rend(); ++c) {
            for (auto i = (*c)->instances.rbegin(); i != (*c)->instances.rend(); ++i) {
                destroy_instance(**i);
            }
        }
        return;
    }
    threads_.stop();
    bool all_ended = true;
    for (const auto& [thread, core] : s.cores) {
        if (s.executor->remove(*core, answer_timeout_ns)) continue;
        s.executor->abandon(*core);
        all_ended = false;
    }
    // a function that hangs may still use its instance: leave everything as it is, and a watchdog
    // to its time-out
    if (!all_ended) {
        s.abandoned = true;
        return;
    }
    s.cores.clear();
    threads_.disarm_watchdog();
    for (auto c = s.model.components.rbegin(); c != s.model.components.rend(); ++c) {
        for (auto i = (*c)->instances.rbegin(); i != (*c)->instances.rend(); ++i) {
            destroy_instance(**i);
        }
    }
}

}  // namespace hal
