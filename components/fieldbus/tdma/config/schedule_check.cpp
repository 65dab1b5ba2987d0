// SPDX-License-Identifier: MIT
// Every way in which a schedule cannot work.
#include <algorithm>

#include "schedule_plan.hpp"

namespace hal::tdma::config {

namespace {

constexpr std::size_t smallest_ip_mtu = 68;  // RFC 791

class ScheduleCheck {
public:
    ScheduleCheck(const Schedule& s, std::vector<Message>& out) : s_(s), out_(out), entries_(plan::entries_of(s)) {}

    void run() {
        for (std::size_t i = 0; i < entries_.size(); ++i) {
            within(entries_[i]);
            for (std::size_t k = i + 1; k < entries_.size() && out_.size() <= most_messages; ++k) apart(entries_[i], entries_[k]);
        }
        for (const StationEntry& e : s_.stations) station(e);
        backups();
    }

private:
    void say(Severity severity, const Place& at, std::string sentence, std::string help, std::string label = {}) {
        if (out_.size() > most_messages) return;
        out_.push_back({severity, Topic::schedule, at, std::move(sentence), std::move(label), std::move(help)});
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
        return std::to_string(e.bytes) + " bytes take " + microseconds(e.until - e.at) + " at " + std::to_string(s_.speed) + " Mbit/s";
    }

    void within(const plan::Entry& e) {
        if (e.at >= s_.cycle)
            return say(Severity::error, e.place,
                       called(e) + " lies at " + microseconds(e.at) + ", behind the end of the cycle of " + microseconds(s_.cycle),
                       "choose an offset below " + microseconds(s_.cycle));
        if (e.until + s_.guard <= s_.cycle) return;
        say(Severity::error, e.place,
            called(e) + " reaches into the next cycle: " + microseconds(e.at) + " + " + length(e) + " + guard " + microseconds(s_.guard) +
                " = " + microseconds(e.until + s_.guard) + ", the cycle has " + microseconds(s_.cycle),
            fitting(e, s_.cycle - e.at));
    }

    /// What to write so that an entry fits in `time`.
    std::string fitting(const plan::Entry& e, Time time) const {
        const Time bytes = (time - s_.guard) * s_.speed / 8000 - 24;
        if (e.what == plan::Entry::What::slot && bytes >= 60)
            return "at most " + std::to_string(bytes - 14) + " bytes fit: slot " + std::to_string(e.id) + " OFFSET " +
                   std::to_string(e.phasing + 1) + "/" + std::to_string(e.period) + " " + std::to_string(bytes - 14) +
                   "; or a longer cycle";
        return "a frame of 60 bytes and the guard take " + microseconds(s_.wire(60) + s_.guard) +
               ": move it, or use a longer cycle or a faster line";
    }

    void apart(const plan::Entry& a, const plan::Entry& b) {  // a.at <= b.at
        if (b.at >= a.until + s_.guard || !plan::meet(a, b)) return;
        // The master's own slot behind its sync: one line, one after the other.
        const bool own = a.station == b.station && a.what == plan::Entry::What::sync;
        if (own && b.at >= a.until) return;
        const std::string why = length(a) + ": " + microseconds(a.at) + " + " + microseconds(a.until - a.at) + " + guard " +
                                microseconds(s_.guard) + " = " + microseconds(a.until + s_.guard);
        const Place& at = b.place.length != 0 ? b.place : a.place;
        std::string  help = "the earliest offset for it is " + microseconds(a.until + s_.guard);
        if (a.what == plan::Entry::What::slot) {
            const Time bytes = (b.at - a.at - s_.guard) * s_.speed / 8000 - 24;
            if (bytes >= 60)
                help += "; or give slot " + std::to_string(a.id) + " of " + s_.stations[a.station].name + " a size of " +
                        std::to_string(bytes - 14);
        }
        say(Severity::error, at, called(b) + " begins at " + microseconds(b.at) + ", before " + called(a) + " is over: " + why, help,
            "line " + std::to_string(a.place.line) + " is in the way");
    }

    void station(const StationEntry& e) {
        if (e.slots.empty() && e.role == Role::backup)
            say(Severity::error, e.at,
                "'" + e.name +
                    "' cannot be calibrated, as it has no slot to ask the master in; a backup that is not calibrated cannot take over",
                "write slot 0 OFFSET below it");
        if (e.slots.empty() && e.role == Role::slave)
            say(Severity::warning, e.at, "'" + e.name + "' has no slot: it can neither send nor be calibrated",
                "write slot 0 OFFSET below it");
        if (e.phase + e.lead >= s_.cycle)
            say(Severity::error, e.at,
                "the thread of '" + e.name + "' is done " + microseconds(e.phase) + " + " + microseconds(e.lead) +
                    " after the sync, the cycle has " + microseconds(s_.cycle),
                "phase + lead must be less than the cycle");
        for (const SlotEntry& slot : e.slots)
            if (slot.setup.id == tunnel_slot && slot.setup.size < smallest_ip_mtu + rtmac_bytes)
                say(Severity::error, slot.at,
                    "slot 1 is that of ordinary packets, and " + std::to_string(slot.setup.size) + " bytes are too few: IP needs " +
                        std::to_string(smallest_ip_mtu) + " and the RTmac header " + std::to_string(rtmac_bytes),
                    "give it at least " + std::to_string(smallest_ip_mtu + rtmac_bytes) + ", or another id");
    }

    void backups() {
        const Time                       arrives = s_.path(ethernet::smallest_frame) + s_.guard;
        std::vector<const StationEntry*> list;
        for (const StationEntry& e : s_.stations)
            if (e.role == Role::backup) list.push_back(&e);
        std::stable_sort(list.begin(), list.end(), [](const auto* a, const auto* b) { return a->backup_offset < b->backup_offset; });
        for (std::size_t i = 0; i < list.size(); ++i) {
            const StationEntry& e = *list[i];
            const Time          before = i == 0 ? 0 : list[i - 1]->backup_offset;
            const std::string   whose = i == 0 ? "the master's sync" : "the sync of " + list[i - 1]->name;
            if (e.phase > 0 && e.phase < before + arrives)
                say(Severity::error, e.backup_at,
                    "the thread of '" + e.name + "' looks " + microseconds(e.phase) + " after the beginning of the cycle; " + whose +
                        " is there only after " + microseconds(before) + " + " + microseconds(s_.path(60)) + " + guard " +
                        microseconds(s_.guard) + " = " + microseconds(before + arrives),
                    "the smallest backup-offset that works is " + microseconds(needed(before + arrives)));
            if (e.phase > 0 && e.phase + e.lead >= e.backup_offset)
                say(Severity::error, e.backup_at,
                    "'" + e.name + "' knows " + microseconds(e.phase + e.lead) +
                        " after the beginning of the cycle whether to take over, and would do it at " + microseconds(e.backup_offset),
                    "phase + lead must be less than backup-offset");
        }
        if (s_.master() == nullptr && s_.stations.size() > 1)
            say(Severity::warning, s_.stations.front().at, "there is no master: the stations wait for one that is not in this file",
                "write master: and its slots");
    }
    static Time needed(Time phase) { return 2 * phase <= 200'000 ? 2 * phase : phase + 100'000; }

    const Schedule&          s_;
    std::vector<Message>&    out_;
    std::vector<plan::Entry> entries_;
};

}  // namespace

void judge(const Schedule& s, std::vector<Message>& out) { ScheduleCheck(s, out).run(); }

}  // namespace hal::tdma::config
