// SPDX-License-Identifier: MIT
#include "sdo_client.hpp"

#include <algorithm>

namespace hal::canopen {

SdoClient::SdoClient(FrameQueue& out, const SdoClientSettings& settings) : out_(out), settings_(settings) {}

void SdoClient::configure(std::uint32_t request_cob, std::uint32_t answer_cob) noexcept {
    cancel_all(Abort::no_resource);
    request_cob_ = request_cob;
    answer_id_ = (answer_cob & cob_invalid) != 0 ? 0xffffffff : cob_id(answer_cob);
    answer_extended_ = (answer_cob & cob_extended) != 0;
    block_refused_ = false;
}

bool SdoClient::submit(SdoRequest& request) noexcept {
    if (request.status == SdoRequest::Status::waiting || request.status == SdoRequest::Status::active) return false;
    request.status = SdoRequest::Status::waiting;
    request.abort = Abort::none, request.aborted_by_server = request.unsent = false;
    request.size = 0, request.retries = 0, request.next = nullptr;
    (first_ == nullptr ? first_ : last_->next) = &request;
    last_ = &request;
    return true;
}

void SdoClient::cancel(SdoRequest& request, Abort why) noexcept {
    if (&request == first_) {
        if (state_ != State::idle) return give_up(why);
        offset_ = 0;
        return finish(why);
    }
    for (auto* r = first_; r != nullptr; r = r->next) {
        if (r->next != &request) continue;
        r->next = request.next;
        if (last_ == &request) last_ = r;
        request.next = nullptr, request.status = SdoRequest::Status::done, request.abort = why;
        if (request.on_done != nullptr) request.on_done(request, request.context);
        return;
    }
}

void SdoClient::cancel_all(Abort why) noexcept {
    const auto* until = last_;  // what is submitted again meanwhile stays
    while (first_ != nullptr) {
        const bool end = first_ == until;
        cancel(*first_, why);
        if (end) break;
    }
}

void SdoClient::finish(Abort why, bool there) noexcept {
    auto& request = *first_;
    first_ = request.next;
    if (first_ == nullptr) last_ = nullptr;
    state_ = State::idle;
    pending_ = false;
    request.next = nullptr;
    request.abort = why, request.aborted_by_server = there;
    request.size = offset_;
    request.status = SdoRequest::Status::done;
    if (request.on_done != nullptr) request.on_done(request, request.context);
}

void SdoClient::give_up(Abort why) noexcept {
    send_initiate(0x80, static_cast<std::uint32_t>(why));
    finish(why);
}

/// A transfer that broke for a reason that need not come again is begun anew; by segments where nobody asked for blocks, because some
/// servers have them and cannot do them.
void SdoClient::broke(Abort why, bool there) noexcept {
    if (restarts_left_ == 0) {
        if (!there) send_initiate(0x80, static_cast<std::uint32_t>(why));
        return finish(why, there);
    }
    if (!there) send_initiate(0x80, static_cast<std::uint32_t>(why));
    --restarts_left_;
    ++retries_, ++first_->retries;
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
    Bytes b{command, static_cast<std::uint8_t>(first_->index), static_cast<std::uint8_t>(first_->index >> 8), first_->sub};
    store(b.data() + 4, value);
    send(b);
}

bool SdoClient::is_about(const Frame& f) const noexcept {
    return load<std::uint16_t>(f.data.data() + 1) == first_->index && f.data[3] == first_->sub;
}

void SdoClient::begin() noexcept {
    auto& r = *first_;
    r.status = SdoRequest::Status::active;
    restarts_left_ = settings_.restarts;
    if (request_cob_ & cob_invalid) return offset_ = 0, finish(Abort::no_resource);
    const bool many = !r.upload && r.data.size() >= settings_.block_from;
    begin_mode(!block_refused_ && (r.mode == SdoMode::block || (r.mode == SdoMode::automatic && many)));
}

void SdoClient::begin_mode(bool block) noexcept {
    auto& r = *first_;
    in_block_ = block;
    toggle_ = 0, offset_ = 0, crc_ = 0, crc_until_ = 0, sequence_ = 0, held_count_ = 0, stalls_ = 0, acknowledged_ = 0,
    last_acknowledgement_ = 0;
    size_ = r.upload ? 0 : static_cast<std::uint32_t>(r.data.size());
    size_told_ = crc_used_ = block_sent_ = last_seen_ = heard_block_ = block_any_ = gap_ = cut_short_ = false;
    wrong_ = Abort::none;
    progress();
    if (r.upload) {
        block_size_ = std::clamp<std::uint8_t>(settings_.block_size, 1, 127);
        state_ = block ? State::block_upload_start : State::upload_start;
        // Values of up to three segments may come the ordinary way.
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
    if (state_ == State::idle && first_ != nullptr) begin();
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
        if (command >> 5 != 3 || !is_about(f)) return stranger(Abort::command);
        progress();
        if (size_ > 0 && size_ <= 4) return offset_ = size_, finish(Abort::none);
        state_ = State::download;
        return send_segment();
    case State::download:
        if (command >> 5 != 1) return stranger(Abort::command);
        if ((command & 0x10) != toggle_) return stranger(Abort::toggle);
        progress();
        offset_ += segment_;
        toggle_ ^= 0x10;
        return offset_ == size_ ? finish(Abort::none) : send_segment();
    case State::upload_start: return on_upload_start(f);
    case State::upload: return on_upload_segment(f);
    case State::block_download_start:
        if ((command & 0xe3) != 0xa0 || !is_about(f)) return stranger(Abort::command);
        if (f.data[4] < 1 || f.data[4] > 127) return give_up(Abort::block_size);
        progress();
        crc_used_ = (command & 4) != 0;
        block_size_ = f.data[4];
        state_ = State::block_download;
        return pump();
    case State::block_download: return on_block_acknowledge(f);
    case State::block_download_end:
        if (command != 0xa1) return stranger(Abort::command);
        return finish(Abort::none);
    case State::block_upload_start: {
        if (!is_about(f)) return stranger(Abort::command);
        if (command >> 5 == 2) return on_upload_start(f);
        if ((command & 0xe1) != 0xc0) return stranger(Abort::command);
        crc_used_ = (command & 4) != 0;
        size_told_ = (command & 2) != 0;
        size_ = size_told_ ? load<std::uint32_t>(f.data.data() + 4) : 0;
        if (size_ > first_->room.size()) return give_up(Abort::memory);
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
    if (!is_about(f)) return stranger(why);  // of an earlier transfer: some servers send it late
    const bool starting = state_ == State::upload_start || state_ == State::download_start || state_ == State::block_upload_start ||
                          state_ == State::block_download_start;
    if (starting) {
        // A server without block transfer says so in one of these ways.
        if (in_block_ && (why == Abort::command || why == Abort::access || why == Abort::general)) {
            block_refused_ = why == Abort::command;
            return begin_mode(false);
        }
        return finish(why, true);
    }
    switch (why) {
    case Abort::toggle: case Abort::timeout: case Abort::command: case Abort::sequence: case Abort::crc: return broke(why, true);
    default: return finish(why, true);
    }
}

// Segments.

void SdoClient::send_segment() noexcept {
    segment_ = std::min<std::uint32_t>(7, size_ - offset_);
    Bytes b{static_cast<std::uint8_t>(toggle_ | (7 - segment_) << 1 | (offset_ + segment_ == size_ ? 1 : 0))};
    if (segment_ != 0) std::memcpy(b.data() + 1, first_->data.data() + offset_, segment_);
    send(b);
}

bool SdoClient::put(std::span<const std::uint8_t> bytes) noexcept {
    if (size_told_ && bytes.size() > size_ - offset_) return broke(Abort::too_long, false), false;
    if (bytes.size() > first_->room.size() - offset_) return give_up(Abort::memory), false;
    if (!bytes.empty()) std::memcpy(first_->room.data() + offset_, bytes.data(), bytes.size());
    offset_ += static_cast<std::uint32_t>(bytes.size());
    return true;
}

void SdoClient::on_upload_start(const Frame& f) noexcept {
    const auto command = f.data[0];
    if (command >> 5 != 2 || !is_about(f)) return stranger(Abort::command);
    progress();
    size_told_ = (command & 1) != 0;
    if ((command & 2) != 0) {
        size_ = size_told_ ? 4U - (command >> 2 & 3) : 4U;
        if (!size_told_) size_ = static_cast<std::uint32_t>(std::min<std::size_t>(4, first_->room.size()));
        size_told_ = true;
        if (put({f.data.data() + 4, size_})) finish(Abort::none);
        return;
    }
    size_ = size_told_ ? load<std::uint32_t>(f.data.data() + 4) : 0;
    if (size_ > first_->room.size()) return give_up(Abort::memory);
    state_ = State::upload;
    send({0x60});
}

void SdoClient::on_upload_segment(const Frame& f) noexcept {
    const auto command = f.data[0];
    if (command >> 5 != 0) return stranger(Abort::command);
    if ((command & 0x10) != toggle_) return stranger(Abort::toggle);
    progress();
    if (!put({f.data.data() + 1, 7U - (command >> 1 & 7)})) return;
    toggle_ ^= 0x10;
    if ((command & 1) == 0) return send({static_cast<std::uint8_t>(0x60 | toggle_)});
    if (size_told_ && offset_ != size_) return broke(Abort::too_short, false);
    finish(Abort::none);
}

// Block download.

void SdoClient::pump() noexcept {
    while (!block_sent_ && out_.room() > out_.reserve()) {
        const auto from = offset_ + sequence_ * 7U;
        const auto count = std::min<std::uint32_t>(7, size_ - from);
        const bool last = from + count == size_;
        Bytes b{static_cast<std::uint8_t>(++sequence_ | (last ? 0x80 : 0))};
        std::memcpy(b.data() + 1, first_->data.data() + from, count);
        if (from == crc_until_) crc_ = crc16({b.data() + 1, count}, crc_), crc_until_ += count;
        send(b);
        block_sent_ = last || sequence_ == block_size_;
        block_end_ = out_.taken() + out_.size();
        heard_ = now_;
    }
}

void SdoClient::on_block_acknowledge(const Frame& f) noexcept {
    if ((f.data[0] & 0xe3) != 0xa2) return stranger(Abort::command);
    const auto good = f.data[1], next = f.data[2];
    const auto said = static_cast<std::uint16_t>(good << 8 | next);
    const bool again = said == last_acknowledgement_;
    // The one before again; it cannot be about segments that have not left yet.
    if (again && (good > sequence_ || !block_sent_ || out_.taken() < block_end_)) return stranger(Abort::sequence);
    if (good > sequence_) return broke(Abort::sequence, false);
    // A server that varies the size after a loss never says the same of two blocks: this one came twice, or it still waits for our block.
    // One that comes in the middle of a block is of a server that waited too long: it goes on behind what it has.
    if (again && good != next) {
        if (now_ - acknowledged_at_ < settings_.timeout / 10) return stranger(Abort::sequence);
        if (good != 0) {
            if (++stalls_ > 4 + settings_.resends) return broke(Abort::sequence, false);
            acknowledged_at_ = now_;
            sequence_ = 0;
            block_sent_ = false;
            return pump();
        }
    }
    last_acknowledgement_ = said;
    acknowledged_at_ = now_;
    if (next < 1 || next > 127) return give_up(Abort::block_size);
    if (good == 0 && ++stalls_ > 4 + settings_.resends) return broke(Abort::sequence, false);
    if (good != 0) stalls_ = 0;
    if (good < sequence_) ++retries_, ++first_->retries;
    progress();
    offset_ += std::min<std::uint32_t>(good * 7U, size_ - offset_);
    block_size_ = next;
    sequence_ = 0;
    block_sent_ = false;
    if (offset_ != size_) return pump();
    state_ = State::block_download_end;
    send_block_end();
}

void SdoClient::send_block_end() noexcept {
    Bytes b{static_cast<std::uint8_t>(0xc1 | (7 - (size_ - 1) % 7 - 1) << 2)};
    store(b.data() + 1, crc_used_ ? crc_ : std::uint16_t{0});
    send(b);
}

// Block upload: as the server does it in a block download.

void SdoClient::on_block_segment(const Frame& f) noexcept {
    const std::uint8_t number = f.data[0] & 0x7f;
    const bool last = (f.data[0] & 0x80) != 0;
    if (cut_short_ && number != 1) return;
    if (!block_any_ && number != 1 && number == acknowledged_ && std::equal(held_.begin(), held_.end(), f.data.begin() + 1)) {
        ++unexpected_;  // a duplicate last segment of the previous block, or the server missed the acknowledgement: repeat it
        return;        // when nothing else comes
    }
    cut_short_ = false;
    block_any_ = true;
    if (number == sequence_ + 1 && number <= block_size_) {
        if (held_count_ != 0) {
            if (crc_used_) crc_ = crc16(held_, crc_);
            if (!put(held_)) return;
        }
        std::copy_n(f.data.begin() + 1, 7, held_.begin());
        held_count_ = 7;
        sequence_ = number;
        last_seen_ = last;
        last_command_ = f.data[0];
        heard_block_ = true;
        progress();
    } else {
        ++unexpected_;
        if (number <= sequence_ && !last && number != block_size_) return;
        if (number > sequence_) gap_ = true;
    }
    if (number == block_size_ || last) acknowledge_block(gap_ ? Size::smaller : Size::larger);
}

void SdoClient::acknowledge_block(Size size) noexcept {
    const std::uint8_t before = block_size_;
    if (size != Size::same) block_size_ = next_block_size(before, size == Size::smaller, sequence_, settings_.block_size);
    // Of a part of a block, the same twice would be taken for the last one again.
    if (sequence_ == acknowledged_ && block_size_ == before && sequence_ != before)
        block_size_ = next_block_size(before, true, sequence_, settings_.block_size);
    acknowledged_ = sequence_;
    if (sequence_ != 0) stalls_ = 0;
    else if (++stalls_ > 4 + settings_.resends) return broke(Abort::sequence, false);
    send({0xa2, sequence_, block_size_});
    sequence_ = 0;
    block_any_ = gap_ = false;
    if (last_seen_) state_ = State::block_upload_end;
}

void SdoClient::on_block_end(const Frame& f) noexcept {
    const auto command = f.data[0];
    if ((command & 0xe3) != 0xc1) return stranger(Abort::command);
    const std::uint32_t count = 7U - (command >> 2 & 7);
    const bool good = crc16({held_.data(), count}, crc_) == load<std::uint16_t>(f.data.data() + 1);
    const bool again = command == last_command_ && std::equal(held_.begin(), held_.end(), f.data.begin() + 1);
    if (again && !(crc_used_ && good)) return stranger(Abort::command);  // the last segment again, which can look like an end
    if (crc_used_ && !good) return broke(Abort::crc, false);
    if (!put({held_.data(), count})) return;
    if (size_told_ && offset_ != size_) return broke(Abort::too_short, false);
    send({0xa1});
    const bool lost = pending_;
    finish(Abort::none);
    if (lost) send_again();
}

/// Nothing useful came for the whole time-out: the last word is said again, then the transfer begun again, then given up.
void SdoClient::silence() noexcept {
    heard_ = now_;
    if (resends_left_ == 0) {
        const bool starting = state_ == State::upload_start || state_ == State::download_start || state_ == State::block_upload_start ||
                              state_ == State::block_download_start;
        const auto why = wrong_ != Abort::none ? wrong_ : Abort::timeout;
        return starting ? give_up(why) : broke(why, false);
    }
    --resends_left_;
    ++retries_, ++first_->retries;
    if (state_ == State::block_upload && heard_block_) {
        if (!block_any_) return send({0xa2, acknowledged_, block_size_});
        acknowledge_block(gap_ ? Size::smaller : Size::same);
        cut_short_ = first_ != nullptr && state_ == State::block_upload;
        return;
    }
    send_again();
}

void SdoClient::poll(Time now) noexcept {
    now_ = now;
    if (pending_ && out_.room() > 0) send_again();
    if (state_ == State::idle) {
        if (first_ != nullptr) begin();
        return;
    }
    if (state_ == State::block_download && !block_sent_ && !pending_) {
        const auto before = sequence_;
        pump();
        const bool moves = sequence_ != before || out_.taken() != taken_;  // others may have had the room
        taken_ = out_.taken();
        if (!block_sent_ && !moves) return no_room();
        if (!block_sent_) heard_ = now;
    }
    if (pending_) return no_room();
    full_since_ = -1;
    if (now - heard_ >= settings_.timeout) silence();
}

/// The server cannot be blamed for not answering what did not leave. But a bus that takes nothing for as long as a silent server would be
/// waited for is given up, too; without an abort, which would not leave either.
void SdoClient::no_room() noexcept {
    heard_ = now_;
    if (full_since_ < 0) full_since_ = now_;
    if (now_ - full_since_ < settings_.timeout * (settings_.resends + 1)) return;
    full_since_ = -1;
    first_->unsent = true;
    finish(Abort::timeout);
}

}  // namespace hal::canopen
