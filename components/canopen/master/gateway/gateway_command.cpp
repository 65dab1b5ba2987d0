// SPDX-License-Identifier: MIT
#include "gateway_command.hpp"

#include <algorithm>
#include <iterator>

#include "canopen/eds/eds_text.hpp"
#include "text/text_table.hpp"

namespace hal::canopen::gateway {

using eds::same_word;

namespace {

enum class Scope : std::uint8_t { gateway, net, node };

struct Row {
    std::string_view first, second;  ///< words; the second may be empty
    Verb verb;
    Scope scope;
    std::uint8_t min = 0;
    std::uint8_t max = 0;  ///< numbers behind them
};

constexpr Row rows[] = {
    {"start", "", Verb::start, Scope::node},
    {"stop", "", Verb::stop, Scope::node},
    {"preop", "", Verb::preoperational, Scope::node},
    {"preoperational", "", Verb::preoperational, Scope::node},
    {"reset", "node", Verb::reset_node, Scope::node},
    {"reset", "comm", Verb::reset_communication, Scope::node},
    {"reset", "communication", Verb::reset_communication, Scope::node},
    {"enable", "guarding", Verb::enable_guarding, Scope::node, 2, 2},
    {"disable", "guarding", Verb::disable_guarding, Scope::node},
    {"enable", "heartbeat", Verb::enable_heartbeat, Scope::node, 1, 1},
    {"disable", "heartbeat", Verb::disable_heartbeat, Scope::node},
    {"init", "", Verb::init, Scope::net, 1, 1},
    {"set", "heartbeat", Verb::set_heartbeat, Scope::net, 1, 1},
    {"set", "id", Verb::set_id, Scope::net, 1, 1},
    {"set", "command_timeout", Verb::set_command_timeout, Scope::net, 1, 1},
    {"set", "command_size", Verb::set_command_size, Scope::net, 1, 1},
    {"set", "sdo_timeout", Verb::set_sdo_timeout, Scope::net, 1, 1},
    {"set", "sdo_block", Verb::set_sdo_block, Scope::net, 1, 1},
    {"store", "", Verb::store, Scope::net},
    {"restore", "", Verb::restore, Scope::net},
    {"set", "network", Verb::set_network, Scope::gateway, 1, 1},
    {"set", "node", Verb::set_node, Scope::net, 1, 1},
    {"info", "version", Verb::info_version, Scope::net},
    {"lss_switch_glob", "", Verb::lss_switch_global, Scope::net, 1, 1},
    {"lss_switch_sel", "", Verb::lss_switch_selective, Scope::net, 4, 4},
    {"lss_set_node", "", Verb::lss_set_node, Scope::net, 1, 1},
    {"lss_conf_bitrate", "", Verb::lss_bit_rate, Scope::net, 2, 2},
    {"lss_activate_bitrate", "", Verb::lss_activate, Scope::net, 1, 1},
    {"lss_store", "", Verb::lss_store, Scope::net},
    {"lss_inquire_addr", "", Verb::lss_inquire, Scope::net, 0, 1},
    {"lss_get_node", "", Verb::lss_get_node, Scope::net},
    {"lss_identity", "", Verb::lss_identify, Scope::net, 6, 6},
    {"lss_ident_nonconf", "", Verb::lss_identify_unconfigured, Scope::net},
    {"_lss_fastscan", "", Verb::lss_fastscan, Scope::net, 0, 1},
};

/// Words, those in quotation marks without them (a doubled mark is one). False: a mark is never
/// closed.
bool split(std::string_view line, std::vector<std::string>& words) {
    for (std::size_t n = 0; n < line.size();) {
        if (line[n] == ' ' || line[n] == '\t') {
            ++n;
            continue;
        }
        if (line[n] == '#') {
            return true;  // a comment
        }
        std::string word;
        if (line[n] == '"') {
            for (++n;; ++n) {
                if (n == line.size()) return false;
                if (line[n] == '"' && (n + 1 == line.size() || line[n + 1] != '"')) break;
                if (line[n] == '"') {
                    ++n;
                }
                word += line[n];
            }
            ++n;
        } else {
            while (n < line.size() && line[n] != ' ' && line[n] != '\t') {
                word += line[n++];
            }
        }
        words.push_back(std::move(word));
    }
    return true;
}

bool number(std::string_view text, std::uint32_t max, std::uint32_t& value) {
    bool negative = false;
    std::uint64_t read = 0;
    if (!read_number(text, negative, read) || negative || read > max) return false;
    value = static_cast<std::uint32_t>(read);
    return true;
}

struct Reader {
    Parsed out = {};
    std::vector<std::string> words = {};
    std::size_t at = 0;

    bool fail(std::string why, Error error = Error::syntax) {
        out.error = error;
        out.why = std::move(why);
        return false;
    }
    bool more() const { return at < words.size(); }
    bool take(std::uint32_t max, std::uint32_t& value, const char* what) {
        if (!more()) return fail(std::string("the ") + what + " is missing");
        if (!number(words[at], max, value)) {
            return fail("'" + words[at].substr(0, 40) + "' is no " + what);
        }
        ++at;
        return true;
    }
    bool end() {
        return !more() || fail("nothing is expected at '" + words[at].substr(0, 40) + "'");
    }

    bool numbers(std::size_t min, std::size_t max) {
        Command& c = out.command;
        while (more() && c.numbers.size() < max) {
            std::uint32_t value = 0;
            if (!take(UINT32_MAX, value, "number")) return false;
            c.numbers.push_back(value);
        }
        return c.numbers.size() < min ? fail("a number is missing") : end();
    }
    /// How many numbers, net and node, may stand before a command.
    static std::size_t max_numbers(Scope scope) {
        if (scope == Scope::gateway) return 0;
        return scope == Scope::net ? 1 : 2;
    }
    bool scope(Scope scope, const std::vector<std::uint32_t>& before) {
        Command& c = out.command;
        if (before.size() > max_numbers(scope)) {
            return fail("there are too many numbers before the command");
        }
        if (scope == Scope::node && !before.empty()) {
            c.node = before.back();
        }
        if (scope == Scope::node ? before.size() == 2 : !before.empty()) {
            c.net = before.front();
        }
        return true;
    }
    bool object(bool writes) {
        Command& c = out.command;
        std::uint32_t index = 0;
        std::uint32_t sub = 0;
        if (!take(0xffff, index, "index") || !take(0xff, sub, "sub-index")) return false;
        c.index = static_cast<std::uint16_t>(index);
        c.sub = static_cast<std::uint8_t>(sub);
        if (!more()) return !writes || fail("data type and value are missing");
        c.format = format(words[at]);
        if (!c.format) {
            return fail("unknown data type '" + words[at].substr(0, 40) + "'; see: help");
        }
        ++at;
        if (!writes) return end();
        if (!bytes_of(std::span(words).subspan(at), *c.format, c.value)) {
            return fail("invalid value for type " + std::string(c.format->word));
        }
        at = words.size();
        return true;
    }
    bool transmission(std::uint32_t& type) {
        if (!more()) return fail("the transmission type is missing: event, rtr, sync0 to sync240");
        const std::string word = eds::lower(words[at]);
        if (word == "event") {
            type = on_event;
        } else if (word == "rtr") {
            type = on_request;
        } else if (word == "sync") {
            type = 1;
        } else if (!word.starts_with("sync") || !number(word.substr(4), 240, type)) {
            return fail("invalid transmission type '" + word.substr(0, 40) +
                        "': use event, rtr, sync0 to sync240");
        }
        ++at;
        return true;
    }
    bool pdo_setup() {
        Command& c = out.command;
        std::uint32_t number = 0;
        std::uint32_t cob = 0;
        std::uint32_t type = 0;
        std::uint32_t count = 0;
        if (!take(512, number, "PDO number") || !take(UINT32_MAX, cob, "COB-ID") ||
            !transmission(type) || !take(64, count, "count")) {
            return false;
        }
        c.numbers = {number, cob, type};
        for (; count > 0; --count, ++at) {
            if (!more()) return fail("a data type is missing");
            const Format* f = format(words[at]);
            if (!f || bits_of(f->type) == 0) {
                return fail("'" + words[at].substr(0, 40) + "' is not a data type of fixed length");
            }
            c.formats.push_back(f);
        }
        return end();
    }
    bool pdo_values(bool writes) {
        Command& c = out.command;
        std::uint32_t number = 0;
        std::uint32_t count = 0;
        if (!take(512, number, "PDO number")) return false;
        c.numbers = {number};
        if (!writes) return end();
        if (!take(64, count, "count")) return false;
        c.numbers.push_back(count);
        c.values.assign(words.begin() + static_cast<std::ptrdiff_t>(at), words.end());
        at = words.size();
        return true;
    }
    bool flag() {
        if (!more()) return fail("enable or disable is missing");
        const bool on = same_word(words[at], "enable") || words[at] == "1";

        const bool off = same_word(words[at], "disable") || words[at] == "0";
        if (!on && !off) {
            return fail("'" + words[at].substr(0, 40) + "' is neither enable nor disable");
        }
        out.command.numbers = {on ? 1U : 0U};
        ++at;
        return end();
    }
    bool next_is(std::string_view a, std::string_view b) const {
        return more() && (same_word(words[at], a) || same_word(words[at], b));
    }
    std::vector<std::uint32_t> address();
    bool transfer(bool writes, const std::vector<std::uint32_t>& before);
    bool simple(const std::string& first, const std::vector<std::uint32_t>& before);
    bool command();
};

/// The numbers before the command: net and node. One too many is kept, for the message.
std::vector<std::uint32_t> Reader::address() {
    std::vector<std::uint32_t> numbers;
    std::uint32_t value = 0;
    while (more() && numbers.size() < 3 && number(words[at], UINT32_MAX, value)) {
        numbers.push_back(value);
        ++at;
    }
    return numbers;
}

/// `read` and `write`, of an object or of a PDO.
bool Reader::transfer(bool writes, const std::vector<std::uint32_t>& before) {
    const bool is_pdo = next_is("pdo", "p");
    if (!is_pdo) {
        out.command.verb = writes ? Verb::write : Verb::read;
        return scope(Scope::node, before) && object(writes);
    }
    out.command.verb = writes ? Verb::write_pdo : Verb::read_pdo;
    if (!scope(Scope::net, before)) return false;
    ++at;
    return pdo_values(writes);
}

/// A command of the table of rows.
bool Reader::simple(const std::string& first, const std::vector<std::uint32_t>& before) {
    bool known = false;
    for (const Row& row : rows) {
        if (!same_word(first, row.first)) continue;
        known = true;
        if (!row.second.empty()) {
            if (!next_is(row.second, row.second)) continue;
            ++at;
        }
        out.command.verb = row.verb;
        return scope(row.scope, before) && numbers(row.min, row.max);
    }
    if (!known) {
        return fail("unknown command '" + first.substr(0, 40) + "'; see: help",
                    Error::not_supported);
    }
    const std::string found = more() ? " is not '" + words[at].substr(0, 40) + "'" : " is missing";
    return fail("what to " + first + found + "; see: help", Error::not_supported);
}

bool Reader::command() {
    const std::vector<std::uint32_t> before = address();
    if (!more()) return fail("the command is missing");
    const std::string first = words[at++];
    const auto is = [&](std::string_view word) { return same_word(first, word); };
    if (is("read") || is("r")) return transfer(false, before);
    if (is("write") || is("w")) return transfer(true, before);
    if (is("set") && next_is("rpdo", "tpdo")) {
        out.command.verb = same_word(words[at], "rpdo") ? Verb::set_rpdo : Verb::set_tpdo;
        ++at;
        return scope(Scope::net, before) && pdo_setup();
    }
    if (is("boot_up_indication")) {
        out.command.verb = Verb::boot_up_indication;
        return scope(Scope::net, before) && flag();
    }
    if (is("help")) {
        out.command.verb = Verb::help;
        return true;
    }
    return simple(first, before);
}

}  // namespace

const char* to_string(Error error) {
    constexpr TextRow<Error> texts[] = {
        {Error::none, "no error"},
        {Error::not_supported, "request not supported"},
        {Error::syntax, "syntax error"},
        {Error::state, "request not processed due to internal state"},
        {Error::timeout, "timeout"},
        {Error::no_net, "no default net set"},
        {Error::no_node, "no default node set"},
        {Error::bad_net, "unsupported net"},
        {Error::bad_node, "unsupported node"},
        {Error::lost_guarding, "lost guarding message"},
        {Error::heartbeat_started, "heartbeat started"},
        {Error::lost_heartbeat, "heartbeat lost"},
        {Error::boot_up, "boot-up"},
        {Error::init_failed, "CAN could not be initialised"},
        {Error::pdo_used, "PDO already used"},
        {Error::pdo_length, "PDO length exceeded"},
        {Error::lss_own, "LSS: error of the device's own"},
        {Error::lss_node_id, "LSS: node-ID not supported"},
        {Error::lss_bit_rate, "LSS: bit rate not supported"},
        {Error::lss_store, "LSS: parameters cannot be stored"},
        {Error::lss_media, "LSS: no access to the memory"},
        {Error::no_memory, "running out of memory"},
    };
    return find_text(texts, error, "error");
}

Parsed parse(std::string_view line) {
    Reader reader;
    line = eds::trimmed(line);
    if (line.starts_with('[')) {
        const auto close = line.find(']');
        if (close == std::string_view::npos || !number(eds::trimmed(line.substr(1, close - 1)),
                                                       UINT32_MAX, reader.out.command.sequence)) {
            reader.fail("a line begins with [NUMBER]");
            return std::move(reader.out);
        }
        line.remove_prefix(close + 1);
    }
    if (!split(line, reader.words)) {
        reader.fail("a quotation mark is not closed");
        return std::move(reader.out);
    }
    if (!reader.words.empty()) {
        reader.command();
    }
    return std::move(reader.out);
}

std::string_view help_text() {
    return "[SEQ] begins a line; NET and NODE may be left out after `set network`, `set node`; "
           "numbers as in C; answers are OK, a value, "
           "or ERROR:n\n"
           "[[NET] NODE] r[ead] INDEX SUB [TYPE]            [[NET] NODE] w[rite] INDEX SUB TYPE "
           "VALUE\n"
           "[[NET] NODE] start | stop | preop[erational] | reset node | reset comm[unication]\n"
           "[[NET] NODE] enable guarding MS FACTOR | disable guarding | enable heartbeat MS | "
           "disable heartbeat\n"
           "[NET] set rpdo|tpdo N COB-ID event|rtr|syncN COUNT TYPE...    [NET] r p N    [NET] w p "
           "N COUNT VALUE...\n"
           "[NET] init BIT-RATE-INDEX | set heartbeat MS | set id NODE | boot_up_indication "
           "enable|disable | store | restore\n"
           "[NET] set command_timeout MS | set command_size BYTES | set sdo_timeout MS | set "
           "sdo_block 0|1\n"
           "set network NET | [NET] set node NODE | [NET] info version | help\n"
           "[NET] lss_switch_glob 0|1 | lss_switch_sel VENDOR PRODUCT REVISION SERIAL | "
           "lss_set_node NODE | lss_conf_bitrate 0 INDEX\n"
           "[NET] lss_activate_bitrate MS | lss_store | lss_inquire_addr [0..3] | lss_get_node | "
           "lss_ident_nonconf | _lss_fastscan [MS]\n"
           "[NET] lss_identity VENDOR PRODUCT REVISION-FROM REVISION-TO SERIAL-FROM SERIAL-TO\n"
           "types: b i8..i64 u8..u64 r32 r64 t td vs os us d (os, us, d in base64), and as "
           "additions x8..x64 hex\n";
}

}  // namespace hal::canopen::gateway
