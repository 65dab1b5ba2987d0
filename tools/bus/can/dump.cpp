// SPDX-License-Identifier: MIT
// `hal can dump`: prints the frames of one or more buses, one per line.
#include "bus/can/dump.hpp"

#include <algorithm>
#include <fmt/core.h>
#include <poll.h>
#include <time.h>
#include <unistd.h>

#include "bus/can/bus.hpp"
#include "bus/can/frame_decoder.hpp"
#include "bus/json_text.hpp"
#include "cli/output.hpp"
#include "link/capture.hpp"
#include "link/timing.hpp"
#include "text/quoting.hpp"

namespace hal::tools {

namespace {

constexpr const char* colour(FrameKind kind) {
    switch (kind) {
    case FrameKind::error:
    case FrameKind::emergency: return "\x1b[31m";
    case FrameKind::nmt:
    case FrameKind::lss: return "\x1b[35m";
    case FrameKind::sync:
    case FrameKind::time:
    case FrameKind::heartbeat: return "\x1b[2m";
    case FrameKind::pdo: return "\x1b[32m";
    case FrameKind::sdo: return "\x1b[36m";
    default: return "";
    }
}

/// One of the buses.
struct Source {
    can::Link* link = nullptr;
    std::string name;            ///< shown in each line; empty: the only bus
    std::int64_t to_wall = 0;    ///< offset from the time of its frames to the time of day
    std::uint64_t frames = 0;
    std::uint64_t error_frames = 0;  ///< of `frames`; the link counts them as errors
    std::int64_t busy = 0;       ///< bus time taken by its frames
    FrameDecoder decoder = {};
    std::vector<can::Frame> received = std::vector<can::Frame>(256);
};

std::string line(const can::Frame& f, double time, const std::string& bus,
                 const DecodedFrame& decoded, bool coloured) {
    std::string mark = f.fd ? " FD" : "";
    if (f.bit_rate_switch) {
        mark += '+';
    }
    if (f.error_state) {
        mark += " ESI";
    }
    std::string text =
        fmt::format("{:12.6f}  {}{}  {:>8}  [{}]{} {:23}", time, bus, f.own ? "tx" : "rx",
                    id_text(f), f.length, mark, data_text(f, " "));
    if (!decoded.text.empty()) {
        text += "  " + decoded.text;
    }
    while (text.back() == ' ') {
        text.pop_back();
    }
    const std::string_view start = coloured ? colour(decoded.kind) : "";
    return start.empty() ? text + "\n" : fmt::format("{}{}\x1b[0m\n", start, text);
}

std::string bus_member(const Source& source) {
    return source.name.empty() ? "" : fmt::format(R"("bus":{},)", json_text(source.name));
}

std::string json_line(const can::Frame& f, double time, const Source& source,
                      const DecodedFrame& decoded) {
    std::string text = fmt::format(
        R"({{"time":{:.6f},{}"direction":"{}","id":{},"extended":{},"length":{},"data":"{}")", time,
        bus_member(source), f.own ? "tx" : "rx", f.id, f.extended, f.length,
        f.remote ? "" : data_text(f, ""));
    if (f.remote) {
        text += R"(,"remote":true)";
    }
    if (f.fd) {
        text += fmt::format(R"(,"fd":true,"bit_rate_switch":{},"error_state":{})",
                            f.bit_rate_switch, f.error_state);
    }
    if (f.error) {
        text += R"(,"error":true)";
    }
    if (!decoded.text.empty()) {
        text += fmt::format(R"(,"meaning":"{}")", decoded.text);
    }
    return text + "}\n";
}

/// Returns `can0` of `can:can0?bitrate=500k`.
std::string short_name(const std::string& address) {
    const std::string plain = address.substr(0, address.find('?'));
    return plain.substr(plain.find(':') + 1);
}

/// Returns the offset from the time of a link's frames to the time of day. A capture is played now
/// and keeps the times of its recording.
std::int64_t shift_to_wall(const can::Link& link, const can::Frame& first) {
    const can::Description& about = link.description();
    if (!about.file.empty()) {
        const can::Capture capture = can::read_capture(about.file);
        for (const can::Frame& f : capture.frames) {
            if (f.same(first)) {
                return f.time_ns -
                       first.time_ns;  // a filter may have dropped the first frame of the file
            }
        }
    }
    timespec real{};
    clock_gettime(CLOCK_REALTIME, &real);
    return real.tv_sec * 1'000'000'000LL + real.tv_nsec - monotonic_ns();
}

struct Heard {
    const can::Frame* frame;
    Source* source;
};

/// Like `listen` for several buses: batches in the order of their times.
void listen_to_all(Bus& bus, std::vector<Source>& sources, std::int64_t for_ns,
                   const std::function<bool(std::span<const Heard>)>& take) {
    const std::int64_t end = for_ns >= 0 ? monotonic_ns() + for_ns : INT64_MAX;
    std::vector<Heard> batch;
    std::vector<pollfd> descriptors{{bus.stop.fd(), POLLIN, 0}};
    bool polled = true;
    for (const Source& s : sources) {
        polled = polled && s.link->descriptor() >= 0;
        descriptors.push_back({s.link->descriptor(), POLLIN, 0});  // poll() skips what has none
    }
    for (;;) {
        batch.clear();
        bool over = true;
        for (Source& s : sources) {
            const std::size_t count = s.link->receive(s.received, can::unclocked);
            for (const can::Frame& f : std::span(s.received).first(count)) {
                batch.push_back({&f, &s});
            }
            over = over && count == 0 && s.link->description().transport == "capture" &&
                   s.link->state() == can::State::down;
        }
        std::stable_sort(batch.begin(), batch.end(), [](const Heard& a, const Heard& b) {
            return a.frame->time_ns < b.frame->time_ns;
        });
        if (!batch.empty() && !take(batch)) return;
        const std::int64_t now = monotonic_ns();
        if (now >= end || bus.stop.requested() || over) return;
        if (batch.empty()) {
            ::poll(descriptors.data(), descriptors.size(), polled ? 20 : 1);
        }
    }
}

bool report(const DumpOptions& options, const Source& source, double seconds) {
    const can::Description& about = source.link->description();
    const can::Statistics s = source.link->statistics();
    const double load = static_cast<double>(source.busy) / 1e7 / seconds;
    const std::uint64_t frames = source.frames - source.error_frames;
    if (options.json) {
        const std::string share = about.bit_rate ? fmt::format("{:.2f}", load) : "null";
        return print(fmt::format(
            R"({{"statistics":{{{}"frames":{},"seconds":{:.3f},"load_percent":{},"errors":{},"lost":{},"bus_offs":{},"state":"{}"}}}})"
            "\n",
            bus_member(source), frames, seconds, share, s.errors, s.lost, s.bus_offs,
            can::to_string(s.state)));
    }
    const std::string share = about.bit_rate ? fmt::format("{:.1f} %", load)
                                             : "unknown (add ?bitrate=500k to the address)";
    const std::string name = source.name.empty() ? "" : source.name + ": ";
    const std::string state =
        about.transport == "capture" ? "" : fmt::format(", bus {}", can::to_string(s.state));
    write_all(STDERR_FILENO,
              fmt::format("{}{} in {:.2f} s, bus load {}, {} errors, {} lost{}\n", name,
                          counted(frames, "frame"), seconds, share, s.errors, s.lost, state));
    return true;
}

/// Formats the frames of all buses, and counts them.
class DumpText {
public:
    DumpText(const DumpOptions& options, std::size_t name_width, bool coloured)
        : options_(options), name_width_(name_width), coloured_(coloured) {}

    bool complete() const { return options_.count != 0 && frames_ >= options_.count; }

    std::string add(const can::Frame& f, Source& source) {
        const double time = seconds_of(f, source);
        ++frames_;
        ++source.frames;
        if (f.error) {
            ++source.error_frames;
        } else {
            const can::Description& about = source.link->description();
            source.busy += can::duration_ns(can::frame_bits(f), about.bit_rate, about.data_rate);
        }
        const DecodedFrame decoded = source.decoder.decode(f);
        if (options_.json) return json_line(f, time, source, decoded);
        const std::string name =
            name_width_ == 0 ? "" : fmt::format("{:{}}  ", source.name, name_width_);
        return line(f, time, name, decoded, coloured_);
    }

private:
    /// Returns the time of the frame as --time has it: since the first frame of all buses by
    /// default.
    double seconds_of(const can::Frame& f, Source& source) {
        if (options_.time == "absolute") {
            if (source.frames == 0) {
                source.to_wall = shift_to_wall(*source.link, f);
            }
            return static_cast<double>(f.time_ns + source.to_wall) / 1e9;
        }
        if (frames_ == 0) {
            before_ = f.time_ns;
        }
        const std::int64_t since = f.time_ns - before_;
        if (options_.time == "delta") {
            before_ = f.time_ns;
        }
        return static_cast<double>(since) / 1e9;
    }

    const DumpOptions& options_;
    const std::size_t name_width_;
    const bool coloured_;
    std::uint64_t frames_ = 0;
    std::int64_t before_ = 0;  // time of the first frame, or of the previous one
};

}  // namespace

int run_can_dump(const DumpOptions& options) {
    constexpr std::string_view times[] = {"", "relative", "delta", "absolute"};
    if (std::ranges::find(times, options.time) == std::end(times)) {
        return fail(options, fmt::format("invalid --time '{}'; write relative, delta or absolute",
                                         options.time));
    }
    Bus bus;
    if (!bus.open(options, options.words, options.filters)) return 1;
    bus.announce(options);
    std::vector<Source> sources(1 + bus.more.size());
    std::size_t width = 0;
    for (std::size_t n = 0; n < sources.size(); ++n) {
        sources[n].link = n == 0 ? bus.link.get() : bus.more[n - 1].get();
        if (sources.size() > 1) {
            sources[n].name = short_name(options.words[n]);
        }
        width = std::max(width, sources[n].name.size());
    }
    DumpText lines{options, width, !options.json && colours(STDOUT_FILENO)};
    const std::int64_t began = monotonic_ns();
    bool written = true;
    listen_to_all(bus, sources, options.for_ns, [&](std::span<const Heard> batch) {
        std::string text;
        for (const auto& [frame, source] : batch) {
            text += lines.add(*frame, *source);
            if (lines.complete()) break;
        }
        written = print(text);
        return written && !lines.complete();
    });
    if (!written) return 1;
    const double seconds = static_cast<double>(monotonic_ns() - began) / 1e9;
    for (const Source& source : sources) {
        if (!report(options, source, seconds)) return 1;
    }
    return 0;
}

}  // namespace hal::tools
