// SPDX-License-Identifier: MIT
// A smart-serial port of an emulated card, with its channels.
#pragma once

#include <array>
#include <cstdint>
#include <memory>

#include "mesa/card/remote_7i76.hpp"
#include "mesa/hostmot2/smart_serial.hpp"

namespace hal::mesa {

/// Executes the commands of its command register. A command is done after the time of an exchange,
/// or when the register has been read a few times: while a driver is set up, the time of a card in
/// memory does not pass. What is read from CS and user registers is never what was written.
class SerialPort {
public:
    static constexpr std::int64_t exchange_ns = 100'000;

    /// Sets how many channels have pins. [setup]
    void set_channels(unsigned count) noexcept;
    /// Connects a device to a channel. [setup]
    void connect(unsigned channel, std::uint32_t serial_number);
    Remote7i76* remote(unsigned channel) noexcept { return channels_[channel].remote.get(); }
    const Remote7i76* remote(unsigned channel) const noexcept {
        return channels_[channel].remote.get();
    }
    /// A lost device neither answers nor is supplied. [realtime]
    void set_lost(bool lost) noexcept { is_lost_ = lost; }
    void reset() noexcept;
    /// Does what is due at the time. [realtime]
    void advance(std::int64_t now_ns) noexcept;
    /// `reg` is the number of the register as in the descriptor, `channel` 0 for those of the port.
    /// [realtime]
    std::uint32_t read(unsigned reg, unsigned channel) noexcept;
    void write(unsigned reg, unsigned channel, std::uint32_t value, std::int64_t now_ns) noexcept;

private:
    static constexpr unsigned user_registers = 3;
    enum class State : std::uint8_t { stopped, setup, running };
    struct Channel {
        std::unique_ptr<Remote7i76> remote;
        State state = State::stopped;
        std::uint32_t request = 0;  ///< written to CS
        std::uint32_t status = 0;  ///< read from CS
        std::array<std::uint32_t, user_registers> in{}, out{};
    };

    void execute(std::int64_t now_ns) noexcept;
    void access_local(std::uint32_t command) noexcept;
    void start(std::uint32_t mask, State state) noexcept;
    void do_it(std::uint32_t mask, std::int64_t now_ns) noexcept;
    bool exchange(Channel& channel, std::int64_t now_ns) noexcept;

    std::array<Channel, smart_serial::max_channels> channels_;
    using LocalMemory = std::array<std::uint8_t, 0x400>;
    static LocalMemory usual_local() noexcept;
    LocalMemory local_ = usual_local();

    std::uint32_t command_ = 0;  ///< 0: done
    std::uint32_t data_ = 0;
    std::int64_t done_ns_ = 0;
    std::int64_t newest_ns_ = 0;
    unsigned reads_ = 0;  ///< of the command register since it was written
    bool is_lost_ = false;
};

}  // namespace hal::mesa
