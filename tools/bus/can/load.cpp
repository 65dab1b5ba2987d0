// SPDX-License-Identifier: MIT
// `hal can load`: the bus load by identifier.
#include "bus/can/load.hpp"

#include <algorithm>
#include <fmt/core.h>
#include <map>
#include <unistd.h>

#include "bus/can/bus.hpp"
#include "bus/can/frame_decoder.hpp"
#include "cli/output.hpp"
#include "link/timing.hpp"

namespace hal::tools {

namespace {

struct Share {
    can::Frame sample;
    std::uint64_t frames = 0;
    std::uint64_t bits = 0;
    std::int64_t busy_ns = 0;
};

}  // namespace

int run_can_load(const BusLoadOptions& options) {
    Bus bus;
    if (!bus.open(options, options.words[0])) return 1;
    const can::Description& about = bus.link->description();
    bus.announce(options);
    constexpr std::int64_t window_ns = 100'000'000;
    std::map<std::pair<bool, std::uint32_t>, Share> shares;
    std::map<std::int64_t, std::int64_t> windows;
    const std::int64_t began = monotonic_ns();
    listen(bus, options.for_ns >= 0 ? options.for_ns : 2'000'000'000,
           [&](std::span<const can::Frame> batch) {
        for (const can::Frame& f : batch) {
            if (f.error) continue;
            Share& share = shares[{f.extended, f.id}];
            const can::Bits bits = can::frame_bits(f);
            const std::int64_t time = can::duration_ns(bits, about.bit_rate, about.data_rate);
            share.sample = f;
            ++share.frames;
            share.bits += bits.total();
            share.busy_ns += time;
            windows[f.time_ns / window_ns] += time;
        }
        return true;
    });
    const double seconds = static_cast<double>(monotonic_ns() - began) / 1e9;
    std::vector<const Share*> rows;
    Share all;
    for (const auto& [key, share] : shares) {
        rows.push_back(&share);
        all.frames += share.frames;
        all.bits += share.bits;
        all.busy_ns += share.busy_ns;
    }
    std::stable_sort(rows.begin(), rows.end(),
                     [](const Share* a, const Share* b) { return a->bits > b->bits; });
    const auto row = [&](const std::string& id, const std::string& what, const Share& share) {
        const std::string percent =
            about.bit_rate
                ? fmt::format("{:.2f}", static_cast<double>(share.busy_ns) / 1e7 / seconds)
                : "-";
        return fmt::format("{:>8}  {:22}  {:>9.1f}  {:>9}  {:>8}\n", id, what,
                           static_cast<double>(share.frames) / seconds, share.bits, percent);
    };
    std::string text = fmt::format("{:>8}  {:22}  {:>9}  {:>9}  {:>8}\n", "id", "meaning",
                                   "frames/s", "bits", "percent");
    for (const Share* share : rows) {
        text += row(id_text(share->sample), service_name(share->sample.id, share->sample.extended),
                    *share);
    }
    text += row("all", "", all);
    if (!print(text)) return 1;
    std::int64_t peak = 0;
    for (const auto& [window, busy] : windows) {
        peak = std::max(peak, busy);
    }
    const can::Statistics s = bus.link->statistics();
    const std::string load_text =
        about.bit_rate ? fmt::format("peak load over 0.1 s: {:.1f} %",
                                     static_cast<double>(peak) * 100 / window_ns)
                       : "load unknown without a bit rate; add ?bitrate=500k to the address";
    write_all(STDERR_FILENO, fmt::format("{:.2f} s; {}; {} errors, {} lost\n", seconds, load_text,
                                         s.errors, s.lost));
    return 0;
}

}  // namespace hal::tools
