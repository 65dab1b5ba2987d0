// SPDX-License-Identifier: MIT
// The value of an object during a transfer by SDO: of the dictionary, or of the stream of a domain.
#pragma once

#include <memory>

#include "dictionary.hpp"

namespace hal::canopen {

/// One transfer after the other. Values other than domains are copied, so that they change at once
/// and not while they are read. [realtime]
class ObjectTransfer {
public:
    /// The dictionary outlives it. [setup]
    explicit ObjectTransfer(Dictionary&);

    /// Selects an object; a transfer in progress ends incomplete.
    Abort select(std::uint16_t index, std::uint8_t sub) noexcept;
    /// Begins to read; size() is the length of the value then.
    Abort open_read() noexcept;
    /// Begins to write a value of `size` bytes; 0 and not `known`: the client did not announce it.
    Abort open_write(bool known, std::uint32_t size) noexcept;
    /// Reads bytes of the value.
    Abort read(std::uint32_t offset, std::span<std::uint8_t>) noexcept;
    /// Reads the next bytes of the value.
    Abort read_next(std::span<std::uint8_t>) noexcept;
    /// Appends bytes to the value.
    Abort write(std::span<const std::uint8_t>) noexcept;
    /// Applies the value that was written.
    Abort commit() noexcept;
    /// Writes a whole value.
    Abort write_at_once(std::span<const std::uint8_t>) noexcept;
    /// Ends the transfer of a domain, if there is one.
    void close(bool complete) noexcept;

    const Entry& entry() const noexcept { return *entry_; }
    std::uint32_t size() const noexcept { return size_; }
    std::uint32_t left() const noexcept { return size_ - offset_; }

private:
    Dictionary& dictionary_;
    const std::size_t scratch_size_;
    const std::unique_ptr<std::uint8_t[]> scratch_;
    Entry* entry_ = nullptr;
    bool writing_ = false;
    bool stream_open_ = false;
    bool size_known_ = false;
    std::uint32_t size_ = 0;  // as announced, or of the value that is read
    std::uint32_t offset_ = 0;  // bytes transferred
};

}  // namespace hal::canopen
