// SPDX-License-Identifier: MIT
// What the slaves of a capture answered, by datagram.
#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "ethercat/wire/frames.hpp"
#include "link/ethernet_capture.hpp"

namespace hal::ethercat {

/// The answers of a capture. A datagram gets the answer that the same one (command, address,
/// length) has in the capture: the next one for each repetition, the last one again when there are
/// no more. What a master writes to a slave moves the position in the capture: reads that follow
/// get answers from behind the same write there, and none from behind a write that has not been
/// repeated. Bytes that no answer to the same datagram changed stay as they are sent: outputs.
class RecordedAnswers {
public:
    /// Reads the EtherCAT frames of a capture. [setup]
    explicit RecordedAnswers(const std::vector<hal::ethernet::Captured>& frames);

    /// Returns the number of datagrams that have an answer. [any]
    std::size_t size() const noexcept { return answers_; }
    /// Turns the datagrams of a sent frame into what returned in the capture. Returns how many of
    /// them are not in the capture: they stay as they are, with the working counter 0. [realtime]
    std::size_t answer(std::span<std::uint8_t> frame) noexcept;

private:
    /// Of a datagram: what makes it the same one.
    struct Key {
        Command command{};
        std::uint16_t length = 0;
        std::uint32_t address = 0;
        auto operator<=>(const Key&) const = default;
    };
    /// One datagram and its answer.
    struct Answer {
        std::size_t order = 0;  ///< in the capture
        std::size_t sent = 0;  ///< place of the data as sent
        std::size_t returned = 0;  ///< place of the data as returned
        std::uint16_t position = 0;
        std::uint16_t wkc = 0;
    };
    /// The answers to the same datagram.
    struct Series {
        std::vector<Answer> answers;
        std::vector<bool> changed;  ///< by byte: one of the answers differs from what was sent
        std::size_t next = 0;
    };
    /// A slave, or all of them: how far its writes have been repeated.
    struct Target {
        std::vector<std::size_t> writes;  ///< their order, ascending
        std::size_t reached = 0;  ///< order from which on reads are answered
        std::size_t next_write() const noexcept;
    };

    static bool is_write(Command command) noexcept;
    static std::uint32_t target_of(const DatagramView& d) noexcept;
    static Key key_of(const DatagramView& d) noexcept;
    std::size_t keep(const DatagramView& d);
    void add(const DatagramView& sent, const DatagramView& returned);
    const Answer* find_write(Series& series, Target& target, const DatagramView& d) noexcept;
    const Answer* find_read(Series& series, const Target& target) noexcept;
    bool answer(const DatagramView& d) noexcept;

    std::vector<std::uint8_t> bytes_;
    std::map<Key, Series> series_;
    std::map<std::uint32_t, Target> targets_;
    std::size_t answers_ = 0;
};

}  // namespace hal::ethercat
