// SPDX-License-Identifier: MIT
#include <algorithm>
#include <map>

#include "link/timing.hpp"
#include "table.hpp"
#include "text/quoting.hpp"

namespace hal::scocan {

namespace {

class Check {
public:
    Check(const Table& table, text::Messages<Topic>& report) : t_(table), report_(report) {}

    void run() {
        if (t_.nodes.empty()) {
            return error({1, 1, 0, 0}, "the table has no node", "add nodes: node clock A sync");
        }
        roles();
        times();
        if (t_.modes.empty()) {
            return error({1, 1, 0, 0}, "the table has no mode", "add a line: mode 0 run");
        }
        if (!t_.has_mode(0)) {
            error(t_.modes.front().at, "mode 0 is missing: nodes start in it",
                  "number the first mode 0");
        }
        for (const Mode& m : t_.modes) {
            mode(m);
        }
        for (const Message& m : t_.messages) {
            message(m);
        }
    }

private:
    void error(const Span& at, std::string sentence, std::string help = {}) {
        report_.error(Topic::slots, at, std::move(sentence), std::move(help));
    }
    std::string bits(std::uint32_t count) const { return std::to_string(count) + " bits"; }

    /// Reports roles that do not fit together: a missing SYNC node, a second node with a role of
    /// which a bus has one, and backups whose SYNC does not fit in slot 0.
    void roles() {
        const Node* sync = nullptr;
        const Node* monitor = nullptr;
        std::map<std::uint32_t, const Node*> backups;
        const auto duplicate = [&](const Node& n, const Node& first, const std::string& what) {
            error(n.at,
                  "duplicate " + what + ": node " + quoted(first.name) + " in line " +
                      std::to_string(first.at.line) + " is it",
                  "a bus has one");
        };
        for (const Node& n : t_.nodes) {
            if (n.role == Role::sync) {
                if (sync != nullptr) {
                    duplicate(n, *sync, "SYNC node");
                } else {
                    sync = &n;
                }
            }
            if (n.role == Role::monitor) {
                if (monitor != nullptr) {
                    duplicate(n, *monitor, "monitor");
                } else {
                    monitor = &n;
                }
            }
            if (n.role == Role::backup) {
                if (const auto [first, is_new] = backups.emplace(n.backup, &n); !is_new) {
                    duplicate(n, *first->second, "backup " + std::to_string(n.backup));
                }
            }
            if (n.role == Role::bridge && !n.senses) {
                error(n.at, "a bridge is of type A", "write node " + n.name + " A bridge");
            }
        }
        if (sync == nullptr) {
            error(t_.nodes.front().at, "no SYNC node", "add a line: node clock A sync");
        }
        if (backups.empty()) return;
        // All of the last backup's SYNC must be within slot 0.
        const auto last = backups.rbegin()->first;
        const Time end = t_.sync_offset(last) + t_.bits(sync_bits + error_bits) + t_.guard;
        if (end > t_.slot()) {
            error(backups.rbegin()->second->at,
                  "the SYNC of backup " + std::to_string(last) +
                      " does not fit in slot 0: it ends " + std::to_string(last + 1) +
                      " x (75 + 20 bits + guard) = " + microseconds(end) +
                      " behind its start, the slot has " + microseconds(t_.slot()),
                  "use fewer backups or longer slots");
        }
    }

    void times() {
        const Span& at = t_.nodes.front().at;
        if (const Time required = t_.required_guard(t_.cycle * t_.lost); t_.guard < required) {
            error(at,
                  "guard " + microseconds(t_.guard) +
                      " is too short: 3 bits + 0.3 us + 4 ppm of the " + std::to_string(t_.lost) +
                      " cycles that nodes coast = " + microseconds(required),
                  "delete the line guard, write a longer time, or fewer cycles in the line lost");
        }
        if (t_.enabled() < t_.bits(4)) {
            error(at,
                  "idle " + microseconds(t_.idle) +
                      " is too short: the owner must start by idle - guard - 2 bits = " +
                      microseconds(t_.enabled()) + ", at least 4 bits",
                  "delete the line idle, or write at least " + microseconds(t_.guard + t_.bits(6)));
        }
        if (t_.slot() < t_.bits(sync_bits + error_bits) + t_.guard) {
            error(at,
                  "slots of " + microseconds(t_.slot()) +
                      " are too short for the SYNC: 75 + 20 bits + guard " +
                      microseconds(t_.guard) + " = " +
                      microseconds(t_.bits(sync_bits + error_bits) + t_.guard),
                  "use fewer slots, a longer cycle or a higher bit rate");
        }
    }

    void mode(const Mode& m) {
        const auto is_sync = [](const Use& u) { return u.kind == Kind::sync; };
        if (m.slots[0].size() != 1 || !is_sync(m.slots[0].front())) {
            error(m.slots[0].empty() ? m.at : m.slots[0].front().at,
                  "slot 0 of mode " + quoted(m.name) + " is not the SYNC's",
                  "write a line: 0 sync");
        }
        std::map<std::uint32_t, const Use*> owners;
        for (std::size_t slot = 0; slot < m.slots.size(); ++slot) {
            const auto& uses = m.slots[slot];
            for (std::size_t i = 0; i < uses.size(); ++i) {
                const Use& u = uses[i];
                if (slot != 0 && is_sync(u)) {
                    error(u.at, "the SYNC is sent in slot 0 only", "write shared");
                }
                for (std::size_t k = 0; k < i; ++k) {
                    meet(slot, uses[k], u);
                }
                if (u.kind == Kind::priv && u.ids.empty() && t_.last_start(8) < 0) {
                    error(u.at, too_long(slot, max_id),
                          "use fewer slots, a longer cycle, a higher bit rate, or name short "
                          "messages");
                }
                for (const std::uint32_t id : u.ids) {
                    const auto [first, is_new] = owners.emplace(id, &u);
                    if (!is_new && first->second->node != u.node) {
                        error(u.at,
                              "identifier " + id_text(id) +
                                  " has two senders: " + t_.nodes[first->second->node].name +
                                  " in line " + std::to_string(first->second->at.line) + ", and " +
                                  t_.nodes[u.node].name,
                              "two nodes that send the same identifier destroy each other's "
                              "frames; use another one");
                    }
                    if (is_private_fit(id)) continue;
                    error(
                        u.at, too_long(slot, id),
                        "use fewer slots, a longer cycle, a higher bit rate or a shorter message");
                }
            }
        }
    }
    bool is_private_fit(std::uint32_t id) const { return t_.last_start(bytes_of(id)) >= 0; }
    std::uint32_t bytes_of(std::uint32_t id) const {
        const Message* m = t_.message(id);
        return m != nullptr ? m->bytes : 8;
    }
    std::string too_long(std::size_t slot, std::uint32_t id) const {
        const auto bytes = bytes_of(id);
        const auto length = can::worst_case_bits(bytes, false).nominal;
        return "slot " + std::to_string(slot) + " is too short for " + id_text(id) + ": " +
               std::to_string(bytes) + " bytes take " + bits(length) + " + " + bits(error_bits) +
               " for an error at " + std::to_string(t_.bit_rate) + " bit/s, with the guard of " +
               microseconds(t_.guard) + " " +
               microseconds(t_.frame(bytes) + t_.bits(error_bits) + t_.guard) + "; the slot has " +
               microseconds(t_.slot());
    }
    /// Reports two uses of a slot that are active in the same cycle.
    void meet(std::size_t slot, const Use& a, const Use& b) {
        const auto common = std::min(a.every, b.every);  // powers of two
        if (a.offset % common != b.offset % common) return;
        error(b.at,
              "slot " + std::to_string(slot) + " is used twice in the same cycle: first in line " +
                  std::to_string(a.at.line),
              "use another slot, or different cycles: every 2 offset 0, every 2 offset 1");
    }

    void message(const Message& m) {
        for (const Mode& mode : t_.modes) {
            const Use* use = t_.owner(mode.number, m.id);
            if (use == nullptr) continue;
            if (use->node != m.node) {
                error(m.at,
                      "message " + quoted(m.name) + " is sent by " + t_.nodes[m.node].name +
                          ", but its slot in line " + std::to_string(use->at.line) + " is of " +
                          t_.nodes[use->node].name,
                      "name the same node in both lines");
            }
            return;
        }
        if (t_.last_start(m.bytes) < 0) {
            error(m.at, too_long(1, m.id),
                  "use fewer slots, a longer cycle, a higher bit rate or a shorter message");
        }
        if (m.id >= 0x100 && m.id <= 0x2ff) {
            error(m.at,
                  "identifier " + id_text(m.id) + " of " + quoted(m.name) +
                      " is in the range of private slots (0x100..0x2FF) and has none",
                  "give it a slot: 3 private " + t_.nodes[m.node].name + " " + id_text(m.id) +
                      ", or use 0x300..0x77F");
        }
    }

    static constexpr std::uint32_t max_id = 0x7ff;  // stands for any message: 8 bytes
    const Table& t_;
    text::Messages<Topic>& report_;
};

}  // namespace

void check(const Table& table, text::Messages<Topic>& report) { Check(table, report).run(); }

}  // namespace hal::scocan
