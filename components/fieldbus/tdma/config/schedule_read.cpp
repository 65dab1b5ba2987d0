// SPDX-License-Identifier: MIT
// A line is a block's head (`master:`, `backup-master:`, `slave:`) or KEY VALUE…; # begins a comment. Times are in microseconds, as RTnet
// writes them, or have a unit.
#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>

#include "schedule_plan.hpp"

namespace hal::tdma::config {

namespace {

struct Word {
    std::string text;
    Place       at;
};

bool is_space(char c) { return c == ' ' || c == '\t' || c == '\r'; }

std::vector<Word> words_of(std::string_view line, std::uint32_t number, std::size_t offset) {
    std::vector<Word> words;
    line = line.substr(0, line.find('#'));
    std::uint32_t column = 1;
    for (std::size_t i = 0; i < line.size();) {
        if (is_space(line[i])) {
            ++i, ++column;
            continue;
        }
        const std::size_t begin = i;
        const auto        at = column;
        for (; i < line.size() && !is_space(line[i]); ++i)
            if ((static_cast<unsigned char>(line[i]) & 0xc0) != 0x80) ++column;  // characters, not bytes
        words.push_back({std::string(line.substr(begin, i - begin)),
                         {number, at, static_cast<std::uint32_t>(offset + begin), static_cast<std::uint32_t>(i - begin)}});
    }
    return words;
}

std::optional<std::uint64_t> natural(std::string_view text) {
    std::uint64_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    return error == std::errc() && end == text.data() + text.size() && !text.empty() ? std::optional(value) : std::nullopt;
}

/// 50, 50us, 12.5us, 1ms, 800ns; a number alone is in microseconds.
std::optional<Time> duration(std::string_view text) {
    double factor = 1e3;
    for (const auto& [unit, ns] : {std::pair<std::string_view, double>{"ns", 1}, {"us", 1e3}, {"ms", 1e6}, {"s", 1e9}})
        if (text.ends_with(unit)) {
            text.remove_suffix(unit.size());
            factor = ns;
            break;
        }
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, std::chars_format::fixed);
    if (error != std::errc() || end != text.data() + text.size() || text.empty() || !(value >= 0 && value * factor <= 1e12)) return {};
    return std::llround(value * factor);
}

/// How many letters have to be changed, for "did you mean".
std::size_t distance(std::string_view a, std::string_view b) {
    std::vector<std::size_t> row(b.size() + 1);
    for (std::size_t k = 0; k <= b.size(); ++k) row[k] = k;
    for (std::size_t i = 1; i <= a.size(); ++i) {
        std::size_t before = row[0];
        row[0] = i;
        for (std::size_t k = 1; k <= b.size(); ++k) {
            const std::size_t above = row[k];
            row[k] = std::min({row[k] + 1, row[k - 1] + 1, before + (a[i - 1] == b[k - 1] ? 0 : 1)});
            before = above;
        }
    }
    return row[b.size()];
}

class Reader {
public:
    Reading read(std::string_view text) {
        std::uint32_t number = 0;
        for (std::size_t at = 0; at <= text.size();) {
            const std::size_t end = std::min(text.find('\n', at), text.size());
            const auto        words = words_of(text.substr(at, end - at), ++number, at);
            if (!words.empty()) line(words);
            at = end + 1;
        }
        finish();
        std::stable_sort(out_.messages.begin(), out_.messages.end(),
                         [](const Message& a, const Message& b) { return a.at.offset < b.at.offset; });
        return std::move(out_);
    }

private:
    using Take = void (Reader::*)(const std::vector<Word>&);
    struct Key {
        Take        take;
        const char* usage;
        bool        of_station;  // else of the segment: anywhere
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
            {"backup-slot", {&Reader::take_backup, "backup-offset MICROSECONDS", true}},  // as one page of RTnet has it
            {"phase", {&Reader::take_phase, "phase MICROSECONDS", true}},
            {"lead", {&Reader::take_lead, "lead MICROSECONDS", true}},
            {"stage2", {&Reader::take_stage_2, "stage2 FILE", true}},
        };
        return all;
    }

    void error(Topic topic, const Place& at, std::string sentence, std::string help = {}, std::string label = {}) {
        if (out_.messages.size() > most_messages) return;
        out_.messages.push_back({Severity::error, topic, at, std::move(sentence), std::move(label), std::move(help)});
    }

    void line(const std::vector<Word>& words) {
        const Word& first = words.front();
        if (first.text.back() == ':') {
            head(words);
            return;
        }
        const auto key = keys().find(first.text);
        if (key == keys().end()) {
            std::string best;
            for (const char* block : {"master", "backup-master", "slave"})
                if (first.text == block) best = first.text + ":";
            for (const auto& [name, of] : keys())
                if (distance(first.text, name) <= 2 && (best.empty() || distance(first.text, name) < distance(first.text, best)))
                    best = name;
            error(Topic::line, first.at, "there is no key '" + first.text + "'",
                  best.empty()
                      ? "blocks are master:, backup-master:, slave:; keys are cycle, slot, ip, mac, name, backup-offset, stage2, phase, "
                        "lead, guard, speed, forward, lost, rounds, heartbeat"
                      : "did you mean '" + best + "'?");
            return;
        }
        if (key->second.of_station && station_ == nullptr) {
            error(Topic::line, first.at, "'" + first.text + "' belongs to a station", "write it below master:, backup-master: or slave:");
            return;
        }
        const std::size_t most = first.text == "slot" ? 5 : 2, least = first.text == "slot" ? 3 : 2;
        if (words.size() < least || words.size() > most) {
            const Place& at = words.size() > most ? words[most].at : first.at;
            error(Topic::line, at, words.size() > most ? "nothing is expected here" : "'" + first.text + "' lacks its value",
                  std::string("it is written ") + key->second.usage);
            return;
        }
        if (first.text != "slot" && first.text != "cycle") {
            const auto [before, is_new] = (key->second.of_station ? given_ : given_to_all_).emplace(first.text, first.at.line);
            if (!is_new) {
                error(Topic::line, first.at, "'" + first.text + "' is given already, in line " + std::to_string(before->second));
                return;
            }
        }
        (this->*key->second.take)(words);
    }

    void head(const std::vector<Word>& words) {
        given_.clear();
        const Word&                                 first = words.front();
        constexpr std::pair<std::string_view, Role> blocks[] = {
            {"master:", Role::master}, {"backup-master:", Role::backup}, {"slave:", Role::slave}};
        const auto* block = std::find_if(std::begin(blocks), std::end(blocks), [&](const auto& b) { return b.first == first.text; });
        if (block == std::end(blocks)) {
            error(Topic::line, first.at, "there is no block '" + first.text + "'", "blocks are master:, backup-master:, slave:");
            station_ = &ignored_;
            return;
        }
        if (words.size() > 1)
            error(Topic::line, words[1].at, "nothing is expected here", "a name is written below it: name " + words[1].text);
        if (block->second == Role::master)
            if (const StationEntry* other = out_.schedule.master()) {
                error(Topic::line, first.at, "there is a master already, in line " + std::to_string(other->at.line),
                      "write backup-master: and a backup-offset");
                station_ = &ignored_;
                return;
            }
        if (out_.schedule.stations.size() >= 256) {
            error(Topic::line, first.at, "there are more than 256 stations");
            station_ = &ignored_;
            return;
        }
        out_.schedule.stations.push_back({});
        station_ = &out_.schedule.stations.back();
        station_->role = block->second;
        station_->at = first.at;
    }

    bool time(const Word& w, Time& out, Time least, Time most, const char* example) {
        const auto value = duration(w.text);
        if (!value) error(Topic::value, w.at, "'" + w.text + "' is no time", std::string("in microseconds, or with a unit: ") + example);
        else if (*value < least || *value > most)
            error(Topic::value, w.at, "'" + w.text + "' is outside " + microseconds(least) + " to " + microseconds(most));
        else out = *value;
        return value && *value >= least && *value <= most;
    }
    template <class T>
    bool number(const Word& w, T& out, std::uint64_t least, std::uint64_t most) {
        const auto value = natural(w.text);
        const bool good = value && *value >= least && *value <= most;
        if (good) out = static_cast<T>(*value);
        else error(Topic::value, w.at, "'" + w.text + "' is no number from " + std::to_string(least) + " to " + std::to_string(most));
        return good;
    }

    void take_cycle(const std::vector<Word>& w) {
        if (out_.schedule.cycle != 0) error(Topic::line, w[0].at, "the cycle is given already", "all stations of a segment have the same");
        time(w[1], out_.schedule.cycle, 20'000, 1'000'000'000, "cycle 1000");
    }
    void take_speed(const std::vector<Word>& w) { number(w[1], out_.schedule.speed, 10, 100'000); }
    void take_guard(const std::vector<Word>& w) { time(w[1], out_.schedule.guard, 0, 10'000'000, "guard 10"); }
    void take_forward(const std::vector<Word>& w) { time(w[1], out_.schedule.forward, 0, 10'000'000, "forward 2"); }
    void take_lost(const std::vector<Word>& w) { number(w[1], out_.schedule.lost, 1, 100'000); }
    void take_rounds(const std::vector<Word>& w) { number(w[1], out_.schedule.rounds, 1, 250); }
    void take_heartbeat(const std::vector<Word>& w) { number(w[1], out_.schedule.heartbeat_ms, 0, 60'000); }
    void take_phase(const std::vector<Word>& w) { time(w[1], station_->phase, 0, 1'000'000'000, "phase 100"); }
    void take_lead(const std::vector<Word>& w) { time(w[1], station_->lead, 0, 1'000'000'000, "lead 100"); }
    void take_stage_2(const std::vector<Word>& w) { station_->stage_2 = w[1].text; }
    void take_name(const std::vector<Word>& w) {
        const auto good = [](char c) {
            return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_' || c == '.';
        };
        if (!std::all_of(w[1].text.begin(), w[1].text.end(), good) || w[1].text.size() > 40) {
            error(Topic::value, w[1].at, "'" + w[1].text + "' is no name", "letters, digits, '-', '_' and '.', at most 40");
            return;
        }
        if (w[1].text == "auto") {
            error(Topic::value, w[1].at, "'auto' is no name",
                  "station=auto is a station that gets its block from the master; call it something else");
            return;
        }
        for (const StationEntry& s : out_.schedule.stations)
            if (&s != station_ && s.name == w[1].text) {
                error(Topic::value, w[1].at, "the station of line " + std::to_string(s.at.line) + " has this name, too");
                break;
            }
        station_->name = w[1].text;
    }
    void take_ip(const std::vector<Word>& w) {
        station_->ip = parse_ip(w[1].text);
        if (!station_->ip) error(Topic::value, w[1].at, "'" + w[1].text + "' is no IPv4 address", "it is written 10.0.0.2");
        for (const StationEntry& s : out_.schedule.stations)
            if (&s != station_ && station_->ip && s.ip == station_->ip) {
                error(Topic::value, w[1].at, "the station of line " + std::to_string(s.at.line) + " has this address, too");
                break;
            }
    }
    void take_mac(const std::vector<Word>& w) {
        station_->mac = ethernet::parse_address(w[1].text);
        if (!station_->mac) error(Topic::value, w[1].at, "'" + w[1].text + "' is no MAC address", "it is written 02:00:00:00:00:07");
        for (const StationEntry& s : out_.schedule.stations)
            if (&s != station_ && station_->mac && s.mac == station_->mac) {
                error(Topic::value, w[1].at, "the station of line " + std::to_string(s.at.line) + " has this address, too");
                break;
            }
    }
    void take_backup(const std::vector<Word>& w) {
        if (station_->role != Role::backup && station_ != &ignored_) {
            error(Topic::line, w[0].at, "only a backup-master: has a backup offset");
            return;
        }
        station_->backup_at = w[1].at;
        time(w[1], station_->backup_offset, 1'000, 1'000'000'000, "backup-offset 200");
    }
    void take_slot(const std::vector<Word>& w) {
        SlotEntry slot;
        slot.at = {w[0].at.line, w[0].at.column, w[0].at.offset, w.back().at.offset + w.back().at.length - w[0].at.offset};
        const bool numbered = number(w[1], slot.setup.id, 0, 31);
        time(w[2], slot.setup.offset, 0, 1'000'000'000, "slot 0 200");
        if (w.size() > 3) {
            const std::string& text = w[3].text;
            const auto         slash = text.find('/');
            const auto         phasing = natural(text.substr(0, slash));
            const auto         period = slash == std::string::npos ? std::nullopt : natural(text.substr(slash + 1));
            if (!phasing || !period || *period == 0 || *period > 1'000'000 || *phasing == 0 || *phasing > *period)
                error(Topic::value, w[3].at, "'" + text + "' is no PHASING/PERIOD",
                      "1/2 is every first of two cycles, 2/2 every second; phasing goes from 1 to the period");
            else slot.setup.period = static_cast<std::uint32_t>(*period), slot.setup.phasing = static_cast<std::uint32_t>(*phasing - 1);
        }
        if (w.size() > 4) {
            slot.sized = true;
            number(w[4], slot.setup.size, 46, 1500);
        }
        for (const SlotEntry& other : station_->slots)
            if (numbered && other.setup.id == slot.setup.id)
                return error(Topic::line, w[1].at, "the station has a slot " + w[1].text + " already, in line " + std::to_string(other.at.line));
        if (station_->slots.size() >= most_slots)
            return error(Topic::line, w[0].at, "a station has at most " + std::to_string(most_slots) + " slots");
        station_->slots.push_back(slot);
    }

    void finish() {
        Schedule& s = out_.schedule;
        if (!out_.good()) return;
        const Place beginning{1, 1, 0, 0};
        if (s.stations.empty())
            return error(Topic::line, beginning, "there is no station", "write master:, below it cycle 1000 and slot 0 100");
        if (s.cycle == 0) {
            const StationEntry* m = s.master();
            return error(Topic::line, m != nullptr ? m->at : s.stations.front().at, "the cycle is not given",
                         "write cycle 1000 below master:");
        }
        unsigned backups = 0, slaves = 0;
        for (StationEntry& e : s.stations) {
            const unsigned which = e.role == Role::backup ? ++backups : e.role == Role::slave ? ++slaves : 0;
            if (e.name.empty())
                e.name = e.role == Role::master ? "master" : (e.role == Role::backup ? "backup-" : "slave-") + std::to_string(which);
            if (e.role == Role::backup && e.backup_offset == 0)
                error(Topic::line, e.at, "the backup offset is not given", "write backup-offset 200 below it");
            if (e.phase < 0) e.phase = e.role == Role::backup ? e.backup_offset - std::min<Time>(e.backup_offset / 2, 100'000) : 0;
            if (e.lead < 0) e.lead = 0;
        }
        if (!out_.good()) return;
        sizes();
        judge(s, out_.messages);
    }

    /// A slot without a size is as long as fits before the next frame of anybody, or before the end of the cycle.
    void sizes() {
        Schedule& s = out_.schedule;
        for (StationEntry& e : s.stations)
            for (SlotEntry& slot : e.slots)
                if (!slot.sized) slot.setup.size = 46;
        const auto entries = plan::entries_of(s);
        for (std::size_t i = 0; i < entries.size(); ++i) {
            if (entries[i].what != plan::Entry::What::slot) continue;
            Time end = s.cycle;
            for (std::size_t k = i + 1; k < entries.size(); ++k)
                if (plan::meet(entries[i], entries[k])) {
                    end = std::min(end, entries[k].at);
                    break;
                }
            const Time bytes = (end - entries[i].at - s.guard) * s.speed / 8000 - 24 - static_cast<Time>(ethernet::header_bytes);
            for (SlotEntry& slot : s.stations[entries[i].station].slots)
                if (slot.setup.id == entries[i].id && !slot.sized)
                    slot.setup.size = static_cast<std::uint32_t>(std::clamp<Time>(bytes, 46, 1500));
        }
    }

    Reading                              out_;
    StationEntry                         ignored_;
    StationEntry*                        station_ = nullptr;
    std::map<std::string, std::uint32_t> given_, given_to_all_;  // keys that are there once: of the block, of the segment; their lines
};

}  // namespace

Reading read(std::string_view text) { return Reader().read(text); }

}  // namespace hal::tdma::config
