// SPDX-License-Identifier: MIT
#include "sdo_client.hpp"

#include <algorithm>
#include <iterator>

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
    if (!by_server) {
        send_initiate(0x80, static_cast<std::uint32_t>(why));
    }
    if (restarts_left_ == 0) return finish(why, by_server);
    --restarts_left_;
    count_retry();
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
    const bool wants_block = r.mode == SdoMode::block || (r.mode == SdoMode::automatic && many);
    begin_mode(wants_block && !block_refused_);
}

void SdoClient::begin_mode(bool block) noexcept {
    in_block_ = block;
    toggle_ = 0;
    offset_ = 0;
    stalls_ = 0;
    size_known_ = false;
    last_error_ = Abort::none;
    restart_timer();
    if (first_->upload) return begin_upload(block);
    begin_download(block);
}

void SdoClient::begin_upload(bool block) noexcept {
    size_ = 0;
    state_ = block ? State::block_upload_start : State::upload_start;
    if (!block) return send_initiate(0x40, 0);
    receiver_.begin(std::clamp<std::uint8_t>(settings_.block_size, 1, 127));
    // pst = 21: the server may answer values of up to three segments by segmented transfer.
    send_initiate(0xa4, receiver_.size() | 21U << 8);
}

void SdoClient::begin_download(bool block) noexcept {
    size_ = static_cast<std::uint32_t>(first_->data.size());
    if (block && size_ != 0) {
        state_ = State::block_download_start;
        return send_initiate(0xc6, size_);
    }
    state_ = State::download_start;
    if (size_ == 0 || size_ > 4) return send_initiate(0x21, size_);
    std::uint32_t value = 0;
    std::memcpy(&value, first_->data.data(), size_);
    send_initiate(static_cast<std::uint8_t>(0x23 | (4 - size_) << 2), value);
}

void SdoClient::handle(const Frame& f, Time now) noexcept {
    now_ = now;
    if (f.length != 8) return;
    dispatch(f);
    if (state_ == State::idle && first_ != nullptr) {
        begin();
    }
}

void SdoClient::dispatch(const Frame& f) noexcept {
    if (state_ == State::idle) {
        ++unexpected_;
        return;
    }
    if (f.data[0] == 0x80) return on_abort(f);
    using Receive = void (SdoClient::*)(const Frame&);
    static constexpr Receive handlers[] = {
        nullptr,
        &SdoClient::on_download_start,
        &SdoClient::on_download_segment,
        &SdoClient::on_upload_start,
        &SdoClient::on_upload_segment,
        &SdoClient::on_block_download_start,
        &SdoClient::on_block_acknowledge,
        &SdoClient::on_block_download_end,
        &SdoClient::on_block_upload_start,
        &SdoClient::on_block_segment,
        &SdoClient::on_block_end,
    };
    static_assert(std::size(handlers) == static_cast<std::size_t>(State::block_upload_end) + 1);
    (this->*handlers[static_cast<std::size_t>(state_)])(f);
}

void SdoClient::on_block_download_end(const Frame& f) noexcept {
    if (f.data[0] != 0xa1) return ignore(Abort::command);
    finish(Abort::none);
}

/// Returns true until the server has accepted the transfer.
bool SdoClient::starting() const noexcept {
    switch (state_) {
    case State::upload_start:
    case State::download_start:
    case State::block_upload_start:
    case State::block_download_start: return true;
    default: return false;
    }
}

void SdoClient::on_abort(const Frame& f) noexcept {
    const auto why = static_cast<Abort>(load<std::uint32_t>(f.data.data() + 4));
    // of an earlier transfer: some servers send their abort late
    if (!concerns_request(f)) return ignore(why);
    if (starting()) {
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

void SdoClient::on_download_start(const Frame& f) noexcept {
    if (f.data[0] >> 5 != 3 || !concerns_request(f)) return ignore(Abort::command);
    restart_timer();
    if (size_ > 0 && size_ <= 4) {
        offset_ = size_;
        return finish(Abort::none);
    }
    state_ = State::download;
    send_segment();
}

void SdoClient::on_download_segment(const Frame& f) noexcept {
    if (f.data[0] >> 5 != 1) return ignore(Abort::command);
    if ((f.data[0] & 0x10) != toggle_) return ignore(Abort::toggle);
    restart_timer();
    offset_ += segment_;
    toggle_ ^= 0x10;
    if (offset_ == size_) return finish(Abort::none);
    send_segment();
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
    if (command >> 5 != 2 || !concerns_request(f)) return ignore(Abort::command);
    restart_timer();
    size_known_ = (command & 1) != 0;
    if ((command & 2) != 0) {
        // without a size, as much as the caller wants
        const auto wanted =
            static_cast<std::uint32_t>(std::min<std::size_t>(4, first_->buffer.size()));
        size_ = size_known_ ? 4U - (command >> 2 & 3) : wanted;
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
    if (command >> 5 != 0) return ignore(Abort::command);
    if ((command & 0x10) != toggle_) return ignore(Abort::toggle);
    restart_timer();
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
    last_received_ = now_;
    if (resends_left_ == 0) {
        const auto why = last_error_ != Abort::none ? last_error_ : Abort::timeout;
        return starting() ? abort(why) : restart_or_fail(why, false);
    }
    --resends_left_;
    count_retry();
    if (state_ != State::block_upload || !receiver_.holds()) return send_again();
    if (!receiver_.any()) return send({0xa2, receiver_.acknowledged(), receiver_.size()});
    acknowledge_block(receiver_.change(BlockChange::same));
    if (first_ != nullptr && state_ == State::block_upload) {
        receiver_.ignore_rest();
    }
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
    if (state_ == State::block_download && !sender_.complete() && !pending_) {
        const auto before = sender_.sequence();
        send_block();
        // other clients may have used the space
        const bool moves = sender_.sequence() != before || out_.popped() != popped_;
        popped_ = out_.popped();
        if (!sender_.complete()) {
            if (!moves) return queue_full();
            last_received_ = now;
        }
    }
    if (pending_) return queue_full();
    queue_full_since_ = -1;
    if (now - last_received_ >= settings_.timeout) {
        on_timeout();
    }
}

/// A full transmit queue is not the server's timeout, so the response timer is held. If the queue
/// stays full for as long as an unresponsive server would be waited for, the request fails, without
/// an abort frame because that could not be sent either.
void SdoClient::queue_full() noexcept {
    last_received_ = now_;
    if (queue_full_since_ < 0) {
        queue_full_since_ = now_;
    }
    if (now_ - queue_full_since_ < settings_.timeout * (settings_.resends + 1)) return;
    queue_full_since_ = -1;
    first_->not_sent = true;
    finish(Abort::timeout);
}

// Block download.

void SdoClient::on_block_download_start(const Frame& f) noexcept {
    const auto command = f.data[0];
    if ((command & 0xe3) != 0xa0 || !concerns_request(f)) return ignore(Abort::command);
    if (!is_block_size(f.data[4])) return abort(Abort::block_size);
    restart_timer();
    sender_.begin(f.data[4], (command & 4) != 0);
    state_ = State::block_download;
    send_block();
}

void SdoClient::send_block() noexcept {
    const auto before = sender_.sequence();
    sender_.send(out_, request_cob_, size_,
                 [&](std::uint32_t offset, std::span<std::uint8_t> bytes) {
        std::memcpy(bytes.data(), first_->data.data() + offset, bytes.size());
        return true;
    });
    if (sender_.sequence() == before) return;
    std::copy_n(sender_.last().data.begin(), sent_.size(), sent_.begin());
    pending_ = false;
    last_received_ = now_;
}

/// The server acknowledges the first `good` segments of this block and asks for a block of `next`.
/// Continues behind them, or restarts the transfer when too many blocks bring nothing. What is not an
/// acknowledgement of this block is ignored; the timeout decides.
void SdoClient::on_block_acknowledge(const Frame& f) noexcept {
    if ((f.data[0] & 0xe3) != 0xa2) return ignore(Abort::command);
    const auto good = f.data[1];
    const auto next = f.data[2];
    const auto sent = sender_.sequence();
    const Time duplicates_within = settings_.timeout / 10;
    switch (sender_.evaluate(good, next, out_, now_, duplicates_within)) {
    case Acknowledgement::duplicate: return ignore(Abort::sequence);
    case Acknowledgement::beyond: return restart_or_fail(Abort::sequence, false);
    case Acknowledgement::stalled:
        if (!count_stall()) return restart_or_fail(Abort::sequence, false);
        sender_.repeat(now_);
        return send_block();
    case Acknowledgement::of_this_block: break;
    }
    if (!is_block_size(next)) return abort(Abort::block_size);
    if (good != 0) {
        stalls_ = 0;
    } else if (!count_stall()) {
        return restart_or_fail(Abort::sequence, false);
    }
    if (good < sent) {
        count_retry();
    }
    restart_timer();
    sender_.advance(good, next, size_, now_);
    offset_ = sender_.offset();
    if (offset_ != size_) return send_block();
    state_ = State::block_download_end;
    send_block_end();
}

void SdoClient::send_block_end() noexcept {
    Bytes b{static_cast<std::uint8_t>(0xc1 | sender_.unused() << 2)};
    store(b.data() + 1, sender_.crc());
    send(b);
}

// Block upload.

void SdoClient::on_block_upload_start(const Frame& f) noexcept {
    const auto command = f.data[0];
    if (!concerns_request(f)) return ignore(Abort::command);
    if (command >> 5 == 2) return on_upload_start(f);
    if ((command & 0xe1) != 0xc0) return ignore(Abort::command);
    receiver_.use_crc((command & 4) != 0);
    size_known_ = (command & 2) != 0;
    size_ = size_known_ ? load<std::uint32_t>(f.data.data() + 4) : 0;
    if (size_ > first_->buffer.size()) return abort(Abort::memory);
    restart_timer();
    state_ = State::block_upload;
    send({0xa3});
}

void SdoClient::on_block_segment(const Frame& f) noexcept {
    const auto arrived = receiver_.accept(
        f, [&](std::span<const std::uint8_t> bytes) { return store_received(bytes); });
    switch (arrived) {
    case BlockReceiver::Arrived::failed:
    case BlockReceiver::Arrived::ignored: return;
    case BlockReceiver::Arrived::repeated:  // or the server missed the acknowledgement, which the
    case BlockReceiver::Arrived::duplicate:  // timeout repeats
        ++unexpected_;
        return;
    case BlockReceiver::Arrived::out_of_order: ++unexpected_; break;
    case BlockReceiver::Arrived::in_order: restart_timer(); break;
    }
    if (receiver_.ends_with(f)) {
        acknowledge_block(receiver_.change(BlockChange::larger));
    }
}

void SdoClient::acknowledge_block(BlockChange change) noexcept {
    const std::uint8_t good = receiver_.acknowledge(change, settings_.block_size);
    if (good != 0) {
        stalls_ = 0;
    } else if (!count_stall()) {
        return restart_or_fail(Abort::sequence, false);
    }
    send({0xa2, good, receiver_.size()});
    if (receiver_.last_seen()) {
        state_ = State::block_upload_end;
    }
}

void SdoClient::on_block_end(const Frame& f) noexcept {
    if ((f.data[0] & 0xe3) != 0xc1) return ignore(Abort::command);
    const bool valid = receiver_.crc_matches(f);
    // a repeated last segment, which can look like an end frame
    if (receiver_.repeats_last(f) && !(receiver_.crc_used() && valid)) {
        return ignore(Abort::command);
    }
    if (receiver_.crc_used() && !valid) return restart_or_fail(Abort::crc, false);
    if (!store_received(receiver_.rest(f))) return;
    if (size_known_ && offset_ != size_) return restart_or_fail(Abort::too_short, false);
    send({0xa1});
    const bool lost = pending_;
    finish(Abort::none);
    if (lost) {
        send_again();
    }
}

}  // namespace hal::canopen
