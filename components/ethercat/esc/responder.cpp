// SPDX-License-Identifier: MIT
#include "ethercat/esc/responder.hpp"

#include <algorithm>
#include <array>
#include <cstring>

#include "link/system.hpp"

namespace hal::ethercat::esc {

LineOnSegments::LineOnSegments(Line& line, ethernet::Port& primary, ethernet::Port* secondary)
    : line_(line), ports_{&primary, secondary} {
    connected_ = true;
    for (std::size_t i = 0; i < 2; ++i) {
        sides_[i].owner = this;
        sides_[i].end = static_cast<End>(i);
        if (ports_[i] == nullptr) continue;
        ethernet::Segment* segment = ports_[i]->segment();
        connected_ &= segment != nullptr && segment->respond(&sides_[i]);
    }
}

LineOnSegments::~LineOnSegments() {
    if (!connected_) return;
    for (ethernet::Port* port : ports_) {
        if (port != nullptr) {
            port->segment()->respond(nullptr);
        }
    }
}

void LineOnSegments::Side::arrived(std::span<std::uint8_t> frame,
                                   std::int64_t first_bit_ns) noexcept {
    const Line::Passage out = owner->line_.process(frame, end, first_bit_ns);
    ethernet::Port* port = owner->ports_[static_cast<std::size_t>(out.end)];
    if (out.lost || port == nullptr) return;
    for (unsigned i = 0; i < out.copies; ++i) {
        port->send(frame, {.at_ns = out.first_bit_ns}, first_bit_ns);
    }
}

namespace serve_facts {
constexpr std::int64_t tick_ns = 1'000'000;
constexpr std::size_t frames_at_once = 32;
}  // namespace serve_facts

void serve(Line& line, ethernet::Port& primary, ethernet::Port* secondary,
           const std::atomic<bool>& stop, ServeControl* control) noexcept {
    const std::array<ethernet::Port*, 2> both{&primary, secondary};
    std::array<std::uint8_t, ethernet::max_frame> frame;
    std::array<bool, 2> up{true, true};
    std::int64_t tick = 0;
    while (!stop.load(std::memory_order_relaxed)) {
        bool worked = false;
        for (std::size_t side = 0; side < both.size(); ++side) {
            if (both[side] == nullptr) continue;
            for (std::size_t i = 0; i < serve_facts::frames_at_once; ++i) {
                const auto arrival = both[side]->receive(link::monotonic_ns());
                if (!arrival) break;
                worked = true;
                const std::size_t length = std::min(arrival->bytes.size(), frame.size());
                std::memcpy(frame.data(), arrival->bytes.data(), length);
                // The stamp of the kernel is free of the latency of this thread.
                const std::int64_t now = link::monotonic_ns();
                const std::int64_t first_bit_ns =
                    std::clamp(arrival->time_ns, now - serve_facts::tick_ns, now);
                const auto out =
                    line.process({frame.data(), length}, static_cast<End>(side), first_bit_ns);
                ethernet::Port* port = both[static_cast<std::size_t>(out.end)];
                if (out.lost || port == nullptr) continue;
                for (unsigned copy = 0; copy < out.copies; ++copy) {
                    port->send({frame.data(), length}, {}, now);
                }
            }
        }
        const std::int64_t now = link::monotonic_ns();
        if (now >= tick) {
            line.advance(now);
            for (std::size_t side = 0; side < both.size(); ++side) {
                if (both[side] == nullptr) continue;
                const bool is_up = both[side]->statistics().up;
                if (is_up != up[side]) {
                    line.set_cable(static_cast<End>(side), is_up);
                }
                up[side] = is_up;
            }
            if (control != nullptr) {
                control->work(line, now);
            }
            tick = now + serve_facts::tick_ns;
        }
        if (worked) continue;
        // With two ports one is polled while the other waits.
        const std::int64_t until = secondary == nullptr ? tick : std::min(tick, now + 20'000);
        primary.wait(until);
    }
}

}  // namespace hal::ethercat::esc
