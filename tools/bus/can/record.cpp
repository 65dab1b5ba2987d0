// SPDX-License-Identifier: MIT
// `hal can record` and `hal can replay`: records a bus to a file, and sends a file to a bus.
#include "bus/can/record.hpp"

#include <cerrno>
#include <cmath>
#include <cstring>
#include <fmt/core.h>
#include <time.h>
#include <unistd.h>

#include "bus/can/bus.hpp"
#include "cli/output.hpp"
#include "link/capture.hpp"
#include "text/quoting.hpp"

namespace hal::tools {

int run_can_record(const CanRecordOptions& options) {
    if (options.words.size() != 2) {
        return fail(options, "expected ADDRESS FILE; type: hal can record ADDRESS FILE.log");
    }
    const std::string& file = options.words[1];
    if (!file.ends_with(".log") && !file.ends_with(".pcapng")) {
        return fail(options, fmt::format("unknown format of '{}'; write a name that ends in .log "
                                         "(candump) or .pcapng (Wireshark)",
                                         file));
    }
    Bus bus;
    if (!bus.open(options, options.words[0], true, options.filters)) return 1;
    std::string problem, channel = options.words[0].substr(0, options.words[0].find('?'));
    channel.erase(0, channel.find(':') + 1);
    // the candump format has one word here
    if (channel.empty() || channel.find_first_of("/: %[") != channel.npos) {
        channel = "can0";
    }
    const auto recorder = can::record(file, channel, problem);
    if (!recorder) return fail(options, problem);
    bus.announce(options);
    timespec real{};
    clock_gettime(CLOCK_REALTIME, &real);
    // files have the time of day
    const std::int64_t shift = real.tv_sec * 1'000'000'000LL + real.tv_nsec - monotonic_ns();
    std::uint64_t frames = 0;
    bool written = true;
    listen(bus, options.for_ns, [&](std::span<const can::Frame> batch) {
        for (can::Frame f : batch) {
            f.time_ns += shift;
            if (!recorder->write(f)) return written = false;
            if (++frames == options.count) return false;
        }
        return written = recorder->flush();
    });
    if (!written || !recorder->flush()) {
        return fail(options,
                    fmt::format("cannot write '{}': {}; the file ends with the last complete frame",
                                file, std::strerror(errno)));
    }
    const can::Statistics s = bus.link->statistics();
    write_all(STDERR_FILENO,
              fmt::format("{} in {}, {} lost\n", counted(frames, "frame"), file, s.lost));
    return exit_code(s.lost == 0);  // the file is incomplete
}

int run_can_replay(const CanReplayOptions& options) {
    if (options.words.size() != 2) {
        return fail(options, "expected FILE ADDRESS; type: hal can replay FILE ADDRESS");
    }
    if (!(options.speed > 0) || !std::isfinite(options.speed)) {
        return fail(options,
                    "invalid --speed; write a factor above 0: 1 as recorded, 2 twice as fast");
    }
    const can::Capture capture = can::read_capture(options.words[0]);
    if (!capture.problem.empty()) {
        return fail(options, fmt::format("{}: {}", options.words[0], capture.problem));
    }
    if (capture.frames.empty()) {
        return fail(options, fmt::format("{}: no CAN frames in this file", options.words[0]));
    }
    bool fd = false;
    for (const can::Frame& f : capture.frames) {
        fd = fd || f.fd;
    }
    Bus bus;
    if (!bus.open(options, options.words[1], fd)) return 1;
    if (bus.is_capture()) {
        return fail(options, fmt::format("cannot send to '{}': it is a capture", options.words[1]));
    }
    const std::int64_t began = monotonic_ns();
    const std::int64_t zero = capture.frames.front().time_ns;
    std::uint64_t sent = 0;
    std::uint64_t skipped = 0;
    for (const can::Frame& f : capture.frames) {
        if (f.error) {
            ++skipped;
            continue;
        }
        const double after = static_cast<double>(f.time_ns - zero) / options.speed;
        const std::int64_t left =
            began + static_cast<std::int64_t>(after < 9e17 ? after : 9e17) - monotonic_ns();
        if (left > 0) {
            bus.link->flush(can::unclocked);
        }
        if (left > 0 ? bus.stop.wait_ns(left) : bus.stop.requested()) break;
        send_with_timeout(bus, f);
        ++sent;
    }
    const int status = finish_sending(bus, options, sent);
    if (status == 0) {
        write_all(STDERR_FILENO,
                  fmt::format("{} in {:.2f} s{}\n", counted(sent, "frame"),
                              static_cast<double>(monotonic_ns() - began) / 1e9,
                              skipped ? fmt::format(", {} error frames skipped", skipped) : ""));
    }
    return status;
}

}  // namespace hal::tools
