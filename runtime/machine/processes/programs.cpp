// SPDX-License-Identifier: MIT
#include "machine/processes/programs.hpp"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <csignal>
#include <fstream>
#include <poll.h>
#include <unistd.h>
#include <utility>

#include "execute/core.hpp"
#include "hal/system_log.hpp"
#include "machine/processes/address.hpp"
#include "machine/run/running_model.hpp"
#include "text/find_row.hpp"
#include "text/netlist_name.hpp"

namespace hal {
namespace {

constexpr std::int64_t stop_timeout_ns = 5'000'000'000;  // from SIGTERM to SIGKILL

using Process = ProgramEntry::Process;

std::string in_use_text(const ProgramEntry& entry) {
    return "the name '" + entry.name + "' is in use by process " + std::to_string(entry.pid) +
           " (" + entry.state() + ")";
}

/// Returns the process that started `pid`; 0 when it is unknown.
pid_t parent_of(pid_t pid) {
    std::ifstream file("/proc/" + std::to_string(pid) + "/stat");
    std::string text;
    std::getline(file, text);
    // the name, which is in parentheses, may contain blanks; the state and the parent follow
    const auto name_end = text.rfind(") ");
    pid_t parent = 0;
    if (name_end == text.npos || name_end + 4 > text.size()) return 0;
    std::from_chars(text.data() + name_end + 4, text.data() + text.size(), parent);
    return parent;
}

}  // namespace

Programs::Programs(RunningModel& machine, SessionState& state)
    : machine_(machine), model_(machine, state), children_(machine, *this) {}

Programs::~Programs() {
    {
        SessionLock lock = machine_.lock();
        const auto all_ended = [&] { return !any_child_runs(); };
        ending_children_ = true;
        signal_children(SIGTERM);
        changed_.wait_for(lock, std::chrono::seconds(2), all_ended);
        signal_children(SIGKILL);
        changed_.wait_for(lock, std::chrono::seconds(2), all_ended);
        children_.request_end();
    }
    children_.join();
}

bool Programs::any_child_runs() const { return std::ranges::any_of(entries_, &Entry::running); }

void Programs::signal_children(int signal) {
    for (const Entry& entry : entries_) {
        if (entry.running()) {
            kill(entry.pid, signal);
        }
    }
}

pid_t Programs::start(const ProcessStart& start, bool waited, std::string& problem) {
    const pid_t pid = spawn(start, problem);
    if (pid != 0) {
        entries_.push_back(
            {.number = ++numbers_, .pid = pid, .process = Process::running, .waited = waited});
    }
    return pid;
}

pid_t Programs::spawn(const ProcessStart& start, std::string& problem) {
    const pid_t pid = children_.start(start, problem);
    if (pid != 0) {
        std::erase_if(refusals_, [&](const auto& refusal) { return refusal.first == pid; });
    }
    return pid;
}

std::uint64_t Programs::add(pid_t pid, const std::string& name, const Command& command,
                            bool reserved) {
    Entry* const started = find(pid);
    if (!started || started->ended()) return 0;
    const std::uint64_t number = started->number;
    note_name(name);
    // its pins and links wait for the new program
    if (Entry* const entry = reserved ? find(name) : nullptr; entry && entry->dead()) {
        entry->number = number;
        entry->pid = pid;
        entry->process = Process::running;
        entry->started_as = name;
        entry->reserved = true;
        entry->stopping = false;
        entry->death()->restarted = true;
        entry->restarts = {};
        std::erase_if(entries_,
                      [&](const Entry& e) { return e.number == number && e.name.empty(); });
        model_.replace_process(name, pid);
        return number;
    }
    std::string unique = name;
    for (int i = 2; machine_.model().find_component(unique) || find(unique); ++i) {
        unique = name + "-" + std::to_string(i);
    }
    note_name(unique);
    started->name = unique;
    started->started_as = name;
    started->reserved = reserved;
    model_.add(unique, pid, command);
    return number;
}

Programs::Entry* Programs::find(std::string_view name) {
    if (name.empty()) return nullptr;
    return find_row(entries_, name, &Entry::name);
}

Programs::Entry* Programs::find(pid_t pid) {
    return find_row_if(entries_, [&](const Entry& e) { return e.pid == pid && !e.gone(); });
}

Programs::Entry* Programs::find_number(std::uint64_t number) {
    return find_row(entries_, number, &Entry::number);
}

Programs::Entry* Programs::find_started_as(std::string_view name) {
    Entry* found = nullptr;
    for (Entry& entry : entries_) {
        const bool lives = !entry.gone() || entry.restarts.due_ns != 0;
        if (lives && !entry.started_as.empty() && entry.started_as == name) {
            found = &entry;
        }
    }
    return found;
}

bool Programs::was_known(std::string_view name) const {
    return std::ranges::find(known_names_, name) != known_names_.end();
}

void Programs::note_name(const std::string& name) {
    if (was_known(name)) return;
    known_names_.push_front(name);
    if (known_names_.size() > max_known_names) {
        known_names_.pop_back();
    }
}

bool Programs::answers(std::uint64_t owner) const {
    return std::ranges::find(entries_, owner, &Entry::owner) != entries_.end();
}

std::string Programs::refusal_of(pid_t pid) const {
    const auto at = std::ranges::find(refusals_, pid, &std::pair<pid_t, std::string>::first);
    return at == refusals_.end() ? "" : at->second;
}

std::optional<int> Programs::ended_with(pid_t pid) const {
    const auto at = std::ranges::find(last_ends_, pid, &std::pair<pid_t, int>::first);
    return at == last_ends_.end() ? std::nullopt : std::optional(at->second);
}

std::vector<std::string> Programs::registered_by(pid_t pid) const {
    std::vector<std::string> all;
    for (const Entry& entry : entries_) {
        if (entry.pid == pid && entry.registered()) {
            all.push_back(entry.name);
        }
    }
    return all;
}

std::vector<std::string> Programs::names() const {
    std::vector<std::string> all;
    for (const Entry& entry : entries_) {
        if (!entry.name.empty()) {
            all.push_back(entry.name);
        }
    }
    return all;
}

void Programs::collect(pid_t pid) {
    std::erase_if(entries_, [&](const Entry& e) { return e.pid == pid && !e.dead(); });
}

void Programs::abandon(pid_t pid) {
    Entry* const entry = find(pid);
    if (!entry) return;
    entry->waited = false;
    if (entry->ended()) {
        collect(pid);
    }
}

// --- registration ---

bool Programs::runs_as_child(pid_t pid) const {
    return std::ranges::any_of(entries_,
                               [&](const Entry& e) { return e.pid == pid && e.running(); });
}

/// Remembers why the registration of a child is rejected, for the command that waits for it.
std::string Programs::reject(pid_t pid, std::string why) {
    if (runs_as_child(pid)) {
        refusals_.emplace_front(pid, why);
    }
    if (refusals_.size() > max_refusals) {
        refusals_.pop_back();
    }
    return why;
}

/// Returns why the process `pid` must not register under the name of the entry, or "".
std::string Programs::conflict_with(const Entry& entry, pid_t pid) const {
    if (entry.registered()) return in_use_text(entry);
    if (!entry.reserved || entry.ended() || entry.pid == pid) return "";
    // an earlier program must not take the name of the one that was just started
    const auto older = start_time(pid);
    if (older == 0 || older >= start_time(entry.pid)) return "";
    return "the name '" + entry.name + "' is reserved for process " + std::to_string(entry.pid) +
           ", which loadusr has started";
}

/// Returns the entry that loadusr made for the process under a name of its own, because its name
/// was a dead program's; nullptr: none.
Programs::Entry* Programs::find_newcomer(const Entry& dead, pid_t pid) {
    return find_row_if(entries_, [&](const Entry& e) {
        return &e != &dead && e.pid == pid && e.running() && !e.registered() && !e.reserved;
    });
}

/// The process takes over the component of a dead one. Returns its entry.
Programs::Entry& Programs::succeed(Entry& dead, pid_t pid) {
    const std::string name = dead.name;
    if (Entry* const newcomer = find_newcomer(dead, pid)) {
        // the two become one
        remove(*newcomer);
        dead.number = newcomer->number;
        dead.process = Process::running;
        dead.waited = newcomer->waited;
        dead.restarts.start = newcomer->restarts.start;
        dead.restarts.policy = newcomer->restarts.policy;
        std::erase_if(entries_, [&](const Entry& e) { return &e == newcomer; });
    } else if (dead.pid != pid) {
        dead.process = Process::foreign;
    }
    Entry& entry = *find(name);
    entry.pid = pid;
    entry.restarts.due_ns = 0;
    entry.stopping = false;
    entry.unregister();
    model_.replace_process(name, pid);
    return entry;
}

/// Makes the process a component of that name. `of_process`: its entry, if any, which becomes the
/// component unless it is one already.
Programs::Entry& Programs::enter(Entry* of_process, pid_t pid, const std::string& name) {
    Entry* entry = of_process;
    if (!entry || entry->registered() || entry->reserved) {
        entry = &entries_.emplace_back(Entry{.number = ++numbers_, .pid = pid});
    }
    remove(*entry);
    note_name(name);
    entry->name = name;
    model_.add(name, pid, Command{});
    return *entry;
}

std::string Programs::announce(pid_t pid, const std::string& name, std::uint64_t owner,
                               bool ready) {
    if (!good_instance_name(name)) {
        return "'" + shown_name(name) +
               "' is not a valid name for a component; use 1 to 64 letters, digits and - _ . with "
               "no . at the beginning";
    }
    Entry* entry = find(name);
    bool succeeds = false;
    if (entry) {
        std::string conflict = conflict_with(*entry, pid);
        if (!conflict.empty()) return reject(pid, std::move(conflict));
        if (entry->dead()) {
            entry = &succeed(*entry, pid);
            succeeds = true;
        }
    } else {
        if (machine_.model().find_component(name) || machine_.model().find_instance(name)) {
            return reject(pid, "the name '" + name + "' is in use by a component in the machine");
        }
        Entry* const of_process = find(pid);
        if (of_process && of_process->ready() && owner == 0) {
            return "process " + std::to_string(pid) + " is the component '" + of_process->name +
                   "' already";
        }
        entry = &enter(of_process, pid, name);
    }
    entry->owner = owner;
    entry->timeout_ns = Entry::usual_timeout_ns;
    entry->heartbeat = {};
    set_ready(*entry, ready);
    if (auto* const initializing = std::get_if<Entry::Initializing>(&entry->component)) {
        initializing->succeeds = succeeds;
    }
    return "";
}

Programs::Entry* Programs::owned(std::string_view name, std::uint64_t owner) {
    Entry* const entry = find(name);
    return entry && !entry->dead() && entry->owner == owner ? entry : nullptr;
}

void Programs::set_ready(Entry& entry, bool ready) {
    if (ready) {
        entry.component = Entry::Ready{};
        entry.reserved = false;
    } else if (entry.owner != 0) {
        entry.component = Entry::Initializing{.succeeds = entry.is_unready_successor()};
    } else {
        entry.component = Entry::Unregistered{};
    }
    note_alive(entry);
    if (ready && entry.heartbeat.every_ns != 0) {
        children_.wake();
    }
    if (ready) {
        // of a dead program's pins those that its successor does not have are removed
        model_.keep_pins(entry.name, entry.pins);
    }
    notify();
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

// --- the end of a component or of its process ---

void Programs::leave(Entry& entry) {
    if (entry.is_unready_successor() && !entry.stopping) {
        return die(entry, "it has ended before it was ready");  // another one may have the pins
    }
    remove(entry);
    entry.name.clear();
    entry.streams.clear();
    entry.reserved = false;
    entry.unregister();
    if (!entry.running()) {
        std::erase_if(entries_, [&](const Entry& e) { return &e == &entry; });
    }
    notify();
}

void Programs::remove(const Entry& entry) {
    if (!entry.name.empty()) {
        model_.remove(entry.name);
    }
}

void Programs::forget(Entry& entry) {
    remove(entry);
    entry.name.clear();
    entry.unregister();
    if (!entry.waited) {
        std::erase_if(entries_, [&](const Entry& e) { return &e == &entry; });
    }
    notify();
}

bool Programs::has_pins(const Entry& entry) const {
    return !entry.name.empty() && model_.instance_of(entry.name) != nullptr;
}

void Programs::withdraw(std::uint64_t owner) {
    stream_users_.release(owner);
    for (std::size_t i = entries_.size(); i-- > 0;) {
        Entry& entry = entries_[i];
        if (entry.owner != owner) continue;
        if (entry.stopping) {
            leave(entry);  // it was asked to end
        } else if (has_pins(entry)) {
            die(entry, "its connection ended");
        } else if (entry.process == Process::foreign) {
            forget(entry);
        } else {
            entry.owner = 0;
            entry.component = Entry::Unregistered{};
        }
    }
}

void Programs::die(Entry& entry, const std::string& how) {
    entry.die(monotonic_ns(), "since " + time_of_day() + " (" + how + ")");
    // the end of a child follows that of its connection, and has the reason
    if (!entry.running() && !entry.stopping && !ending_children_ && has_outputs(entry)) {
        report_death(entry, how);
    }
    children_.wake();
    notify();
}

bool Programs::has_outputs(const Entry& entry) const {
    const Instance* const instance = model_.instance_of(entry.name);
    return instance && std::ranges::any_of(instance->pins, [](const auto& pin) {
        return pin->dir == HAL_DIR_OUT || pin->dir == HAL_DIR_IO;
    });
}

/// Prints it, and adds it to the event log: what the outputs are linked to may move on.
void Programs::report_death(const Entry& entry, const std::string& how) {
    const std::string line = "component '" + entry.name + "' died (" + how +
                             "): its outputs keep their last values, or take those that it has "
                             "declared; see: show comp " +
                             entry.name;
    machine_.event_log().add("message", line);
    if (!prints_deaths_) return;
    const std::string printed = "hal: " + line + "\n";
    // the lock of the session is held: a terminal or pipe that takes nothing must not stop it
    pollfd terminal{STDERR_FILENO, POLLOUT, 0};
    const bool may_write = poll(&terminal, 1, 0) == 1 && (terminal.revents & POLLOUT) != 0;
    if (!may_write || !write_whole(STDERR_FILENO, printed)) {
        write_system_log("hal", printed);
    }
}

void Programs::child_ended(pid_t pid, int status) {
    last_ends_.emplace_front(pid, status);
    if (last_ends_.size() > max_last_ends) {
        last_ends_.pop_back();
    }
    for (std::size_t i = entries_.size(); i-- > 0;) {
        Entry& entry = entries_[i];
        if (entry.pid != pid) continue;
        if (entry.running()) {
            end_child(i, status);
        } else if (entry.process == Process::foreign) {
            end_component(entry, status);
        }
    }
}

/// The process of a second component of it has ended; the connection ends a moment earlier or
/// later.
void Programs::end_component(Entry& entry, int status) {
    constexpr std::int64_t between_ns = 1'000'000'000;
    const Entry::Dead* const dead = entry.death();
    const bool just_died = dead && monotonic_ns() - dead->since_ns < between_ns;
    if (entry.stopping) {
        leave(entry);
    } else if (has_pins(entry) && (!dead || just_died)) {
        die(entry, exit_text(status));
    }
}

void Programs::end_child(std::size_t index, int status) {
    Entry* entry = &entries_[index];
    entry->process = Process::ended;
    entry->status = status;
    entry->kill_ns = 0;
    const Restart when = entry->restarts.policy.when;
    const bool wanted = when == Restart::always || (when == Restart::on_failure && status != 0);
    const bool restarts = wanted && !ending_children_ && !entry->stopping;
    if (entry->stopping || (!has_pins(*entry) && !restarts)) return forget(*entry);
    // its status is still to be collected: the component goes on as an entry of its own
    if (entry->waited) {
        Entry component = *entry;
        component.number = ++numbers_;
        component.waited = false;
        entry->name.clear();
        entry->unregister();
        entry = &entries_.emplace_back(std::move(component));
    }
    die(*entry, exit_text(status));
    if (restarts) {
        schedule(*entry);
    }
}

void Programs::keep_alive(pid_t pid, const ProcessStart& start, const RestartPolicy& policy) {
    Entry* const entry = find(pid);
    if (!entry || policy.when == Restart::no) return;
    entry->restarts.start = start;
    entry->restarts.policy = policy;
}

std::string Programs::unload(Transaction& transaction, Entry& entry) {
    const bool lives = !entry.gone() && !entry.ended();
    if (lives && kill(entry.pid, 0) != 0 && errno == EPERM) {
        return "'" + entry.name + "' (process " + std::to_string(entry.pid) +
               ") belongs to another user and cannot be ended from here";
    }
    if (entry.gone()) {
        model_.remove_component(transaction, entry.name);
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
    entry.restarts.due_ns = 0;
    if (entry.gone()) {
        forget(entry);
        return true;
    }
    if (entry.ended() || kill(entry.pid, SIGTERM) != 0) return false;
    kill(entry.pid, SIGCONT);  // one that is stopped would never see it
    return true;
}

void Programs::give_up(Entry& entry) {
    const std::uint64_t number = entry.number;
    entry.kill_ns = monotonic_ns() + stop_timeout_ns;
    if (!terminate(entry)) return;
    // nullptr: it was dead and is forgotten
    if (Entry* const living = find_number(number); living && !living->dead()) {
        remove(*living);
        living->name.clear();
    }
    children_.wake();
    notify();
}

// --- what happens in time: heartbeat timeouts, declared values after a death, restarts, SIGKILL
// ---

void Programs::schedule(Entry& entry) {
    const std::int64_t now = monotonic_ns();
    std::vector<std::int64_t>& recent = entry.restarts.recent;
    std::erase_if(recent, [&](std::int64_t at) { return now - at > RestartPolicy::within_ns; });
    if (recent.size() >= RestartPolicy::max_restarts) {
        entry.death()->report += ", given up after " + std::to_string(RestartPolicy::max_restarts) +
                                 " restarts in " +
                                 format_duration(static_cast<double>(RestartPolicy::within_ns));
        return;
    }
    entry.restarts.due_ns = now + entry.restarts.policy.delay_ns;
    children_.wake();
}

std::int64_t Programs::next_due_ns() const {
    std::int64_t due = INT64_MAX;
    for (const Entry& entry : entries_) {
        due = std::min(due, entry.next_due_ns());
    }
    return due;
}

void Programs::set_rate(Entry& entry, std::int64_t every_ns) {
    entry.heartbeat.every_ns = every_ns;
    note_alive(entry);
    if (every_ns != 0) {
        children_.wake();
    }
}

void Programs::note_alive(Entry& entry) {
    Entry::Heartbeat& heartbeat = entry.heartbeat;
    if (heartbeat.every_ns == 0 && heartbeat.missing.empty()) return;
    heartbeat.last_ns = monotonic_ns();
    if (heartbeat.missing.empty()) return;
    heartbeat.missing.clear();
    machine_.values().write(std::exchange(heartbeat.before_timeout, {}));
    children_.wake();
    notify();
}

void Programs::time_out(Entry& entry) {
    Entry::Heartbeat& heartbeat = entry.heartbeat;
    heartbeat.missing = "since " + time_of_day(monotonic_ns() - heartbeat.last_ns);
    if (entry.timeout_ns >= 0) {
        std::vector<Pin*> pins;
        std::vector<std::pair<Pin*, hal_value>> declared;
        for (Pin* const pin : entry.pins) {
            if ((pin->flags & HAL_PIN_SAFE) && pin->dir != HAL_DIR_IN) {
                pins.push_back(pin);
                declared.emplace_back(pin, pin->safe);
            }
        }
        const auto values = machine_.values().peek(pins);
        for (std::size_t i = 0; i < pins.size(); ++i) {
            heartbeat.before_timeout.emplace_back(pins[i], values[i]);
        }
        machine_.values().write(declared);
    }
    // its end starts it again
    if (entry.restarts.policy.when != Restart::no && entry.running()) {
        kill(entry.pid, SIGKILL);
    }
    notify();
}

void Programs::apply_declared_values(Entry& entry) {
    entry.death()->declared = true;
    std::vector<std::pair<Pin*, hal_value>> values;
    if (has_pins(entry)) {
        for (const auto& pin : model_.instance_of(entry.name)->pins) {
            if (pin->flags & HAL_PIN_SAFE) {
                values.emplace_back(pin.get(), pin->safe);
            }
        }
    }
    machine_.values().write(values);
}

void Programs::start_again(Entry& entry, std::int64_t now_ns) {
    entry.restarts.due_ns = 0;
    std::string problem;
    const pid_t pid = spawn(entry.restarts.start, problem);
    if (pid == 0) {
        entry.death()->report += ", cannot be started again: " + problem;
        return;
    }
    entry.restarts.recent.push_back(now_ns);
    entry.pid = pid;
    entry.process = Process::running;
    // it had left in good order and registers its name again
    if (entry.name.empty()) {
        entry.component = Entry::Unregistered{};
    } else {
        entry.death()->restarted = true;
        model_.replace_process(entry.name, pid);
    }
}

bool Programs::awaits(pid_t pid) const {
    if (awaited_.empty()) return false;
    constexpr int max_generations = 32;
    for (int i = 0; i < max_generations && pid > 1; ++i, pid = parent_of(pid)) {
        if (std::find(awaited_.begin(), awaited_.end(), pid) != awaited_.end()) return true;
    }
    return false;
}

// What sleeps longer than it meant to was suspended as a whole, and the programs' signs of life
// wait to be read.
void Programs::act_in_time(std::int64_t overslept_ns) {
    constexpr std::int64_t suspended_ns = 200'000'000;
    const std::int64_t now = monotonic_ns();
    const auto is_due = [&](std::int64_t time) { return time != 0 && now >= time; };
    for (Entry& entry : entries_) {
        Entry::Heartbeat& heartbeat = entry.heartbeat;
        if (overslept_ns > suspended_ns && heartbeat.every_ns != 0) {
            heartbeat.last_ns = std::max(heartbeat.last_ns, now - heartbeat.every_ns);
        }
        if (is_due(entry.heartbeat_due_ns())) {
            time_out(entry);
        }
        if (is_due(entry.kill_ns)) {
            entry.kill_ns = 0;
            if (!entry.ended()) {
                kill(entry.pid, SIGKILL);
            }
        }
        if (is_due(entry.declared_due_ns())) {
            apply_declared_values(entry);
        }
        if (is_due(entry.restarts.due_ns)) {
            start_again(entry, now);
        }
    }
}

}  // namespace hal
