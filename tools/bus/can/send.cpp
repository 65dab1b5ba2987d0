// SPDX-License-Identifier: MIT
// `hal can send`: sends frames, once or periodically.
#include "bus/can/send.hpp"

#include <fmt/core.h>

#include "bus/can/bus.hpp"
#include "bus/can/periodic.hpp"
#include "cli/output.hpp"

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
    const auto send = [&](std::uint64_t) {
        for (const can::Frame& f : frames) {
            send_with_timeout(bus, f);
        }
    };
    if (options.every_ns == 0) {
        send(0);
        return finish_sending(bus, options, frames.size());
    }
    const Repeated sent = repeat(bus, options, options.every_ns, send);
    return finish_rounds(bus, options, sent.rounds * frames.size(), sent);
}

}  // namespace hal::tools
