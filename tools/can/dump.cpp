// SPDX-License-Identifier: MIT
// `hal can dump`: what is on the bus, a line per frame.
#include <fmt/core.h>
#include <unistd.h>

#include "can/bus.hpp"
#include "can/meaning.hpp"
#include "link/timing.hpp"
#include "say.hpp"

namespace hal::tools {

namespace {

constexpr const char* colour(Kind kind) {
    switch (kind) {
    case Kind::error:
    case Kind::emergency: return "\x1b[31m";
    case Kind::nmt:
    case Kind::lss: return "\x1b[35m";
    case Kind::sync:
    case Kind::time:
    case Kind::heartbeat: return "\x1b[2m";
    case Kind::pdo: return "\x1b[32m";
    case Kind::sdo: return "\x1b[36m";
    default: return "";
    }
}

std::string line(const can::Frame& f, double time, const Meaning& meaning, bool coloured) {
    const char* mark = f.fd ? f.bit_rate_switch ? " FD+" : " FD" : "";
    std::string text =
        fmt::format("{:12.6f}  {}  {:>8}  [{}]{} {:23}", time, f.own ? "tx" : "rx", id_text(f), f.length, mark, data_text(f, " "));
    if (!meaning.text.empty()) text += "  " + meaning.text;
    while (text.back() == ' ') text.pop_back();
    const std::string_view start = coloured ? colour(meaning.kind) : "";
    return start.empty() ? text + "\n" : fmt::format("{}{}\x1b[0m\n", start, text);
}

std::string json_line(const can::Frame& f, double time, const Meaning& meaning) {
    std::string text = fmt::format(R"({{"time":{:.6f},"direction":"{}","id":{},"extended":{},"length":{},"data":"{}")", time,
                                   f.own ? "tx" : "rx", f.id, f.extended, f.length, f.remote ? "" : data_text(f, ""));
    if (f.remote) text += R"(,"remote":true)";
    if (f.fd) text += fmt::format(R"(,"fd":true,"bit_rate_switch":{})", f.bit_rate_switch);
    if (f.error) text += R"(,"error":true)";
    if (!meaning.text.empty()) text += fmt::format(R"(,"meaning":"{}")", meaning.text);
    return text + "}\n";
}

}  // namespace

int run_can_dump(const Options& options) {
    if (options.words.size() != 1)
        return fail(options, fmt::format("nothing is expected at '{}'; see: hal help can dump", options.words[1]));
    Bus bus;
    if (!bus.open(options, options.words[0])) return 1;
    bus.announce(options);
    const bool coloured = !options.json && colours(STDOUT_FILENO);
    Interpreter interpreter;
    std::uint64_t frames = 0;
    std::int64_t first = 0, busy = 0;
    const can::Description& about = bus.link->description();
    const std::int64_t began = now_ns();
    bool written = true;
    listen(bus, options.for_ns, [&](std::span<const can::Frame> batch) {
        std::string text;
        for (const can::Frame& f : batch) {
            if (frames++ == 0) first = f.time_ns;
            const double time = static_cast<double>(f.time_ns - first) / 1e9;
            const Meaning meaning = interpreter.of(f);
            text += options.json ? json_line(f, time, meaning) : line(f, time, meaning, coloured);
            if (!f.error) busy += can::duration_ns(can::frame_bits(f), about.bit_rate, about.data_rate);
            if (frames == options.count) break;
        }
        written = print(text);
        return written && (options.count == 0 || frames < options.count);
    });
    if (!written) return 1;
    const double seconds = static_cast<double>(now_ns() - began) / 1e9;
    const can::Statistics s = bus.link->statistics();
    const double load = static_cast<double>(busy) / 1e7 / seconds;
    if (options.json) {
        const std::string share = about.bit_rate ? fmt::format("{:.2f}", load) : "null";
        return print(fmt::format(
                   R"({{"statistics":{{"frames":{},"seconds":{:.3f},"load_percent":{},"errors":{},"lost":{},"bus_offs":{},"state":"{}"}}}})"
                   "\n",
                   frames, seconds, share, s.errors, s.lost, s.bus_offs, can::word(s.state)))
                   ? 0
                   : 1;
    }
    const std::string share = about.bit_rate ? fmt::format("{:.1f} %", load) : "unknown (add ?bitrate=500k to the address)";
    write_all(STDERR_FILENO,
              fmt::format("{} frame{} in {:.2f} s, bus load {}, {} errors, {} lost{}\n", frames, frames == 1 ? "" : "s", seconds, share,
                          s.errors, s.lost, bus.is_capture() ? "" : fmt::format(", bus {}", can::word(s.state))));
    return 0;
}

}  // namespace hal::tools
