// SPDX-License-Identifier: MIT
// A byte stream between two components; include hal/component.hpp.
#pragma once

#include <cstddef>
#include <cstdint>

#include "hal/abi.h"

namespace hal {

/// A byte stream (LinuxCNC `port`): one writer, one reader, never blocks. Reads and writes are
/// atomic: all bytes or none.
class Port {
public:
    explicit Port(hal_port* port = nullptr) noexcept : port_(port) {}
    std::size_t capacity() const noexcept { return port_ ? port_->capacity : 0; }
    /// Bytes waiting. [any]
    std::size_t readable() const noexcept {
        return port_ ? static_cast<std::size_t>(load(port_->head) - load(port_->tail)) : 0;
    }
    /// Free bytes. [any]
    std::size_t writable() const noexcept { return capacity() - readable(); }
    /// Copies `bytes` without consuming them; false when fewer are available. [realtime] reader
    bool peek(void* to, std::size_t bytes) const noexcept {
        if (readable() < bytes) return false;
        for (std::size_t i = 0; i < bytes; ++i) {
            static_cast<std::uint8_t*>(to)[i] = port_->data[(port_->tail + i) % port_->capacity];
        }
        return true;
    }
    /// Consumes `bytes`; false, without consuming any, when fewer are available. [realtime] reader
    bool read(void* to, std::size_t bytes) const noexcept {
        return peek(to, bytes) && discard(bytes);
    }
    bool discard(std::size_t bytes) const noexcept {
        if (readable() < bytes) return false;
        store(port_->tail, port_->tail + bytes);
        return true;
    }
    /// Appends `bytes`; false, without writing any, when there is not enough space. [realtime]
    /// writer
    bool write(const void* from, std::size_t bytes) const noexcept {
        if (writable() < bytes) return false;
        for (std::size_t i = 0; i < bytes; ++i) {
            port_->data[(port_->head + i) % port_->capacity] =
                static_cast<const std::uint8_t*>(from)[i];
        }
        store(port_->head, port_->head + bytes);
        return true;
    }

private:
    static std::uint64_t load(const std::uint64_t& v) noexcept {
        return __atomic_load_n(&v, __ATOMIC_ACQUIRE);
    }
    static void store(std::uint64_t& v, std::uint64_t x) noexcept {
        __atomic_store_n(&v, x, __ATOMIC_RELEASE);
    }
    hal_port* port_;
};

}  // namespace hal
