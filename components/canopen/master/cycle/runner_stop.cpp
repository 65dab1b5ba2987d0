// SPDX-License-Identifier: MIT
// What the master does when its thread is stopped, and with what arrived until it runs again.
#include "runner.hpp"

namespace hal::canopen {

void Runner::make_safe() noexcept {
    if (link_ == nullptr) return;
    boots_.store(true);
    if (safe_.exchange(true)) {
        return;  // nothing was started, or the safe values were sent
    }
    if (!active()) {
        return;             // the network is another one's
    }
    if (!send_safe_values()) {
        safe_.store(false);
    }
}

/// Returns whether the link took all of them.
bool Runner::send_safe_values() noexcept {
    bool all = true;
    bool synchronous = false;
    const auto send = [&](const can::Frame& f) {
        if (link_->send(f, now_) != can::Sent::queued) {
            all = false;
        }
    };
    for (Output& out : outputs_) {
        if (!out.open) continue;
        if (out.sent->pdo->multiplexed()) {
            if (!make_safe_alone(out)) {
                all = false;
            }
            continue;
        }
        std::uint64_t image = 0;
        for (const Sent::Part& part : out.sent->parts) {
            const Slot& s = slots_[part.placed];
            const std::uint64_t value = s.has_safe ? s.safe : number_in(*s.entry);
            image |= (part.bits >= 64 ? value : value & ((std::uint64_t{1} << part.bits) - 1))
                     << part.first;
        }
        can::Frame f = out.frame;
        store(f.data.data(), image);
        send(f);
        synchronous = synchronous || out.sent->pdo->synchronous();
    }
    if (synchronous && produces_) {
        send(sync_frame_);
    }
    for (const OwnSrdo& srdo : own_.srdos) {  // silence alone would take the node its SCT
        if (!srdo.pdo->to_node) continue;
        std::uint64_t image = 0;
        unsigned bit = 0;
        for (const std::size_t n : srdo.placed) {
            const Slot& s = slots_[n];
            const unsigned bits = s.object->bits;
            const std::uint64_t value = s.has_safe ? s.safe : number_in(*s.entry);
            image |= (bits >= 64 ? value : value & ((std::uint64_t{1} << bits) - 1)) << bit;
            bit += bits;
        }
        can::Frame f = make_frame(srdo.pdo->cob, static_cast<std::uint8_t>(srdo.pdo->bytes()));
        store(f.data.data(), image);
        send(f);
        f.id = srdo.pdo->cob + 1;
        store(f.data.data(), ~image);
        send(f);
    }
    for (const can::Frame& f : farewell_) {
        send(f);
    }
    link_->flush(now_);
    return all;
}

/// Returns whether the link took all of them.
bool Runner::make_safe_alone(const Output& out) noexcept {
    bool all = true;
    for (const Sent::Part& part : out.sent->parts) {
        const Slot& s = slots_[part.placed];
        can::Frame f = out.frame;
        f.data[0] = static_cast<std::uint8_t>(0x80 | statuses_[s.node]->id);
        store(f.data.data() + 1, s.object->index);
        f.data[3] = s.object->sub;
        store(f.data.data() + 4,
              static_cast<std::uint32_t>(s.has_safe ? s.safe : number_in(*s.entry)));
        if (link_->send(f, now_) != can::Sent::queued) {
            all = false;
        }
    }
    return all;
}

/// Drops the frames that arrived while no cycles ran: their values and answers are old. Emergencies
/// are still reported.
void Runner::drop_backlog(Time now) noexcept {
    constexpr std::size_t max_frames = 8192;
    std::array<can::Frame, 32> frames;
    for (std::size_t dropped = 0; dropped < max_frames; dropped += frames.size()) {
        const std::size_t count = link_->receive(frames, now);
        for (std::size_t i = 0; i < count; ++i) {
            const can::Frame& f = frames[i];
            const bool is_data = !f.extended && !f.remote && !f.error;
            const bool is_emergency = is_data && f.id > 0x80 && f.id < 0x100;
            if (is_emergency && active()) {
                master_.handle(f, now);
            }
        }
        if (count < frames.size()) return;
    }
}

}  // namespace hal::canopen
