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

namespace {

constexpr std::int64_t tick_ns = 1'000'000;
constexpr std::int64_t poll_ns = 20'000;
constexpr std::size_t frames_at_once = 32;

/// Works a line on one or two ports.
class LineServer {
public:
    LineServer(Line& line, ethernet::Port& primary, ethernet::Port* secondary,
               ServeControl* control) noexcept
        : line_(line), ports_{&primary, secondary}, control_(control) {}

    void run(const std::atomic<bool>& stop) noexcept {
        std::int64_t next_tick_ns = 0;
        while (!stop.load(std::memory_order_relaxed)) {
            bool received = false;
            for (const End end : {End::primary, End::secondary}) {
                received = pass_frames(end) || received;
            }
            const std::int64_t now = link::monotonic_ns();
            if (now >= next_tick_ns) {
                tick(now);
                next_tick_ns = now + tick_ns;
            }
            if (!received) {
                wait(now, next_tick_ns);
            }
        }
    }

private:
    ethernet::Port* port(End end) const noexcept { return ports_[static_cast<std::size_t>(end)]; }

    /// Sends the frames that have arrived at one end through the line. Returns whether there were
    /// any.
    bool pass_frames(End end) noexcept {
        if (port(end) == nullptr) return false;
        for (std::size_t n = 0; n < frames_at_once; ++n) {
            const auto arrival = port(end)->receive(link::monotonic_ns());
            if (!arrival) return n > 0;
            pass(*arrival, end);
        }
        return true;
    }
    void pass(const ethernet::Arrival& arrival, End end) noexcept {
        const std::size_t length = std::min(arrival.bytes.size(), frame_.size());
        std::memcpy(frame_.data(), arrival.bytes.data(), length);
        // The stamp of the kernel is free of the latency of this thread.
        const std::int64_t now = link::monotonic_ns();
        const std::int64_t first_bit_ns = std::clamp(arrival.time_ns, now - tick_ns, now);
        const Line::Passage out = line_.process({frame_.data(), length}, end, first_bit_ns);
        ethernet::Port* const leaving = port(out.end);
        if (out.lost || leaving == nullptr) return;
        for (unsigned copy = 0; copy < out.copies; ++copy) {
            leaving->send({frame_.data(), length}, {}, now);
        }
    }
    void tick(std::int64_t now) noexcept {
        line_.advance(now);
        for (const End end : {End::primary, End::secondary}) {
            if (port(end) == nullptr) continue;
            bool& was_up = up_[static_cast<std::size_t>(end)];
            const bool is_up = port(end)->statistics().up;
            if (is_up != was_up) {
                line_.set_cable(end, is_up);
            }
            was_up = is_up;
        }
        if (control_ != nullptr) {
            control_->work(line_, now);
        }
    }
    /// Waits for a frame at the first port. The second one is polled meanwhile.
    void wait(std::int64_t now, std::int64_t until_ns) noexcept {
        const bool has_two = port(End::secondary) != nullptr;
        port(End::primary)->wait(has_two ? std::min(until_ns, now + poll_ns) : until_ns);
    }

    Line& line_;
    std::array<ethernet::Port*, 2> ports_;
    ServeControl* control_;
    std::array<bool, 2> up_{true, true};
    std::array<std::uint8_t, ethernet::max_frame> frame_;
};

}  // namespace

void serve(Line& line, ethernet::Port& primary, ethernet::Port* secondary,
           const std::atomic<bool>& stop, ServeControl* control) noexcept {
    LineServer(line, primary, secondary, control).run(stop);
}

}  // namespace hal::ethercat::esc
