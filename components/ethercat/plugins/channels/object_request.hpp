// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <cstring>

#include "cia301/values.hpp"
#include "ethercat/master/request_queue.hpp"
#include "ethercat/plugins/channels/channel.hpp"

namespace hal::ethercat {

/// An object that is read once by SDO when the slave is in PRE-OP or higher, and can be written
/// afterwards. The requests are served beside the process data; nothing waits for them.
class ObjectRequest {
public:
    /// How the value is read and written: by CoE, or by SoE with the number of a parameter (IDN) as
    /// `index` and the number of the drive as `sub`.
    enum class Protocol : std::uint8_t { coe, soe };

    ObjectRequest(std::uint16_t index, std::uint8_t sub, unsigned bits, bool is_signed,
                  Protocol protocol = Protocol::coe)
        : bits_(bits), is_signed_(is_signed), protocol_(protocol) {
        request_.index = index;
        request_.sub = sub;
    }
    /// The object with the role `object` of a channel, with the bits of its settings.
    explicit ObjectRequest(const ChannelPlan& plan)
        : ObjectRequest(plan.channel.objects.at("object").index,
                        plan.channel.objects.at("object").sub,
                        static_cast<unsigned>(plan.channel.setting("bits", 32)),
                        plan.channel.setting("signed", 0) != 0) {}

    /// Call once per cycle. [realtime]
    void step(const SlaveImage& image) noexcept {
        if (waits_ns_ > 0) {
            waits_ns_ -= image.period_ns;
        }
        switch (state_) {
        case State::unknown:
            if (image.reachable && waits_ns_ <= 0) {
                begin(image, protocol_ == Protocol::soe ? Kind::soe_read : Kind::sdo_upload,
                      State::reading);
            }
            break;
        case State::reading:
        case State::writing: finish(image); break;
        case State::known: break;
        }
    }
    /// Returns whether the object was read; a write may be under way. [realtime]
    bool known() const noexcept { return state_ == State::known || state_ == State::writing; }
    std::int64_t value() const noexcept { return value_; }
    /// Writes the object unless a write is under way. [realtime]
    void write(const SlaveImage& image, std::int64_t value) noexcept {
        if (state_ != State::known || !image.reachable || waits_ns_ > 0) return;
        std::memcpy(data_.data(), &value, data_.size());
        wanted_ = value;
        begin(image, protocol_ == Protocol::soe ? Kind::soe_write : Kind::sdo_download,
              State::writing);
    }
    /// Forgets the object: the master starts again. [setup]
    void restart() noexcept {
        state_ = State::unknown;
        waits_ns_ = 0;
        request_.stage = master::MailboxRequest::Stage::idle;
    }

private:
    using Kind = master::MailboxRequest::Kind;
    enum class State : std::uint8_t { unknown, reading, known, writing };
    static constexpr std::int64_t retry_ns = 1'000'000'000;

    void begin(const SlaveImage& image, Kind kind, State state) noexcept {
        if (image.mailbox == nullptr) return;
        request_.kind = kind;
        request_.slave = image.slave;
        request_.data = std::span(data_).first(bits_ / 8);
        if (image.mailbox->submit(request_)) {
            state_ = state;
        }
    }
    void finish(const SlaveImage& image) noexcept {
        if (image.mailbox == nullptr || !image.mailbox->finished(request_)) return;
        request_.stage = master::MailboxRequest::Stage::idle;
        const bool good = static_cast<bool>(request_.result);
        if (!good) {
            waits_ns_ = retry_ns;
        }
        if (state_ == State::writing) {
            state_ = State::known;
            value_ = good ? wanted_ : value_;
            return;
        }
        state_ = good ? State::known : State::unknown;
        if (good) {
            const std::uint64_t raw = read_bits(data_, 0, bits_);
            value_ =
                is_signed_ ? cia301::sign_extended(raw, bits_) : static_cast<std::int64_t>(raw);
        }
    }

    const unsigned bits_;
    const bool is_signed_;
    const Protocol protocol_;
    master::MailboxRequest request_;
    std::array<std::uint8_t, 8> data_{};
    std::int64_t value_ = 0;
    std::int64_t wanted_ = 0;
    std::int64_t waits_ns_ = 0;
    State state_ = State::unknown;
};

}  // namespace hal::ethercat
