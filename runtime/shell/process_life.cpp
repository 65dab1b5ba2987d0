// SPDX-License-Identifier: MIT
// What becomes of a program as a component: it comes, is ready, dies, is started again, leaves.
//
//   initializing -> ready -> (leaves: gone)
//                     |
//                     v  its connection or process ends without having left
//                   dead: pins keep their values, then take the declared ones; a program of the same name takes them over
#include <algorithm>
#include <csignal>
#include <cstring>
#include <ctime>

#include <sys/wait.h>

#include "session/session.hpp"
#include "shell/address.hpp"
#include "shell/processes.hpp"

namespace hal {
namespace {

std::int64_t steady_ns() { return std::chrono::steady_clock::now().time_since_epoch() / std::chrono::nanoseconds(1); }

std::string clock_text() {
    const std::time_t now = std::time(nullptr);
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

constexpr int give_up_ms = 3'600'000;

}  // namespace

std::string Processes::Entry::state() const {
    if (ready) return "ready";
    if (!dead()) return "initializing";
    return "dead " + obituary + (restart_ns != 0 ? ", starts again" : !restarts.empty() && child && !ended ? ", started again" : "");
}

bool Processes::has_pins(const Entry& entry) const {
    const LoadedComponent* const component = entry.name.empty() ? nullptr : session_.model().find_component(entry.name);
    return component && component->process != 0 && !component->instances.empty();
}

std::string Processes::announce(pid_t pid, const std::string& name, std::uint64_t owner, bool ready) {
    if (!good_instance_name(name)) return "'" + name + "' is no good name for a component";
    Entry* entry = find(name);
    if (entry && !entry->dead() && (entry->ready || entry->owner != 0)) return "a component '" + name + "' is there already";
    if (entry && entry->dead()) {
        // loadusr has entered the newcomer under a name of its own, because this one was taken: the two become one
        const auto fresh = std::find_if(entries_.begin(), entries_.end(), [&](const Entry& e) {
            return &e != entry && e.pid == pid && e.child && !e.ended && !e.ready && e.owner == 0;
        });
        if (fresh != entries_.end()) {
            if (!fresh->name.empty()) session_.remove_process(fresh->name);
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
        entry->declared = false;
        entry->stopping = false;
        entry->pins.clear();
        session_.set_process(name, pid);
    } else if (!entry) {
        if (session_.model().find_component(name) || session_.model().find_instance(name))
            return "a component '" + name + "' is there already";
        entry = find(pid);
        if (entry && entry->ready && owner == 0)
            return "process " + std::to_string(pid) + " is the component '" + entry->name + "' already";
        if (!entry || entry->ready || entry->owner != 0) entry = &entries_.emplace_back(Entry{.pid = pid});
        if (!entry->name.empty()) session_.remove_process(entry->name);
        entry->name = name;
        session_.add_process(name, pid, Command{});
    }
    entry->owner = owner;
    entry->timeout_ns = Entry{}.timeout_ns;
    set_ready(*entry, ready);
    return "";
}

Processes::Entry* Processes::owned(std::string_view name, std::uint64_t owner) {
    Entry* const entry = find(name);
    return entry && !entry->dead() && entry->owner == owner ? entry : nullptr;
}

void Processes::set_ready(Entry& entry, bool ready) {
    entry.ready = ready;
    if (const LoadedComponent* const component = ready ? session_.model().find_component(entry.name) : nullptr;
        component && !component->instances.empty()) {
        // of a dead program's pins those that its successor does not have go
        std::vector<Pin*> orphans;
        for (const auto& pin : component->instances.front()->pins)
            if (std::find(entry.pins.begin(), entry.pins.end(), pin.get()) == entry.pins.end()) orphans.push_back(pin.get());
        session_.remove_outside_pins(entry.name, orphans);
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
    session_.remove_process(entry.name);
    entry.name.clear();
    entry.pins.clear();
    entry.streams.clear();
    entry.ready = false;
    entry.owner = 0;
    if (!entry.child || entry.ended) std::erase_if(entries_, [&](const Entry& e) { return &e == &entry; });
    changed_.notify_all();
}

void Processes::forget(Entry& entry) {
    if (!entry.name.empty()) session_.remove_process(entry.name);
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
        if (has_pins(entry)) die(entry, "its connection ended");
        else if (!entry.child) forget(entry);
    }
}

void Processes::die(Entry& entry, const std::string& how) {
    entry.ready = false;
    entry.owner = 0;
    entry.pins.clear();
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
            if (has_pins(*entry) && !entry->dead()) die(*entry, ending(status));
            continue;
        }
        entry->ended = true;
        entry->status = status;
        const bool restarts = !ending_children_ && !entry->stopping &&
                              (entry->restart.when == Restart::always || (entry->restart.when == Restart::on_failure && status != 0));
        if (!has_pins(*entry) && !restarts) {
            forget(*entry);
            continue;
        }
        if (entry->waited) {  // its status is still to be collected: the component goes on as an entry of its own
            Entry component = *entry;
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
    }
    if (due == INT64_MAX) return -1;
    const std::int64_t left = due - steady_ns();
    return left <= 0 ? 0 : static_cast<int>(std::min<std::int64_t>((left + 999'999) / 1'000'000, give_up_ms));
}

void Processes::act_in_time() {
    const std::int64_t now = steady_ns();
    for (Entry& entry : entries_) {
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
            entry.child = true;
            if (entry.name.empty()) entry.dead_ns = 0;  // it had left in good order, and says its name anew
            else session_.set_process(entry.name, pid);
        }
    }
}

bool Processes::terminate(Entry& entry) {
    entry.stopping = true;
    entry.restart_ns = 0;
    if (entry.dead() && (entry.ended || !entry.child)) {
        forget(entry);
        return true;
    }
    return !entry.ended && kill(entry.pid, SIGTERM) == 0;
}

}  // namespace hal
