// SPDX-License-Identifier: MIT
// `hal ethercat sdos`, `foe-read` and `foe-write`: the object dictionary and the files of one
// slave.
#include <unistd.h>

#include "bus/ethercat/mailbox_failure.hpp"
#include "bus/ethercat/session.hpp"
#include "bus/ethercat/words.hpp"
#include "cli/output.hpp"
#include "ethercat/wire/foe.hpp"
#include "ethercat/wire/sii.hpp"
#include "hal/read_file.hpp"

namespace hal::tools {

namespace {

using ethercat::master::BusSlave;
using ethercat::master::MailboxRequest;
using Outcome = ethercat::master::MailboxResult::Outcome;

std::string named(const std::vector<std::uint8_t>& bytes, std::size_t length) {
    return std::string(bytes.begin(),
                       bytes.begin() + static_cast<std::ptrdiff_t>(std::min(length, bytes.size())));
}

/// Returns "rwr-r-": read and write in PRE-OP, SAFE-OP and OP.
std::string access_word(std::uint16_t access) {
    std::string text;
    for (unsigned state = 0; state < 3; ++state) {
        text += (access >> state & 1) != 0 ? 'r' : '-';
        text += (access >> (3 + state) & 1) != 0 ? 'w' : '-';
    }
    return text;
}

/// Transfers a file; `bytes` is read or written. Returns false after printing the reason.
bool transfer_file(const EthercatFileOptions& options, EthercatSession& session, BusSlave& s,
                   bool write, const std::string& name, std::vector<std::uint8_t>& bytes) {
    if (options.boot && !session.set_boot(options, s, true)) return false;
    ethercat::master::FoeProgress progress;
    MailboxRequest request;
    request.kind = write ? MailboxRequest::Kind::foe_write : MailboxRequest::Kind::foe_read;
    request.slave = s.number;
    request.name = name;
    request.data = bytes;

    request.progress = &progress;
    request.foe.password = options.password;
    const bool finished = session.run(request);
    if (finished && request.result) {
        if (!write) {
            bytes.resize(request.result.length);
        }
        if (!options.boot || session.set_boot(options, s, false)) return true;
        fail(options,
             fmt::format("slave {}: file '{}' was {}, but the slave did not return to PRE-OP",
                         s.position, name, write ? "written" : "read"));

        return false;
    }
    std::string why = "no progress within 60 s";
    if (finished && request.result.outcome == Outcome::aborted) {
        why = fmt::format(
            "the slave ends the transfer with FoE error 0x{:04X} ({}){}{}", request.result.abort,
            ethercat::foe::to_string(static_cast<ethercat::foe::Error>(request.result.abort)),
            progress.text[0] != '\0' ? ": " : "", progress.text.data());
    } else if (finished) {
        why = mailbox_failure_text(s, request.result);
    }
    fail(options, fmt::format("slave {}: file '{}': {}", s.position, name, why));
    if (options.boot && finished) {
        session.set_boot(options, s, false);
    }
    return false;
}

}  // namespace

int run_ethercat_sdos(const EthercatPositionOptions& options) {
    EthercatSession session;
    if (!session.open(options, true)) return 1;
    if (!session.arguments().empty()) {
        return fail(options, fmt::format("unexpected argument '{}'", session.arguments().front()));
    }
    const BusSlave* s = session.chosen(options);
    if (s == nullptr) return 1;
    std::vector<std::uint8_t> list(65536), name(256);
    MailboxRequest request;
    request.slave = s->number;
    request.kind = MailboxRequest::Kind::object_list;

    request.data = list;
    request.index = static_cast<std::uint16_t>(ethercat::coe::List::all);
    if (!session.run(request) || !request.result) {
        return fail(
            options,
            fmt::format(
                "slave {}: it does not list its objects; use its manual, and hal ethercat upload",
                s->position));
    }
    std::string text, json;
    for (std::size_t n = 0; n + 1 < request.result.length; n += 2) {
        const auto index = ethercat::get<std::uint16_t>(list.data() + n);
        MailboxRequest object;
        object.slave = s->number;
        object.kind = MailboxRequest::Kind::object;
        object.index = index;

        object.data = name;
        // a slave may list an object that it does not describe
        if (!session.run(object) || !object.result) continue;
        const std::string title = named(name, object.object.name_length);
        text += fmt::format("0x{:04X} {}\n", index, title);
        json += fmt::format("{}{{\"index\":{},\"name\":{},\"entries\":[",
                            json.empty() ? "[" : ",\n ", index, json_string(title));
        bool first = true;
        for (unsigned sub = 0; sub <= object.object.max_sub; ++sub) {
            MailboxRequest entry;
            entry.slave = s->number;
            entry.kind = MailboxRequest::Kind::entry;
            entry.data = name;
            entry.index = index;
            entry.sub = static_cast<std::uint8_t>(sub);
            if (!session.run(entry) || !entry.result) continue;
            const std::string type =
                ethercat::sii::type_name(static_cast<std::uint8_t>(entry.entry.type));
            const std::string label = named(name, entry.entry.name_length);
            text += fmt::format("  {:02X}  {}  {:<7} {:>3} bit  {}\n", sub,
                                access_word(entry.entry.access), type, entry.entry.bits, label);
            json += fmt::format(R"({}{{"sub":{},"access":"{}","type":{},"bits":{},"name":{}}})",
                                first ? "" : ",", sub, access_word(entry.entry.access),
                                json_string(type), entry.entry.bits, json_string(label));
            first = false;
        }
        json += "]}";
    }
    return print(list_or_text(options.json, json, text)) ? 0 : 1;
}

int run_ethercat_foe_read(const EthercatFileOptions& options) {
    EthercatSession session;
    if (!session.open(options)) return 1;
    if (session.arguments().size() != 1) {
        return fail(options, "type: hal ethercat foe-read ADDRESS -p N NAME > FILE");
    }
    BusSlave* s = session.chosen(options);
    if (s == nullptr) return 1;
    std::vector<std::uint8_t> bytes(std::size_t{16} << 20);
    if (!transfer_file(options, session, *s, false, session.arguments()[0], bytes)) return 1;
    if (options.json) {
        return print(fmt::format("{{\"position\":{},\"bytes\":{}}}\n", s->position,
                                 json_string(hex_text(bytes))))
                   ? 0
                   : 1;
    }
    if (::isatty(STDOUT_FILENO) != 0) {
        return fail(options, "the file may be binary; redirect it: > FILE");
    }
    return print(std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size())) ? 0
                                                                                              : 1;
}

constexpr std::size_t max_file = std::size_t{256} << 20;

int run_ethercat_foe_write(const EthercatFileOptions& options) {
    const std::size_t first = options.emulate.empty() ? 1 : 0;
    const std::size_t count = options.words.size();
    if (count != first + 1 && count != first + 2) {
        return fail(options, "type: hal ethercat foe-write ADDRESS -p N FILE [NAME]");
    }
    std::string content;
    if (!read_regular_file(options.words[first], max_file, content)) {
        return fail(options, fmt::format("cannot read '{}': {}", options.words[first], content));
    }
    std::vector<std::uint8_t> bytes(content.begin(), content.end());
    const std::string path = options.words[first];
    const std::string name =
        count == first + 2 ? options.words.back() : path.substr(path.rfind('/') + 1);
    EthercatSession session;
    if (!session.open(options)) return 1;
    BusSlave* s = session.chosen(options);
    if (s == nullptr || !transfer_file(options, session, *s, true, name, bytes)) return 1;
    if (options.json) {
        return print(fmt::format("{{\"position\":{},\"name\":{},\"bytes\":{}}}\n", s->position,
                                 json_string(name), bytes.size()))
                   ? 0
                   : 1;
    }
    return print(fmt::format("slave {}: '{}' written, {} bytes\n", s->position, name, bytes.size()))
               ? 0
               : 1;
}

}  // namespace hal::tools
