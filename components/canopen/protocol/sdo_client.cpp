// SPDX-License-Identifier: MIT
#include "sdo_client.hpp"

#include <algorithm>

namespace hal::canopen {

SdoClient::SdoClient(FrameQueue& out, const SdoClientSettings& settings)
    : out_(out), settings_(settings) {}

void SdoClient::configure(std::uint32_t request_cob, std::uint32_t answer_cob) noexcept {
    cancel_all(Abort::no_resource);
    request_cob_ = request_cob;
    answer_id_ = (answer_cob & cob_invalid) != 0 ? 0xffffffff : cob_id(answer_cob);
    answer_extended_ = (answer_cob & cob_extended) != 0;
    block_refused_ = false;
}

bool SdoClient::submit(SdoRequest& request) noexcept {
    if (request.status == SdoRequest::Status::waiting ||
        request.status == SdoRequest::Status::active) {
        return false;
    }
    request.status = SdoRequest::Status::waiting;
    request.abort = Abort::none;
    request.aborted_by_server = request.not_sent = false;
    request.size = 0;
    request.retries = 0;
    request.next = nullptr;
    (first_ == nullptr ? first_ : last_->next) = &request;
    last_ = &request;
    return true;
}

void SdoClient::cancel(SdoRequest& request, Abort why) noexcept {
    if (&request == first_) {
        if (state_ != State::idle) return abort(why);
        offset_ = 0;
        return finish(why);
    }
    for (auto* r = first_; r != nullptr; r = r->next) {
        if (r->next != &request) continue;
        r->next = request.next;
        if (last_ == &request) {
            last_ = r;
        }
        request.next = nullptr;
        request.status = SdoRequest::Status::done;
        request.abort = why;
        if (request.on_done != nullptr) {
            request.on_done(request, request.context);
        }
        return;
    }
}

void SdoClient::cancel_all(Abort why) noexcept {
    const auto* until = last_;  // requests that a callback submits stay queued
    while (first_ != nullptr) {
        const bool end = first_ == until;
        cancel(*first_, why);
        if (end) break;
    }
}

void SdoClient::finish(Abort why, bool by_server) noexcept {
    auto& request = *first_;
    first_ = request.next;
    if (first_ == nullptr) {
        last_ = nullptr;
    }
    state_ = State::idle;
    pending_ = false;
    request.next = nullptr;
    request.abort = why;
    request.aborted_by_server = by_server;
    request.size = offset_;
    request.status = SdoRequest::Status::done;
    if (request.on_done != nullptr) {
        request.on_done(request, request.context);
    }
}

void SdoClient::abort(Abort why) noexcept {
    send_initiate(0x80, static_cast<std::uint32_t>(why));
    finish(why);
}

/// Restarts a transfer that failed for a transient reason. It continues by segments unless the
/// request demanded blocks, because some servers offer block transfer and fail to carry it out.
void SdoClient::restart_or_fail(Abort why, bool by_server) noexcept {
    if (restarts_left_ == 0) {
        if (!by_server) {
            send_initiate(0x80, static_cast<std::uint32_t>(why));
        }
        return finish(why, by_server);
    }
    if (!by_server) {
        send_initiate(0x80, static_cast<std::uint32_t>(why));
    }
    --restarts_left_;
    ++retries_;
    ++first_->retries;
    begin_mode(in_block_ && first_->mode == SdoMode::block);
}

void SdoClient::send(const Bytes& bytes) noexcept {
    sent_ = bytes;
    send_again();
}
void SdoClient::send_again() noexcept {
    Frame f = make_frame(request_cob_, 8);
    std::copy(sent_.begin(), sent_.end(), f.data.begin());
    pending_ = !out_.push(f);
}
void SdoClient::send_initiate(std::uint8_t command, std::uint32_t value) noexcept {
    Bytes b{command, static_cast<std::uint8_t>(first_->index),
            static_cast<std::uint8_t>(first_->index >> 8), first_->sub};
    store(b.data() + 4, value);
    send(b);
}

bool SdoClient::concerns_request(const Frame& f) const noexcept {
    return load<std::uint16_t>(f.data.data() + 1) == first_->index && f.data[3] == first_->sub;
}

void SdoClient::begin() noexcept {
    auto& r = *first_;
    r.status = SdoRequest::Status::active;
    restarts_left_ = settings_.restarts;
    if (request_cob_ & cob_invalid) {
        offset_ = 0;
        return finish(Abort::no_resource);
    }
    const bool many = !r.upload && r.data.size() >= settings_.block_from;
    begin_mode(!block_refused_ &&
               (r.mode == SdoMode::block || (r.mode == SdoMode::automatic && many)));
}

void SdoClient::begin_mode(bool block) noexcept {
    auto& r = *first_;
    in_block_ = block;
    toggle_ = 0;
    offset_ = 0;
    crc_ = 0;
    crc_until_ = 0;
    sequence_ = 0;
    held_count_ = 0;
    stalls_ = 0;

    acknowledged_ = 0;
    last_acknowledgement_ = 0;
    size_ = r.upload ? 0 : static_cast<std::uint32_t>(r.data.size());
    size_known_ = crc_used_ = block_sent_ = last_seen_ = segment_received_ = block_any_ = gap_ =
        acknowledged_early_ = false;
    last_error_ = Abort::none;
    progress();
    if (r.upload) {
        block_size_ = std::clamp<std::uint8_t>(settings_.block_size, 1, 127);
        state_ = block ? State::block_upload_start : State::upload_start;
        // pst = 21: the server may answer values of up to three segments by segmented transfer.
        return block ? send_initiate(0xa4, block_size_ | 21U << 8) : send_initiate(0x40, 0);
    }
    if (block && size_ != 0) {
        state_ = State::block_download_start;
        return send_initiate(0xc6, size_);
    }
    state_ = State::download_start;
    if (size_ == 0 || size_ > 4) return send_initiate(0x21, size_);
    std::uint32_t value = 0;
    std::memcpy(&value, r.data.data(), size_);
    send_initiate(static_cast<std::uint8_t>(0x23 | (4 - size_) << 2), value);
}

void SdoClient::handle(const Frame& f, Time now) noexcept {
    now_ = now;
    if (f.length != 8) return;
    take(f);
    if (state_ == State::idle && first_ != nullptr) {
        begin();
    }
}

void SdoClient::take(const Frame& f) noexcept {
    if (state_ == State::idle) {
        ++unexpected_;
        return;
    }
    const auto command = f.data[0];
    if (command == 0x80) return on_abort(f);
    switch (state_) {
    case State::download_start:
        if (command >> 5 != 3 || !concerns_request(f)) return unexpected(Abort::command);
        progress();
        if (size_ > 0 && size_ <= 4) {
            offset_ = size_;
            return finish(Abort::none);
        }
        state_ = State::download;
        return send_segment();
    case State::download:
        if (command >> 5 != 1) return unexpected(Abort::command);
        if ((command & 0x10) != toggle_) return unexpected(Abort::toggle);
        progress();
        offset_ += segment_;
        toggle_ ^= 0x10;
        return offset_ == size_ ? finish(Abort::none) : send_segment();
    case State::upload_start: return on_upload_start(f);
    case State::upload: return on_upload_segment(f);
    case State::block_download_start:
        if ((command & 0xe3) != 0xa0 || !concerns_request(f)) return unexpected(Abort::command);
        if (f.data[4] < 1 || f.data[4] > 127) return abort(Abort::block_size);
        progress();
        crc_used_ = (command & 4) != 0;
        block_size_ = f.data[4];
        state_ = State::block_download;
        return send_block();
    case State::block_download: return on_block_acknowledge(f);
    case State::block_download_end:
        if (command != 0xa1) return unexpected(Abort::command);
        return finish(Abort::none);
    case State::block_upload_start: {
        if (!concerns_request(f)) return unexpected(Abort::command);
        if (command >> 5 == 2) return on_upload_start(f);
        if ((command & 0xe1) != 0xc0) return unexpected(Abort::command);
        crc_used_ = (command & 4) != 0;
        size_known_ = (command & 2) != 0;
        size_ = size_known_ ? load<std::uint32_t>(f.data.data() + 4) : 0;
        if (size_ > first_->buffer.size()) return abort(Abort::memory);
        progress();
        state_ = State::block_upload;
        return send({0xa3});
    }
    case State::block_upload: return on_block_segment(f);
    case State::block_upload_end: return on_block_end(f);
    case State::idle: return;
    }
}

void SdoClient::on_abort(const Frame& f) noexcept {
    const auto why = static_cast<Abort>(load<std::uint32_t>(f.data.data() + 4));
    // of an earlier transfer: some servers send their abort late
    if (!concerns_request(f)) return unexpected(why);
    const bool starting = state_ == State::upload_start || state_ == State::download_start ||
                          state_ == State::block_upload_start ||
                          state_ == State::block_download_start;
    if (starting) {
        // The abort codes with which servers without block transfer reject it.
        if (in_block_ && (why == Abort::command || why == Abort::access || why == Abort::general)) {
            block_refused_ = why == Abort::command;
            return begin_mode(false);
        }
        return finish(why, true);
    }
    switch (why) {
    case Abort::toggle:
    case Abort::timeout:
    case Abort::command:
    case Abort::sequence:
    case Abort::crc: return restart_or_fail(why, true);
    default: return finish(why, true);
    }
}

void SdoClient::send_segment() noexcept {
    segment_ = std::min<std::uint32_t>(7, size_ - offset_);
    Bytes b{static_cast<std::uint8_t>(toggle_ | (7 - segment_) << 1 |
                                      (offset_ + segment_ == size_ ? 1 : 0))};
    if (segment_ != 0) {
        std::memcpy(b.data() + 1, first_->data.data() + offset_, segment_);
    }
    send(b);
}

bool SdoClient::store_received(std::span<const std::uint8_t> bytes) noexcept {
    if (size_known_ && bytes.size() > size_ - offset_) {
        restart_or_fail(Abort::too_long, false);
        return false;
    }
    if (bytes.size() > first_->buffer.size() - offset_) {
        abort(Abort::memory);
        return false;
    }
    if (!bytes.empty()) {
        std::memcpy(first_->buffer.data() + offset_, bytes.data(), bytes.size());
    }
    offset_ += static_cast<std::uint32_t>(bytes.size());
    return true;
}

void SdoClient::on_upload_start(const Frame& f) noexcept {
    const auto command = f.data[0];
    if (command >> 5 != 2 || !concerns_request(f)) return unexpected(Abort::command);
    progress();
    size_known_ = (command & 1) != 0;
    if ((command & 2) != 0) {
        size_ = size_known_ ? 4U - (command >> 2 & 3) : 4U;
        if (!size_known_) {
            size_ = static_cast<std::uint32_t>(std::min<std::size_t>(4, first_->buffer.size()));
        }
        size_known_ = true;
        if (store_received({f.data.data() + 4, size_})) {
            finish(Abort::none);
        }
        return;
    }
    size_ = size_known_ ? load<std::uint32_t>(f.data.data() + 4) : 0;
    if (size_ > first_->buffer.size()) return abort(Abort::memory);
    state_ = State::upload;
    send({0x60});
}

void SdoClient::on_upload_segment(const Frame& f) noexcept {
    const auto command = f.data[0];
    if (command >> 5 != 0) return unexpected(Abort::command);
    if ((command & 0x10) != toggle_) return unexpected(Abort::toggle);
    progress();
    if (!store_received({f.data.data() + 1, 7U - (command >> 1 & 7)})) return;
    toggle_ ^= 0x10;
    if ((command & 1) == 0) {
        return send({static_cast<std::uint8_t>(0x60 | toggle_)});
    }
    if (size_known_ && offset_ != size_) return restart_or_fail(Abort::too_short, false);
    finish(Abort::none);
}

/// On timeout: repeats the last frame, then restarts the transfer, then fails.
void SdoClient::on_timeout() noexcept {
    heard_ = now_;
    if (resends_left_ == 0) {
        const bool starting = state_ == State::upload_start || state_ == State::download_start ||
                              state_ == State::block_upload_start ||
                              state_ == State::block_download_start;
        const auto why = last_error_ != Abort::none ? last_error_ : Abort::timeout;
        return starting ? abort(why) : restart_or_fail(why, false);
    }
    --resends_left_;
    ++retries_;
    ++first_->retries;
    if (state_ == State::block_upload && segment_received_) {
        if (!block_any_) {
            return send({0xa2, acknowledged_, block_size_});
        }
        acknowledge_block(gap_ ? BlockChange::smaller : BlockChange::same);
        acknowledged_early_ = first_ != nullptr && state_ == State::block_upload;
        return;
    }
    send_again();
}

void SdoClient::poll(Time now) noexcept {
    now_ = now;
    if (pending_ && out_.space() > 0) {
        send_again();
    }
    if (state_ == State::idle) {
        if (first_ != nullptr) {
            begin();
        }
        return;
    }
    if (state_ == State::block_download && !block_sent_ && !pending_) {
        const auto before = sequence_;
        send_block();
        // other clients may have used the space
        const bool moves = sequence_ != before || out_.popped() != popped_;
        popped_ = out_.popped();
        if (!block_sent_ && !moves) return queue_full();
        if (!block_sent_) {
            heard_ = now;
        }
    }
    if (pending_) return queue_full();
    queue_full_since_ = -1;
    if (now - heard_ >= settings_.timeout) {
        on_timeout();
    }
}

/// A full transmit queue is not the server's timeout, so the response timer is held. If the queue
/// stays full for as long as an unresponsive server would be waited for, the request fails, without
/// an abort frame because that could not be sent either.
void SdoClient::queue_full() noexcept {
    heard_ = now_;
    if (queue_full_since_ < 0) {
        queue_full_since_ = now_;
    }
    if (now_ - queue_full_since_ < settings_.timeout * (settings_.resends + 1)) return;
    queue_full_since_ = -1;
    first_->not_sent = true;
    finish(Abort::timeout);
}

}  // namespace hal::canopen
