// SPDX-License-Identifier: MIT
#include "rtcfg_client.hpp"

#include <algorithm>

namespace hal::tdma::rtcfg {

Client::Client(Station& station, Logical own, ClientEvents& events, bool wants_file)
    : station_(station),
      own_(own),
      events_(events),
      wants_file_(wants_file),
      file_(max_stage_2_size) {}

void Client::begin() noexcept {
    step_ = Step::waiting;
    acknowledge_ = reply_ = false;
    sent_at_ = INT64_MIN / 2;
}

void Client::accept(const Address& server, std::uint16_t heartbeat_ms) noexcept {
    begin();
    server_ = server;
    heartbeat_ms_ = heartbeat_ms;
    step_ = Step::announcing;
}

bool Client::send(Message& m) noexcept {
    m.from = station_.address();
    m.client = own_;
    const std::size_t length = encode(m, frame_);
    return length != 0 && station_.send(std::span(frame_).first(length), default_slot,
                                        last_priority) == ethernet::Sent::queued;
}

/// Compares IP addresses when both are known, otherwise MAC addresses.
bool Client::is_for_us(const Message& m) const noexcept {
    return own_.by_ip && m.client.by_ip ? m.client == own_ : m.to == station_.address();
}

/// Stores the next part of the file; a lost part is requested again by acknowledging the received
/// bytes.
void Client::take(const Message& m, std::span<const std::uint8_t> data, Time now) noexcept {
    const std::uint32_t offset = m.id == Id::stage_2 ? 0 : m.offset;
    // without the padding of a short frame
    data = data.first(std::min<std::size_t>(data.size(), length_ - std::min(offset, length_)));
    if (offset == received_ && !data.empty()) {
        std::copy(data.begin(), data.end(), file_.begin() + offset);
        received_ += static_cast<std::uint32_t>(data.size());
    }
    sent_at_ = now;
    if (++since_ >= burst_ || received_ == length_ || m.id == Id::stage_2) {
        acknowledge_ = true;
    }
    if (received_ == length_) {
        step_ = Step::finished;
        events_.on_stage_2(file_, received_, server_);
    }
}

void Client::arrived(std::span<const std::uint8_t> frame, Time now) noexcept {
    Message m;
    if (!decode(frame, m)) {
        ++foreign_;
        return;
    }
    switch (m.id) {
    case Id::stage_1:
        if (!is_for_us(m)) return;
        // two servers: the first one counts
        if (step_ != Step::waiting && m.from != server_ && m.from != station_.status().master) {
            ++foreign_;
            events_.on_other_server(m.from);
            return;
        }
        burst_ = static_cast<std::uint8_t>(std::clamp<unsigned>(m.burst, 1, 4));
        events_.on_stage_1(m.data, m.from);
        return;
    case Id::stage_2:
        if (step_ == Step::announcing && wants_file_ && m.from == server_ &&
            m.to == station_.address() && m.length <= file_.size()) {
            length_ = m.length;
            received_ = 0;
            since_ = 0;
            heartbeat_ms_ = m.heartbeat_ms;
            step_ = Step::receiving;
            take(m, m.data, now);
            return;
        }
        break;
    case Id::stage_2_fragment:
        if (step_ == Step::receiving && m.from == server_ && m.to == station_.address()) {
            return take(m, m.data, now);
        }
        // the acknowledgement was lost
        if (step_ >= Step::finished && m.from == server_) {
            acknowledge_ = true;
            return void();
        }
        break;
    case Id::announce_new:
        reply_to_ = m.from;
        reply_ = configured();
        return;
    case Id::dead_station:
        if (configured() && m.from == server_) return events_.on_dead_station(m.dead);
        break;
    default: return;  // for other stations
    }
    ++foreign_;
}

void Client::before_slots(Time now) noexcept {
    Message m;
    if (reply_) {
        m.id = Id::announce_reply;
        m.to = reply_to_;
        reply_ = !send(m);
    }
    const bool late = now - sent_at_ >= retry_after;
    switch (step_) {
    case Step::waiting: break;
    case Step::announcing:
        if (!late) break;
        m = {};
        m.id = Id::announce_new;
        m.to = ethernet::broadcast;

        m.flags = wants_file_ ? wants_stage_2 : is_ready;
        m.burst = burst_;
        if (!send(m)) break;
        sent_at_ = now;
        if (!wants_file_) {
            step_ = Step::finished;
        }
        break;
    case Step::receiving:
    case Step::finished:
    case Step::ready:
        if (acknowledge_ || (late && step_ == Step::receiving)) {
            m = {};
            m.id = Id::acknowledge;
            m.to = server_;
            m.length = received_;
            if (!send(m)) break;
            acknowledge_ = false;
            since_ = 0;
            sent_at_ = now;
        }
        if (step_ == Step::receiving) break;
        m = {};
        if (step_ == Step::finished) {
            m.id = Id::ready;
            m.to = ethernet::broadcast;
            if (send(m)) {
                step_ = Step::ready;
                sent_at_ = now;
            }
        } else if (heartbeat_ms_ != 0 &&
                   now - sent_at_ >= static_cast<Time>(heartbeat_ms_) * 1'000'000) {
            m.id = Id::heartbeat;
            m.to = server_;
            if (send(m)) {
                sent_at_ = now;
            }
        }
        break;
    }
}

}  // namespace hal::tdma::rtcfg
