// SPDX-License-Identifier: MIT
// The other side of an EtherCAT cable for the bench: emulated slaves, or a responder that only
// returns frames with the counters they had.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <thread>
#include <tuple>
#include <vector>

#include "drivers/link/ethernet.hpp"
#include "drivers/link/system.hpp"
#include "ethercat/devices/registry.hpp"
#include "ethercat/esc/line.hpp"

namespace hal::bench {

/// A packet socket for EtherCAT as a program of one's own would open it: blocking, without own
/// frames.
class RawSocket {
public:
    /// Throws std::runtime_error when it cannot be opened.
    explicit RawSocket(const std::string& interface);
    /// Waits at most 20 ms. Returns the bytes received, 0: none.
    std::size_t receive(std::span<std::uint8_t> frame) noexcept;
    void send(std::span<const std::uint8_t> frame) noexcept;

private:
    link::Descriptor socket_;
};

/// Slaves at an interface, in a real-time thread.
class Slaves {
public:
    /// `line`: devices as in `hal node ethercat`.
    Slaves(const std::string& interface, const std::string& line);
    ~Slaves() { stop(); }

    enum class Mode {
        emulated,  ///< controller by controller; remembers counters and short answers by datagram
        null,  ///< returns what it remembers: what a wire without time would do
    };
    /// Works on that CPU until stop().
    void start(Mode mode, int cpu);
    void stop();
    /// Remembers the answers of others. Not while it works.
    void learn(const Slaves& others) { answers_ = others.answers_; }
    /// Changes the line. Not while it works.
    ethercat::esc::Line& line() { return line_; }
    /// Returns the shortest frame with process data that it saw: one that carries nothing else.
    const std::vector<std::uint8_t>& cyclic_frame() const { return cyclic_; }

private:
    using Key = std::tuple<std::uint8_t, std::uint32_t, std::uint16_t>;  // command, address, length
    struct Answer {
        std::uint16_t wkc = 0;
        std::array<std::uint8_t, 8> data{};
    };
    void emulate() noexcept;
    void return_frames() noexcept;
    void remember(std::span<std::uint8_t> asked, std::span<std::uint8_t> answered) noexcept;
    void answer(std::span<std::uint8_t> frame) noexcept;

    const std::string interface_;
    std::vector<ethercat::devices::Device> devices_;
    ethercat::esc::Line line_;
    std::map<Key, Answer> answers_;
    std::vector<std::uint8_t> cyclic_;
    std::unique_ptr<ethernet::Port> port_;  // emulated
    std::unique_ptr<RawSocket> socket_;  // null
    std::atomic<bool> stop_{false};
    std::thread thread_;
};

}  // namespace hal::bench
