// SPDX-License-Identifier: MIT
// `hal ethercat reg-read`, `reg-write`, `sii-read`, `sii-write` and `alias`: registers and EEPROM
// of one slave.
#include <fmt/core.h>
#include <unistd.h>

#include "bus/ethercat/wire.hpp"
#include "bus/ethercat/words.hpp"
#include "cli/output.hpp"
#include "hal/read_file.hpp"

namespace hal::tools {

namespace {

/// Writes the words that differ and reads them back. Returns the number of words written; nullopt:
/// after printing the reason.
std::optional<std::size_t> write_image(const EthercatPositionOptions& options, EthercatWire& wire,
                                       std::size_t position,
                                       const std::vector<std::uint8_t>& image) {
    const auto before = wire.sii(position, image.size());
    if (!before) {
        fail(options,
             fmt::format("slave {}: its EEPROM is not readable; switch it off and on", position));

        return std::nullopt;
    }
    std::size_t count = 0;
    for (std::size_t n = 0; n < image.size(); n += 2) {
        if (image[n] == (*before)[n] && image[n + 1] == (*before)[n + 1]) continue;
        if (!wire.write_sii(position, static_cast<std::uint32_t>(n / 2),
                            static_cast<std::uint16_t>(image[n] | image[n + 1] << 8))) {
            fail(options, fmt::format("slave {}: word 0x{:X} of its EEPROM is not writable "
                                      "after {} words; is it write-protected?",
                                      position, n / 2, count));

            return std::nullopt;
        }
        ++count;
    }
    if (wire.sii(position, image.size()) != image) {
        fail(options, fmt::format("slave {}: the EEPROM does not contain what was written; "
                                  "write it again before switching it off",
                                  position));

        return std::nullopt;
    }
    return count;
}

}  // namespace

int run_ethercat_reg_read(const EthercatPositionOptions& options) {
    EthercatWire wire;
    if (!wire.open(options)) return 1;
    const auto& words = wire.arguments();
    const auto address = ethercat_number(words.empty() ? "" : words[0], 0xffff);
    const auto length = words.size() == 2 ? ethercat_number(words[1], ethercat::max_datagram_data)
                                          : std::optional<std::uint64_t>(2);
    if (words.size() > 2 || !address || !length || *length == 0) {
        return fail(options,
                    "type: hal ethercat reg-read ADDRESS -p N REGISTER [BYTES]; "
                    "registers are 0..0xffff, at most 1486 bytes (default 2)");
    }
    const auto* s = wire.chosen(options);
    if (s == nullptr) return 1;
    const auto bytes = wire.read(s->position, static_cast<std::uint16_t>(*address),
                                 static_cast<std::uint16_t>(*length));
    if (!bytes) {
        return fail(options, fmt::format("slave {}: no answer to a read of register 0x{:04X}, {} "
                                         "bytes; does the device have it?",
                                         s->position, *address, *length));
    }
    if (options.json) {
        return print(fmt::format("{{\"position\":{},\"register\":{},\"bytes\":\"{}\"}}\n",
                                 s->position, *address, hex_text(*bytes)))
                   ? 0
                   : 1;
    }
    return print(hex_text(*bytes) + "\n") ? 0 : 1;
}

int run_ethercat_reg_write(const EthercatPositionOptions& options) {
    EthercatWire wire;
    if (!wire.open(options)) return 1;
    const auto& words = wire.arguments();
    const auto address = ethercat_number(words.empty() ? "" : words[0], 0xffff);
    std::vector<std::uint8_t> bytes;
    bool good = address && words.size() > 1;
    for (std::size_t n = 1; good && n < words.size(); ++n) {
        const auto byte = ethercat_number(words[n], 0xff);
        good = byte.has_value();
        if (good) {
            bytes.push_back(static_cast<std::uint8_t>(*byte));
        }
    }
    if (!good) {
        return fail(options,
                    "type: hal ethercat reg-write ADDRESS -p N REGISTER BYTE…; "
                    "registers are 0..0xffff, bytes 0..255, the lowest first");
    }
    const auto* s = wire.chosen(options);
    if (s == nullptr) return 1;
    if (!wire.write(s->position, static_cast<std::uint16_t>(*address), bytes)) {
        return fail(options, fmt::format("slave {}: register 0x{:04X}, {} bytes, is not writable",
                                         s->position, *address, bytes.size()));
    }
    return !options.json ||
                   print(fmt::format("{{\"position\":{},\"register\":{},\"written\":{}}}\n",
                                     s->position, *address, bytes.size()))
               ? 0
               : 1;
}

int run_ethercat_sii_read(const EthercatPositionOptions& options) {
    EthercatWire wire;
    if (!wire.open(options) || !wire.without_arguments(options)) return 1;
    const auto* s = wire.chosen(options);
    if (s == nullptr) return 1;
    const auto bytes = wire.sii(s->position);
    if (!bytes) {
        return fail(
            options,
            fmt::format("slave {}: its EEPROM is not readable; switch it off and on", s->position));
    }
    if (options.json) {
        return print(fmt::format("{{\"position\":{},\"bytes\":\"{}\"}}\n", s->position,
                                 hex_text(*bytes)))
                   ? 0
                   : 1;
    }
    if (::isatty(STDOUT_FILENO) != 0) {
        return fail(options, "the SII is binary; redirect it: > slave.sii");
    }
    return print(std::string_view(reinterpret_cast<const char*>(bytes->data()), bytes->size())) ? 0
                                                                                                : 1;
}

int run_ethercat_sii_write(const EthercatPositionOptions& options) {
    const std::size_t address_words = options.emulate.empty() ? 1 : 0;
    if (options.words.size() != address_words + 1) {
        return fail(options, "type: hal ethercat sii-write ADDRESS -p N FILE");
    }
    constexpr std::size_t min = 128;
    constexpr std::size_t max = 128 * 1024;
    constexpr std::size_t max_image_file = std::size_t{16} << 20;
    std::string content;
    if (!read_regular_file(options.words.back(), max_image_file, content)) {
        return fail(options, fmt::format("cannot read '{}': {}", options.words.back(), content));
    }
    const std::vector<std::uint8_t> image(content.begin(), content.end());
    if (image.size() < min || image.size() > max || image.size() % 2 != 0) {
        return fail(
            options,
            fmt::format("'{}' has {} bytes; an SII image has an even number of 128 to 131072",
                        options.words.back(), image.size()));
    }
    const auto contents = ethercat::sii::parse(image);
    if (!contents.checksum_valid) {
        return fail(
            options,
            fmt::format("'{}' is not an SII image: its checksum is wrong; nothing was written",
                        options.words.back()));
    }
    EthercatWire wire;
    if (!wire.open(options)) return 1;
    const auto* s = wire.chosen(options);
    if (s == nullptr) return 1;
    const std::size_t space = wire.contents(s->position).eeprom_bytes;
    if (space != 0 && image.size() > space) {
        return fail(
            options,
            fmt::format("'{}' has {} bytes, the EEPROM of slave {} only {}; nothing was written",
                        options.words.back(), image.size(), s->position, space));
    }
    const auto count = write_image(options, wire, s->position, image);
    if (!count) return 1;
    if (options.json) {
        return print(fmt::format("{{\"position\":{},\"words\":{}}}\n", s->position, *count)) ? 0
                                                                                             : 1;
    }
    return print(fmt::format(
               "slave {}: {} words written; it uses them after it was switched off and on\n",
               s->position, *count))
               ? 0
               : 1;
}

int run_ethercat_alias(const EthercatPositionOptions& options) {
    EthercatWire wire;
    if (!wire.open(options)) return 1;
    const auto alias =
        wire.arguments().size() == 1 ? ethercat_number(wire.arguments()[0], 0xffff) : std::nullopt;
    if (!alias) {
        return fail(options,
                    "type: hal ethercat alias ADDRESS -p N ALIAS; an alias is 1..65535, 0 is none");
    }
    const auto* s = wire.chosen(options);
    if (s == nullptr) return 1;
    wire.identify();
    for (std::size_t n = 0; *alias != 0 && n < wire.size(); ++n) {
        if (n != s->position && wire.contents(n).alias() == *alias) {
            return fail(options, fmt::format("slave {} has alias {} already; choose another one", n,
                                             *alias));
        }
    }
    auto image = wire.sii(s->position, 16);
    if (!image) {
        return fail(
            options,
            fmt::format("slave {}: its EEPROM is not readable; switch it off and on", s->position));
    }
    const unsigned before = (*image)[8] | (*image)[9] << 8;
    (*image)[8] = static_cast<std::uint8_t>(*alias);

    (*image)[9] = static_cast<std::uint8_t>(*alias >> 8);
    (*image)[14] = ethercat::sii::checksum(*image);
    (*image)[15] = 0;
    if (!write_image(options, wire, s->position, *image)) return 1;
    if (options.json) {
        return print(fmt::format("{{\"position\":{},\"alias\":{},\"before\":{}}}\n", s->position,
                                 *alias, before))
                   ? 0
                   : 1;
    }
    return print(fmt::format(
               "slave {}: alias {}, before {}; it has it after it was switched off and on\n",
               s->position, *alias, before))
               ? 0
               : 1;
}

}  // namespace hal::tools
