// SPDX-License-Identifier: MIT
#include "packet.hpp"

#include <algorithm>

#include "spaces.hpp"

namespace hal::mesa {

void Request::put(const Command& command) noexcept {
    store(bytes_.data() + size_, word_of(command));
    store(bytes_.data() + size_ + 2, command.address);
    size_ += command.head_size();
    if (!command.is_write) {
        reply_size_ += command.data_size();
    }
}

std::optional<std::size_t> Request::read(Space space, std::uint16_t address, Unit unit,
                                         std::size_t count, bool advances) noexcept {
    const std::size_t offset = reply_size_;
    if (count == 0 || count > max_datagram) return {};
    const std::size_t commands = (count + max_units - 1) / max_units;
    Command command{.space = space, .unit = unit, .advances = advances};
    if (size_ + commands * command.head_size() > max_datagram) return {};
    if (offset + count * bytes_of(unit) > max_datagram) return {};
    std::size_t next = address;
    while (count > 0) {
        command.count = static_cast<std::uint8_t>(std::min<std::size_t>(count, max_units));
        command.address = static_cast<std::uint16_t>(next);
        put(command);
        next += advances ? command.data_size() : 0;
        count -= command.count;
    }
    return offset;
}

std::optional<std::size_t> Request::read_information(Space space) noexcept {
    const std::size_t offset = reply_size_;
    const Command command{
        .information = true, .space = space, .unit = Unit::u16, .count = Information::size / 2};
    if (size_ + command.head_size() > max_datagram) return {};
    if (offset + command.data_size() > max_datagram) return {};
    put(command);
    return offset;
}

std::optional<std::size_t> Request::write(Space space, std::uint16_t address, Unit unit,
                                          std::span<const std::uint8_t> data,
                                          bool advances) noexcept {
    const std::size_t count = data.size() / bytes_of(unit);
    if (count == 0 || count > max_units || count * bytes_of(unit) != data.size()) return {};
    const Command command{.is_write = true,
                          .space = space,
                          .unit = unit,
                          .advances = advances,
                          .count = static_cast<std::uint8_t>(count),
                          .address = address};
    if (size_ + command.head_size() + data.size() > max_datagram) return {};
    put(command);
    const std::size_t offset = size_;
    std::copy(data.begin(), data.end(), bytes_.begin() + static_cast<std::ptrdiff_t>(offset));
    size_ += data.size();
    return offset;
}

std::optional<std::size_t> Request::write32(std::uint16_t address, std::uint32_t value) noexcept {
    std::array<std::uint8_t, 4> data;
    store(data.data(), value);
    return write(Space::hostmot2, address, Unit::u32, data);
}

bool Request::append(const Request& other) noexcept {
    if (size_ + other.size_ > max_datagram) return false;
    if (reply_size_ + other.reply_size_ > max_datagram) return false;
    std::copy_n(other.bytes_.begin(), other.size_,
                bytes_.begin() + static_cast<std::ptrdiff_t>(size_));
    size_ += other.size_;
    reply_size_ += other.reply_size_;
    return true;
}

RequestReader::Next RequestReader::next(Command& command,
                                        std::span<const std::uint8_t>& data) noexcept {
    data = {};
    if (rest_.empty()) return Next::end;
    if (rest_.size() < 2) return Next::malformed;
    command = command_of(load<std::uint16_t>(rest_.data()));
    const std::size_t head = command.head_size();
    const std::size_t written = command.is_write ? command.data_size() : 0;
    if (command.count == 0 || rest_.size() < head + written) {
        rest_ = {};
        return Next::malformed;
    }
    if (command.has_address) {
        command.address = load<std::uint16_t>(rest_.data() + 2);
    }
    data = rest_.subspan(head, written);
    rest_ = rest_.subspan(head + written);
    return Next::command;
}

}  // namespace hal::mesa
