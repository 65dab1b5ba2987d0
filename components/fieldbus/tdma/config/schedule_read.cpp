// SPDX-License-Identifier: MIT
// A line is the head of a block (`master:`, `backup-master:`, `slave:`) or KEY VALUE…; `#` or `;`
// begins a comment. Times without a unit are in microseconds, as in RTnet.
#include <algorithm>
#include <map>

#include "schedule_plan.hpp"
#include "text/numbers.hpp"
#include "text/suggest.hpp"

namespace hal::tdma::config {

namespace {

using text::Word;

class Reader {
public:
    Reading read(std::string_view file) {
        text::Lines lines(file);
        while (const auto one = lines.next()) {
            line(text::words_of(*one));
        }
        finish();
        out_.messages = std::move(report_.all);
        text::sort(out_.messages);
        return std::move(out_);
    }

private:
    using Take = void (Reader::*)(const std::vector<Word>&);
    struct Key {
        Take take;
        const char* usage;
        bool of_station;  // else of the segment: anywhere
    };

    static const std::map<std::string, Key>& keys() {
        static const std::map<std::string, Key> all{
            {"cycle", {&Reader::take_cycle, "cycle MICROSECONDS", false}},
            {"speed", {&Reader::take_speed, "speed MBIT/S", false}},
            {"guard", {&Reader::take_guard, "guard MICROSECONDS", false}},
            {"forward", {&Reader::take_forward, "forward MICROSECONDS", false}},
            {"lost", {&Reader::take_lost, "lost CYCLES", false}},
            {"rounds", {&Reader::take_rounds, "rounds NUMBER", false}},
            {"heartbeat", {&Reader::take_heartbeat, "heartbeat MILLISECONDS", false}},
            {"name", {&Reader::take_name, "name NAME", true}},
            {"ip", {&Reader::take_ip, "ip ADDRESS", true}},
            {"mac", {&Reader::take_mac, "mac ADDRESS", true}},
            {"slot", {&Reader::take_slot, "slot ID OFFSET [PHASING/PERIOD [SIZE]]", true}},
            {"backup-offset", {&Reader::take_backup, "backup-offset MICROSECONDS", true}},
            {"backup-slot",
             {&Reader::take_backup, "backup-offset MICROSECONDS",
              true}},  // as one page of RTnet has it
            {"phase", {&Reader::take_phase, "phase MICROSECONDS", true}},
            {"lead", {&Reader::take_lead, "lead MICROSECONDS", true}},
            {"stage2", {&Reader::take_stage_2, "stage2 FILE", true}},
        };
        return all;
    }

    void error(Topic topic, const Span& at, std::string sentence, std::string help = {}) {
        report_.error(topic, at, std::move(sentence), std::move(help));
    }

    void line(const std::vector<Word>& words) {
        const Word& first = words.front();
        if (first.text.back() == ':') {
            head(words);
            return;
        }
        const auto key = keys().find(first.text);
        if (key == keys().end()) {
            std::vector<std::string> names{"master:", "backup-master:", "slave:"};
            for (const auto& [name, of] : keys()) {
                names.push_back(name);
            }
            error(Topic::line, first.at, "unknown key '" + first.text + "'",
                  suggestion(first.text, names, "blocks and keys are"));
            return;
        }
        if (key->second.of_station && station_ == nullptr) {
            error(Topic::line, first.at, "'" + first.text + "' outside a station block",
                  "write it below master:, backup-master: or slave:");
            return;
        }
        const std::size_t most = first.text == "slot" ? 5 : 2;
        const std::size_t least = first.text == "slot" ? 3 : 2;
        if (words.size() < least || words.size() > most) {
            const Span& at = words.size() > most ? words[most].at : first.at;
            error(Topic::line, at,
                  words.size() > most ? "unexpected text" : "'" + first.text + "' has no value",
                  std::string("write ") + key->second.usage);
            return;
        }
        if (first.text != "slot" && first.text != "cycle") {
            const auto [before, is_new] = (key->second.of_station ? given_ : given_to_all_)
                                              .emplace(first.text, first.at.line);
            if (!is_new) {
                error(Topic::line, first.at, "duplicate key '" + first.text + "'",
                      "first in line " + std::to_string(before->second) + "; delete one of them");
                return;
            }
        }
        (this->*key->second.take)(words);
    }

    void head(const std::vector<Word>& words) {
        given_.clear();
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

    bool time(const Word& w, Time& out, Time least, Time most, const char* example) {
        const auto value = parse_duration_ns(w.text, 1e3);
        if (!value) {
            error(Topic::value, w.at, "invalid time '" + w.text + "'",
                  std::string("write microseconds, or a number with a unit: ") + example);
        } else if (*value < least || *value > most) {
            error(Topic::value, w.at,
                  "'" + w.text + "' is out of range (" + microseconds(least) + ".." +
                      microseconds(most) + ")");
        } else {
            out = *value;
        }
        return value && *value >= least && *value <= most;
    }
    template <class T>
    bool number(const Word& w, T& out, std::uint64_t least, std::uint64_t most) {
        const auto value = parse_natural(w.text);
        const bool good = value && *value >= least && *value <= most;
        if (good) {
            out = static_cast<T>(*value);
        } else {
            error(Topic::value, w.at,
                  "invalid number '" + w.text + "': expected " + std::to_string(least) + ".." +
                      std::to_string(most));
        }
        return good;
    }

    void take_cycle(const std::vector<Word>& w) {
        if (out_.schedule.cycle != 0) {
            error(Topic::line, w[0].at, "duplicate key 'cycle'",
                  "all stations of a segment share one cycle");
        }
        time(w[1], out_.schedule.cycle, 20'000, 1'000'000'000, "cycle 1000");
    }
    void take_speed(const std::vector<Word>& w) { number(w[1], out_.schedule.speed, 10, 100'000); }
    void take_guard(const std::vector<Word>& w) {
        time(w[1], out_.schedule.guard, 0, 10'000'000, "guard 10");
    }
    void take_forward(const std::vector<Word>& w) {
        time(w[1], out_.schedule.forward, 0, 10'000'000, "forward 2");
    }
    void take_lost(const std::vector<Word>& w) { number(w[1], out_.schedule.lost, 1, 100'000); }
    void take_rounds(const std::vector<Word>& w) { number(w[1], out_.schedule.rounds, 1, 250); }
    void take_heartbeat(const std::vector<Word>& w) {
        number(w[1], out_.schedule.heartbeat_ms, 0, 60'000);
    }
    void take_phase(const std::vector<Word>& w) {
        time(w[1], station_->phase, 0, 1'000'000'000, "phase 100");
    }
    void take_lead(const std::vector<Word>& w) {
        time(w[1], station_->lead, 0, 1'000'000'000, "lead 100");
    }
    void take_stage_2(const std::vector<Word>& w) { station_->stage_2 = w[1].text; }
    void take_name(const std::vector<Word>& w) {
        const auto good = [](char c) {
            return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                   c == '-' || c == '_' || c == '.';
        };
        if (!std::all_of(w[1].text.begin(), w[1].text.end(), good) || w[1].text.size() > 40) {
            error(Topic::value, w[1].at, "invalid name '" + w[1].text + "'",
                  "use at most 40 letters, digits, '-', '_' and '.'");
            return;
        }
        if (w[1].text == "auto") {
            error(Topic::value, w[1].at, "reserved name 'auto'",
                  "station=auto selects a station that gets its block from the master; choose "
                  "another name");
            return;
        }
        for (const StationEntry& s : out_.schedule.stations) {
            if (&s != station_ && s.name == w[1].text) {
                error(
                    Topic::value, w[1].at,
                    "duplicate name: the station in line " + std::to_string(s.at.line) + " has it");
                break;
            }
        }
        station_->name = w[1].text;
    }
    void take_ip(const std::vector<Word>& w) {
        station_->ip = parse_ip(w[1].text);
        if (!station_->ip) {
            error(Topic::value, w[1].at, "invalid IPv4 address '" + w[1].text + "'",
                  "write it as in 10.0.0.2");
        }
        for (const StationEntry& s : out_.schedule.stations) {
            if (&s != station_ && station_->ip && s.ip == station_->ip) {
                error(Topic::value, w[1].at,
                      "duplicate address: the station in line " + std::to_string(s.at.line) +
                          " has it");
                break;
            }
        }
    }
    void take_mac(const std::vector<Word>& w) {
        station_->mac = ethernet::parse_address(w[1].text);
        if (!station_->mac) {
            error(Topic::value, w[1].at, "invalid MAC address '" + w[1].text + "'",
                  "write it as in 02:00:00:00:00:07");
        }
        for (const StationEntry& s : out_.schedule.stations) {
            if (&s != station_ && station_->mac && s.mac == station_->mac) {
                error(Topic::value, w[1].at,
                      "duplicate address: the station in line " + std::to_string(s.at.line) +
                          " has it");
                break;
            }
        }
    }
    void take_backup(const std::vector<Word>& w) {
        if (station_->role != Role::backup && station_ != &ignored_) {
            error(Topic::line, w[0].at, "only a backup-master: has a backup offset",
                  "delete the line");
            return;
        }
        station_->backup_at = w[1].at;
        time(w[1], station_->backup_offset, 1'000, 1'000'000'000, "backup-offset 200");
    }
    void take_slot(const std::vector<Word>& w) {
        SlotEntry slot;
        slot.at = {w[0].at.line, w[0].at.column, w[0].at.offset,
                   w.back().at.offset + w.back().at.length - w[0].at.offset};
        const bool numbered = number(w[1], slot.setup.id, 0, 31);
        time(w[2], slot.setup.offset, 0, 1'000'000'000, "slot 0 200");
        if (w.size() > 3) {
            const std::string& text = w[3].text;
            const auto slash = text.find('/');
            const auto phasing = parse_natural(text.substr(0, slash));
            const auto period =
                slash == std::string::npos ? std::nullopt : parse_natural(text.substr(slash + 1));
            if (!phasing || !period || *period == 0 || *period > 1'000'000 || *phasing == 0 ||
                *phasing > *period) {
                error(Topic::value, w[3].at, "invalid PHASING/PERIOD '" + text + "'",
                      "1/2 is the first of every two cycles, 2/2 the second; phasing is 1..PERIOD");
            } else {
                slot.setup.period = static_cast<std::uint32_t>(*period);

                slot.setup.phasing = static_cast<std::uint32_t>(*phasing - 1);
            }
        }
        if (w.size() > 4) {
            slot.sized = true;
            number(w[4], slot.setup.size, 46, 1500);
        }
        for (const SlotEntry& other : station_->slots) {
            if (numbered && other.setup.id == slot.setup.id) {
                return error(
                    Topic::line, w[1].at, "duplicate slot " + w[1].text,
                    "first in line " + std::to_string(other.at.line) + "; use another number");
            }
        }
        if (station_->slots.size() >= most_slots) {
            return error(Topic::line, w[0].at,
                         "more than " + std::to_string(most_slots) + " slots in one station",
                         "delete some");
        }
        station_->slots.push_back(slot);
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
        unsigned backups = 0;
        unsigned slaves = 0;
        for (StationEntry& e : s.stations) {
            const unsigned which = e.role == Role::backup  ? ++backups
                                   : e.role == Role::slave ? ++slaves
                                                           : 0;
            if (e.name.empty()) {
                e.name = e.role == Role::master ? "master"
                                                : (e.role == Role::backup ? "backup-" : "slave-") +
                                                      std::to_string(which);
            }
            if (e.role == Role::backup && e.backup_offset == 0) {
                error(Topic::line, e.at, "missing backup-offset",
                      "write backup-offset 200 below it");
            }
            if (e.phase < 0) {
                e.phase = e.role == Role::backup
                              ? e.backup_offset - std::min<Time>(e.backup_offset / 2, 100'000)
                              : 0;
            }
            if (e.lead < 0) {
                e.lead = 0;
            }
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

    Reading out_;
    text::Messages<Topic> report_;
    StationEntry ignored_;
    StationEntry* station_ = nullptr;
    // lines of the keys that may occur once: in a block, in the file
    std::map<std::string, std::uint32_t> given_, given_to_all_;
};

}  // namespace

Reading read(std::string_view text) { return Reader().read(text); }

}  // namespace hal::tdma::config
