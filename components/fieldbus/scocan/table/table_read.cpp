// SPDX-License-Identifier: MIT
// A line is KEY VALUE…, or a slot of the mode above it; `#` begins a comment.
#include <algorithm>
#include <charconv>
#include <map>

#include "table.hpp"
#include "text/numbers.hpp"
#include "text/quoting.hpp"
#include "text/suggest.hpp"

namespace hal::scocan {

namespace {

using text::Word;
using Words = std::vector<Word>;

class Reader {
public:
    Reading read(std::string_view file) {
        text::Lines lines(file, "#");
        while (const auto one = lines.next()) {
            line(text::words_of(*one));
        }
        finish();
        out_.messages = std::move(report_.all);
        text::sort(out_.messages);
        return std::move(out_);
    }

private:
    using Take = void (Reader::*)(const Words&);
    struct Key {
        Take take;
        const char* usage;
        std::size_t least, most;
    };
    static const std::map<std::string, Key>& keys() {
        static const std::map<std::string, Key> all{
            {"bitrate", {&Reader::take_bit_rate, "bitrate 1M", 2, 2}},
            {"cycle", {&Reader::take_cycle, "cycle 10ms", 2, 2}},
            {"slots", {&Reader::take_slots, "slots NUMBER", 2, 2}},
            {"guard", {&Reader::take_guard, "guard 4us", 2, 2}},
            {"idle", {&Reader::take_idle, "idle 16us", 2, 2}},
            {"lost", {&Reader::take_lost, "lost CYCLES", 2, 2}},
            {"node",
             {&Reader::take_node, "node NAME A|B [sync | backup K | monitor | bridge]", 3, 5}},
            {"mode", {&Reader::take_mode, "mode NUMBER NAME", 3, 3}},
            {"message",
             {&Reader::take_message,
              "message NAME ID [node NODE] [bytes N] [period T | event T] [deadline T] [jitter T] "
              "[fields NAME:TYPE,…]",
              3, 18}},
        };
        return all;
    }

    void error(Topic topic, const Span& at, std::string sentence, std::string help = {}) {
        report_.error(topic, at, std::move(sentence), std::move(help));
    }

    void line(const Words& words) {
        const Word& first = words.front();
        if (first.text[0] >= '0' && first.text[0] <= '9') return slot(words);
        const auto key = keys().find(first.text);
        if (key == keys().end()) {
            std::vector<std::string> names;
            for (const auto& [name, of] : keys()) {
                names.push_back(name);
            }
            return error(Topic::line, first.at, "unknown key " + quoted(first.text),
                         suggestion(first.text, names, "keys are"));
        }
        const Key& k = key->second;
        if (words.size() < k.least || words.size() > k.most) {
            const bool more = words.size() > k.most;
            return error(Topic::line, more ? words[k.most].at : first.at,
                         more ? "unexpected text" : quoted(first.text) + " is incomplete",
                         std::string("write ") + k.usage);
        }
        if (k.most == 2) {
            const auto [before, is_new] = given_.emplace(first.text, first.at.line);
            if (!is_new) {
                return error(
                    Topic::line, first.at, "duplicate key " + quoted(first.text),
                    "first in line " + std::to_string(before->second) + "; delete one of them");
            }
        }
        (this->*k.take)(words);
    }

    bool time(const Word& w, Time& out, Time least, Time most, const char* example) {
        const auto value = parse_duration_ns(w.text, 0.0);
        if (!value) {
            error(Topic::value, w.at, "invalid time " + quoted(w.text),
                  std::string("write a number with a unit: ") + example);

            return false;
        }
        if (*value < least || *value > most) {
            error(Topic::value, w.at,
                  quoted(w.text) + " is out of range (" + microseconds(least) + ".." +
                      microseconds(most) + ")");

            return false;
        }
        out = *value;
        return true;
    }
    template <class T>
    bool number(const Word& w, T& out, std::uint64_t least, std::uint64_t most) {
        const auto value = parse_natural(w.text);
        if (!value || *value < least || *value > most) {
            error(Topic::value, w.at,
                  "invalid number " + quoted(w.text) + ": expected " + std::to_string(least) +
                      ".." + std::to_string(most));

            return false;
        }
        out = static_cast<T>(*value);
        return true;
    }
    bool name(const Word& w) {
        const auto fits = [](char c) {
            return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                   c == '-' || c == '_';
        };
        if (std::all_of(w.text.begin(), w.text.end(), fits) && w.text.size() <= 40) return true;
        error(Topic::value, w.at, "invalid name " + quoted(w.text),
              "use at most 40 letters, digits, '-' and '_'");
        return false;
    }
    /// Reads an identifier of the application: not one that the discipline itself uses.
    bool identifier(const Word& w, std::uint32_t& out) {
        const auto value = parse_natural(w.text);
        if (!value || *value > 0x7ff) {
            error(Topic::value, w.at, "invalid identifier " + quoted(w.text), "write 0x010..0x77F");

            return false;
        }
        out = static_cast<std::uint32_t>(*value);
        if (!is_reserved(out)) return true;
        const bool is_sync = out < 0x10;
        error(Topic::value, w.at, "reserved identifier " + id_text(out),
              is_sync ? "0x000..0x00F are for the SYNC and the announcements; use 0x010..0x77F"
                      : "0x780..0x7FF are for the configuration of the nodes; use 0x010..0x77F");
        return false;
    }
    std::optional<std::size_t> node(const Word& w) {
        const auto found = out_.table.find(w.text);
        if (found) return found;
        std::vector<std::string> all;
        for (const Node& n : out_.table.nodes) {
            all.push_back(n.name);
        }
        error(Topic::value, w.at, "unknown node " + quoted(w.text),
              all.empty() ? "define it above: node " + w.text + " A"
                          : suggestion(w.text, all, "nodes above this line are"));
        return {};
    }

    void take_bit_rate(const Words& w) {
        const auto value = parse_quantity(w[1].text);
        const double scale = !value                ? 0
                             : value->unit == "k"  ? 1e3
                             : value->unit == "M"  ? 1e6
                             : value->unit.empty() ? 1
                                                   : 0;
        const double rate = value ? value->number * scale : 0;
        if (rate < 10e3 || rate > 1e6) {
            return error(Topic::value, w[1].at, "invalid bit rate " + quoted(w[1].text),
                         "write 10k..1M, as in 500k or 1M");
        }
        out_.table.bit_rate = static_cast<std::uint32_t>(rate);
    }
    void take_cycle(const Words& w) {
        time(w[1], out_.table.cycle, 100'000, 10'000'000'000, "cycle 10ms");
        cycle_at_ = w[1].at;
    }
    void take_slots(const Words& w) {
        number(w[1], out_.table.slots, 2, most_slots);
        slots_at_ = w[1].at;
    }
    void take_guard(const Words& w) { time(w[1], out_.table.guard, 1, 1'000'000'000, "guard 4us"); }
    void take_idle(const Words& w) { time(w[1], out_.table.idle, 1, 1'000'000'000, "idle 16us"); }
    void take_lost(const Words& w) { number(w[1], out_.table.lost, 1, 1000); }

    void take_node(const Words& w) {
        Node n{.name = w[1].text, .at = w[1].at};
        if (!name(w[1])) return;
        if (const auto other = out_.table.find(n.name)) {
            return error(Topic::value, w[1].at, "duplicate node " + quoted(n.name),
                         "first in line " + std::to_string(out_.table.nodes[*other].at.line) +
                             "; choose another name");
        }
        if (out_.table.nodes.size() >= most_nodes) {
            return error(Topic::line, w[0].at, "more than 126 nodes", "split the bus");
        }
        if (w[2].text != "A" && w[2].text != "B") {
            return error(Topic::value, w[2].at, "invalid type " + quoted(w[2].text),
                         "write A for a controller that detects an idle slot, B for one that waits "
                         "for the announcement of the monitor");
        }
        n.senses = w[2].text == "A";
        if (w.size() > 3) {
            constexpr Role roles[] = {Role::sync, Role::backup, Role::monitor, Role::bridge};
            const auto* role = std::find_if(std::begin(roles), std::end(roles),
                                            [&](Role r) { return w[3].text == to_string(r); });
            if (role == std::end(roles)) {
                return error(
                    Topic::value, w[3].at, "unknown role " + quoted(w[3].text),
                    suggestion(w[3].text, {"sync", "backup", "monitor", "bridge"}, "roles are"));
            }
            n.role = *role;
            if (n.role == Role::backup && w.size() < 5) {
                return error(Topic::line, w[3].at, "the backup has no number", "write backup 1");
            }
            if (n.role == Role::backup && !number(w[4], n.backup, 1, 7)) return;
            if (n.role != Role::backup && w.size() > 4) {
                return error(Topic::line, w[4].at, "unexpected text", "delete it");
            }
        }
        out_.table.nodes.push_back(std::move(n));
    }

    void take_mode(const Words& w) {
        Mode m{.name = w[2].text, .at = w[1].at};
        mode_ = nullptr;
        bad_mode_ = true;
        if (!number(w[1], m.number, 0, most_modes - 1) || !name(w[2])) return;
        for (const Mode& other : out_.table.modes) {
            if (other.number == m.number || other.name == m.name) {
                return error(Topic::value, w[other.number == m.number ? 1 : 2].at, "duplicate mode",
                             "first in line " + std::to_string(other.at.line) +
                                 "; choose another number and name");
            }
        }
        out_.table.modes.push_back(std::move(m));
        mode_ = &out_.table.modes.back();
        bad_mode_ = false;
    }

    void slot(const Words& w) {
        if (mode_ == nullptr) {
            if (!bad_mode_) {
                error(Topic::line, w[0].at, "slot outside a mode",
                      "write a line above it: mode 0 run");
            }
            return;
        }
        const auto dash = w[0].text.find('-');
        std::uint32_t first = 0;
        std::uint32_t last = 0;
        const auto end = out_.table.slots - 1;
        if (!number(text::part(w[0], 0, std::min(dash, w[0].text.size())), first, 0, end)) return;
        last = first;
        if (dash != std::string::npos &&
            !number(text::part(w[0], dash + 1, w[0].text.size()), last, first, end)) {
            return;
        }
        constexpr const char* usage =
            "write 3 private NODE ID[,ID]|any [every K offset J], 4-7 shared, or 0 sync";
        if (w.size() < 2) return error(Topic::line, w[0].at, "slot without a use", usage);
        Use use{.at = w[0].at};
        std::size_t next = 2;
        if (w[1].text == "private") {
            use.kind = Kind::priv;
            if (w.size() < 4) {
                return error(Topic::line, w[1].at, "private slot without node and identifier",
                             usage);
            }
            const auto owner = node(w[2]);
            bool good = owner.has_value();
            use.node = owner.value_or(0);
            for (const Word& one : text::list_of(w[3])) {
                std::uint32_t id = 0;
                if (w[3].text == "any") break;
                if (identifier(one, id)) {
                    use.ids.push_back(id);
                } else {
                    good = false;
                }
            }
            if (use.ids.size() > 64) {
                return error(Topic::value, w[3].at, "more than 64 identifiers in one slot",
                             "use further slots");
            }
            if (!good) return;
            next = 4;
        } else if (w[1].text == "sync") {
            use.kind = Kind::sync;
        } else if (w[1].text != "shared") {
            return error(Topic::line, w[1].at, "unknown use " + quoted(w[1].text),
                         suggestion(w[1].text, {"private", "shared", "sync"}, "uses are"));
        }
        if (w.size() > next) {
            if (use.kind != Kind::priv || w.size() != next + 4 || w[next].text != "every" ||
                w[next + 2].text != "offset") {
                return error(Topic::line, w[next].at, "unexpected text", usage);
            }
            if (!number(w[next + 1], use.every, 1, counter_cycles) ||
                !number(w[next + 3], use.offset, 0, use.every - 1)) {
                return;
            }
            if ((use.every & (use.every - 1)) != 0) {
                return error(Topic::value, w[next + 1].at,
                             "invalid number " + quoted(w[next + 1].text) +
                                 ": the cycle counter is modulo 64",
                             "write 1, 2, 4, 8, 16, 32 or 64");
            }
        }
        if (mode_->slots.size() < out_.table.slots) {
            mode_->slots.resize(out_.table.slots);
        }
        for (std::uint32_t s = first; s <= last; ++s) {
            mode_->slots[s].push_back(use);
        }
    }

    void take_message(const Words& w) {
        Message m{.name = w[1].text, .at = w[1].at};
        if (!name(w[1]) || !identifier(w[2], m.id)) return;
        for (const Message& other : out_.table.messages) {
            if (other.name == m.name || other.id == m.id) {
                return error(Topic::value, w[other.name == m.name ? 1 : 2].at, "duplicate message",
                             "first in line " + std::to_string(other.at.line) +
                                 "; choose another name and identifier");
            }
        }
        bool sender = false;
        bool sized = false;
        for (std::size_t i = 3; i < w.size(); i += 2) {
            const std::string& key = w[i].text;
            for (std::size_t k = 3; k < i; k += 2) {
                if (const std::string& other = w[k].text; other == key || is_interval(other, key)) {
                    return error(
                        Topic::line, w[i].at,
                        other == key ? "duplicate key " + quoted(key)
                                     : "period and event are both given",
                        other == key
                            ? "delete one of them"
                            : "delete one of them; event T is the shortest interval of an event");
                }
            }
            if (i + 1 == w.size()) {
                return error(Topic::line, w[i].at, quoted(key) + " has no value",
                             std::string("write ") + keys().at("message").usage);
            }
            const Word& value = w[i + 1];
            bool good = true;
            if (key == "node") {
                const auto found = node(value);
                good = sender = found.has_value();
                m.node = found.value_or(0);
            } else if (key == "bytes") {
                good = sized = number(value, m.bytes, 0, 8);
            } else if (key == "period" || key == "event") {
                good = time(value, m.period, 1000, 1'000'000'000'000, "period 10ms");

                m.event = key == "event";
            } else if (key == "deadline") {
                good = time(value, m.deadline, 1000, 1'000'000'000'000, "deadline 10ms");
            } else if (key == "jitter") {
                good = time(value, m.jitter, 0, 1'000'000'000'000, "jitter 100us");
            } else if (key == "fields") {
                good = fields(value, m);
            } else {
                return error(
                    Topic::line, w[i].at, "unknown key " + quoted(key),
                    suggestion(key,
                               {"node", "bytes", "period", "event", "deadline", "jitter", "fields"},
                               "keys are"));
            }
            if (!good) return;
        }
        std::uint32_t used = 0;
        for (const Field& f : m.fields) {
            used += size_of(f.type);
        }
        if (!sized) {
            m.bytes = m.fields.empty() ? 8 : used;
        }
        if (used > m.bytes) {
            return error(Topic::value, w[1].at,
                         "the fields of " + quoted(m.name) + " have " + std::to_string(used) +
                             " bytes, the message has " + std::to_string(m.bytes),
                         "a CAN frame carries 8 bytes; send the rest in another message");
        }
        if (!sender) {
            unowned_.emplace_back(out_.table.messages.size(), w[1].at);
        }
        out_.table.messages.push_back(std::move(m));
    }

    static bool is_interval(std::string_view a, std::string_view b) {
        return (a == "period" && b == "event") || (a == "event" && b == "period");
    }

    bool fields(const Word& value, Message& m) {
        constexpr std::string_view pins[] = {"send",     "sent", "fresh",
                                             "received", "age",  "interval"};
        std::uint32_t at = 0;
        for (const Word& one : text::list_of(value)) {
            const auto colon = one.text.find(':');
            constexpr FieldType types[] = {FieldType::u8,  FieldType::s8,  FieldType::u16,
                                           FieldType::s16, FieldType::u32, FieldType::s32,
                                           FieldType::f32, FieldType::f64};
            const std::string type_text =
                colon == std::string::npos ? "" : one.text.substr(colon + 1);
            const auto* type = std::find_if(std::begin(types), std::end(types),
                                            [&](FieldType t) { return type_text == to_string(t); });
            if (colon == std::string::npos || colon == 0 || type == std::end(types)) {
                error(Topic::value, one.at, "invalid field " + quoted(one.text),
                      "write NAME:TYPE; types are u8, s8, u16, s16, u32, s32, f32, f64");

                return false;
            }
            const Word field_name = text::part(one, 0, colon);
            if (!name(field_name)) return false;
            if (std::find(std::begin(pins), std::end(pins), field_name.text) != std::end(pins)) {
                error(Topic::value, field_name.at, "reserved field name " + quoted(field_name.text),
                      "each message has pins send, sent, fresh, received, age and interval; "
                      "choose another name");

                return false;
            }
            for (const Field& other : m.fields) {
                if (other.name == field_name.text) {
                    error(Topic::value, field_name.at,
                          "duplicate field " + quoted(field_name.text));

                    return false;
                }
            }
            m.fields.push_back({field_name.text, *type, at});
            at += size_of(*type);
        }
        if (at > 8) {
            error(Topic::value, value.at,
                  "the fields have " + std::to_string(at) + " bytes, a CAN frame carries 8",
                  "send the rest in another message");

            return false;
        }
        return true;
    }

    void finish() {
        Table& t = out_.table;
        if (t.cycle % t.slots != 0) {
            error(Topic::value, slots_at_.line != 0 ? slots_at_ : cycle_at_,
                  "a cycle of " + microseconds(t.cycle) + " in " + std::to_string(t.slots) +
                      " slots: slots must be whole nanoseconds",
                  "choose a number of slots that divides the cycle");
        }
        for (Mode& m : t.modes) {
            m.slots.resize(std::max<std::size_t>(m.slots.size(), t.slots));
        }
        if (t.guard == 0) {
            t.guard = (t.required_guard(t.cycle * t.lost) + 999) / 1000 * 1000;
        }
        if (t.idle == 0) {
            t.idle = std::max(t.bits(16), t.guard + t.bits(10));
        }
        t.index();
        for (const auto& [index, at] : unowned_) {
            owner_of(t.messages[index], at);
        }
        if (!report_.failed()) {
            check(t, report_);
        }
        t.crc = crc16(normalised(t));
    }
    /// The sender of a message without `node` is the owner of its private slot.
    void owner_of(Message& m, const Span& at) {
        for (const Mode& mode : out_.table.modes) {
            if (const Use* use = out_.table.owner(mode.number, m.id)) {
                m.node = use->node;
                return;
            }
        }
        error(Topic::value, at, "message " + quoted(m.name) + " has no sender",
              "write node NAME behind it; no private slot has " + id_text(m.id));
    }

    Reading out_;
    text::Messages<Topic> report_;
    std::map<std::string, std::uint32_t> given_;
    std::vector<std::pair<std::size_t, Span>> unowned_;
    Mode* mode_ = nullptr;
    bool bad_mode_ = false;
    Span cycle_at_, slots_at_;
};

}  // namespace

Reading read(std::string_view text) { return Reader().read(text); }

}  // namespace hal::scocan
