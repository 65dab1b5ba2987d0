// SPDX-License-Identifier: MIT
#include "ethercat/config/slave_writes.hpp"

#include <algorithm>

namespace hal::ethercat::config {

using master::StartupWrite;

StartupWrite startup_write(unsigned index, unsigned sub, std::vector<std::uint8_t> data,
                           State before) {
    StartupWrite w;
    w.index = static_cast<std::uint16_t>(index);
    w.sub = static_cast<std::uint8_t>(sub);
    w.data = std::move(data);
    w.before = before;
    return w;
}

void SlaveWrites::read() {
    for (Line* line : in_.keys.all_of("")) {
        const auto words = words_of(line->key);
        if (line->used || words.size() < 2) continue;
        const std::string& kind = words[0].text;
        line->used = true;
        if (kind == "idn") {
            idn(*line, words);
        } else if (kind == "aoe") {
            aoe(*line, words);
        } else if (kind == "sdo" || kind == "register") {
            sdo(*line, words);
        } else {
            line->used = false;
        }
    }
}

/// `sdo 6060 = 8`, `sdo gear-ratio-1 = 5`, `sdo 2000:1 u16 = 5`, `sdo 8000 complete = 01 00 02`,
/// `register 0420 u16 = 1000`.
void SlaveWrites::sdo(const Line& line, const std::vector<Word>& words) {
    const bool is_register = words[0].text == "register";
    const std::optional<ObjectAddress> address = address_of(words[1], is_register);
    if (!address || words.size() > 3) return reject_key(line, words[0].text);
    StartupWrite write = startup_write(address->index, address->sub, {}, State::safeop);
    write.line = line.key.at.line;
    if (is_register) {
        write.protocol = StartupWrite::Protocol::reg;
    }
    const std::string form = words.size() == 3 ? words[2].text : "";
    const bool is_raw = form == "complete" || form == "raw";
    const auto data = is_raw ? raw_value(line) : typed_value(line, words, *address);
    if (!data) return;
    write.complete = form == "complete";
    write.data = *data;
    in_.slave.startup.push_back(std::move(write));
}

/// Parses `6060`, `2000:1` or, but for a register, the name of a pin.
std::optional<ObjectAddress> SlaveWrites::address_of(const Word& word, bool is_register) {
    const auto address = parse_address(word, in_.report);
    if (address || is_register) return address;
    return pdos_.find(word.text);
}

void SlaveWrites::reject_key(const Line& line, const std::string& kind) {
    const char* const help = kind == "register"
                                 ? "write register 0420 u16 = 1000"
                                 : "write sdo 6060 = 8, with a name: sdo gear-ratio-1 = 5, or "
                                   "with a type: sdo 2000:1 u16 = 5";
    in_.report.error(Topic::value, line.key.at,
                     "invalid " + kind + " '" + line.key.text.substr(kind.size() + 1) + "'", help);
}

/// Returns hexadecimal bytes, or nullopt after reporting the reason.
std::optional<std::vector<std::uint8_t>> SlaveWrites::raw_value(const Line& line) {
    auto data = esi::hex_bytes(line.value.text);
    if (!data || data->empty()) {
        in_.keys.reject(line, "hexadecimal bytes in the order of the wire, as in 01 00 E8 03");
        return std::nullopt;
    }
    return data;
}

/// Returns the bytes of the value of `sdo ADDRESS [TYPE] = VALUE`, or nullopt after reporting the
/// reason.
std::optional<std::vector<std::uint8_t>> SlaveWrites::typed_value(const Line& line,
                                                                  const std::vector<Word>& words,
                                                                  const ObjectAddress& address) {
    const bool is_register = words[0].text == "register";
    const std::string label = is_register ? "register " + words[1].text
                                          : "object " + object_text(address.index, address.sub);
    const std::optional<DataType> type =
        words.size() == 3 ? written_type(words[2]) : known_type(line, words, address, label);
    if (!type) return std::nullopt;
    std::string expected;
    auto data = value_bytes(line.value.text, *type, expected);
    if (!data) {
        in_.report.error(Topic::value, line.value.at,
                         "invalid value '" + line.value.text + "' of " + label,
                         "write " + expected);
    }
    return data;
}

std::optional<DataType> SlaveWrites::written_type(const Word& word) {
    const auto type = parse_type(word, in_.report);
    if (!type) {
        in_.report.error(Topic::value, word.at, "unknown type '" + word.text + "'",
                         "the types are " + std::string(value_type_names) + ", complete and raw");
    }
    return type;
}

/// Returns the type of an object from the description of the device, or that of the pin which has
/// it.
std::optional<DataType> SlaveWrites::known_type(const Line& line, const std::vector<Word>& words,
                                                const ObjectAddress& address,
                                                const std::string& label) {
    const bool is_register = words[0].text == "register";
    const Known known = is_register ? Known{} : pdos_.known(address.index, address.sub);
    if (known.bits != 0) return DataType{known.type, std::min(known.bits, 64U)};
    const bool is_described = device_ != nullptr && !is_register;
    in_.report.error(Topic::object, line.key.at,
                     is_described ? label + " is not in the description of '" + in_.info.type + "'"
                                  : label + " has no known type",
                     "write its type, as in " + words[0].text + " " + words[1].text +
                         " u16 = " + line.value.text);
    return std::nullopt;
}

/// Adds a write of hexadecimal bytes.
void SlaveWrites::bytes_write(const Line& line, StartupWrite::Protocol protocol, unsigned index,
                              unsigned sub, std::uint16_t port) {
    const auto data = esi::hex_bytes(line.value.text);
    if (!data || data->empty()) {
        return in_.keys.reject(line, "hexadecimal bytes in the order of the wire, as in 07 00");
    }
    StartupWrite w = startup_write(static_cast<std::uint16_t>(index),
                                   static_cast<std::uint8_t>(sub), *data, State::safeop);
    w.protocol = protocol;
    w.port = port;
    w.line = line.key.at.line;
    in_.slave.startup.push_back(std::move(w));
}

/// `idn S-0-15 = 07 00`, `idn P-0-150 1 = 01 00`: the number after it is the drive's.
void SlaveWrites::idn(const Line& line, const std::vector<Word>& words) {
    const std::string& text = words[1].text;  // lower case
    const auto parts = list_of({text, line.key.at}, '-');
    const auto set = parts.size() == 3 ? parse_natural(parts[1].text) : std::nullopt;

    const auto number = parts.size() == 3 ? parse_natural(parts[2].text) : std::nullopt;
    const auto drive =
        words.size() == 3 ? parse_natural(words[2].text) : std::optional<std::uint64_t>(0);
    if (!set || *set > 7 || !number || *number > 4095 ||
        (parts[0].text != "s" && parts[0].text != "p") || !drive || *drive > 7 ||
        words.size() > 3) {
        return in_.report.error(Topic::value, line.key.at, "invalid IDN '" + text + "'",
                                "write idn S-0-15 = 07 00, or idn P-0-150 1 = 07 00 for drive 1");
    }
    const unsigned product = parts[0].text == "p" ? 0x8000U : 0U;
    bytes_write(line, StartupWrite::Protocol::soe,
                product | static_cast<unsigned>(*set << 12 | *number),
                static_cast<unsigned>(*drive), 0);
}

/// `aoe 2001 = 05 00`, `aoe 8000:1 1001 = 01 00`: the number after the object is the port.
void SlaveWrites::aoe(const Line& line, const std::vector<Word>& words) {
    const auto at = parse_address(words[1], in_.report);
    const auto port =
        words.size() == 3 ? parse_natural(words[2].text) : std::optional<std::uint64_t>(0);
    if (!at || !port || *port > 0xffff || words.size() > 3) {
        return in_.report.error(Topic::value, line.key.at,
                                "invalid aoe '" + line.key.text.substr(4) + "'",
                                "write aoe 8000:1 1001 = 01 00");
    }
    bytes_write(line, StartupWrite::Protocol::aoe, at->index, at->sub,
                static_cast<std::uint16_t>(*port));
}

}  // namespace hal::ethercat::config
