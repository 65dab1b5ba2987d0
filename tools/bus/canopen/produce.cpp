// SPDX-License-Identifier: MIT
// `hal can generate`: generates bus load. `hal can produce`: sends the periodic frames of a master: heartbeat, SYNC, guarding.
#include "bus/canopen/produce.hpp"

#include <charconv>
#include <fmt/core.h>
#include <random>
#include <unistd.h>

#include "bus/can/bus.hpp"
#include "bus/canopen/node_client.hpp"
#include "canopen/protocol/numbers.hpp"
#include "cli/output.hpp"
#include "text/diagnostic.hpp"

namespace hal::tools {

namespace {

/// Sends the frames of `next` every `every` until the time or count is reached or a signal arrives.
int send_periodically(Bus& bus, const PeriodicOptions& options, std::int64_t every,
                      const std::function<can::Frame(std::uint64_t)>& next) {
    std::uint64_t wanted = 0;
    const std::int64_t began = monotonic_ns();
    for (std::int64_t due = began;;) {
        send_with_timeout(bus, next(wanted));
        bus.link->flush(can::unclocked);
        ++wanted;
        due += every;
        if (wanted == options.count || (options.for_ns >= 0 && due - began >= options.for_ns)) {
            break;
        }
        const std::int64_t left = due - monotonic_ns();
        if (left > 0 ? bus.stop.wait_ns(left) : bus.stop.requested()) break;
    }
    const double seconds = static_cast<double>(monotonic_ns() - began) / 1e9;
    const int status = finish_sending(bus, options, wanted);
    if (status == 0) {
        write_all(STDERR_FILENO,
                  fmt::format("{} frame{} in {:.2f} s\n", wanted, wanted == 1 ? "" : "s", seconds));
    }
    return status;
}

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

int run_can_produce(const ProduceOptions& options) {
    const std::vector<std::string> kinds{"heartbeat", "sync", "guarding"};
    const std::string kind = options.words.size() > 1 ? options.words[1] : "";
    if (kind != "heartbeat" && kind != "sync" && kind != "guarding") {
        const std::string hint = did_you_mean(kind, kinds);
        return fail(options,
                    kind.empty()
                        ? "missing KIND; type: hal can produce ADDRESS heartbeat NODE | sync | "
                          "guarding NODE"
                        : fmt::format("unknown kind '{}'; {}", kind,
                                      hint.empty() ? "write heartbeat, sync or guarding" : hint));
    }
    std::uint8_t node = 0;
    const bool of_node = kind != "sync";
    if (options.words.size() != (of_node ? 3U : 2U)) {
        return fail(
            options,
            of_node
                ? fmt::format("expected one node; type: hal can produce ADDRESS {} NODE", kind)
                : fmt::format("unexpected argument '{}'; a SYNC has no node", options.words[2]));
    }
    if (of_node && !node_of(options, options.words[2], node)) return 1;
    if (options.counter > 240 || options.counter == 1) {
        return fail(options, fmt::format("invalid --counter {}; write 2..240", options.counter));
    }
    if (options.counter != 0 && of_node) return fail(options, "--counter is valid with sync only");
    Bus bus;
    if (!bus.open(options, options.words[0], false)) return 1;
    const std::int64_t usual = kind == "sync" ? 10'000'000 : 100'000'000;
    return send_periodically(bus, options, options.every_ns > 0 ? options.every_ns : usual,
                             [&](std::uint64_t n) {
        if (kind == "guarding") return can::Frame::request(0x700U + node, 1);
        if (kind == "heartbeat") {
            return can::Frame(0x700U + node,
                              {static_cast<std::uint8_t>(canopen::NmtState::operational)});
        }
        return options.counter == 0
                   ? can::Frame(0x80, {})
                   : can::Frame(0x80, {static_cast<std::uint8_t>(n % options.counter + 1)});
    });
}

}  // namespace hal::tools
