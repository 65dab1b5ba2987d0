// SPDX-License-Identifier: MIT
// `hal ethercat upload` and `download`: objects of one slave.
#include <algorithm>
#include <bit>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fmt/core.h>
#include <optional>

#include "bus/ethercat/mailbox_failure.hpp"
#include "bus/ethercat/session.hpp"
#include "bus/ethercat/words.hpp"
#include "cia301/values.hpp"
#include "cli/output.hpp"
#include "ethercat/wire/coe.hpp"
#include "text/find_row.hpp"

namespace hal::tools {

namespace {

using ethercat::master::BusSlave;
using ethercat::master::MailboxRequest;
using Outcome = ethercat::master::MailboxResult::Outcome;
using Bytes = std::vector<std::uint8_t>;

enum class Form : std::uint8_t { logic, sign, number, real, text, octets };
struct ValueType {
    const char* name;
    Form form;
    std::size_t bytes;       ///< 0: any
    std::uint16_t coe_type;  ///< as SDO information reports it
};
namespace code = ethercat::coe::type;
constexpr ValueType value_types[] = {{"bool", Form::logic, 1, code::boolean},
                                     {"int8", Form::sign, 1, code::s8},
                                     {"int16", Form::sign, 2, code::s16},
                                     {"int32", Form::sign, 4, code::s32},
                                     {"int64", Form::sign, 8, code::s64},
                                     {"uint8", Form::number, 1, code::u8},
                                     {"uint16", Form::number, 2, code::u16},
                                     {"uint32", Form::number, 4, code::u32},
                                     {"uint64", Form::number, 8, code::u64},
                                     {"float", Form::real, 4, code::real32},
                                     {"double", Form::real, 8, code::real64},
                                     {"string", Form::text, 0, code::visible_string},
                                     {"octet_string", Form::octets, 0, code::octet_string}};

/// Returns the value as `upload` shows it; `plain` is its second half, as JSON.
std::string value_text_of(const Bytes& bytes, const ValueType& type, std::string& plain) {
    if (type.form == Form::text) {
        const auto end = std::find(bytes.begin(), bytes.end(), 0);
        const std::string text(bytes.begin(), end);
        json_quote(plain, text);
        return text;
    }
    if (type.form == Form::octets || bytes.size() != type.bytes) {
        json_quote(plain, hex_text(bytes));
        return hex_text(bytes);
    }
    const std::uint64_t raw = cia301::natural_of(bytes);
    const auto bits = static_cast<unsigned>(8 * type.bytes);
    if (type.form == Form::real) {
        const double value = cia301::real_of(raw, bits);
        const std::string text = fmt::format("{}", value);
        if (std::isfinite(value)) {
            plain += text;
        } else {
            json_quote(plain, text);
        }
        return text;
    }
    plain += type.form == Form::sign ? fmt::format("{}", cia301::sign_extended(raw, bits))
                                     : fmt::format("{}", raw);
    return fmt::format("0x{:0{}x} {}", raw, 2 * type.bytes, plain);
}

/// Parses hexadecimal bytes separated by blanks.
std::optional<Bytes> octets_of(const std::string& text) {
    Bytes bytes;
    char* end = nullptr;
    for (const char* at = text.c_str(); *at != '\0'; at = end) {
        const unsigned long value = std::strtoul(at, &end, 16);
        if (end == at || value > 0xff) return std::nullopt;
        bytes.push_back(static_cast<std::uint8_t>(value));
        while (*end == ' ') {
            ++end;
        }
    }
    return bytes.empty() ? std::nullopt : std::optional(bytes);
}

std::optional<std::uint64_t> real_bits(const std::string& text, unsigned bits) {
    char* end = nullptr;
    const double value = std::strtod(text.c_str(), &end);
    if (end == text.c_str() || *end != '\0') return std::nullopt;
    return bits == 32 ? std::bit_cast<std::uint32_t>(static_cast<float>(value))
                      : std::bit_cast<std::uint64_t>(value);
}

std::optional<std::uint64_t> signed_bits(const std::string& text, unsigned bits) {
    char* end = nullptr;
    errno = 0;
    const std::int64_t value = std::strtoll(text.c_str(), &end, 0);
    if (end == text.c_str() || *end != '\0' || errno != 0) return std::nullopt;
    const auto raw = static_cast<std::uint64_t>(value);
    return cia301::sign_extended(raw, bits) == value ? std::optional(raw) : std::nullopt;
}

/// Returns the bits of a number; nullopt: invalid or out of range.
std::optional<std::uint64_t> number_bits(const std::string& text, const ValueType& type) {
    const auto bits = static_cast<unsigned>(8 * type.bytes);
    switch (type.form) {
    case Form::real: return real_bits(text, bits);
    case Form::sign: return signed_bits(text, bits);
    case Form::logic: return ethercat_number(text, 1);
    default: return ethercat_number(text, UINT64_MAX >> (64 - bits));
    }
}

/// Returns the bytes of a typed value; nullopt: invalid or out of range.
std::optional<Bytes> value_bytes(const std::string& text, const ValueType& type) {
    if (type.form == Form::text) return Bytes(text.begin(), text.end());
    if (type.form == Form::octets) return octets_of(text);
    const std::optional<std::uint64_t> raw = number_bits(text, type);
    if (!raw) return std::nullopt;
    Bytes bytes;
    for (std::size_t n = 0; n < type.bytes; ++n) {
        bytes.push_back(static_cast<std::uint8_t>(*raw >> 8 * n));
    }
    return bytes;
}

/// Prints why a request to the mailbox failed; returns the exit code.
int fail_mailbox(const Options& options, const BusSlave& s, const std::string& what,
                 const ethercat::master::MailboxResult& result) {
    const std::string who = fmt::format("slave {}: {}: ", s.position, what);
    if (result.outcome != Outcome::aborted) {
        return fail(options, who + mailbox_failure_text(s, result));
    }
    return fail(options, fmt::format("{}SDO transfer aborted with code 0x{:08X}: {}", who,
                                     result.abort, ethercat::coe::abort_text(result.abort)));
}

void fail_unfinished(const Options& options, const BusSlave& s, const std::string& what) {
    fail(options, fmt::format("slave {}: {}: not finished within 60 s", s.position, what));
}

/// Returns whether the machine behind a gateway has closed the connection, after printing it.
bool gateway_is_lost(const EthercatValueOptions& options, const EthercatSession& session) {
    if (!session.gateway_lost()) return false;
    fail(options, fmt::format("{} closed the connection; does the machine still run?",
                              options.words.front()));
    return true;
}

/// The last row: for a type that nobody knows.
const ValueType& plain_bytes() { return value_types[std::size(value_types) - 1]; }

/// Returns the type of --type; nullptr after reporting an unknown name.
const ValueType* named_type(const EthercatValueOptions& options) {
    const ValueType* const named = find_row(value_types, options.type, &ValueType::name);
    if (named == nullptr) {
        fail(options,
             fmt::format("unknown type '{}'; see: hal help ethercat upload", options.type));
    }
    return named;
}

/// Returns the type that the slave reports, or plain_bytes(); nullptr after printing the reason.
/// `must_be_known`: fails when the slave does not answer.
const ValueType* reported_type(const EthercatValueOptions& options, EthercatSession& session,
                               const BusSlave& s, std::uint16_t index, std::uint8_t sub,
                               bool must_be_known) {
    constexpr std::size_t max_name = 256;
    Bytes name(max_name);
    MailboxRequest request;
    request.kind = MailboxRequest::Kind::entry;
    request.slave = s.number;
    request.index = index;
    request.sub = sub;
    request.data = name;
    const bool has_finished = session.run(request);
    if (gateway_is_lost(options, session)) return nullptr;
    if (has_finished && request.result) {
        const ValueType* const type =
            find_row(value_types, request.entry.type, &ValueType::coe_type);
        return type != nullptr ? type : &plain_bytes();
    }
    const Outcome outcome = has_finished ? request.result.outcome : Outcome::timed_out;
    const bool answers = outcome != Outcome::timed_out && outcome != Outcome::lost;
    if (answers || !must_be_known) return &plain_bytes();  // it need not describe its objects
    const std::string what = fmt::format("the type of 0x{:04X}:{} (--type names it)", index, sub);
    if (has_finished) {
        fail_mailbox(options, s, what, request.result);
    } else {
        fail_unfinished(options, s, what);
    }
    return nullptr;
}

/// An object of a slave, and the type of its value.
struct SlaveObject {
    const BusSlave* slave = nullptr;
    std::uint16_t index = 0;
    std::uint8_t sub = 0;
    const ValueType* type = nullptr;

    std::string label() const { return fmt::format("0x{:04X}:{}", index, sub); }
};

/// Finds the object of the arguments INDEX SUB [VALUE] on the open bus. Returns nullopt after
/// printing the reason.
std::optional<SlaveObject> find_object(const EthercatValueOptions& options,
                                       EthercatSession& session, bool download) {
    const auto& words = session.arguments();
    if (words.size() != (download ? 3U : 2U)) {
        fail(options, fmt::format("type: {} ADDRESS -p N INDEX SUB{}", options.program,
                                  download ? " VALUE" : ""));
        return std::nullopt;
    }
    const auto index = ethercat_number(words[0], 0xffff);
    if (!index) {
        fail(options, fmt::format("invalid index '{}'; write 0..0xffff", words[0]));
        return std::nullopt;
    }
    const auto sub = ethercat_number(words[1], 0xff);
    if (!sub) {
        fail(options, fmt::format("invalid sub-index '{}'; write 0..255", words[1]));
        return std::nullopt;
    }
    SlaveObject object;
    object.index = static_cast<std::uint16_t>(*index);
    object.sub = static_cast<std::uint8_t>(*sub);
    object.slave = session.chosen(options);
    if (object.slave == nullptr) return std::nullopt;
    object.type = options.type.empty() ? reported_type(options, session, *object.slave,
                                                       object.index, object.sub, download)
                                       : named_type(options);
    if (object.type == nullptr) return std::nullopt;
    return object;
}

/// Uploads the object to `bytes`, which it shortens to the value, or downloads `bytes` to it.
/// Returns false after printing the reason.
bool transfer(const EthercatValueOptions& options, EthercatSession& session,
              const SlaveObject& object, MailboxRequest::Kind kind, Bytes& bytes) {
    MailboxRequest request;
    request.kind = kind;
    request.slave = object.slave->number;
    request.index = object.index;
    request.sub = object.sub;
    request.data = bytes;
    if (!session.run(request)) {
        fail_unfinished(options, *object.slave, object.label());
        return false;
    }
    if (gateway_is_lost(options, session)) return false;
    if (!request.result) {
        fail_mailbox(options, *object.slave, object.label(), request.result);
        return false;
    }
    if (kind == MailboxRequest::Kind::sdo_upload) {
        bytes.resize(request.result.length);
    }
    return true;
}

std::string json_line(const SlaveObject& object, const std::string& value) {
    return fmt::format("{{\"position\":{},\"index\":{},\"sub\":{},\"type\":\"{}\",\"value\":{}}}\n",
                       object.slave->position, object.index, object.sub, object.type->name, value);
}

}  // namespace

int run_ethercat_upload(const EthercatValueOptions& options) {
    EthercatSession session;
    if (!session.open(options, true)) return 1;
    const std::optional<SlaveObject> object = find_object(options, session, false);
    if (!object) return 1;
    Bytes bytes(65536);
    if (!transfer(options, session, *object, MailboxRequest::Kind::sdo_upload, bytes)) return 1;
    const ValueType& type = *object->type;
    const bool has_fixed_size = !options.type.empty() && type.bytes != 0;
    if (has_fixed_size && bytes.size() != type.bytes) {
        return fail(options,
                    fmt::format("{} has {} bytes, type {} has {}; --type selects another one",
                                object->label(), bytes.size(), type.name, type.bytes));
    }
    std::string json_value;
    const std::string text = value_text_of(bytes, type, json_value);
    return exit_code(print(options.json ? json_line(*object, json_value) : text + "\n"));
}

int run_ethercat_download(const EthercatValueOptions& options) {
    EthercatSession session;
    if (!session.open(options, true)) return 1;
    const std::optional<SlaveObject> object = find_object(options, session, true);
    if (!object) return 1;
    const std::string& text = session.arguments()[2];
    std::optional<Bytes> bytes = value_bytes(text, *object->type);
    if (!bytes) {
        return fail(options,
                    fmt::format("invalid value '{}' for {}, type {}; --type selects another one",
                                text, object->label(), object->type->name));
    }
    if (!transfer(options, session, *object, MailboxRequest::Kind::sdo_download, *bytes)) return 1;
    if (!options.json) return 0;
    std::string json_value;
    value_text_of(*bytes, *object->type, json_value);
    return exit_code(print(json_line(*object, json_value)));
}

}  // namespace hal::tools
