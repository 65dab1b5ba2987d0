// SPDX-License-Identifier: MIT
#include "sdo_server.hpp"

#include <algorithm>

namespace hal::canopen {

SdoServer::SdoServer(Dictionary& dictionary, FrameQueue& out, const SdoServerSettings& settings)
    : out_(out), settings_(settings), object_(dictionary) {}

void SdoServer::configure(std::uint32_t request_cob, std::uint32_t answer_cob) noexcept {
    reset();
    on_ = ((request_cob | answer_cob) & cob_invalid) == 0 && cob_id(request_cob) != 0 &&
          cob_id(answer_cob) != 0;
    request_id_ = cob_id(request_cob);
    request_extended_ = (request_cob & cob_extended) != 0;
    answer_cob_ = answer_cob;
}

void SdoServer::reset() noexcept {
    object_.close(false);
    pending_ = repeatable_ = false;
    state_ = ended_ = State::idle;
}

void SdoServer::answer(const Bytes& bytes) noexcept {
    last_answer_ = bytes;
    Frame f = make_frame(answer_cob_, 8);
    std::copy(bytes.begin(), bytes.end(), f.data.begin());
    pending_ = !out_.push(f);
}

void SdoServer::answer_initiate(std::uint8_t command, std::uint32_t value) noexcept {
    Bytes b{command, static_cast<std::uint8_t>(index_), static_cast<std::uint8_t>(index_ >> 8),
            sub_};
    store(b.data() + 4, value);
    answer(b);
}

void SdoServer::abort(Abort why, bool notify) noexcept {
    object_.close(false);
    repeatable_ = false;
    state_ = ended_ = State::idle;
    last_abort_ = why;
    ++aborted_;
    if (notify) {
        answer_initiate(0x80, static_cast<std::uint32_t>(why));
    }
}

void SdoServer::finish() noexcept {
    ended_ = state_;
    state_ = State::idle;
    ++transfers_;
}

/// Keeps index and sub-index of a request, for the answer.
void SdoServer::address(const Frame& f) noexcept {
    index_ = load<std::uint16_t>(f.data.data() + 1);
    sub_ = f.data[3];
}

bool SdoServer::select(const Frame& f) noexcept {
    repeatable_ = false;
    state_ = ended_ = State::idle;
    toggle_ = 0;
    address(f);
    return proceed(object_.select(index_, sub_));
}

bool SdoServer::open_read() noexcept { return proceed(object_.open_read()); }

void SdoServer::handle(const Frame& f, Time now) noexcept {
    if (f.length != 8) return;
    now_ = heard_ = now;
    pending_ = false;  // the client did not wait for the response
    Bytes bytes;
    std::copy_n(f.data.begin(), 8, bytes.begin());
    const bool repeated = bytes == last_request_;
    last_request_ = bytes;
    const std::uint8_t command = f.data[0];
    if (command == 0x80) {
        if (state_ != State::idle) {
            abort(static_cast<Abort>(load<std::uint32_t>(f.data.data() + 4)), false);
        }
        return;
    }
    if (state_ == State::block_download) {
        // The response was lost, or the abort of the client: it repeats the request. Only a segment
        // out of sequence can look like this.
        if (bytes == block_request_ && !receiver_.expects(f)) return start_block_download(f);
        return block_segment(f);
    }
    // the last segment repeated: the client missed the acknowledgement
    const bool ended = state_ == State::block_download_end;
    const bool segment = command >> 5 == 0 || command >> 5 == 3;
    const bool tolerated = repeatable_ && settings_.tolerate_repeats && segment;
    if (repeated && (ended || tolerated)) return answer(last_answer_);
    dispatch(f);
}

void SdoServer::dispatch(const Frame& f) noexcept {
    const std::uint8_t command = f.data[0];
    switch (command >> 5) {
    case 0: return download_segment(f);
    case 1: return start_download(f);
    case 2: return start_upload(f);
    case 3: return upload_segment(f);
    case 5: return (command & 3) == 0 ? start_block_upload(f) : block_upload_command(f);
    case 6: return (command & 1) == 0 ? start_block_download(f) : end_block_download(f);
    default: break;
    }
    if (state_ == State::idle) {
        address(f);
    }
    abort(Abort::command);
}

void SdoServer::start_download(const Frame& f) noexcept {
    if (!select(f)) return;
    if ((f.data[0] & 2) != 0) return expedited_download(f);
    const bool known = (f.data[0] & 1) != 0;
    const auto size = known ? load<std::uint32_t>(f.data.data() + 4) : 0;
    if (!proceed(object_.open_write(known, size))) return;
    state_ = State::download;
    answer_initiate(0x60, 0);
}

void SdoServer::expedited_download(const Frame& f) noexcept {
    const Entry& entry = object_.entry();
    std::uint32_t size = 4;
    if ((f.data[0] & 1) != 0) {
        size = 4 - (f.data[0] >> 2 & 3);
    } else if (entry.bits != 0) {
        size = std::min<std::uint32_t>(size, entry.capacity);
    }
    if (!proceed(object_.write_at_once({f.data.data() + 4, size}))) return;
    ++transfers_;
    answer_initiate(0x60, 0);
}

void SdoServer::download_segment(const Frame& f) noexcept {
    if (state_ != State::download) return abort(Abort::command);
    if ((f.data[0] & 0x10) != toggle_) return abort(Abort::toggle);
    const std::uint32_t count = 7 - (f.data[0] >> 1 & 7);
    if (!proceed(object_.write({f.data.data() + 1, count}))) return;
    const bool last = (f.data[0] & 1) != 0;
    if (last && !proceed(object_.commit())) return;
    answer({static_cast<std::uint8_t>(0x20 | toggle_)});
    toggle_ ^= 0x10;
    repeatable_ = true;
    if (last) {
        finish();
    }
}

void SdoServer::start_upload(const Frame& f) noexcept {
    if (!select(f) || !open_read()) return;
    const std::uint32_t size = object_.size();
    if (size == 0 || size > 4) {
        state_ = State::upload;
        return answer_initiate(0x41, size);
    }
    std::uint32_t value = 0;
    if (!proceed(object_.read(0, {reinterpret_cast<std::uint8_t*>(&value), size}))) return;
    object_.close(true);
    ++transfers_;
    answer_initiate(static_cast<std::uint8_t>(0x43 | (4 - size) << 2), value);
}

void SdoServer::upload_segment(const Frame& f) noexcept {
    if (state_ != State::upload) return abort(Abort::command);
    if ((f.data[0] & 0x10) != toggle_) return abort(Abort::toggle);
    const auto count = std::min<std::uint32_t>(7, object_.left());
    Bytes b{};
    if (!proceed(object_.read_next({b.data() + 1, count}))) return;
    const bool last = object_.left() == 0;
    b[0] = static_cast<std::uint8_t>(toggle_ | (7 - count) << 1 | (last ? 1 : 0));
    answer(b);
    toggle_ ^= 0x10;
    repeatable_ = true;
    if (!last) return;
    object_.close(true);
    finish();
}

void SdoServer::poll(Time now) noexcept {
    now_ = now;
    if (pending_) {
        answer(last_answer_);
    }
    if (state_ == State::idle) return;
    if (state_ == State::block_upload) {
        send_block();
    }
    const bool waits = now - heard_ < settings_.timeout;
    if (state_ == State::block_download && now - reminded_ >= acknowledge_after() && waits &&
        (receiver_.any() || receiver_.holds())) {
        reminded_ = now;
        on_block_timeout();
    }
    if (now - heard_ < settings_.timeout) return;
    // all data was sent; only the final confirmation of the client is missing
    if (state_ == State::block_upload_end) return confirm_block_upload();
    abort(Abort::timeout);
}

// Block download.

void SdoServer::start_block_download(const Frame& f) noexcept {
    if (!select(f)) return;
    const bool known = (f.data[0] & 2) != 0;
    const auto size = known ? load<std::uint32_t>(f.data.data() + 4) : 0;
    if (!proceed(object_.open_write(known, size))) return;
    receiver_.begin(std::clamp<std::uint8_t>(settings_.block_size, 1, 127));
    receiver_.use_crc((f.data[0] & 4) != 0);
    state_ = State::block_download;
    block_request_ = last_request_;
    reminded_ = now_;
    answer_initiate(0xa4, receiver_.size());
}

void SdoServer::block_segment(const Frame& f) noexcept {
    reminded_ = now_;
    Abort why = Abort::none;
    const auto arrived = receiver_.accept(f, [&](std::span<const std::uint8_t> bytes) {
        why = object_.write(bytes);
        return why == Abort::none;
    });
    switch (arrived) {
    case BlockReceiver::Arrived::failed: return abort(why);
    case BlockReceiver::Arrived::ignored:
    case BlockReceiver::Arrived::duplicate: return;
    case BlockReceiver::Arrived::repeated:
        if (now_ - acknowledged_at_ < acknowledge_after() / 4) return;
        acknowledged_at_ = now_;
        return answer({0xa2, receiver_.acknowledged(), receiver_.size()});
    case BlockReceiver::Arrived::out_of_order:
    case BlockReceiver::Arrived::in_order: break;
    }
    if (receiver_.ends_with(f)) {
        acknowledge_block(receiver_.change(BlockChange::larger));
    }
}

void SdoServer::acknowledge_block(BlockChange change) noexcept {
    const std::uint8_t good = receiver_.acknowledge(change, settings_.block_size);
    acknowledged_at_ = now_;
    answer({0xa2, good, receiver_.size()});
    if (receiver_.last_seen()) {
        state_ = State::block_download_end;
    }
}

/// The end of the block was lost, or the client is slow: acknowledges what arrived, and the client
/// continues from there with a new block. If nothing of this block arrived, the last
/// acknowledgement or the whole block was lost; the client then sees an invalid segment number, or
/// the CRC fails.
void SdoServer::on_block_timeout() noexcept {
    if (!receiver_.any()) return answer({0xa2, receiver_.acknowledged(), receiver_.size()});
    acknowledge_block(receiver_.change(BlockChange::same));
    if (state_ == State::block_download) {
        receiver_.ignore_rest();
    }
}

void SdoServer::end_block_download(const Frame& f) noexcept {
    // the confirmation was lost
    if (state_ == State::idle && ended_ == State::block_download_end) return answer({0xa1});
    if (state_ != State::block_download_end) return abort(Abort::command);
    if (receiver_.crc_used() && !receiver_.crc_matches(f)) return abort(Abort::crc);
    if (!proceed(object_.write(receiver_.rest(f))) || !proceed(object_.commit())) return;
    answer({0xa1});
    finish();
}

// Block upload.

void SdoServer::start_block_upload(const Frame& f) noexcept {
    const std::uint8_t block_size = f.data[4];
    const std::uint8_t protocol_switch = f.data[5];
    if (!is_block_size(block_size)) {
        address(f);
        return abort(Abort::block_size);
    }
    if (!select(f) || !open_read()) return;
    // segments are cheaper
    if (object_.size() == 0 || (protocol_switch != 0 && object_.size() <= protocol_switch)) {
        object_.close(true);
        return start_upload(f);
    }
    sender_.begin(block_size, (f.data[0] & 4) != 0);
    state_ = State::block_upload_start;
    answer_initiate(0xc6, object_.size());
}

/// A frame that repeats one of a step that is over is ignored, except that the end is sent again.
void SdoServer::block_upload_command(const Frame& f) noexcept {
    const bool over = state_ == State::idle && ended_ == State::block_upload_end;
    switch (f.data[0] & 3) {
    case 3: return start_blocks();
    case 2:
        if (over) return;
        if (state_ == State::block_upload_end) return end_block_upload();
        if (state_ == State::block_upload) return on_acknowledgement(f);
        break;
    case 1:
        if (over) return;
        if (state_ == State::block_upload_end) return confirm_block_upload();
        break;
    default: break;
    }
    abort(Abort::command);
}

void SdoServer::start_blocks() noexcept {
    if (state_ == State::block_upload) return;
    if (state_ != State::block_upload_start) return abort(Abort::command);
    state_ = State::block_upload;
    send_block();
}

void SdoServer::on_acknowledgement(const Frame& f) noexcept {
    const std::uint8_t good = f.data[1];
    const std::uint8_t next = f.data[2];
    if (!is_block_size(next)) return abort(Abort::block_size);
    if (good > 127) return abort(Abort::sequence);
    switch (sender_.evaluate(good, next, out_, now_, acknowledge_after() / 4)) {
    case Acknowledgement::duplicate: return;
    case Acknowledgement::beyond: return abort(Abort::sequence);
    case Acknowledgement::stalled: sender_.repeat(now_); break;
    case Acknowledgement::of_this_block: sender_.advance(good, next, object_.size(), now_); break;
    }
    if (sender_.offset() != object_.size()) return send_block();
    state_ = State::block_upload_end;
    end_block_upload();
}

void SdoServer::send_block() noexcept {
    const auto before = sender_.sequence();
    Abort why = Abort::none;
    sender_.send(out_, answer_cob_, object_.size(),
                 [&](std::uint32_t offset, std::span<std::uint8_t> bytes) {
        why = object_.read(offset, bytes);
        return why == Abort::none;
    });
    if (sender_.sequence() != before) {
        heard_ = now_;
    }
    proceed(why);
}

void SdoServer::end_block_upload() noexcept {
    Bytes b{static_cast<std::uint8_t>(0xc1 | sender_.unused() << 2)};
    store(b.data() + 1, sender_.crc());
    answer(b);
}

void SdoServer::confirm_block_upload() noexcept {
    object_.close(true);
    finish();
}

}  // namespace hal::canopen
