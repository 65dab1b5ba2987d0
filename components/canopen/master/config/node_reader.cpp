// SPDX-License-Identifier: MIT
#include "node_reader.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <utility>

#include "canopen/eds/concise_dcf.hpp"

namespace hal::canopen::config {

namespace {

constexpr Choice<Reaction> reactions[] = {
    {"nothing", Reaction::nothing}, {"restart", Reaction::restart}, {"stop-all", Reaction::stop_all}, {"reset-all", Reaction::reset_all}};

/// Types as `write 0x2000 u16 = 5` has them.
constexpr Choice<Type> types[] = {{"bool", Type::boolean},   {"i8", Type::integer8},    {"i16", Type::integer16},
                                  {"i32", Type::integer32},  {"i64", Type::integer64},  {"u8", Type::unsigned8},
                                  {"u16", Type::unsigned16}, {"u32", Type::unsigned32}, {"u64", Type::unsigned64},
                                  {"real32", Type::real32},  {"real64", Type::real64},  {"text", Type::visible_string}};

std::optional<Type> type_named(std::string_view word) {
    for (const auto& t : types)
        if (lower(word) == t.word) return t.value;
    return {};
}
std::string upper(std::string text) {
    for (char& c : text) c = static_cast<char>(c >= 'a' && c <= 'z' ? c - 'a' + 'A' : c);
    return text;
}
constexpr const char* type_words = "u8, u16, u32, u64, i8, i16, i32, i64, real32, real64 or bool";

/// "2026-03-01", "2026-03-01 14:30", "2026-03-01 14:30:05" as 1020h has it: days since 1984-01-01, and ms since midnight.
std::optional<std::pair<std::uint32_t, std::uint32_t>> since_1984(const std::string& text) {
    using namespace std::chrono;
    int      read = 0, hour = 0, minute = 0, second = 0, y = 0;
    unsigned m = 0, d = 0;
    if (std::sscanf(text.c_str(), "%4d-%2u-%2u%n", &y, &m, &d, &read) != 3) return {};
    int more = 0;
    if (std::sscanf(text.c_str() + read, " %2d:%2d%n", &hour, &minute, &more) == 2) {
        read += std::exchange(more, 0);
        std::sscanf(text.c_str() + read, ":%2d%n", &second, &more);
        read += more;
    }
    const year_month_day date{year(y), month(m), day(d)};
    if (static_cast<std::size_t>(read) != text.size() || !date.ok() || hour < 0 || hour > 23 || minute < 0 || minute > 59 || second < 0 ||
        second > 59)
        return {};
    const auto days = (sys_days(date) - sys_days(year(1984) / 1 / 1)).count();
    if (days < 1 || days > 0xffff) return {};
    return std::pair(static_cast<std::uint32_t>(days), static_cast<std::uint32_t>(((hour * 60 + minute) * 60 + second) * 1000));
}

/// INDEX or INDEX:SUB with a hexadecimal index; none when it is something else.
std::optional<std::pair<std::uint16_t, std::uint8_t>> address(std::string_view text, bool& has_sub) {
    if (!text.starts_with("0x")) return {};
    const std::size_t colon = std::min(text.find(':'), text.size());
    has_sub = colon < text.size();
    const auto index = natural(text.substr(0, colon));
    const auto sub = has_sub ? natural(text.substr(colon + 1)) : std::optional<std::uint64_t>(0);
    if (!index || !sub || *index > 0xffff || *sub > 0xff) return {};
    return std::pair(static_cast<std::uint16_t>(*index), static_cast<std::uint8_t>(*sub));
}

}  // namespace

void NodeReader::read() {
    describe();
    settings();
    firmware();
    pdos();
    srdos();
    writes();
    object_options();
    finish_objects();
    leftover();
    scanner_list();
    for (Pdo& pdo : node_.pdos)
        if (!pdo.safety) configure(pdo);
    configure_srdos();
}

void NodeReader::describe() {
    const Line* file = keys_.find("eds");
    const Line* profile = keys_.find("device");
    unsigned    axes = 1;
    keys_.take_small("axes", axes, 1, 8);
    if (file != nullptr) eds_ = descriptions_.get(file->value, report_);
    if (eds_ != nullptr) catalog_ = std::make_unique<Catalog>(*eds_, node_.setup.id);
    else if (profile != nullptr && file == nullptr) {
        catalog_ = std::make_unique<Catalog>(lower(profile->value.text), axes);
        if (catalog_->empty()) keys_.refuse(*profile, listed(Catalog::profiles()) + "; or give the device's EDS: eds = FILE");
    }
    undescribed_ = (file != nullptr && eds_ == nullptr) || (profile != nullptr && file == nullptr && catalog_->empty());
    if (!catalog_) catalog_ = std::make_unique<Catalog>("", 1);
}

void NodeReader::identity(const char* key, std::uint32_t& to, std::uint64_t described) {
    to = static_cast<std::uint32_t>(described);
    const Line* line = keys_.find(key);
    if (line == nullptr) return;
    if (lower(line->value.text) == "any") to = 0;
    else if (const auto value = natural(line->value.text); value && *value <= 0xffffffff) to = static_cast<std::uint32_t>(*value);
    else keys_.refuse(*line, "a number, decimal or with 0x, or any");
}

void NodeReader::settings() {
    NodeSetup& s = node_.setup;
    const auto described = [&](std::uint16_t index, std::uint8_t sub, std::optional<std::uint32_t> otherwise) {
        return eds_ == nullptr ? 0 : catalog_->number(index, sub, otherwise.value_or(0));
    };
    const eds::DeviceInfo none{}, &info = eds_ != nullptr ? eds_->device : none;
    identity("device-type", s.device_type, described(0x1000, 0, {}));
    identity("vendor", s.vendor, described(0x1018, 1, info.vendor_number));
    identity("product", s.product, described(0x1018, 2, info.product_number));
    identity("revision", s.revision, 0);
    identity("serial", s.serial, 0);
    keys_.take_flag("mandatory", s.mandatory);
    keys_.take_flag("configure", s.configure);
    keys_.take_flag("keep-alive", s.keep_alive);
    keys_.take_flag("start", s.start);
    keys_.take_flag("restore", s.restore);
    keys_.take_flag("save", s.save);
    keys_.take_small("start-order", s.start_order, 0, 127);
    keys_.take_time("sdo-timeout", s.sdo_timeout, millisecond, 60 * second);
    keys_.take_small("sdo-retries", s.sdo_resends, 0, 20);
    if (const Line* line = keys_.find("configured")) {
        const std::string text = lower(line->value.text);
        const auto        date = since_1984(text);
        node_.dated_by_content = text == "by-content";
        if (date) s.configuration_date = date->first, s.configuration_time = date->second;
        else if (!node_.dated_by_content && text != "no") keys_.refuse(*line, "by-content, a date such as 2026-03-01 14:30, or no");
    }
    keys_.take_time("boot-time", s.boot_limit, millisecond, 3600 * second);
    keys_.take_time("retry", s.retry, millisecond, 3600 * second);
    keys_.take_time("retry-most", s.retry_most, millisecond, 3600 * second);
    s.retry_most = std::max(s.retry, s.retry_most);
    keys_.take_choice("on-failure", s.on_failure, reactions);
    keys_.take_choice("on-loss", s.on_loss, reactions);

    Time heartbeat = Time{s.heartbeat_ms} * millisecond, watch = Time{bus_.heartbeat_ms} * millisecond * 5 / 2;
    if (keys_.take_time("heartbeat", heartbeat, millisecond, 65535 * millisecond, true))
        s.heartbeat_ms = static_cast<std::uint16_t>(heartbeat / millisecond);
    if (Time limit = 0; keys_.take_time("silence", limit, millisecond, 600 * second, true)) s.heartbeat_limit = limit == 0 ? -1 : limit;
    if (s.heartbeat_limit > 0 && s.heartbeat_limit < heartbeat)
        report_.error(Topic::node, keys_.find("silence")->value.at, "silence is a loss before the next heartbeat is due",
                      "heartbeat is " + std::to_string(s.heartbeat_ms) + "ms; write at least twice that");
    if (const Line* line = keys_.find("guarding")) {
        const auto words = words_of(line->value);
        const auto period = words.empty() ? std::nullopt : duration(words[0].text);
        const auto factor = words.size() == 3 && words[1].text == "x" ? natural(words[2].text) : std::nullopt;
        if (lower(line->value.text) == "no") s.guard_ms = 0;
        else if (!period || *period < millisecond || *period > 65535 * millisecond || !factor || *factor < 1 || *factor > 255)
            keys_.refuse(*line, "a period and how many may be missed, as in 100ms x 3");
        else
            s.guard_ms = static_cast<std::uint16_t>(*period / millisecond), s.guard_factor = static_cast<std::uint8_t>(*factor),
            s.heartbeat_ms = 0;
    }
    keys_.take_time("watch-master", watch, millisecond, 65535 * millisecond, true);
    s.master_limit_ms = bus_.heartbeat_ms == 0 ? std::uint16_t{0} : static_cast<std::uint16_t>(std::min<Time>(watch / millisecond, 65535));
    if (const Line* line = keys_.find("watch-master"); line != nullptr && bus_.heartbeat_ms == 0 && watch != 0)
        report_.error(Topic::node, line->value.at, "the master has no heartbeat that the node could watch",
                      "write heartbeat = 100ms in [bus]");
    keys_.find("type");
}

void NodeReader::firmware() {
    NodeProgram& p = node_.setup.program;
    if (const Line* line = keys_.find("firmware")) p.update = descriptions_.bytes(line->value, p.image, report_);
    keys_.take_small("firmware-number", p.number, 1, 254);
    keys_.take_small("firmware-id", p.id, 1, 0xffffffff);
    keys_.take_text("firmware-version", p.version);
    keys_.take_time("firmware-time", p.limit, second, 3600 * second);
}

// What is written to the node before it is started.

void NodeReader::writes() {
    // What all nodes have to agree on about the SYNC; one that does not know it is not asked.
    const auto agree = [&](std::uint16_t index, auto value) {
        node_.setup.writes.push_back(object_write(index, 0, value));
        node_.setup.writes.back().optional = true;
    };
    if (bus_.sync_counter != 0) agree(0x1019, bus_.sync_counter);
    if (bus_.sync_window != 0) agree(0x1007, static_cast<std::uint32_t>(bus_.sync_window / microsecond));
    if (bus_.sync_cob != 0x80) agree(0x1005, bus_.sync_cob);
    if (eds_ != nullptr && eds_->commissioning) values_of_dcf();
    std::vector<Line*> lines = keys_.all_of("write "), commands = keys_.all_of("command ");
    lines.insert(lines.end(), commands.begin(), commands.end());
    std::sort(lines.begin(), lines.end(), [](const Line* a, const Line* b) { return a->key.at.offset < b->key.at.offset; });
    for (Line* line : lines) write_one(*line);
}

/// What a DCF says of the node, but for what this file says: its PDOs, and how it is watched.
void NodeReader::values_of_dcf() {
    const Word& file = keys_.find("eds")->value;
    const auto  configuration = eds::configuration_of(*eds_, node_.setup.id);
    for (const auto& m : configuration.messages)
        report_.warning(Topic::value, file.at, "line " + std::to_string(m.at.line) + " of '" + file.text + "': " + m.sentence, m.help);
    for (const auto& w : configuration.writes)
        if ((w.index < 0x1400 || w.index > 0x1bff) && w.index != 0x1016 && w.index != 0x1017) node_.setup.writes.push_back({w, {}});
    const std::size_t slash = file.text.rfind('/');
    for (const eds::Object& o : eds_->objects)
        for (const eds::Entry& e : o.entries) {
            if (e.download_file.empty()) continue;
            if (o.index == 0x1f50) {
                report_.warning(
                    Topic::value, file.at, "the program '" + e.download_file + "' that '" + file.text + "' names is not downloaded",
                    "write firmware = " + e.download_file + ", with firmware-id or firmware-version of what the node shall have");
                continue;
            }
            const bool  whole = e.download_file.front() == '/' || slash == file.text.npos;
            ObjectWrite write{{o.index, e.sub, {}}, e.name.empty() ? o.name : e.name};
            std::string why;
            if (!descriptions_.bytes(whole ? e.download_file : file.text.substr(0, slash + 1) + e.download_file, write.data, why))
                report_.error(Topic::value, file.at,
                              "the file '" + e.download_file + "', which '" + file.text + "' names for object " +
                                  object_label(o.index, e.sub) + ", cannot be read: " + why,
                              "put it beside that file, or take its line DownloadFile= out");
            else if (write.data.empty())
                report_.warning(
                    Topic::value, file.at,
                    "the file '" + e.download_file + "' for object " + object_label(o.index, e.sub) + " is empty, and is not written");
            else node_.setup.writes.push_back(std::move(write));
        }
}

void NodeReader::write_one(const Line& line) {
    const_cast<Line&>(line).used = true;
    auto              words = words_of(line.key);
    const std::string verb = words[0].text;
    words.erase(words.begin());
    const auto refuse = [&](std::string sentence, std::string help) {
        report_.error(Topic::object, line.key.at, std::move(sentence), std::move(help));
    };
    if (words.empty() || words.size() > 2)
        return refuse("what is written is missing", verb + " OBJECT = VALUE, as in: " + verb + " 0x6083 = 1000");
    bool                has_sub = false;
    const auto          place = address(words[0].text, has_sub);
    const Known*        known = place ? catalog_->find(place->first, place->second) : catalog_->find(words[0].text);
    std::optional<Type> type = words.size() == 2 ? type_named(words[1].text) : std::nullopt;
    if (words.size() == 2 && !type) return refuse("'" + words[1].text + "' is no type", std::string("write ") + type_words + " or text");
    if (known == nullptr && !(place && type)) {
        if (undescribed_) return;
        if (!place) return refuse("the node has no object '" + words[0].text + "'", did_you_mean(words[0].text, catalog_->names()));
        return refuse("the description has no object " + object_label(place->first, place->second),
                      "give its type: " + verb + " " + words[0].text + " u16 = " + line.value.text);
    }
    const std::uint16_t index = known != nullptr ? known->index : place->first;
    const std::uint8_t  sub = known != nullptr ? known->sub : place->second;
    if (!type) type = known->type;
    if (known != nullptr && !known->writable)
        return refuse("object " + object_label(index, sub, known->single) + " (" + known->about + ") cannot be written",
                      "the description has it as read only");
    const eds::Encoded value = eds::encode_strictly(line.value.text, static_cast<std::uint16_t>(*type), node_.setup.id);
    if (!value || value.bytes.empty()) {
        const std::string wanted = to_string(*type), problem = value ? "there is no value to write" : value.error;
        report_.error(Topic::value, line.value.at, problem,
                      problem.find(wanted) == std::string::npos ? "the object is of type " + wanted : "");
        return;
    }
    node_.setup.writes.push_back({{index, sub, value.bytes}, known != nullptr ? known->about : std::string()});
    node_.setup.writes.back().always = verb == "command";
}

// PDOs.

std::map<std::pair<bool, unsigned>, NodeReader::PdoWish> NodeReader::wishes(const char* what, unsigned most) {
    std::map<std::pair<bool, unsigned>, PdoWish> out;
    for (const bool to_node : {true, false}) {
        const std::string beginning = std::string(to_node ? "r" : "t") + what;
        for (Line* line : keys_.all_of(beginning)) {
            const std::string rest = line->key.text.substr(beginning.size());
            const std::size_t dot = std::min(rest.find('.'), rest.size());
            const auto        number = natural(rest.substr(0, dot));
            if (!number) continue;  // an object whose name begins so
            line->used = true;
            if (*number < 1 || *number > most) {
                report_.error(Topic::value, line->key.at, "there is no " + upper(what) + " " + std::to_string(*number),
                              upper(what) + "s are numbered from 1 to " + std::to_string(most));
                continue;
            }
            PdoWish& wish = out[{to_node, static_cast<unsigned>(*number)}];
            wish.number = static_cast<unsigned>(*number), wish.to_node = to_node;
            if (dot == rest.size()) wish.objects = line;
            else wish.options[rest.substr(dot + 1)] = line;
        }
    }
    return out;
}

void NodeReader::pdos() {
    auto       wished = wishes();
    const bool mentioned = std::any_of(wished.begin(), wished.end(), [](const auto& w) { return w.second.objects != nullptr; });
    for (unsigned number = 1; number <= 512; ++number)
        for (const bool to_node : {true, false}) {
            const auto base = static_cast<std::uint16_t>((to_node ? 0x1400U : 0x1800U) + number - 1);
            const bool on = (catalog_->number(base, 1, cob_invalid) & cob_invalid) == 0 &&
                            catalog_->number(static_cast<std::uint16_t>(base + 0x200), 0, 0) != 0;
            const auto wish = wished.find({to_node, number});
            if (wish != wished.end()) {
                if (wish->second.objects != nullptr || (on && !mentioned)) pdo(wish->second);
                else {
                    const Line& line = *wish->second.options.begin()->second;
                    report_.error(Topic::node, line.key.at,
                                  std::string(to_node ? "rpdo" : "tpdo") + std::to_string(number) + " is not used",
                                  "name its objects: " + std::string(to_node ? "rpdo" : "tpdo") + std::to_string(number) +
                                      " = OBJECT, OBJECT, or = default");
                }
            } else if (on && !mentioned) {
                pdo({number, to_node});
            } else if (on) {  // what is not named stays off the bus
                auto off = to_node ? rpdo_writes(number, {}, node_.setup.id) : tpdo_writes(number, {}, node_.setup.id);
                std::move(off.begin(), off.end(), std::back_inserter(node_.setup.writes));
            }
        }
}

void NodeReader::pdo(const PdoWish& wish) {
    Pdo pdo;
    pdo.to_node = wish.to_node, pdo.number = wish.number;
    pdo.at = wish.objects != nullptr ? wish.objects->value.at : node_.at;
    const std::string word = wish.objects != nullptr ? lower(wish.objects->value.text) : "default";
    const auto        base = static_cast<std::uint16_t>((wish.to_node ? 0x1400U : 0x1800U) + wish.number - 1);
    if (word == "none") {
        auto off = wish.to_node ? rpdo_writes(wish.number, {}, node_.setup.id) : tpdo_writes(wish.number, {}, node_.setup.id);
        std::move(off.begin(), off.end(), std::back_inserter(node_.setup.writes));
        return;
    }
    pdo.transmission = bus_.sync != SyncMode::none ? 1 : 255;
    if (word == "default") {
        if (!default_objects(wish, pdo)) return;
        pdo.transmission = static_cast<std::uint8_t>(catalog_->number(base, 2, 255));
        pdo.inhibit_100us = static_cast<std::uint16_t>(catalog_->number(base, 3, 0));
        pdo.event_ms = static_cast<std::uint16_t>(catalog_->number(base, 5, 0));
    } else if (word.starts_with("mpdo ")) {
        pdo.multiplex = wish.to_node ? Multiplex::destination_address : Multiplex::source_address;
        pdo.transmission = 255;
        Word rest = wish.objects->value;
        rest.text.erase(0, 5), rest.at.offset += 5, rest.at.column += 5, rest.at.length -= 5;
        objects_of(rest, pdo);
        std::erase_if(pdo.objects, [&](const Object& o) { return !multiplexable(o, pdo); });
    } else {
        objects_of(wish.objects->value, pdo);
    }
    const auto described = static_cast<std::uint32_t>(catalog_->number(base, 1, cob_invalid));
    if ((described & cob_invalid) == 0 && cob_id(described) != 0) pdo.cob = described & (cob_extended | 0x1fffffff);
    else if (wish.number <= 4) pdo.cob = (wish.to_node ? 0x100U : 0x80U) + 0x100 * wish.number + node_.setup.id;
    pdo_options(wish, pdo);
    if (pdo.multiplexed()) {
        for (const char* key : {"transmission", "request"})
            if (const auto given = wish.options.find(key); given != wish.options.end() && pdo.transmission < 254)
                report_.error(Topic::node, given->second->value.at, "a multiplexed PDO is sent when an object changes",
                              "write transmission = event, or leave it out");
        if (!pdo.objects.empty()) node_.pdos.push_back(std::move(pdo));
    } else if (pdo.bits() > 64)
        report_.error(Topic::object, pdo.at, "these objects are " + std::to_string(pdo.bits()) + " bits together; a PDO carries 64",
                      "move some to another PDO");
    else if (!pdo.objects.empty()) node_.pdos.push_back(std::move(pdo));
}

bool NodeReader::multiplexable(const Object& o, const Pdo& pdo) {
    if (!o.filler && o.bits <= 32 && o.bits % 8 == 0) return true;
    report_.error(
        Topic::object, pdo.at,
        o.filler ? std::string("a multiplexed PDO has no gaps") : "object '" + o.pin + "' has " + std::to_string(o.bits) + " bits",
        "a multiplexed PDO carries one object of 8, 16, 24 or 32 bits at a time");
    return false;
}

void NodeReader::pdo_options(const PdoWish& wish, Pdo& pdo) {
    const bool asked = wish.options.contains("request");
    if (asked) pdo.transmission = 253;
    for (const auto& [name, line] : wish.options) {
        const std::string value = lower(line->value.text);
        if (name == "transmission") {
            const auto words = words_of(line->value);
            const auto every = words.size() == 2 && lower(words[0].text) == "sync" ? natural(words[1].text) : std::nullopt;
            const auto number = natural(value);
            if (value == "sync") pdo.transmission = 1;
            else if (value == "event") pdo.transmission = 255;
            else if (value == "sync on change") pdo.transmission = 0;
            else if (every && *every >= 1 && *every <= 240) pdo.transmission = static_cast<std::uint8_t>(*every);
            else if (number && (*number <= 240 || *number == 254 || *number == 255 || (asked && (*number == 252 || *number == 253))))
                pdo.transmission = static_cast<std::uint8_t>(*number);
            else if (number && (*number == 252 || *number == 253) && !wish.to_node)
                report_.error(Topic::node, line->value.at, "such a PDO is sent only when it is asked for",
                              "write tpdo" + std::to_string(wish.number) + ".request = 100ms");
            else keys_.refuse(*line, "sync, sync N, sync on change, or event");
        } else if (name == "request") {
            const auto time = duration(value);
            if (wish.to_node)
                report_.error(Topic::value, line->key.at, "only what a node sends can be asked for", "an rpdo is sent by the master");
            else if (!time || *time < millisecond || *time > 3600 * second) keys_.refuse(*line, "a time from 1ms to 3600s");
            else pdo.request = *time;
        } else if (name == "inhibit" || name == "event-timer" || name == "timeout") {
            const auto time = duration(value);
            const Time most = name == "inhibit" ? 6553 * millisecond : 65535 * millisecond;
            if (!time || *time > most) keys_.refuse(*line, "a time up to " + std::to_string(most / millisecond) + "ms");
            else if (name == "inhibit") pdo.inhibit_100us = static_cast<std::uint16_t>(*time / (100 * microsecond));
            else if (name == "event-timer") pdo.event_ms = static_cast<std::uint16_t>(*time / millisecond);
            else if (!wish.to_node) pdo.limit = *time;
            else
                report_.error(Topic::value, line->key.at, "only what a node sends can fail to come",
                              "an rpdo has no time-out; the node may have one: event-timer");
        } else if (name == "cob-id") {
            const bool          plus = value.starts_with("$nodeid+");
            const auto          id = natural(plus ? std::string_view(value).substr(8) : std::string_view(value));
            const std::uint64_t cob = id.value_or(0x20000000) + (plus ? node_.setup.id : 0);
            if (!id || cob == 0 || cob > 0x1fffffff) keys_.refuse(*line, "an identifier such as 0x1C1, or $NODEID+0x180");
            else if (cob <= 0x7ff && (restricted(static_cast<std::uint32_t>(cob)) || cob == cob_id(bus_.sync_cob)))
                report_.error(Topic::value, line->value.at, "identifier '" + line->value.text + "' belongs to another service of CANopen",
                              "PDOs have 0x181 to 0x57F");
            else pdo.cob = static_cast<std::uint32_t>(cob) | (cob > 0x7ff ? cob_extended : 0);
        } else if (name == "sync-start") {
            const auto number = natural(value);
            if (!number || *number > 240) keys_.refuse(*line, "a number from 0 to 240");
            else if (bus_.sync_counter == 0 && *number != 0)
                report_.error(Topic::node, line->value.at, "the SYNC has no counter to start at", "write sync-counter = N in [bus]");
            else pdo.sync_start = static_cast<std::uint8_t>(*number);
        } else {
            report_.error(Topic::line, line->key.at, "a PDO has no '" + name + "'",
                          "there are transmission, inhibit, event-timer, timeout, request, cob-id, sync-start");
        }
    }
    if (pdo.synchronous() && bus_.sync == SyncMode::none)
        report_.error(
            Topic::node, pdo.at,
            std::string(wish.to_node ? "rpdo" : "tpdo") + std::to_string(wish.number) + " is sent with the SYNC, and there is none",
            "write sync = cycle in [bus], or " + std::string(wish.to_node ? "rpdo" : "tpdo") + std::to_string(wish.number) +
                ".transmission = event");
}

void NodeReader::objects_of(const Word& list, Pdo& pdo) {
    for (const Word& word : list_of(list)) {
        Object out;
        if (object(word, pdo, out)) pdo.objects.push_back(std::move(out));
        if (pdo.objects.size() > 64 && !pdo.multiplexed()) return;
    }
}

bool NodeReader::default_objects(const PdoWish& wish, Pdo& pdo) {
    const auto  mapping = static_cast<std::uint16_t>((wish.to_node ? 0x1600U : 0x1A00U) + wish.number - 1);
    const auto  count = catalog_->number(mapping, 0, 0);
    const Place at = wish.objects != nullptr ? wish.objects->value.at : node_.at;
    const std::string which = (wish.to_node ? "rpdo" : "tpdo") + std::to_string(wish.number);
    if (count == 0xfe || count == 0xff) {
        const std::string sentence = which + " of the description is a multiplexed PDO, whose objects it does not tell";
        const std::string help = "name them: " + which + " = mpdo OBJECT, OBJECT";
        if (wish.objects != nullptr) report_.error(Topic::object, at, sentence, help);
        else report_.note(Topic::object, at, sentence + ": it is left as it is", help);
        return false;
    }
    if (count == 0 || count > 64) {
        report_.error(Topic::object, at, "the description has no default objects for " + which,
                      "name them: " + which + " = OBJECT, OBJECT");
        return false;
    }
    for (unsigned n = 1; n <= count; ++n) {
        const auto     entry = static_cast<std::uint32_t>(catalog_->number(mapping, static_cast<std::uint8_t>(n), 0));
        const auto     index = static_cast<std::uint16_t>(entry >> 16);
        const unsigned bits = entry & 0xff;
        if (entry == 0) continue;
        const Known* known = catalog_->find(index, static_cast<std::uint8_t>(entry >> 8));
        Known        unknown;
        unknown.index = index, unknown.sub = static_cast<std::uint8_t>(entry >> 8), unknown.single = false;
        unknown.name = dashed(object_label(index, unknown.sub)), unknown.about = object_label(index, unknown.sub);
        unknown.type = bits > 32 ? Type::unsigned64 : bits > 16 ? Type::unsigned32 : bits > 8 ? Type::unsigned16 : Type::unsigned8;
        Object out = known_object(known != nullptr && known->type != Type::none ? *known : unknown, bits);
        out.filler = index <= 0x1b;
        pdo.objects.push_back(std::move(out));
    }
    return !pdo.objects.empty();
}

Object NodeReader::known_object(const Known& known, unsigned bits) const {
    Object out;
    out.index = known.index, out.sub = known.sub;
    out.type = known.type, out.bits = static_cast<std::uint8_t>(bits);
    out.pin = known.name, out.about = known.about;
    return out;
}

bool NodeReader::object(const Word& word, Pdo& pdo, Object& out) {
    const auto words = words_of(word);
    const auto refuse = [&](std::string sentence, std::string help, std::string label = {}) {
        report_.error(Topic::object, word.at, std::move(sentence), std::move(help), std::move(label));
        return false;
    };
    if (words.empty()) return refuse("an object is missing between the commas", "write OBJECT, OBJECT");
    const std::string first = lower(words[0].text);
    if (first == "gap") {
        const auto bits = words.size() == 2 ? natural(words[1].text) : std::nullopt;
        const Type type = !bits         ? Type::none
                          : *bits == 1  ? Type::boolean
                          : *bits == 8  ? Type::unsigned8
                          : *bits == 16 ? Type::unsigned16
                          : *bits == 32 ? Type::unsigned32
                                        : Type::none;
        if (type == Type::none || !pdo.to_node)
            return refuse("'" + word.text + "' cannot be", "an rpdo may have gap 1, gap 8, gap 16 or gap 32");
        out.index = static_cast<std::uint16_t>(type), out.bits = static_cast<std::uint8_t>(*bits), out.type = type, out.filler = true;
        return true;
    }
    bool         has_sub = false;
    const auto   place = address(first, has_sub);
    const Known* known = place ? catalog_->find(place->first, place->second) : catalog_->find(first);
    if (place && !has_sub && (known == nullptr || !known->single) && catalog_->has(place->first))
        return refuse("object " + object_label(place->first, 0, true) + " has sub-indices", "write " + object_label(place->first, 1));
    const auto type = words.size() == 2 ? type_named(words[1].text) : std::nullopt;
    if (words.size() > 2 || (words.size() == 2 && !type))
        return refuse("'" + word.text + "' is no object", std::string("write a name, or INDEX:SUB TYPE, the type one of ") + type_words);
    if (known == nullptr) {
        if (undescribed_ && !(place && type)) return false;
        if (!place && catalog_->empty())
            return refuse("nothing is known of this node's objects",
                          "give its description: eds = FILE, or device = " + listed(Catalog::profiles()));
        if (!place) {
            const std::string near = did_you_mean(first, catalog_->names(pdo.to_node));
            return refuse("the node has no object '" + words[0].text + "'",
                          near.empty() ? "a PDO can carry: " + listed(catalog_->names(pdo.to_node), 6) : near);
        }
        if (!type)
            return refuse("the description has no object " + object_label(place->first, place->second),
                          "give its type: " + words[0].text + " u16");
        Known unknown;
        unknown.index = place->first, unknown.sub = place->second;
        unknown.name = dashed(words[0].text), unknown.about = words[0].text, unknown.type = *type;
        out = known_object(unknown, bits_of(*type));
        return bits_of(*type) != 0 || refuse("an object of this type has no fixed length", std::string("write ") + type_words);
    }
    if (pdo.to_node ? !known->to_node : !known->from_node)
        return refuse("object '" + known->name + "' cannot be " + (pdo.to_node ? "received" : "sent") + " in a PDO",
                      pdo.to_node && known->from_node  ? "it is sent by the node: put it into a tpdo"
                      : !pdo.to_node && known->to_node ? "it is received by the node: put it into an rpdo"
                                                       : "its description does not allow it");
    const Type as = type.value_or(known->type);
    if (bits_of(as) == 0) return refuse("object '" + known->name + "' has no fixed length", "a PDO carries numbers");
    out = known_object(*known, bits_of(as));
    out.type = as;
    return true;
}

/// The objects that a node tells by multiplexed PDOs stand in its scanner list. One without it, or with a fixed one, knows by itself.
void NodeReader::scanner_list() {
    constexpr unsigned rows = 254;  // of one object
    unsigned           count = 0;
    for (const Pdo& pdo : node_.pdos) {
        if (pdo.multiplex != Multiplex::source_address) continue;
        for (const Object& o : pdo.objects) {
            const auto   list = static_cast<std::uint16_t>(0x1fa0 + count / rows);
            const auto   row = static_cast<std::uint8_t>(count++ % rows + 1);
            const Known* known = catalog_->find(list, row);
            if (known != nullptr ? !known->writable : catalog_->has(list)) continue;
            node_.setup.writes.push_back(object_write(list, row, 1U << 24 | std::uint32_t{o.index} << 8 | o.sub, "Object scanner list"));
            node_.setup.writes.back().optional = true;
        }
    }
}

void NodeReader::configure(Pdo& pdo) {
    if (pdo.cob == 0) return;  // gets one when all nodes are known
    configure_pdo(node_.setup, pdo);
}

void configure_pdo(NodeSetup& node, const Pdo& pdo) {
    PdoDescription d;
    d.cob = pdo.cob, d.transmission = pdo.transmission, d.multiplex = pdo.multiplex;
    if (!pdo.to_node) d.inhibit_100us = pdo.inhibit_100us, d.sync_start = pdo.sync_start;
    // Sent at least so often; the node misses it when three in a row did not come.
    d.event_ms = static_cast<std::uint16_t>(std::min(pdo.to_node ? 3U * pdo.event_ms : pdo.event_ms, 65535U));
    if (!pdo.multiplexed())
        for (const Object& o : pdo.objects) d.mapping.push_back(map_entry(o.index, o.sub, o.bits));
    auto writes = pdo.to_node ? rpdo_writes(pdo.number, d, node.id) : tpdo_writes(pdo.number, d, node.id);
    std::move(writes.begin(), writes.end(), std::back_inserter(node.writes));
}

}  // namespace hal::canopen::config
