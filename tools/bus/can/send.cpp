// SPDX-License-Identifier: MIT
// `hal can send`: sends frames, once or periodically.
#include "bus/can/send.hpp"

#include <fmt/core.h>
#include <unistd.h>

#include "bus/can/bus.hpp"
#include "cli/output.hpp"
#include "text/quoting.hpp"

namespace hal::tools {

int run_can_send(const SendOptions& options) {
    if (options.words.size() < 2) {
        return fail(options, "missing frame; type: hal can send ADDRESS 123#1122AABB");
    }
    if (options.every_ns == 0 && (options.for_ns >= 0 || options.count != 0)) {
        return fail(options, "--for and --count limit the repetition of --every; add --every 10ms");
    }
    std::vector<can::Frame> frames(options.words.size() - 1);
    std::string problem;
    bool fd = false;
    for (std::size_t i = 0; i < frames.size(); ++i) {
        if (!parse_frame(options.words[i + 1], frames[i], problem)) return fail(options, problem);
        if (frames[i].error) {
            return fail(options,
                        fmt::format("cannot send error frame '{}'; only a controller can send one",
                                    options.words[i + 1]));
        }
        fd = fd || frames[i].fd;
    }
    Bus bus;
    if (!bus.open(options, options.words[0], fd)) return 1;
    std::uint64_t rounds = 0;
    std::uint64_t wanted = 0;
    const std::int64_t began = monotonic_ns();
    for (std::int64_t due = began;;) {
        for (const can::Frame& f : frames) {
            send_with_timeout(bus, f);
            ++wanted;
        }
        bus.link->flush(can::unclocked);
        ++rounds;
        due += options.every_ns;
        if (options.every_ns == 0 || rounds == options.count ||
            (options.for_ns >= 0 && due - began >= options.for_ns)) {
            break;
        }
        const std::int64_t left = due - monotonic_ns();
        if (left > 0 ? bus.stop.wait_ns(left) : bus.stop.requested()) break;
    }
    const double seconds = static_cast<double>(monotonic_ns() - began) / 1e9;
    const int status = finish_sending(bus, options, wanted);
    if (status == 0 && options.every_ns != 0) {
        write_all(STDERR_FILENO,
                  fmt::format("{} in {:.2f} s\n", counted(wanted, "frame"), seconds));
    }
    return status;
}

}  // namespace hal::tools
