// SPDX-License-Identifier: MIT
// `hal mesa read` and `write`: registers by hand.
#include <fmt/core.h>

#include "bus/mesa/card_client.hpp"
#include "bus/mesa/options.hpp"
#include "cli/output.hpp"
#include "text/numbers.hpp"

namespace hal::tools {

using namespace mesa;

namespace {

/// What the words and options name.
struct Target {
    Space space = Space::hostmot2;
    Unit unit = Unit::u32;
    std::uint16_t address = 0;
};

/// Parses ADDRESS and --space. Returns the problem, or "".
std::string parse_target(const MesaAccessOptions& options, Target& target) {
    if (options.words.size() < 2) return "missing argument; write HOST ADDRESS";
    if (options.space < 0 || options.space > 7) return "invalid --space; write 0..7";
    target.space = static_cast<Space>(options.space);
    target.unit =
        target.space == Space::hostmot2 || target.space == Space::flash ? Unit::u32 : Unit::u16;
    const auto address = parse_natural(options.words[1]);
    const std::size_t width = bytes_of(target.unit);
    if (!address || *address > 0xffff || *address % width != 0) {
        return fmt::format(
            "invalid address '{}'; write a multiple of {} up to 0xFFFF, as in 0x1000",
            options.words[1], width);
    }
    target.address = static_cast<std::uint16_t>(*address);
    return {};
}

}  // namespace

int run_mesa_read(const MesaAccessOptions& options) {
    Target target;
    if (const std::string problem = parse_target(options, target); !problem.empty()) {
        return fail(options, problem);
    }
    const std::size_t width = bytes_of(target.unit);
    const auto count = options.words.size() > 2 ? parse_natural(options.words[2]) : 1;
    if (!count || *count == 0 || *count > (0x10000U - target.address) / width ||
        options.words.size() > 3) {
        return fail(options, "invalid count; write HOST ADDRESS COUNT");
    }
    CardClient card;
    if (const std::string problem = card.open(options.words[0], options.timeout_ns);
        !problem.empty()) {
        return fail(options, problem);
    }
    const auto bytes = card.read(target.space, target.address, target.unit, *count);
    if (!bytes) return fail(options, card.silence());
    std::string text;
    for (std::size_t n = 0; n < *count; ++n) {
        const std::uint8_t* const from = bytes->data() + n * width;
        const std::uint32_t value =
            width == 4 ? load<std::uint32_t>(from) : load<std::uint16_t>(from);
        text += fmt::format("0x{:04X}  0x{:0{}X}  {}\n", target.address + n * width, value,
                            2 * width, value);
    }
    return exit_code(print(text));
}

int run_mesa_write(const MesaAccessOptions& options) {
    Target target;
    if (const std::string problem = parse_target(options, target); !problem.empty()) {
        return fail(options, problem);
    }
    const std::size_t width = bytes_of(target.unit);
    const std::size_t room = (0x10000U - target.address) / width;
    if (options.words.size() - 2 > room) {
        return fail(options,
                    fmt::format("{} values from 0x{:04X} on go beyond the end of the space, "
                                "0xFFFF; write at most {}",
                                options.words.size() - 2, target.address, room));
    }
    std::vector<std::uint8_t> data;
    for (std::size_t n = 2; n < options.words.size(); ++n) {
        const auto value = parse_natural(options.words[n]);
        if (!value || *value >> (8 * width) != 0) {
            return fail(options, fmt::format("invalid value '{}'; write a number of {} bits, "
                                             "decimal or with 0x",
                                             options.words[n], 8 * width));
        }
        for (std::size_t byte = 0; byte < width; ++byte) {
            data.push_back(static_cast<std::uint8_t>(*value >> 8 * byte));
        }
    }
    Request request;
    if (!request.write(target.space, target.address, target.unit, data)) {
        return fail(options, "write HOST ADDRESS VALUE…, with 1 to 127 values");
    }
    request.read(Space::card, 0, Unit::u16);  // the answer shows that the request has arrived
    CardClient card;
    if (const std::string problem = card.open(options.words[0], options.timeout_ns);
        !problem.empty()) {
        return fail(options, problem);
    }
    if (!card.ask(request, 1)) {
        return fail(options, card.silence() + "; it may have been written");
    }
    return 0;
}

}  // namespace hal::tools
