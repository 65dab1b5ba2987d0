// SPDX-License-Identifier: MIT
// Checks a schedule for conflicts.
#include <algorithm>

#include "schedule_plan.hpp"

namespace hal::tdma::config {

namespace {

constexpr std::size_t min_ip_mtu = 68;  // RFC 791

class ScheduleCheck {
public:
    ScheduleCheck(const Schedule& s, text::Messages<Topic>& out)
        : s_(s), out_(out), entries_(plan::entries_of(s)) {}

    void run() {
        for (std::size_t i = 0; i < entries_.size(); ++i) {
            within(entries_[i]);
            for (std::size_t k = i + 1; k < entries_.size() && out_.all.size() <= text::max_errors;
                 ++k) {
                apart(entries_[i], entries_[k]);
            }
        }
        for (const StationEntry& e : s_.stations) {
            station(e);
        }
        backups();
        master();
    }

private:
    void report(Severity severity, const Span& at, std::string sentence, std::string help,
                std::string label = {}) {
        out_.add(severity, Topic::schedule, at, std::move(sentence), std::move(help),
                 std::move(label));
    }

    std::string called(const plan::Entry& e) const {
        const std::string& name = s_.stations[e.station].name;
        switch (e.what) {
        case plan::Entry::What::sync: return "the sync of " + name;
        case plan::Entry::What::backup_sync: return "the backup sync of " + name;
        case plan::Entry::What::slot: break;
        }
        return "slot " + std::to_string(e.id) + " of " + name;
    }
    std::string length(const plan::Entry& e) const {
        return std::to_string(e.bytes) + " bytes take " + microseconds(e.until - e.at) + " at " +
               std::to_string(s_.speed) + " Mbit/s";
    }

    void within(const plan::Entry& e) {
        if (e.at >= s_.cycle) {
            return report(Severity::error, e.at_line,
                          called(e) + " begins at " + microseconds(e.at) +
                              ", after the end of the cycle of " + microseconds(s_.cycle),
                          "choose an offset below " + microseconds(s_.cycle));
        }
        if (e.until + s_.guard <= s_.cycle) return;
        report(Severity::error, e.at_line,
               called(e) + " extends into the next cycle: " + microseconds(e.at) + " + " +
                   length(e) + " + guard " + microseconds(s_.guard) + " = " +
                   microseconds(e.until + s_.guard) + "; the cycle is " + microseconds(s_.cycle),
               fitting(e, s_.cycle - e.at));
    }

    /// Returns what to write so that an entry fits in `time`.
    std::string fitting(const plan::Entry& e, Time time) const {
        const Time bytes = (time - s_.guard) * s_.speed / 8000 - 24;
        if (e.what == plan::Entry::What::slot && bytes >= 60) {
            return std::to_string(bytes - 14) + " bytes fit: write slot " + std::to_string(e.id) +
                   " OFFSET " + std::to_string(e.phasing + 1) + "/" + std::to_string(e.period) +
                   " " + std::to_string(bytes - 14) + ", or use a longer cycle";
        }
        return "a frame of 60 bytes and the guard take " + microseconds(s_.wire(60) + s_.guard) +
               ": move it, or use a longer cycle or a faster line";
    }

    void apart(const plan::Entry& a, const plan::Entry& b) {  // a.at <= b.at
        if (b.at >= a.until + s_.guard || !plan::meet(a, b)) return;
        // The master's own slot behind its sync: one line, one after the other.
        const bool own = a.station == b.station && a.what == plan::Entry::What::sync;
        if (own && b.at >= a.until) return;
        const std::string why = length(a) + ": " + microseconds(a.at) + " + " +
                                microseconds(a.until - a.at) + " + guard " +
                                microseconds(s_.guard) + " = " + microseconds(a.until + s_.guard);
        const Span& at = b.at_line.length != 0 ? b.at_line : a.at_line;
        std::string help = "its earliest offset is " + microseconds(a.until + s_.guard);
        if (a.what == plan::Entry::What::slot) {
            const Time bytes = (b.at - a.at - s_.guard) * s_.speed / 8000 - 24;
            if (bytes >= 60) {
                help += "; or give slot " + std::to_string(a.id) + " of " +
                        s_.stations[a.station].name + " a size of " + std::to_string(bytes - 14);
            }
        }
        report(Severity::error, at,
               called(b) + " begins at " + microseconds(b.at) + ", before the end of " + called(a) +
                   ": " + why,
               help, "conflicts with line " + std::to_string(a.at_line.line));
    }

    void station(const StationEntry& e) {
        if (e.slots.empty() && e.role == Role::backup) {
            report(Severity::error, e.at,
                   "'" + e.name +
                       "' has no slot for the calibration; an uncalibrated backup cannot take over",
                   "write slot 0 OFFSET below it");
        }
        if (e.slots.empty() && e.role == Role::slave) {
            report(Severity::warning, e.at,
                   "'" + e.name + "' has no slot: it cannot send and cannot be calibrated",
                   "write slot 0 OFFSET below it");
        }
        if (e.phase + e.lead >= s_.cycle) {
            report(Severity::error, e.at,
                   "the thread of '" + e.name + "' ends " + microseconds(e.phase) + " + " +
                       microseconds(e.lead) + " after the sync; the cycle is " +
                       microseconds(s_.cycle),
                   "phase + lead must be less than the cycle");
        }
        for (const SlotEntry& slot : e.slots) {
            if (slot.setup.id == tunnel_slot && slot.setup.size < min_ip_mtu + rtmac_bytes) {
                report(Severity::error, slot.at,
                       "slot 1 carries IP packets, but its " + std::to_string(slot.setup.size) +
                           " bytes are too few: IP needs " + std::to_string(min_ip_mtu) +
                           " and the RTmac header " + std::to_string(rtmac_bytes),
                       "use a size of at least " + std::to_string(min_ip_mtu + rtmac_bytes) +
                           ", or another slot number");
            }
        }
    }

    void backups() {
        const Time sync_path = s_.path(ethernet::smallest_frame);
        const Time sync_arrives_after = sync_path + s_.guard;
        std::vector<const StationEntry*> list;
        for (const StationEntry& e : s_.stations) {
            if (e.role == Role::backup) {
                list.push_back(&e);
            }
        }
        std::stable_sort(list.begin(), list.end(), [](const auto* a, const auto* b) {
            return a->backup_offset < b->backup_offset;
        });
        for (std::size_t i = 0; i < list.size(); ++i) {
            const StationEntry& e = *list[i];
            const Time before = i == 0 ? 0 : list[i - 1]->backup_offset;
            const std::string whose =
                i == 0 ? "the master's sync" : "the sync of " + list[i - 1]->name;
            if (e.phase > 0 && e.phase < before + sync_arrives_after) {
                report(Severity::error, e.backup_at,
                       "the thread of '" + e.name + "' checks " + microseconds(e.phase) +
                           " after the beginning of the cycle, but " + whose + " arrives after " +
                           microseconds(before) + " + " + microseconds(sync_path) + " + guard " +
                           microseconds(s_.guard) + " = " +
                           microseconds(before + sync_arrives_after),
                       "the smallest backup-offset that works is " +
                           microseconds(needed(before + sync_arrives_after)));
            }
            if (e.phase > 0 && e.phase + e.lead >= e.backup_offset) {
                report(Severity::error, e.backup_at,
                       "'" + e.name + "' decides on the take-over " +
                           microseconds(e.phase + e.lead) +
                           " after the beginning of the cycle, but its backup-offset is " +
                           microseconds(e.backup_offset),
                       "phase + lead must be less than backup-offset");
            }
        }
    }

    void master() {
        if (s_.master() == nullptr && s_.stations.size() > 1) {
            report(Severity::warning, s_.stations.front().at,
                   "no master in this file: the stations wait for an external one",
                   "write master: and its slots");
        }
    }
    static Time needed(Time phase) { return 2 * phase <= 200'000 ? 2 * phase : phase + 100'000; }

    const Schedule& s_;
    text::Messages<Topic>& out_;
    std::vector<plan::Entry> entries_;
};

}  // namespace

void check(const Schedule& s, text::Messages<Topic>& out) { ScheduleCheck(s, out).run(); }

}  // namespace hal::tdma::config
