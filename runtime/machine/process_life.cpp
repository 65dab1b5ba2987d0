// SPDX-License-Identifier: MIT
// What becomes of a program as a component: it comes, is ready, dies, is started again, leaves.
//
//   initializing -> ready <-> not responding (within a declared rate): its outputs have their declared values
//                     |
//                     +--> gone: it leaves, or ends when it was told to
//                     v    its connection or process ends without having left
//                   dead: pins keep their values, then take the declared ones; a program of the same name takes them over
#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <ctime>
#include <unordered_set>
#include <utility>

#include <sys/wait.h>

#include "machine/session.hpp"
#include "machine/address.hpp"
#include "machine/processes.hpp"

namespace hal {
namespace {

std::int64_t steady_ns() { return std::chrono::steady_clock::now().time_since_epoch() / std::chrono::nanoseconds(1); }

/// The time of day so long ago.
std::string clock_text(std::int64_t ago_ns = 0) {
    const std::time_t now = std::time(nullptr) - static_cast<std::time_t>(ago_ns / 1'000'000'000);
    std::tm parts{};
    char text[16];
    if (!localtime_r(&now, &parts) || std::strftime(text, sizeof text, "%H:%M:%S", &parts) == 0) return "?";
    return text;
}

std::string ending(int status) {
    if (status <= 128) return "exit status " + std::to_string(status);
    const char* const name = sigabbrev_np(status - 128);
    return name ? std::string("SIG") + name : "signal " + std::to_string(status - 128);
}

constexpr int longest_sleep_ms = 3'600'000;
constexpr std::int64_t stop_ns = 5'000'000'000;

}  // namespace

std::string Processes::Entry::state() const {
    if (!dead())
        return std::string(!ready            ? "initializing"
                           : silence.empty() ? "ready"
                                             : "not responding " + silence) +
               (stopping ? ", stopping" : "");
    return "dead " + obituary + (restart_ns != 0 ? ", starts again" : again && !ended ? ", started again" : "");
}

bool Processes::has_pins(const Entry& entry) const {
    const LoadedComponent* const component = entry.name.empty() ? nullptr : session_.model().find_component(entry.name);
    return component && component->process != 0 && !component->instances.empty();
}

void Processes::add_to_model(const std::string& name, pid_t pid, const Command& command) {
    Transaction transaction = session_.begin();
    session_.add_process(transaction, name, pid, command);
    Diagnostics none;
    transaction.commit(none);
}

void Processes::replace_in_model(std::string_view name, pid_t pid) {
    Transaction transaction = session_.begin();
    session_.set_process(transaction, name, pid);
    Diagnostics none;
    transaction.commit(none);
}

void Processes::remove_from_model(std::string_view name) {
    Transaction transaction = session_.begin();
    session_.remove_process(transaction, name);
    Diagnostics refused;
    if (!transaction.commit(refused)) session_.disown_process(name);
}

std::string Processes::name_in_use(const Entry& entry) const {
    return "the name '" + entry.name + "' is in use by process " + std::to_string(entry.pid) + " (" + entry.state() + ")";
}

std::string Processes::announce(pid_t pid, const std::string& name, std::uint64_t owner, bool ready) {
    if (!good_instance_name(name)) return "'" + name + "' is not a valid name for a component";
    Entry* entry = find(name);
    const auto refuse = [&](std::string why) {
        const bool child =
            std::any_of(entries_.begin(), entries_.end(), [&](const Entry& e) { return e.pid == pid && e.child && !e.ended; });
        if (child) refusals_.emplace_front(pid, why);
        if (refusals_.size() > most_refusals) refusals_.pop_back();
        return why;
    };
    if (entry && !entry->dead() && (entry->ready || entry->owner != 0)) return refuse(name_in_use(*entry));
    if (entry && entry->reserved && !entry->ended && entry->pid != pid) {
        // a program from before must not come back in the place of the one that has just been started
        const auto older = start_time(pid), newer = start_time(entry->pid);
        if (older != 0 && older < newer)
            return refuse("the name '" + name + "' is reserved for process " + std::to_string(entry->pid) + ", which loadusr has started");
    }
    if (entry && entry->dead()) {
        // loadusr has entered the newcomer under a name of its own, because this one was taken: the two become one
        const auto fresh = std::find_if(entries_.begin(), entries_.end(), [&](const Entry& e) {
            return &e != entry && e.pid == pid && e.child && !e.ended && !e.ready && e.owner == 0 && !e.reserved;
        });
        if (fresh != entries_.end()) {
            if (!fresh->name.empty()) remove_from_model(fresh->name);
            entry->number = fresh->number;
            entry->child = true;
            entry->waited = fresh->waited;
            entry->ended = false;
            entry->start = fresh->start;
            entry->restart = fresh->restart;
            entries_.erase(fresh);
            entry = find(name);
        } else if (entry->pid != pid) {
            entry->child = false;
        }
        entry->pid = pid;
        entry->dead_ns = entry->restart_ns = 0;
        entry->declared = entry->again = entry->stopping = false;
        entry->pins.clear();
        replace_in_model(name, pid);
    } else if (!entry) {
        if (session_.model().find_component(name) || session_.model().find_instance(name))
            return refuse("the name '" + name + "' is in use by a component in the machine");
        entry = find(pid);
        if (entry && entry->ready && owner == 0)
            return "process " + std::to_string(pid) + " is the component '" + entry->name + "' already";
        if (!entry || entry->ready || entry->owner != 0 || entry->reserved)
            entry = &entries_.emplace_back(Entry{.number = ++numbers_, .pid = pid});
        if (!entry->name.empty()) remove_from_model(entry->name);
        entry->name = name;
        add_to_model(name, pid, Command{});
    }
    entry->owner = owner;
    entry->timeout_ns = Entry::usual_timeout_ns;
    entry->every_ns = 0;
    entry->silence.clear();
    entry->before_silence.clear();
    set_ready(*entry, ready);
    return "";
}

Processes::Entry* Processes::owned(std::string_view name, std::uint64_t owner) {
    Entry* const entry = find(name);
    return entry && !entry->dead() && entry->owner == owner ? entry : nullptr;
}

void Processes::set_ready(Entry& entry, bool ready) {
    entry.ready = ready;
    hear(entry);
    if (ready) entry.reserved = false;
    if (ready && entry.every_ns != 0) work();
    if (const LoadedComponent* const component = ready ? session_.model().find_component(entry.name) : nullptr;
        component && !component->instances.empty()) {
        // of a dead program's pins those that its successor does not have go
        const std::unordered_set<const Pin*> kept(entry.pins.begin(), entry.pins.end());
        std::vector<Pin*> orphans;
        for (const auto& pin : component->instances.front()->pins)
            if (!kept.contains(pin.get())) orphans.push_back(pin.get());
        if (!orphans.empty()) {
            Transaction transaction = session_.begin();
            session_.remove_outside_pins(transaction, entry.name, orphans);
            Diagnostics refused;
            transaction.commit(refused);
        }
    }
    changed_.notify_all();
}

ProgramStream* Processes::find_stream(std::string_view name) {
    for (const Entry& entry : entries_)
        for (const auto& stream : entry.streams)
            if (stream->name == name) return stream.get();
    return nullptr;
}

std::vector<std::string> Processes::stream_names() const {
    std::vector<std::string> names;
    for (const Entry& entry : entries_)
        for (const auto& stream : entry.streams) names.push_back(stream->name);
    return names;
}

void Processes::leave(Entry& entry) {
    remove_from_model(entry.name);
    entry.name.clear();
    entry.pins.clear();
    entry.streams.clear();
    entry.ready = entry.reserved = false;
    entry.owner = 0;
    entry.every_ns = 0;
    entry.silence.clear();
    entry.before_silence.clear();
    if (!entry.child || entry.ended) std::erase_if(entries_, [&](const Entry& e) { return &e == &entry; });
    changed_.notify_all();
}

void Processes::forget(Entry& entry) {
    if (!entry.name.empty()) remove_from_model(entry.name);
    entry.name.clear();
    if (!entry.waited) std::erase_if(entries_, [&](const Entry& e) { return &e == &entry; });
    changed_.notify_all();
}

void Processes::withdraw(std::uint64_t owner) {
    for (std::size_t i = entries_.size(); i-- > 0;) {
        Entry& entry = entries_[i];
        if (entry.owner != owner) continue;
        entry.owner = 0;
        entry.ready = false;
        if (entry.stopping) leave(entry);  // it was told to end, and does
        else if (has_pins(entry)) die(entry, "its connection ended");
        else if (!entry.child) forget(entry);
    }
}

void Processes::die(Entry& entry, const std::string& how) {
    entry.ready = entry.again = entry.reserved = false;
    entry.owner = 0;
    entry.pins.clear();
    entry.every_ns = 0;
    entry.silence.clear();
    entry.before_silence.clear();
    if (!entry.dead()) {
        entry.dead_ns = steady_ns();
        entry.declared = false;
    }
    entry.obituary = "since " + clock_text() + " (" + how + ")";
    work();
    changed_.notify_all();
}

void Processes::child_ended(pid_t pid, int status) {
    for (std::size_t i = entries_.size(); i-- > 0;) {
        Entry* entry = &entries_[i];
        if (entry->pid != pid || entry->ended) continue;
        if (!entry->child) {  // a second component of the same process; its connection may end a moment later
            if (entry->stopping) leave(*entry);
            else if (has_pins(*entry) && !entry->dead()) die(*entry, ending(status));
            continue;
        }
        entry->ended = true;
        entry->status = status;
        entry->kill_ns = 0;
        const bool restarts = !ending_children_ && !entry->stopping &&
                              (entry->restart.when == Restart::always || (entry->restart.when == Restart::on_failure && status != 0));
        if (entry->stopping || (!has_pins(*entry) && !restarts)) {
            forget(*entry);
            continue;
        }
        if (entry->waited) {  // its status is still to be collected: the component goes on as an entry of its own
            Entry component = *entry;
            component.number = ++numbers_;
            component.waited = false;
            entry->name.clear();
            entry->pins.clear();
            entry = &entries_.emplace_back(std::move(component));
        }
        die(*entry, ending(status));
        if (restarts) schedule(*entry);
    }
}

void Processes::keep_alive(pid_t pid, const ProcessStart& start, const RestartPolicy& policy) {
    Entry* const entry = find(pid);
    if (!entry || policy.when == Restart::no) return;
    entry->start = start;
    entry->restart = policy;
}

void Processes::schedule(Entry& entry) {
    const std::int64_t now = steady_ns();
    std::erase_if(entry.restarts, [&](std::int64_t at) { return now - at > RestartPolicy::within_ns; });
    if (entry.restarts.size() >= RestartPolicy::most) {
        entry.obituary += ", given up after " + std::to_string(RestartPolicy::most) + " restarts in " +
                          format_duration(static_cast<double>(RestartPolicy::within_ns));
        return;
    }
    entry.restart_ns = now + entry.restart.delay_ns;
    work();
}

int Processes::sleep_ms() const {
    std::int64_t due = INT64_MAX;
    for (const Entry& entry : entries_) {
        if (entry.dead() && !entry.declared && entry.timeout_ns >= 0) due = std::min(due, entry.dead_ns + entry.timeout_ns);
        if (entry.restart_ns != 0) due = std::min(due, entry.restart_ns);
        if (entry.kill_ns != 0) due = std::min(due, entry.kill_ns);
        if (entry.responds() && entry.every_ns != 0) due = std::min(due, entry.due_ns());
    }
    if (due == INT64_MAX) return -1;
    const std::int64_t left = due - steady_ns();
    return left <= 0 ? 0 : static_cast<int>(std::min<std::int64_t>((left + 999'999) / 1'000'000, longest_sleep_ms));
}

void Processes::set_rate(Entry& entry, std::int64_t every_ns) {
    entry.every_ns = every_ns;
    hear(entry);
    if (every_ns != 0) work();
}

void Processes::hear(Entry& entry) {
    if (entry.every_ns == 0 && entry.silence.empty()) return;
    entry.heard_ns = steady_ns();
    if (entry.silence.empty()) return;
    entry.silence.clear();
    session_.write_outside(std::exchange(entry.before_silence, {}));
    work();
    changed_.notify_all();
}

void Processes::fall_silent(Entry& entry) {
    entry.silence = "since " + clock_text(steady_ns() - entry.heard_ns);
    if (entry.timeout_ns >= 0) {
        std::vector<Pin*> pins;
        std::vector<std::pair<Pin*, hal_value>> declared;
        for (Pin* const pin : entry.pins)
            if ((pin->flags & HAL_PIN_SAFE) && pin->dir != HAL_DIR_IN) pins.push_back(pin), declared.emplace_back(pin, pin->safe);
        const auto values = session_.peek_pins(pins);
        for (std::size_t i = 0; i < pins.size(); ++i) entry.before_silence.emplace_back(pins[i], values[i]);
        session_.write_outside(declared);
    }
    if (entry.restart.when != Restart::no && entry.child && !entry.ended) kill(entry.pid, SIGKILL);  // its end starts it again
    changed_.notify_all();
}

// What sleeps longer than it meant to was suspended as a whole, and the programs' signs of life wait to be read.
void Processes::act_in_time(std::int64_t overslept_ns) {
    constexpr std::int64_t suspended_ns = 200'000'000;
    const std::int64_t now = steady_ns();
    for (Entry& entry : entries_) {
        if (overslept_ns > suspended_ns && entry.every_ns != 0) entry.heard_ns = std::max(entry.heard_ns, now - entry.every_ns);
        if (entry.responds() && entry.every_ns != 0 && now >= entry.due_ns()) fall_silent(entry);
        if (entry.kill_ns != 0 && now >= entry.kill_ns) {
            entry.kill_ns = 0;
            if (!entry.ended) kill(entry.pid, SIGKILL);
        }
        if (entry.dead() && !entry.declared && entry.timeout_ns >= 0 && now >= entry.dead_ns + entry.timeout_ns) {
            entry.declared = true;
            std::vector<std::pair<Pin*, hal_value>> values;
            if (has_pins(entry))
                for (const auto& pin : session_.model().find_component(entry.name)->instances.front()->pins)
                    if (pin->flags & HAL_PIN_SAFE) values.emplace_back(pin.get(), pin->safe);
            session_.write_outside(values);
        }
        if (entry.restart_ns != 0 && now >= entry.restart_ns) {
            entry.restart_ns = 0;
            std::string problem;
            const pid_t pid = spawn(entry.start, problem);
            if (pid == 0) {
                entry.obituary += ", cannot be started again: " + problem;
                continue;
            }
            entry.restarts.push_back(now);
            entry.pid = pid;
            entry.ended = false;
            entry.child = entry.again = true;
            if (entry.name.empty()) entry.dead_ns = 0;  // it had left in good order, and says its name anew
            else replace_in_model(entry.name, pid);
        }
    }
}

std::string Processes::unload(Transaction& transaction, Entry& entry) {
    const bool lives = !entry.ended && !(entry.dead() && !entry.child);
    if (lives && kill(entry.pid, 0) != 0 && errno == EPERM)
        return "'" + entry.name + "' (process " + std::to_string(entry.pid) + ") belongs to another user and cannot be ended from here";
    if (entry.dead() && (entry.ended || !entry.child)) session_.remove_process(transaction, entry.name);
    transaction.when_committed([this, name = entry.name] {
        if (Entry* const there = find(name)) terminate(*there);
    });
    return "";
}

bool Processes::terminate(Entry& entry) {
    for (Entry& each : entries_)
        if (each.pid == entry.pid) each.stopping = true;  // the process may be several components
    entry.restart_ns = 0;
    if (entry.dead() && (entry.ended || !entry.child)) {
        forget(entry);
        return true;
    }
    if (entry.ended || kill(entry.pid, SIGTERM) != 0) return false;
    kill(entry.pid, SIGCONT);  // one that is stopped would never see it
    return true;
}

void Processes::give_up(Entry& entry) {
    entry.kill_ns = steady_ns() + stop_ns;
    if (!terminate(entry)) return;
    if (!entry.name.empty() && !entry.dead()) remove_from_model(entry.name);
    if (!entry.dead()) entry.name.clear();
    work();
    changed_.notify_all();
}

}  // namespace hal
