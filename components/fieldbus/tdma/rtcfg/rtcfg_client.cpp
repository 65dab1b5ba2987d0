// SPDX-License-Identifier: MIT
#include "rtcfg_client.hpp"

#include <algorithm>

namespace hal::tdma::rtcfg {

Client::Client(Station& station, Logical own, ClientEvents& events, bool wants_file)
    : TaskChannel(task_bytes),
      station_(station),
      own_(own),
      events_(events),
      wants_file_(wants_file),
      file_(max_stage_2_size) {}

void Client::begin() noexcept {
    stop();
    file_state_ = File::not_announced;
    ready_ = acknowledge_ = reply_ = false;
    sent_at_ = INT64_MIN / 2;
}

void Client::accept(const Address& server, std::uint16_t heartbeat_ms) noexcept {
    begin();
    server_ = server;
    heartbeat_ms_ = heartbeat_ms;
    start([this] { return work(); });
}

// The steps of a client after stage 1, in the order of RTnet, Documentation/RTcfg, "Configuration
// Process": announcement, stage 2, ready, heartbeats.

hal::Task<> Client::work() noexcept {
    co_await next_slots();
    co_await sent(Id::announce_new);
    if (wants_file_) {
        co_await receive_file();
    } else {
        file_state_ = File::complete;
        co_await next_slots();
    }
    co_await sent(Id::ready);
    ready_ = true;
    for (;;) {
        co_await next_slots();
        if (acknowledge_) {
            co_await sent(Id::acknowledge);
        }
        if (heartbeat_ms_ != 0 && now_ - sent_at_ >= Time{heartbeat_ms_} * 1'000'000) {
            co_await sent(Id::heartbeat);
        }
    }
}

/// Stage 2: repeats the announcement until the first frame, then acknowledges what arrives, and
/// what is missing after a second without a frame.
hal::Task<> Client::receive_file() noexcept {
    file_state_ = File::expected;
    while (file_state_ == File::expected) {
        co_await next_slots();
        if (file_state_ == File::expected && is_late()) {
            send(Id::announce_new);
        }
    }
    while (acknowledge_ || file_state_ == File::arriving) {
        if (acknowledge_ || is_late()) {
            co_await sent(Id::acknowledge);
        } else {
            co_await next_slots();
        }
    }
}

/// Sends a frame to the server, in as many cycles as it takes.
hal::Task<> Client::sent(Id id) noexcept {
    while (!send(id)) {
        co_await next_slots();
    }
}

Message Client::message(Id id) const noexcept {
    Message m;
    m.id = id;
    m.to = id == Id::announce_new || id == Id::ready ? ethernet::broadcast : server_;
    m.flags = wants_file_ ? wants_stage_2 : is_ready;
    m.burst = burst_;
    m.length = received_;
    return m;
}

bool Client::send(Id id) noexcept {
    if (!send(message(id))) return false;
    sent_at_ = now_;
    if (id == Id::acknowledge) {
        acknowledge_ = false;
        since_ = 0;
    }
    return true;
}

bool Client::send(Message m) noexcept {
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
void Client::store(std::uint32_t offset, std::span<const std::uint8_t> data) noexcept {
    // without the padding of a short frame
    data = data.first(std::min<std::size_t>(data.size(), length_ - std::min(offset, length_)));
    if (offset == received_ && !data.empty()) {
        std::copy(data.begin(), data.end(), file_.begin() + offset);
        received_ += static_cast<std::uint32_t>(data.size());
    }
    sent_at_ = now_;
    const bool complete = received_ == length_;
    ++since_;
    acknowledge_ = acknowledge_ || since_ >= burst_ || complete;
    if (complete) {
        file_state_ = File::complete;
        events_.on_stage_2(file_, received_, server_);
    }
}

/// Returns false if a second server sent it: the first one counts.
bool Client::arrived_stage_1(const Message& m) noexcept {
    if (!is_for_us(m)) return true;
    if (configured() && m.from != server_ && m.from != station_.status().master) {
        events_.on_other_server(m.from);
        return false;
    }
    burst_ = static_cast<std::uint8_t>(std::clamp<unsigned>(m.burst, 1, 4));
    events_.on_stage_1(m.data, m.from);
    return true;
}

bool Client::arrived_stage_2(const Message& m) noexcept {
    if (file_state_ != File::expected || m.length > file_.size()) return false;
    length_ = m.length;
    received_ = 0;
    since_ = 0;
    heartbeat_ms_ = m.heartbeat_ms;
    acknowledge_ = true;
    file_state_ = File::arriving;
    store(0, m.data);
    return true;
}

bool Client::arrived_fragment(const Message& m) noexcept {
    if (file_state_ == File::arriving) {
        store(m.offset, m.data);
    } else if (file_state_ == File::complete) {
        acknowledge_ = true;  // the acknowledgement was lost
    }
    return file_state_ >= File::arriving;
}

/// Returns false for a frame that is not expected.
bool Client::arrived(const Message& m) noexcept {
    const bool of_server = configured() && m.from == server_;
    const bool is_ours = of_server && m.to == station_.address();
    switch (m.id) {
    case Id::stage_1: return arrived_stage_1(m);
    case Id::stage_2: return is_ours && arrived_stage_2(m);
    case Id::stage_2_fragment: return is_ours && arrived_fragment(m);
    case Id::announce_new:
        reply_to_ = m.from;
        reply_ = configured();
        return true;
    case Id::dead_station:
        if (of_server) {
            events_.on_dead_station(m.dead);
        }
        return of_server;
    default: return true;  // for other stations
    }
}

void Client::arrived(std::span<const std::uint8_t> frame, Time now) noexcept {
    now_ = now;
    Message m;
    if (!decode(frame, m) || !arrived(m)) {
        ++foreign_;
    }
}

void Client::before_slots(Time now) noexcept {
    now_ = now;
    if (reply_) {
        Message reply;
        reply.id = Id::announce_reply;
        reply.to = reply_to_;
        reply_ = !send(reply);
    }
    if (configured()) {
        resume();
    }
}

}  // namespace hal::tdma::rtcfg
