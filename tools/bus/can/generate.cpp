// SPDX-License-Identifier: MIT
#include "bus/can/generate.hpp"

#include <fmt/core.h>
#include <random>

#include "bus/can/periodic.hpp"
#include "cli/output.hpp"
#include "text/numbers.hpp"

namespace hal::tools {

namespace {

/// Parses `181` or `100-1FF`, hexadecimal.
bool parse_range(const std::string& text, std::uint32_t max, std::uint32_t& first,
                 std::uint32_t& last) {
    const std::string_view all = text;
    const auto dash = all.find('-');
    const std::string_view end = dash == all.npos ? all : all.substr(dash + 1);
    return parse_whole(all.substr(0, dash), first, 16) && parse_whole(end, last, 16) &&
           first <= last && last <= max;
}

}  // namespace

int run_can_generate(const GenerateOptions& options) {
    const std::uint32_t max = options.extended ? 0x1fffffff : 0x7ff;
    std::uint32_t first = 0;
    std::uint32_t last = max;
    if (!options.id.empty() && !parse_range(options.id, max, first, last)) {
        return fail(options, fmt::format("invalid --id '{}'; write an identifier or a range in "
                                         "hex, at most {:X}: 181 or 100-1FF",
                                         options.id, max));
    }
    if (options.counting && options.length >= 0 && options.seed >= 0) {
        return fail(options,
                    "--seed has no effect with --counting and --length: nothing is random; delete "
                    "one of them");
    }
    Bus bus;
    if (!bus.open(options, options.words[0], false)) return 1;
    std::mt19937_64 random(options.seed >= 0 ? static_cast<std::uint64_t>(options.seed)
                                             : std::random_device{}());
    return send_periodically(bus, options, options.every_ns > 0 ? options.every_ns : 100'000'000,
                             [&](std::uint64_t n) {
        can::Frame f;
        f.extended = options.extended;
        f.id = options.counting
                   ? first + static_cast<std::uint32_t>(n % (std::uint64_t{last} - first + 1))
                   : std::uniform_int_distribution<std::uint32_t>(first, last)(random);
        f.length = static_cast<std::uint8_t>(options.length >= 0 ? options.length
                                                                 : static_cast<int>(random() % 9));
        const std::uint64_t value = options.counting ? n : random();
        for (unsigned i = 0; i < f.length; ++i) {
            f.data[i] = static_cast<std::uint8_t>(value >> 8 * i);
        }
        return f;
    });
}

}  // namespace hal::tools
