// SPDX-License-Identifier: MIT
// What becomes of a program as a component: it comes, is ready, dies, is started again, leaves.
//
//   initializing -> ready <-> not responding (within a declared rate): its outputs have their declared values
//                     |
//                     +--> gone: it leaves, or ends when it was asked to
//                     v    its connection or process ends without having left
//                   dead: pins keep their values, then take the declared ones; a program of the same name takes them over
#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <unordered_set>
#include <utility>

#include <sys/wait.h>

#include "execute/core.hpp"
#include "machine/address.hpp"
#include "machine/programs.hpp"
#include "machine/session.hpp"

namespace hal {
namespace {

std::string ending(int status) {
    if (status <= 128) return "exit status " + std::to_string(status);
    const char* const name = sigabbrev_np(status - 128);
    return name ? std::string("SIG") + name : "signal " + std::to_string(status - 128);
}

constexpr std::int64_t stop_ns = 5'000'000'000;

}  // namespace

std::string Programs::Entry::state() const {
    if (!dead()) {
        return std::string(!ready                 ? "initializing"
                           : unresponsive.empty() ? "ready"
                                                  : "not responding " + unresponsive) +
               (stopping ? ", stopping" : "");
    }
    return "dead " + end_report +
           (restart_ns != 0   ? ", starts again"
            : again && !ended ? ", started again"
                              : "");
}

std::string Programs::name_in_use(const Entry& entry) const {
    return "the name '" + entry.name + "' is in use by process " + std::to_string(entry.pid) +
           " (" + entry.state() + ")";
}

std::string Programs::announce(pid_t pid, const std::string& name, std::uint64_t owner,
                               bool ready) {
    if (!good_instance_name(name)) return "'" + name + "' is not a valid name for a component";
    Entry* entry = find(name);
    const auto refuse = [&](std::string why) {
        const bool child = std::any_of(entries_.begin(), entries_.end(), [&](const Entry& e) {
            return e.pid == pid && e.child && !e.ended;
        });
        if (child) {
            refusals_.emplace_front(pid, why);
        }
        if (refusals_.size() > most_refusals) {
            refusals_.pop_back();
        }
        return why;
    };
    if (entry && !entry->dead() && (entry->ready || entry->owner != 0)) {
        return refuse(name_in_use(*entry));
    }
    if (entry && entry->reserved && !entry->ended && entry->pid != pid) {
        // an earlier program must not take the name of the one that was just started
        const auto older = start_time(pid);
        const auto newer = start_time(entry->pid);
        if (older != 0 && older < newer) {
            return refuse("the name '" + name + "' is reserved for process " +
                          std::to_string(entry->pid) + ", which loadusr has started");
        }
    }
    if (entry && entry->dead()) {
        // loadusr has entered the newcomer under a name of its own, because this one was taken: the
        // two become one
        const auto fresh = std::find_if(entries_.begin(), entries_.end(), [&](const Entry& e) {
            return &e != entry && e.pid == pid && e.child && !e.ended && !e.ready && e.owner == 0 &&
                   !e.reserved;
        });
        if (fresh != entries_.end()) {
            if (!fresh->name.empty()) {
                remove_from_model(fresh->name);
            }
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
        if (session_.model().find_component(name) || session_.model().find_instance(name)) {
            return refuse("the name '" + name + "' is in use by a component in the machine");
        }
        entry = find(pid);
        if (entry && entry->ready && owner == 0) {
            return "process " + std::to_string(pid) + " is the component '" + entry->name +
                   "' already";
        }
        if (!entry || entry->ready || entry->owner != 0 || entry->reserved) {
            entry = &entries_.emplace_back(Entry{.number = ++numbers_, .pid = pid});
        }
        if (!entry->name.empty()) {
            remove_from_model(entry->name);
        }
        entry->name = name;
        add_to_model(name, pid, Command{});
    }
    entry->owner = owner;
    entry->timeout_ns = Entry::usual_timeout_ns;
    entry->every_ns = 0;
    entry->unresponsive.clear();
    entry->before_timeout.clear();
    set_ready(*entry, ready);
    return "";
}

Programs::Entry* Programs::owned(std::string_view name, std::uint64_t owner) {
    Entry* const entry = find(name);
    return entry && !entry->dead() && entry->owner == owner ? entry : nullptr;
}

void Programs::set_ready(Entry& entry, bool ready) {
    entry.ready = ready;
    note_alive(entry);
    if (ready) {
        entry.reserved = false;
    }
    if (ready && entry.every_ns != 0) {
        work();
    }
    if (const LoadedComponent* const component =
            ready ? session_.model().find_component(entry.name) : nullptr;
        component && !component->instances.empty()) {
        // of a dead program's pins those that its successor does not have go
        const std::unordered_set<const Pin*> kept(entry.pins.begin(), entry.pins.end());
        std::vector<Pin*> orphans;
        for (const auto& pin : component->instances.front()->pins) {
            if (!kept.contains(pin.get())) {
                orphans.push_back(pin.get());
            }
        }
        if (!orphans.empty()) {
            Transaction transaction = session_.begin();
            remove_pins(transaction, entry.name, orphans);
            Diagnostics refused;
            transaction.commit(refused);
        }
    }
    changed_.notify_all();
}

ProgramStream* Programs::find_stream(std::string_view name) {
    for (const Entry& entry : entries_) {
        for (const auto& stream : entry.streams) {
            if (stream->name == name) return stream.get();
        }
    }
    return nullptr;
}

std::vector<std::string> Programs::stream_names() const {
    std::vector<std::string> names;
    for (const Entry& entry : entries_) {
        for (const auto& stream : entry.streams) {
            names.push_back(stream->name);
        }
    }
    return names;
}

void Programs::leave(Entry& entry) {
    remove_from_model(entry.name);
    entry.name.clear();
    entry.pins.clear();
    entry.streams.clear();
    entry.ready = entry.reserved = false;
    entry.owner = 0;
    entry.every_ns = 0;
    entry.unresponsive.clear();
    entry.before_timeout.clear();
    if (!entry.child || entry.ended) {
        std::erase_if(entries_, [&](const Entry& e) { return &e == &entry; });
    }
    changed_.notify_all();
}

void Programs::forget(Entry& entry) {
    if (!entry.name.empty()) {
        remove_from_model(entry.name);
    }
    entry.name.clear();
    if (!entry.waited) {
        std::erase_if(entries_, [&](const Entry& e) { return &e == &entry; });
    }
    changed_.notify_all();
}

void Programs::withdraw(std::uint64_t owner) {
    for (std::size_t i = entries_.size(); i-- > 0;) {
        Entry& entry = entries_[i];
        if (entry.owner != owner) continue;
        entry.owner = 0;
        entry.ready = false;
        if (entry.stopping) {
            leave(entry);  // it was asked to end
        } else if (has_pins(entry)) {
            die(entry, "its connection ended");
        } else if (!entry.child) {
            forget(entry);
        }
    }
}

void Programs::die(Entry& entry, const std::string& how) {
    entry.ready = entry.again = entry.reserved = false;
    entry.owner = 0;
    entry.pins.clear();
    entry.every_ns = 0;
    entry.unresponsive.clear();
    entry.before_timeout.clear();
    if (!entry.dead()) {
        entry.dead_ns = monotonic_ns();
        entry.declared = false;
    }
    entry.end_report = "since " + time_of_day() + " (" + how + ")";
    work();
    changed_.notify_all();
}

void Programs::child_ended(pid_t pid, int status) {
    for (std::size_t i = entries_.size(); i-- > 0;) {
        Entry* entry = &entries_[i];
        if (entry->pid != pid || entry->ended) continue;
        // a second component of the same process; its connection may end a moment later
        if (!entry->child) {
            if (entry->stopping) {
                leave(*entry);
            } else if (has_pins(*entry) && !entry->dead()) {
                die(*entry, ending(status));
            }
            continue;
        }
        entry->ended = true;
        entry->status = status;
        entry->kill_ns = 0;
        const bool restarts = !ending_children_ && !entry->stopping &&
                              (entry->restart.when == Restart::always ||
                               (entry->restart.when == Restart::on_failure && status != 0));
        if (entry->stopping || (!has_pins(*entry) && !restarts)) {
            forget(*entry);
            continue;
        }
        // its status is still to be collected: the component goes on as an entry of its own
        if (entry->waited) {
            Entry component = *entry;
            component.number = ++numbers_;
            component.waited = false;
            entry->name.clear();
            entry->pins.clear();
            entry = &entries_.emplace_back(std::move(component));
        }
        die(*entry, ending(status));
        if (restarts) {
            schedule(*entry);
        }
    }
}

void Programs::keep_alive(pid_t pid, const ProcessStart& start, const RestartPolicy& policy) {
    Entry* const entry = find(pid);
    if (!entry || policy.when == Restart::no) return;
    entry->start = start;
    entry->restart = policy;
}

std::string Programs::unload(Transaction& transaction, Entry& entry) {
    const bool lives = !entry.ended && !(entry.dead() && !entry.child);
    if (lives && kill(entry.pid, 0) != 0 && errno == EPERM) {
        return "'" + entry.name + "' (process " + std::to_string(entry.pid) +
               ") belongs to another user and cannot be ended from here";
    }
    if (entry.dead() && (entry.ended || !entry.child)) {
        remove_component(transaction, entry.name);
    }
    transaction.when_committed([this, name = entry.name] {
        if (Entry* const there = find(name)) {
            terminate(*there);
        }
    });
    return "";
}

bool Programs::terminate(Entry& entry) {
    for (Entry& each : entries_) {
        if (each.pid == entry.pid) {
            each.stopping = true;  // the process may be several components
        }
    }
    entry.restart_ns = 0;
    if (entry.dead() && (entry.ended || !entry.child)) {
        forget(entry);
        return true;
    }
    if (entry.ended || kill(entry.pid, SIGTERM) != 0) return false;
    kill(entry.pid, SIGCONT);  // one that is stopped would never see it
    return true;
}

void Programs::give_up(Entry& entry) {
    entry.kill_ns = monotonic_ns() + stop_ns;
    if (!terminate(entry)) return;
    if (!entry.name.empty() && !entry.dead()) {
        remove_from_model(entry.name);
    }
    if (!entry.dead()) {
        entry.name.clear();
    }
    work();
    changed_.notify_all();
}

}  // namespace hal
