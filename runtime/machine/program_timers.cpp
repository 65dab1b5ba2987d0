// SPDX-License-Identifier: MIT
// What happens to programs in time: heartbeat timeouts, declared values after a death, restarts,
// SIGKILL.
#include <algorithm>
#include <csignal>
#include <ctime>
#include <utility>

#include "execute/core.hpp"
#include "machine/programs.hpp"
#include "machine/session.hpp"

namespace hal {

std::string time_of_day(std::int64_t ago_ns) {
    const std::time_t now = std::time(nullptr) - static_cast<std::time_t>(ago_ns / 1'000'000'000);
    std::tm parts{};
    char text[16];
    if (!localtime_r(&now, &parts) || std::strftime(text, sizeof text, "%H:%M:%S", &parts) == 0) {
        return "?";
    }
    return text;
}

namespace {

constexpr int longest_sleep_ms = 3'600'000;

}  // namespace

void Programs::schedule(Entry& entry) {
    const std::int64_t now = monotonic_ns();
    std::erase_if(entry.restarts,
                  [&](std::int64_t at) { return now - at > RestartPolicy::within_ns; });
    if (entry.restarts.size() >= RestartPolicy::most) {
        entry.end_report += ", given up after " + std::to_string(RestartPolicy::most) +
                            " restarts in " +
                            format_duration(static_cast<double>(RestartPolicy::within_ns));
        return;
    }
    entry.restart_ns = now + entry.restart.delay_ns;
    work();
}

int Programs::sleep_ms() const {
    std::int64_t due = INT64_MAX;
    for (const Entry& entry : entries_) {
        if (entry.dead() && !entry.declared && entry.timeout_ns >= 0) {
            due = std::min(due, entry.dead_ns + entry.timeout_ns);
        }
        if (entry.restart_ns != 0) {
            due = std::min(due, entry.restart_ns);
        }
        if (entry.kill_ns != 0) {
            due = std::min(due, entry.kill_ns);
        }
        if (entry.responds() && entry.every_ns != 0) {
            due = std::min(due, entry.due_ns());
        }
    }
    if (due == INT64_MAX) return -1;
    const std::int64_t left = due - monotonic_ns();
    return left <= 0 ? 0
                     : static_cast<int>(
                           std::min<std::int64_t>((left + 999'999) / 1'000'000, longest_sleep_ms));
}

void Programs::set_rate(Entry& entry, std::int64_t every_ns) {
    entry.every_ns = every_ns;
    note_alive(entry);
    if (every_ns != 0) {
        work();
    }
}

void Programs::note_alive(Entry& entry) {
    if (entry.every_ns == 0 && entry.unresponsive.empty()) return;
    entry.alive_ns = monotonic_ns();
    if (entry.unresponsive.empty()) return;
    entry.unresponsive.clear();
    session_.values().write(std::exchange(entry.before_timeout, {}));
    work();
    changed_.notify_all();
}

void Programs::time_out(Entry& entry) {
    entry.unresponsive = "since " + time_of_day(monotonic_ns() - entry.alive_ns);
    if (entry.timeout_ns >= 0) {
        std::vector<Pin*> pins;
        std::vector<std::pair<Pin*, hal_value>> declared;
        for (Pin* const pin : entry.pins) {
            if ((pin->flags & HAL_PIN_SAFE) && pin->dir != HAL_DIR_IN) {
                pins.push_back(pin);
                declared.emplace_back(pin, pin->safe);
            }
        }
        const auto values = session_.values().peek(pins);
        for (std::size_t i = 0; i < pins.size(); ++i) {
            entry.before_timeout.emplace_back(pins[i], values[i]);
        }
        session_.values().write(declared);
    }
    // its end starts it again
    if (entry.restart.when != Restart::no && entry.child && !entry.ended) {
        kill(entry.pid, SIGKILL);
    }
    changed_.notify_all();
}

// What sleeps longer than it meant to was suspended as a whole, and the programs' signs of life
// wait to be read.
void Programs::act_in_time(std::int64_t overslept_ns) {
    constexpr std::int64_t suspended_ns = 200'000'000;
    const std::int64_t now = monotonic_ns();
    for (Entry& entry : entries_) {
        if (overslept_ns > suspended_ns && entry.every_ns != 0) {
            entry.alive_ns = std::max(entry.alive_ns, now - entry.every_ns);
        }
        if (entry.responds() && entry.every_ns != 0 && now >= entry.due_ns()) {
            time_out(entry);
        }
        if (entry.kill_ns != 0 && now >= entry.kill_ns) {
            entry.kill_ns = 0;
            if (!entry.ended) {
                kill(entry.pid, SIGKILL);
            }
        }
        if (entry.dead() && !entry.declared && entry.timeout_ns >= 0 &&
            now >= entry.dead_ns + entry.timeout_ns) {
            entry.declared = true;
            std::vector<std::pair<Pin*, hal_value>> values;
            if (has_pins(entry)) {
                for (const auto& pin :
                     session_.model().find_component(entry.name)->instances.front()->pins) {
                    if (pin->flags & HAL_PIN_SAFE) {
                        values.emplace_back(pin.get(), pin->safe);
                    }
                }
            }
            session_.values().write(values);
        }
        if (entry.restart_ns != 0 && now >= entry.restart_ns) {
            entry.restart_ns = 0;
            std::string problem;
            const pid_t pid = spawn(entry.start, problem);
            if (pid == 0) {
                entry.end_report += ", cannot be started again: " + problem;
                continue;
            }
            entry.restarts.push_back(now);
            entry.pid = pid;
            entry.ended = false;
            entry.child = entry.again = true;
            // it had left in good order and registers its name again
            if (entry.name.empty()) {
                entry.dead_ns = 0;
            } else {
                replace_in_model(entry.name, pid);
            }
        }
    }
}

}  // namespace hal
