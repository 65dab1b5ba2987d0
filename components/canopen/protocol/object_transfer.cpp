// SPDX-License-Identifier: MIT
#include "object_transfer.hpp"

#include <algorithm>
#include <utility>

namespace hal::canopen {

ObjectTransfer::ObjectTransfer(Dictionary& dictionary)
    : dictionary_(dictionary),
      scratch_size_(dictionary.max()),
      scratch_(std::make_unique<std::uint8_t[]>(scratch_size_)) {}

void ObjectTransfer::close(bool complete) noexcept {
    if (std::exchange(stream_open_, false)) {
        entry_->stream->close(*entry_, writing_, complete);
    }
}

Abort ObjectTransfer::select(std::uint16_t index, std::uint8_t sub) noexcept {
    close(false);
    size_ = 0;
    offset_ = 0;
    Abort why;
    entry_ = dictionary_.find(index, sub, why);
    return why;
}

Abort ObjectTransfer::open_read() noexcept {
    if (const auto why = dictionary_.prepare_read(*entry_); why != Abort::none) return why;
    writing_ = false;
    if (entry_->stream != nullptr) {
        size_ = 0;
        const auto why = entry_->stream->open_read(*entry_, size_);
        stream_open_ = why == Abort::none;
        return why;
    }
    size_ = std::min(entry_->size, static_cast<std::uint32_t>(scratch_size_));
    if (size_ != 0) {
        std::memcpy(scratch_.get(), entry_->data, size_);
    }
    return Abort::none;
}

Abort ObjectTransfer::read(std::uint32_t offset, std::span<std::uint8_t> buffer) noexcept {
    if (buffer.empty()) return Abort::none;
    if (entry_->stream != nullptr) return entry_->stream->read(*entry_, offset, buffer);
    std::memcpy(buffer.data(), scratch_.get() + offset, buffer.size());
    return Abort::none;
}

Abort ObjectTransfer::read_next(std::span<std::uint8_t> buffer) noexcept {
    const auto why = read(offset_, buffer);
    offset_ += static_cast<std::uint32_t>(buffer.size());
    return why;
}

Abort ObjectTransfer::open_write(bool known, std::uint32_t size) noexcept {
    size_known_ = known;
    size_ = size;
    if (!writable(entry_->access)) return Abort::read_only;
    writing_ = true;
    if (entry_->stream != nullptr) {
        const auto why = entry_->stream->open_write(*entry_, size);
        stream_open_ = why == Abort::none;
        return why;
    }
    return size_known_ ? Dictionary::check_length(*entry_, size) : Abort::none;
}

Abort ObjectTransfer::write(std::span<const std::uint8_t> bytes) noexcept {
    if (size_known_ && bytes.size() > left()) return Abort::too_long;
    if (entry_->stream != nullptr) {
        const auto why = entry_->stream->write(*entry_, offset_, bytes);
        if (why != Abort::none) return why;
    } else {
        const auto capacity = std::min<std::size_t>(scratch_size_, entry_->capacity);
        if (bytes.size() > capacity - offset_) return Abort::too_long;
        if (!bytes.empty()) {
            std::memcpy(scratch_.get() + offset_, bytes.data(), bytes.size());
        }
    }
    offset_ += static_cast<std::uint32_t>(bytes.size());
    return Abort::none;
}

Abort ObjectTransfer::commit() noexcept {
    if (size_known_ && offset_ != size_) return Abort::too_short;
    if (entry_->stream == nullptr) {
        return dictionary_.write(*entry_, {scratch_.get(), offset_});
    }
    stream_open_ = false;
    const auto why = entry_->stream->close(*entry_, true, true);
    if (why == Abort::none && entry_->handler != nullptr) {
        entry_->handler->written(*entry_);
    }
    return why;
}

Abort ObjectTransfer::write_at_once(std::span<const std::uint8_t> value) noexcept {
    if (entry_->stream == nullptr) return dictionary_.write(*entry_, value);
    auto why = open_write(true, static_cast<std::uint32_t>(value.size()));
    if (why == Abort::none) {
        why = write(value);
    }
    return why == Abort::none ? commit() : why;
}

}  // namespace hal::canopen
