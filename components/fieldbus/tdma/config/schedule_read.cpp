// SPDX-License-Identifier: MIT
// A line is the head of a block (`master:`, `backup-master:`, `slave:`) or KEY VALUE…; `#` or `;`
// begins a comment. Times without a unit are in microseconds, as in RTnet.
#include <algorithm>
#include <map>

#include "bus/config/key_table.hpp"
#include "schedule_plan.hpp"
#include "text/numbers.hpp"
#include "text/suggest.hpp"

namespace hal::tdma::config {

namespace {

using bus::Entry;
using text::Word;

constexpr Time us = 1'000;
constexpr Time second = 1'000'000 * us;

class Reader {
public:
    static const bus::KeyTable<Reader>& segment_keys();
    static const bus::KeyTable<Reader>& station_keys();

    ReadResult read(std::string_view file) {
        text::Lines lines(file);
        while (const auto one = lines.next()) {
            line(text::words_of(*one));
        }
        finish();
        out_.messages = std::move(report_.all);
        text::sort(out_.messages);
        return std::move(out_);
    }

    Schedule& schedule() { return out_.schedule; }
    StationEntry& station() { return *station_; }

private:
    void error(Topic topic, const Span& at, std::string sentence, std::string help = {}) {
        report_.error(topic, at, std::move(sentence), std::move(help));
    }

    void line(const std::vector<Word>& words) {
        const Word& first = words.front();
        if (first.text.back() == ':') return head(words);
        if (const auto* key = segment_keys().find(first.text)) {
            return segment_keys().read_line(*key, words, *this, given_in_file_, key_report_);
        }
        const auto* key = station_keys().find(first.text);
        if (key == nullptr) {
            std::vector<std::string> names{"master:", "backup-master:", "slave:"};
            for (const auto* table : {&segment_keys(), &station_keys()}) {
                const auto of_table = table->names();
                names.insert(names.end(), of_table.begin(), of_table.end());
            }
            return error(Topic::line, first.at, "unknown key '" + first.text + "'",
                         suggestion(first.text, names, "blocks and keys are"));
        }
        if (station_ == nullptr) {
            return error(Topic::line, first.at, "'" + first.text + "' outside a station block",
                         "write it below master:, backup-master: or slave:");
        }
        station_keys().read_line(*key, words, *this, given_in_block_, key_report_);
    }

    void head(const std::vector<Word>& words) {
        given_in_block_.clear();
        const Word& first = words.front();
        constexpr std::pair<std::string_view, Role> blocks[] = {
            {"master:", Role::master}, {"backup-master:", Role::backup}, {"slave:", Role::slave}};
        const auto* block = std::find_if(std::begin(blocks), std::end(blocks),
                                         [&](const auto& b) { return b.first == first.text; });
        if (block == std::end(blocks)) {
            error(Topic::line, first.at, "unknown block '" + first.text + "'",
                  "the blocks are master:, backup-master:, slave:");
            station_ = &ignored_;
            return;
        }
        if (words.size() > 1) {
            error(Topic::line, words[1].at, "unexpected text",
                  "write the name below it: name " + words[1].text);
        }
        if (block->second == Role::master) {
            if (const StationEntry* other = out_.schedule.master()) {
                error(Topic::line, first.at,
                      "duplicate master: the first is in line " + std::to_string(other->at.line),
                      "write backup-master: and a backup-offset");
                station_ = &ignored_;
                return;
            }
        }
        if (out_.schedule.stations.size() >= 256) {
            error(Topic::line, first.at, "more than 256 stations", "split the segment");
            station_ = &ignored_;
            return;
        }
        out_.schedule.stations.push_back({});
        station_ = &out_.schedule.stations.back();
        station_->role = block->second;
        station_->at = first.at;
    }

    bool time(const Word& w, Time& out, Time min, Time max) {
        const auto value = parse_duration_ns(w.text, 1e3);
        if (!value || *value < min || *value > max) {
            error(Topic::value, w.at, "invalid time '" + w.text + "'",
                  "write " + bus::time_form(min, max, false, true).expected);
            return false;
        }
        out = *value;
        return true;
    }
    template <class T>
    bool number(const Word& w, T& out, std::uint64_t min, std::uint64_t max) {
        const auto value = parse_natural(w.text);
        const bool good = value && *value >= min && *value <= max;
        if (good) {
            out = static_cast<T>(*value);
        } else {
            error(Topic::value, w.at,
                  "invalid number '" + w.text + "': expected " + std::to_string(min) + ".." +
                      std::to_string(max));
        }
        return good;
    }

    bool read_name(const Entry& entry) {
        const Word& name = entry.value;
        if (!bus::is_name(name.text, ".")) {
            error(Topic::value, name.at, "invalid name '" + name.text + "'",
                  "use at most 40 letters, digits, '-', '_' and '.'");
            return true;
        }
        if (name.text == "auto") {
            error(Topic::value, name.at, "reserved name 'auto'",
                  "station=auto selects a station that gets its block from the master; choose "
                  "another name");
            return true;
        }
        report_other("duplicate name", name,
                     [&](const StationEntry& s) { return s.name == name.text; });
        station_->name = name.text;
        return true;
    }
    bool read_ip(const Entry& entry) {
        station_->ip = parse_ip(entry.value.text);
        if (!station_->ip) {
            error(Topic::value, entry.value.at, "invalid IPv4 address '" + entry.value.text + "'",
                  "write it as in 10.0.0.2");
            return true;
        }
        report_other("duplicate address", entry.value,
                     [&](const StationEntry& s) { return s.ip == station_->ip; });
        return true;
    }
    bool read_mac(const Entry& entry) {
        station_->mac = ethernet::parse_address(entry.value.text);
        if (!station_->mac) {
            error(Topic::value, entry.value.at, "invalid MAC address '" + entry.value.text + "'",
                  "write it as in 02:00:00:00:00:07");
            return true;
        }
        report_other("duplicate address", entry.value,
                     [&](const StationEntry& s) { return s.mac == station_->mac; });
        return true;
    }
    /// Reports the first other station that has a property of this one.
    template <class Has>
    void report_other(const std::string& what, const Word& value, Has has) {
        const auto& all = out_.schedule.stations;
        const auto other = std::find_if(all.begin(), all.end(), [&](const StationEntry& s) {
            return &s != station_ && has(s);
        });
        if (other == all.end()) return;
        error(Topic::value, value.at,
              what + ": the station in line " + std::to_string(other->at.line) + " has it");
    }

    bool read_backup(const Entry& entry) {
        if (station_->role != Role::backup && station_ != &ignored_) {
            error(Topic::line, entry.key.at, "only a backup-master: has a backup offset",
                  "delete the line");
            return true;
        }
        station_->backup_at = entry.value.at;
        return bus::time(&StationEntry::backup_offset, us, second)
            .bare_microseconds()
            .parse(*station_, entry);
    }

    bool read_slot(const Entry& entry) {
        const std::vector<Word>& w = entry.words;
        SlotEntry slot;
        slot.at = {w[0].at.line, w[0].at.column, w[0].at.offset,
                   w.back().at.offset + w.back().at.length - w[0].at.offset};
        const bool numbered = number(w[1], slot.setup.id, 0, 31);
        time(w[2], slot.setup.offset, 0, second);
        if (w.size() > 3) {
            read_phasing(w[3], slot);
        }
        if (w.size() > 4) {
            slot.sized = true;
            number(w[4], slot.setup.size, 46, 1500);
        }
        if (is_new_slot(w, slot, numbered)) {
            station_->slots.push_back(slot);
        }
        return true;
    }

    /// Reads PHASING/PERIOD.
    void read_phasing(const Word& w, SlotEntry& slot) {
        constexpr std::uint64_t max_period = 1'000'000;
        const auto slash = std::min(w.text.find('/'), w.text.size());
        const auto phasing = parse_natural(text::part(w, 0, slash).text);
        const auto period = parse_natural(w.text.substr(std::min(slash + 1, w.text.size())));
        if (!phasing || !period || *period == 0 || *period > max_period || *phasing == 0 ||
            *phasing > *period) {
            return error(
                Topic::value, w.at, "invalid PHASING/PERIOD '" + w.text + "'",
                "1/2 is the first of every two cycles, 2/2 the second; phasing is 1..PERIOD");
        }
        slot.setup.period = static_cast<std::uint32_t>(*period);
        slot.setup.phasing = static_cast<std::uint32_t>(*phasing - 1);
    }

    bool is_new_slot(const std::vector<Word>& w, const SlotEntry& slot, bool numbered) {
        const auto& slots = station_->slots;
        const auto other = std::find_if(slots.begin(), slots.end(), [&](const SlotEntry& one) {
            return one.setup.id == slot.setup.id;
        });
        if (numbered && other != slots.end()) {
            error(Topic::line, w[1].at, "duplicate slot " + w[1].text,
                  "first in line " + std::to_string(other->at.line) + "; use another number");
            return false;
        }
        if (slots.size() < max_slots) return true;
        error(Topic::line, w[0].at,
              "more than " + std::to_string(max_slots) + " slots in one station", "delete some");
        return false;
    }

    /// Gives stations without a name one by their role and number: master, backup-1, slave-1.
    void name_stations() {
        std::map<Role, unsigned> numbers;
        for (StationEntry& e : out_.schedule.stations) {
            const unsigned number = ++numbers[e.role];
            if (!e.name.empty()) continue;
            e.name = role_name(e.role);
            if (e.role != Role::master) {
                e.name += "-" + std::to_string(number);
            }
        }
    }
    static const char* role_name(Role role) {
        switch (role) {
        case Role::master: return "master";
        case Role::backup: return "backup";
        default: return "slave";
        }
    }

    /// Sets the times of a station that are not given.
    void complete(StationEntry& e) {
        const bool is_backup = e.role == Role::backup;
        if (is_backup && e.backup_offset == 0) {
            error(Topic::line, e.at, "missing backup-offset", "write backup-offset 200 below it");
        }
        if (e.phase < 0) {
            const Time before = std::min<Time>(e.backup_offset / 2, 100 * us);
            e.phase = is_backup ? e.backup_offset - before : 0;
        }
        e.lead = std::max<Time>(e.lead, 0);
    }

    void finish() {
        Schedule& s = out_.schedule;
        if (report_.failed()) return;
        const Span beginning{1, 1, 0, 0};
        if (s.stations.empty()) {
            return error(Topic::line, beginning, "the file has no station",
                         "write master: and below it cycle 1000 and slot 0 100");
        }
        if (s.cycle == 0) {
            const StationEntry* m = s.master();
            return error(Topic::line, m != nullptr ? m->at : s.stations.front().at, "missing cycle",
                         "write cycle 1000 below master:");
        }
        name_stations();
        for (StationEntry& e : s.stations) {
            complete(e);
        }
        if (report_.failed()) return;
        sizes();
        check(s, report_);
    }

    /// A slot without a size extends to the next frame on the segment, or to the end of the cycle.
    void sizes() {
        Schedule& s = out_.schedule;
        for (StationEntry& e : s.stations) {
            for (SlotEntry& slot : e.slots) {
                if (!slot.sized) {
                    slot.setup.size = 46;
                }
            }
        }
        const auto entries = plan::entries_of(s);
        for (std::size_t i = 0; i < entries.size(); ++i) {
            if (entries[i].what != plan::Entry::What::slot) continue;
            Time end = s.cycle;
            for (std::size_t k = i + 1; k < entries.size(); ++k) {
                if (plan::meet(entries[i], entries[k])) {
                    end = std::min(end, entries[k].at);
                    break;
                }
            }
            const Time bytes = (end - entries[i].at - s.guard) * s.speed / 8000 - 24 -
                               static_cast<Time>(ethernet::header_bytes);
            for (SlotEntry& slot : s.stations[entries[i].station].slots) {
                if (slot.setup.id == entries[i].id && !slot.sized) {
                    slot.setup.size = static_cast<std::uint32_t>(std::clamp<Time>(bytes, 46, 1500));
                }
            }
        }
    }

    ReadResult out_;
    text::Messages<Topic> report_;
    bus::TopicReport<Topic> key_report_{report_};
    StationEntry ignored_;
    StationEntry* station_ = nullptr;
    bus::GivenKeys given_in_block_, given_in_file_;
};

template <class T>
auto of_segment(T Schedule::* member) {
    return [member](Reader& reader) -> T& { return reader.schedule().*member; };
}
template <class T>
auto of_station(T StationEntry::* member) {
    return [member](Reader& reader) -> T& { return reader.station().*member; };
}
template <class Get>
auto time_in_us(Get get, Time min, Time max) {
    return bus::time(get, min, max).bare_microseconds();
}

const bus::KeyTable<Reader>& Reader::segment_keys() {
    static const bus::KeyTable<Reader> table{{
        {"cycle", time_in_us(of_segment(&Schedule::cycle), 20 * us, second), "required",
         "The cycle of all stations."},
        {"speed", bus::number(of_segment(&Schedule::speed), 10, 100'000), "`100`",
         "The line speed in Mbit/s."},
        {"guard", time_in_us(of_segment(&Schedule::guard), 0, 10'000 * us), "`10`",
         "The gap between two frames. A frame that would be later than this is dropped and "
         "counted."},
        {"forward", time_in_us(of_segment(&Schedule::forward), 0, 10'000 * us), "`2`",
         "The forwarding delay of the switch; `0`: no switch."},
        {"lost", bus::number(of_segment(&Schedule::lost), 1, 100'000), "`4`",
         "The cycles without a sync until the station stops sending and its outputs are safe."},
        {"rounds", bus::number(of_segment(&Schedule::rounds), 1, 250), "`100`",
         "The rounds of a calibration."},
        {"heartbeat", bus::number(of_segment(&Schedule::heartbeat_ms), 0, 60'000), "`1000`",
         "The heartbeat in ms of stations that the master configured; `0`: none. A station "
         "without a heartbeat for twice this time is dead."},
    }};
    return table;
}

const bus::KeyTable<Reader>& Reader::station_keys() {
    static const bus::KeyTable<Reader> table{{
        bus::Key<Reader>{"slot",
                         bus::own("", "0..31, a time, 1/1..n/n, 46..1500", &Reader::read_slot), "",
                         "The station may send OFFSET after the sync, in the PHASING-th of PERIOD "
                         "cycles (`1/1`). SIZE is the payload in bytes; by default as many as fit "
                         "before the next frame of any station."}
            .words(2, 4, "ID OFFSET [PHASING/PERIOD [SIZE]]")
            .repeated(),
        {"backup-offset",
         bus::own("a time of 1us..1s, in microseconds or with a unit", "1us..1s",
                  &Reader::read_backup, "TIME"),
         "required",
         "Of a backup: the offset at which this station sends a missing sync. The smallest one "
         "wins. One page of RTnet names it `backup-slot`, which is accepted as well."},
        {"name", bus::own("", "a name", &Reader::read_name, "NAME"), "by its role, as in `slave-1`",
         "A value for `station=`."},
        {"ip", bus::own("", "an IPv4 address", &Reader::read_ip, "ADDRESS"), "none",
         "A value for `station=`."},
        {"mac", bus::own("", "a MAC address", &Reader::read_mac, "ADDRESS"), "none",
         "A value for `station=`. It must equal that of the interface."},
        {"phase", time_in_us(of_station(&StationEntry::phase), 0, second),
         "`0`; of a backup 100 us before its offset, or half of it",
         "The beginning of its thread's cycle after the sync."},
        {"lead", time_in_us(of_station(&StationEntry::lead), 0, second), "`0`",
         "The longest time of its functions until `transmit`. Earlier slots are filled a cycle "
         "ahead."},
        {"stage2", bus::text_value(of_station(&StationEntry::stage_2), "FILE"), "none",
         "A file that the master sends to the station, [with its "
         "schedule](#stations-without-a-file). It has at most 64 KiB."},
        {"backup-slot",
         bus::own("a time of 1us..1s, in microseconds or with a unit", "1us..1s",
                  &Reader::read_backup, "TIME"),
         "", ""},
    }};
    return table;
}

}  // namespace

ReadResult read(std::string_view text) { return Reader().read(text); }

std::string segment_reference() { return Reader::segment_keys().reference(); }
std::string station_reference() { return Reader::station_keys().reference(); }

}  // namespace hal::tdma::config
