// SPDX-License-Identifier: MIT
// A line is KEY VALUE…, or a slot of the mode above it; `#` begins a comment.
#include <algorithm>
#include <charconv>

#include "bus/config/key_table.hpp"
#include "table.hpp"
#include "text/characters.hpp"
#include "text/numbers.hpp"
#include "text/quoting.hpp"
#include "text/suggest.hpp"

namespace hal::scocan {

namespace {

using bus::Entry;
using text::Word;
using Words = std::vector<Word>;

constexpr Time us = 1'000;
constexpr Time ms = 1'000 * us;
constexpr Time second = 1'000 * ms;

constexpr bus::Choice<Role> roles[] = {{"sync", Role::sync},
                                       {"backup", Role::backup},
                                       {"monitor", Role::monitor},
                                       {"bridge", Role::bridge}};

class Reader {
public:
    static const bus::KeyTable<Reader>& keys();
    static const bus::KeyTable<Reader>& message_keys();

    ReadResult read(std::string_view file) {
        text::Lines lines(file, "#");
        while (const auto one = lines.next()) {
            line(text::words_of(*one));
        }
        finish();
        out_.messages = std::move(report_.all);
        text::sort(out_.messages);
        return std::move(out_);
    }

    Table& table() { return out_.table; }
    Message& message() { return message_; }

private:
    void error(Topic topic, const Span& at, std::string sentence, std::string help = {}) {
        report_.error(topic, at, std::move(sentence), std::move(help));
    }

    void line(const Words& words) {
        const Word& first = words.front();
        if (is_digit(first.text[0])) return slot(words);
        const auto* key = keys().find(first.text);
        if (key == nullptr) {
            return error(Topic::line, first.at, "unknown key " + quoted(first.text),
                         suggestion(first.text, keys().names(), "keys are"));
        }
        if (words.size() > 1) {
            value_at_[first.text] = words[1].at;
        }
        keys().read_line(*key, words, *this, given_, key_report_);
    }

    template <class T>
    bool number(const Word& w, T& out, std::uint64_t min, std::uint64_t max) {
        const auto value = parse_natural(w.text);
        if (!value || *value < min || *value > max) {
            error(Topic::value, w.at,
                  "invalid number " + quoted(w.text) + ": expected " + std::to_string(min) + ".." +
                      std::to_string(max));
            return false;
        }
        out = static_cast<T>(*value);
        return true;
    }
    bool name(const Word& w) {
        if (bus::is_name(w.text)) return true;
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

    bool read_node(const Entry& entry) {
        const Words& w = entry.words;
        Node n{.name = w[1].text, .at = w[1].at};
        if (name(w[1]) && is_new_node(w) && read_kind(w[2], n) && read_role(w, n)) {
            table().nodes.push_back(std::move(n));
        }
        return true;
    }

    bool is_new_node(const Words& w) {
        if (const auto other = table().find(w[1].text)) {
            error(Topic::value, w[1].at, "duplicate node " + quoted(w[1].text),
                  "first in line " + std::to_string(table().nodes[*other].at.line) +
                      "; choose another name");
            return false;
        }
        if (table().nodes.size() < max_nodes) return true;
        error(Topic::line, w[0].at, "more than 126 nodes", "split the bus");
        return false;
    }

    bool read_kind(const Word& kind, Node& n) {
        n.senses = kind.text == "A";
        if (n.senses || kind.text == "B") return true;
        error(Topic::value, kind.at, "invalid type " + quoted(kind.text),
              "write A for a controller that detects an idle slot, B for one that waits "
              "for the announcement of the monitor");
        return false;
    }

    bool read_role(const Words& w, Node& n) {
        if (w.size() == 3) return true;
        const auto* role = std::find_if(std::begin(roles), std::end(roles),
                                        [&](const auto& r) { return w[3].text == r.word; });
        if (role == std::end(roles)) {
            error(Topic::value, w[3].at, "unknown role " + quoted(w[3].text),
                  suggestion(w[3].text, {"sync", "backup", "monitor", "bridge"}, "roles are"));
            return false;
        }
        n.role = role->value;
        if (n.role != Role::backup && w.size() > 4) {
            error(Topic::line, w[4].at, "unexpected text", "delete it");
            return false;
        }
        if (n.role != Role::backup) return true;
        if (w.size() == 5) return number(w[4], n.backup, 1, 7);
        error(Topic::line, w[3].at, "the backup has no number", "write backup 1");
        return false;
    }

    bool read_mode(const Entry& entry) {
        const Words& w = entry.words;
        Mode m{.name = w[2].text, .at = w[1].at};
        mode_ = nullptr;
        bad_mode_ = true;
        if (!number(w[1], m.number, 0, max_modes - 1) || !name(w[2])) return true;
        for (const Mode& other : table().modes) {
            if (other.number == m.number || other.name == m.name) {
                error(Topic::value, w[other.number == m.number ? 1 : 2].at, "duplicate mode",
                      "first in line " + std::to_string(other.at.line) +
                          "; choose another number and name");
                return true;
            }
        }
        table().modes.push_back(std::move(m));
        mode_ = &table().modes.back();
        bad_mode_ = false;
        return true;
    }

    // --- A slot: NUMBER[-NUMBER] private NODE IDS [every K offset J], shared, or sync

    static constexpr const char* slot_usage =
        "write 3 private NODE ID[,ID]|any [every K offset J], 4-7 shared, or 0 sync";

    void slot(const Words& w) {
        if (mode_ == nullptr) {
            if (!bad_mode_) {
                error(Topic::line, w[0].at, "slot outside a mode",
                      "write a line above it: mode 0 run");
            }
            return;
        }
        std::uint32_t first = 0;
        std::uint32_t last = 0;
        if (!slot_range(w[0], first, last)) return;
        if (w.size() < 2) {
            return error(Topic::line, w[0].at, "slot without a use", slot_usage);
        }
        Use use{.at = w[0].at};
        std::size_t next = 2;
        if (!slot_kind(w, use, next) || !slot_cycles(w, next, use)) return;
        if (mode_->slots.size() < table().slots) {
            mode_->slots.resize(table().slots);
        }
        for (std::uint32_t s = first; s <= last; ++s) {
            mode_->slots[s].push_back(use);
        }
    }

    bool slot_range(const Word& w, std::uint32_t& first, std::uint32_t& last) {
        const auto dash = std::min(w.text.find('-'), w.text.size());
        const auto end = table().slots - 1;
        if (!number(text::part(w, 0, dash), first, 0, end)) return false;
        last = first;
        if (dash == w.text.size()) return true;
        return number(text::part(w, dash + 1, w.text.size()), last, first, end);
    }

    /// Reads what the slot is used for; `next` is the first word behind it.
    bool slot_kind(const Words& w, Use& use, std::size_t& next) {
        const std::string& kind = w[1].text;
        if (kind == "private") {
            next = 4;
            return private_slot(w, use);
        }
        if (kind == "sync") {
            use.kind = Kind::sync;
            return true;
        }
        if (kind == "shared") return true;
        error(Topic::line, w[1].at, "unknown use " + quoted(kind),
              suggestion(kind, {"private", "shared", "sync"}, "uses are"));
        return false;
    }

    bool private_slot(const Words& w, Use& use) {
        use.kind = Kind::priv;
        if (w.size() < 4) {
            error(Topic::line, w[1].at, "private slot without node and identifier", slot_usage);
            return false;
        }
        const auto owner = node(w[2]);
        bool good = owner.has_value();
        use.node = owner.value_or(0);
        if (w[3].text == "any") return good;
        for (const Word& one : text::list_of(w[3])) {
            std::uint32_t id = 0;
            good = identifier(one, id) && good;
            use.ids.push_back(id);
        }
        if (use.ids.size() <= 64) return good;
        error(Topic::value, w[3].at, "more than 64 identifiers in one slot", "use further slots");
        return false;
    }

    /// Reads `every K offset J`.
    bool slot_cycles(const Words& w, std::size_t next, Use& use) {
        if (w.size() == next) return true;
        if (use.kind != Kind::priv || w.size() != next + 4 || w[next].text != "every" ||
            w[next + 2].text != "offset") {
            error(Topic::line, w[next].at, "unexpected text", slot_usage);
            return false;
        }
        if (!number(w[next + 1], use.every, 1, counter_cycles) ||
            !number(w[next + 3], use.offset, 0, use.every - 1)) {
            return false;
        }
        if ((use.every & (use.every - 1)) == 0) return true;
        error(Topic::value, w[next + 1].at,
              "invalid number " + quoted(w[next + 1].text) + ": the cycle counter is modulo 64",
              "write 1, 2, 4, 8, 16, 32 or 64");
        return false;
    }

    // --- A message: NAME ID and its options

    bool read_message(const Entry& entry) {
        const Words& w = entry.words;
        message_ = Message{};
        message_.name = w[1].text;
        message_.at = w[1].at;
        has_sender_ = false;
        has_size_ = false;
        const bool good = name(w[1]) && identifier(w[2], message_.id) && is_new_message(w) &&
                          read_options(w) && fields_fit(w[1]);
        if (!good) return true;
        if (!has_sender_) {
            unowned_.emplace_back(table().messages.size(), w[1].at);
        }
        table().messages.push_back(std::move(message_));
        return true;
    }

    bool is_new_message(const Words& w) {
        for (const Message& other : table().messages) {
            if (other.name != message_.name && other.id != message_.id) continue;
            error(Topic::value, w[other.name == message_.name ? 1 : 2].at, "duplicate message",
                  "first in line " + std::to_string(other.at.line) +
                      "; choose another name and identifier");
            return false;
        }
        return true;
    }

    bool read_options(const Words& w) {
        bus::GivenKeys given;
        for (std::size_t i = 3; i < w.size(); i += 2) {
            const auto* key = message_keys().find(w[i].text);
            if (key == nullptr) {
                error(Topic::line, w[i].at, "unknown key " + quoted(w[i].text),
                      suggestion(w[i].text, message_keys().names(), "keys are"));
                return false;
            }
            if (i + 1 == w.size()) {
                error(Topic::line, w[i].at, quoted(w[i].text) + " has no value",
                      "write " + bus::usage_of(keys().find("message")->info));
                return false;
            }
            const bool has_interval = is_interval(w[i].text) && message_.period != 0;
            if (has_interval && !given.contains(w[i].text)) {
                error(Topic::line, w[i].at, "period and event are both given",
                      "delete one of them; event T is the shortest interval of an event");
                return false;
            }
            const std::size_t before = report_.all.size();
            message_keys().read_line(*key, {w[i], w[i + 1]}, *this, given, key_report_);
            if (report_.all.size() != before) return false;
        }
        return true;
    }

    static bool is_interval(std::string_view key) { return key == "period" || key == "event"; }

    bool read_sender(const Entry& entry) {
        const auto found = node(entry.value);
        has_sender_ = found.has_value();
        message_.node = found.value_or(0);
        return true;
    }
    bool read_size(const Entry& entry) {
        has_size_ = true;
        return bus::number(&Message::bytes, 0, 8).parse(message_, entry);
    }
    bool read_interval(const Entry& entry) {
        message_.event = entry.key.text == "event";
        return bus::time(&Message::period, us, 1000 * second).parse(message_, entry);
    }

    bool fields_fit(const Word& at) {
        std::uint32_t used = 0;
        for (const Field& f : message_.fields) {
            used += size_of(f.type);
        }
        if (!has_size_) {
            message_.bytes = message_.fields.empty() ? 8 : used;
        }
        if (used <= message_.bytes) return true;
        error(Topic::value, at.at,
              "the fields of " + quoted(message_.name) + " have " + std::to_string(used) +
                  " bytes, the message has " + std::to_string(message_.bytes),
              "a CAN frame carries 8 bytes; send the rest in another message");
        return false;
    }

    bool read_fields(const Entry& entry) {
        for (const Word& one : text::list_of(entry.value)) {
            if (!read_field(one)) return true;
        }
        const std::uint32_t bytes = field_end();
        if (bytes > 8) {
            error(Topic::value, entry.value.at,
                  "the fields have " + std::to_string(bytes) + " bytes, a CAN frame carries 8",
                  "send the rest in another message");
        }
        return true;
    }

    std::uint32_t field_end() const {
        if (message_.fields.empty()) return 0;
        return message_.fields.back().at + size_of(message_.fields.back().type);
    }

    /// Reads NAME:TYPE.
    bool read_field(const Word& one) {
        constexpr FieldType types[] = {FieldType::u8,  FieldType::s8,  FieldType::u16,
                                       FieldType::s16, FieldType::u32, FieldType::s32,
                                       FieldType::f32, FieldType::f64};
        const auto colon = std::min(one.text.find(':'), one.text.size());
        const Word field = text::part(one, 0, colon);
        const std::string type_text = one.text.substr(std::min(colon + 1, one.text.size()));
        const auto* type = std::find_if(std::begin(types), std::end(types),
                                        [&](FieldType t) { return type_text == to_string(t); });
        if (field.empty() || type == std::end(types)) {
            error(Topic::value, one.at, "invalid field " + quoted(one.text),
                  "write NAME:TYPE; types are u8, s8, u16, s16, u32, s32, f32, f64");
            return false;
        }
        if (!name(field) || !is_new_field(field)) return false;
        message_.fields.push_back({field.text, *type, field_end()});
        return true;
    }

    bool is_new_field(const Word& field) {
        constexpr std::string_view pins[] = {"send", "sent",     "fresh",  "received",
                                             "age",  "interval", "invalid"};
        if (std::find(std::begin(pins), std::end(pins), field.text) != std::end(pins)) {
            error(Topic::value, field.at, "reserved field name " + quoted(field.text),
                  "messages have pins send, sent, fresh, received, age, interval and invalid; "
                  "choose another name");
            return false;
        }
        const auto& fields = message_.fields;
        const bool is_new = std::none_of(fields.begin(), fields.end(),
                                         [&](const Field& f) { return f.name == field.text; });
        if (!is_new) {
            error(Topic::value, field.at, "duplicate field " + quoted(field.text));
        }
        return is_new;
    }

    void finish() {
        Table& t = out_.table;
        if (t.cycle % t.slots != 0) {
            const bool slots_given = value_at_.contains("slots");
            error(Topic::value, value_at_[slots_given ? "slots" : "cycle"],
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

    ReadResult out_;
    text::Messages<Topic> report_;
    bus::TopicReport<Topic> key_report_{report_};
    bus::GivenKeys given_;
    std::map<std::string, Span> value_at_;  // by key
    std::vector<std::pair<std::size_t, Span>> unowned_;
    Mode* mode_ = nullptr;
    bool bad_mode_ = false;
    Message message_;  // the one that is read
    bool has_sender_ = false;
    bool has_size_ = false;
};

template <class T>
auto of_table(T Table::* member) {
    return [member](Reader& reader) -> T& { return reader.table().*member; };
}
template <class T>
auto of_message(T Message::* member) {
    return [member](Reader& reader) -> T& { return reader.message().*member; };
}

const bus::KeyTable<Reader>& Reader::keys() {
    static const bus::KeyTable<Reader> table{{
        {"bitrate", bus::bit_rate(of_table(&Table::bit_rate), 10e3, 1e6), "`1M`", "The bit rate."},
        {"cycle", bus::time(of_table(&Table::cycle), 100 * us, 10 * second), "`10ms`",
         "The cycle of the bus."},
        {"slots", bus::number(of_table(&Table::slots), 2, max_slots), "`20`",
         "The number of slots of a cycle. All slots have the same length."},
        {"guard", bus::time(of_table(&Table::guard), 1, second), "the minimum, in whole us",
         "The gap between two slots, for the clock errors of two nodes. It is at least 3 bits + "
         "0.3 us + 4 ppm of the time for which nodes coast (`lost` cycles)."},
        {"idle", bus::time(of_table(&Table::idle), 1, second), "16 bits",
         "A private slot without a frame until this time is idle. The owner must start by idle - "
         "guard - 2 bits, otherwise it skips the slot."},
        {"lost", bus::number(of_table(&Table::lost), 1, 1000), "`10`",
         "The number of lost SYNCs after which a node stops sending."},
        bus::Key<Reader>{"node", bus::own("", "a name, A or B, a role", &Reader::read_node), "",
                         "A node. Type A detects an idle slot itself. Type B waits for the "
                         "announcement of the monitor."}
            .words(2, 4, "NAME A|B [sync | backup K | monitor | bridge]")
            .repeated(),
        bus::Key<Reader>{"mode", bus::own("", "0..15, a name", &Reader::read_mode), "",
                         "The slots of a mode follow. Nodes start in mode 0."}
            .words(2, 2, "NUMBER NAME")
            .repeated(),
        bus::Key<Reader>{"message", bus::own("", "a name, 0x010..0x77F", &Reader::read_message), "",
                         "A message of the application, with the options below."}
            .words(2, 17,
                   "NAME ID [node NODE] [bytes N] [period T | event T] [deadline T] [jitter T] "
                   "[fields NAME:TYPE,…]")
            .repeated(),
    }};
    return table;
}

const bus::KeyTable<Reader>& Reader::message_keys() {
    static const bus::KeyTable<Reader> table{{
        {"node", bus::own("", "a node", &Reader::read_sender), "the owner of the message's slot",
         "The sender."},
        {"bytes", bus::own("a number of 0..8", "0..8", &Reader::read_size),
         "that of the fields; 8 without fields", "The length."},
        {"period",
         bus::own("a time of 1us..1000s, as in 10ms or 0.5s", "1us..1000s", &Reader::read_interval),
         "", "The message is sent periodically."},
        {"event",
         bus::own("a time of 1us..1000s, as in 10ms or 0.5s", "1us..1000s", &Reader::read_interval),
         "", "The message is sent at events, with this shortest interval."},
        {"deadline", bus::time(of_message(&Message::deadline), us, 1000 * second), "the period",
         "The longest permitted latency."},
        {"jitter", bus::time(of_message(&Message::jitter), 0, 1000 * second), "`0`",
         "The queueing jitter of the message."},
        {"fields", bus::own("", "NAME:TYPE, NAME:TYPE", &Reader::read_fields), "none",
         "The fields, with the types u8, s8, u16, s16, u32, s32, f32, f64. The names send, sent, "
         "fresh, received, age, interval and invalid are reserved."},
    }};
    return table;
}

}  // namespace

std::string reference() { return Reader::keys().reference(); }
std::string message_reference() { return Reader::message_keys().reference(); }

ReadResult read(std::string_view text) { return Reader().read(text); }

}  // namespace hal::scocan
