// SPDX-License-Identifier: MIT
#include "serial_port.hpp"

#include <algorithm>

#include "mesa/lbp16/bytes.hpp"

namespace hal::mesa {

namespace {

constexpr std::size_t first_channel_at = 0x20;
constexpr std::size_t channel_bytes = 0x40;
constexpr std::size_t baud_rate_at = 42;
constexpr std::uint32_t baud_rate = 2'500'000;
constexpr unsigned reads_until_done = 2;
constexpr std::uint32_t timeout_error = 1U << 3;

}  // namespace

SerialPort::LocalMemory SerialPort::usual_local() noexcept {
    LocalMemory bytes{};
    bytes[smart_serial::local::version] = smart_serial::local::usual_version;
    bytes[smart_serial::local::channel_offset] = first_channel_at;
    bytes[smart_serial::local::channel_stride] = channel_bytes;
    for (unsigned channel = 0; channel < smart_serial::max_channels; ++channel) {
        store(bytes.data() + first_channel_at + channel * channel_bytes + baud_rate_at, baud_rate);
    }
    return bytes;
}

void SerialPort::set_channels(unsigned count) noexcept {
    local_[smart_serial::local::channels] = static_cast<std::uint8_t>(count);
}

void SerialPort::connect(unsigned channel, std::uint32_t serial_number) {
    channels_[channel].remote = std::make_unique<Remote7i76>(serial_number);
}

void SerialPort::reset() noexcept {
    for (Channel& channel : channels_) {
        channel.state = State::stopped;
        channel.request = 0;
        channel.status = 0;
        channel.in = {};
        channel.out = {};
    }
    command_ = 0;
    data_ = 0;
}

void SerialPort::advance(std::int64_t now_ns) noexcept {
    newest_ns_ = now_ns;
    if (command_ != 0 && now_ns >= done_ns_) {
        execute(now_ns);
    }
    for (Channel& channel : channels_) {
        if (channel.remote) {
            channel.remote->watch(now_ns);
        }
    }
}

std::uint32_t SerialPort::read(unsigned reg, unsigned channel) noexcept {
    if (reg == smart_serial::command) {
        const std::uint32_t value = command_;
        if (command_ != 0 && ++reads_ >= reads_until_done) {
            execute(newest_ns_);
        }
        return value;
    }
    if (reg == smart_serial::data) return data_;
    if (channel >= smart_serial::max_channels) return 0;
    const Channel& of = channels_[channel];
    if (reg == smart_serial::control_status) return of.status;
    return reg - smart_serial::user < user_registers ? of.in[reg - smart_serial::user] : 0;
}

void SerialPort::write(unsigned reg, unsigned channel, std::uint32_t value,
                       std::int64_t now_ns) noexcept {
    if (reg == smart_serial::command) {
        if ((value & smart_serial::port::ignored) != 0) return;
        command_ = value;
        done_ns_ = now_ns + exchange_ns;
        reads_ = 0;
        return;
    }
    if (reg == smart_serial::data) {
        data_ = value;
        return;
    }
    if (channel >= smart_serial::max_channels) return;
    Channel& of = channels_[channel];
    if (reg == smart_serial::control_status) {
        of.request = value;
    } else if (reg - smart_serial::user < user_registers) {
        of.out[reg - smart_serial::user] = value;
    }
}

void SerialPort::access_local(std::uint32_t command) noexcept {
    const std::size_t at = command & 0xfffU;
    const bool is_there = at < local_.size();
    if ((command & smart_serial::port::write_local) == smart_serial::port::write_local) {
        if (is_there) {
            local_[at] = static_cast<std::uint8_t>(data_);
        }
        return;
    }
    data_ = is_there ? local_[at] : 0;
}

void SerialPort::start(std::uint32_t mask, State state) noexcept {
    for (unsigned n = 0; n < smart_serial::max_channels; ++n) {
        Channel& channel = channels_[n];
        if ((mask >> n & 1U) == 0) continue;
        channel.state = state;
        channel.in = {};
        channel.status = 0;
        if (!channel.remote || is_lost_) continue;
        channel.in = {channel.remote->serial_number(), Remote7i76::letters,
                      channel.remote->tables()};
    }
    data_ = 0;
}

/// Returns whether the device answered.
bool SerialPort::exchange(Channel& channel, std::int64_t now_ns) noexcept {
    if (!channel.remote || is_lost_) {
        channel.status = smart_serial::communication_error | timeout_error;
        return false;
    }
    channel.status = 0;
    switch (channel.state) {
    case State::stopped: return false;
    case State::setup: channel.remote->serve(channel.request, channel.in, channel.out); break;
    case State::running: channel.remote->exchange(channel.in, channel.out, now_ns); break;
    }
    return true;
}

void SerialPort::do_it(std::uint32_t mask, std::int64_t now_ns) noexcept {
    data_ = 0;
    for (unsigned n = 0; n < smart_serial::max_channels; ++n) {
        if ((mask >> n & 1U) == 0) continue;
        if (!exchange(channels_[n], now_ns)) {
            data_ |= 1U << n;
        }
    }
}

void SerialPort::execute(std::int64_t now_ns) noexcept {
    const std::uint32_t command = command_;
    command_ = 0;
    const std::uint32_t mask = command & 0xffU;
    if ((command & smart_serial::port::reset) != 0) {
        start(0xff, State::stopped);
    } else if ((command & smart_serial::port::read_local) != 0) {
        access_local(command);
    } else if ((command & smart_serial::port::do_it) != 0) {
        do_it(mask, now_ns);
    } else if ((command & 0xf00U) == smart_serial::port::start) {
        start(mask, State::running);
    } else if ((command & 0xf00U) == smart_serial::port::start_setup) {
        start(mask, State::setup);
    } else if ((command & 0xf00U) == smart_serial::port::stop_all) {
        for (Channel& channel : channels_) {
            channel.state = State::stopped;
        }
        data_ = 0;
    }
}

}  // namespace hal::mesa
