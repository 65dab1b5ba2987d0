// SPDX-License-Identifier: MIT
#include "bus/can/generate.hpp"

#include <charconv>
#include <fmt/core.h>
#include <random>

#include "bus/can/periodic.hpp"
#include "cli/output.hpp"

namespace hal::tools {

namespace {

/// Parses `181` or `100-1FF`, hexadecimal.
bool parse_range(const std::string& text, std::uint32_t max, std::uint32_t& first,
                 std::uint32_t& last) {
    const char* const end = text.data() + text.size();
    const auto one = std::from_chars(text.data(), end, first, 16);
    if (one.ec != std::errc()) return false;
    last = first;
    if (one.ptr != end) {
        if (*one.ptr != '-') return false;
        const auto two = std::from_chars(one.ptr + 1, end, last, 16);
        if (two.ec != std::errc() || two.ptr != end) return false;
    }
    return first <= last && last <= max;
}

}  // namespace

int run_can_generate(const GenerateOptions& options) {
    if (options.words.size() != 1) {
        return fail(options, fmt::format("nothing is expected at '{}'; see: hal help can generate",
                                         options.words[1]));
    }
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
    if (options.length > 8) {
        return fail(options, fmt::format("invalid --length {}; write 0..8", options.length));
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
