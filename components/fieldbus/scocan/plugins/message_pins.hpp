// SPDX-License-Identifier: MIT
// The pins of one message: its fields, and those with which its sender sends it and its receivers
// see it.
#pragma once

#include <bit>
#include <deque>
#include <memory>
#include <optional>

#include "fieldbus/messages/field_values.hpp"
#include "fieldbus/scocan/station/station.hpp"
#include "hal/component.hpp"

namespace hal::scocan {

/// Returns the first 8 bytes of the data, little endian. [realtime]
inline std::uint64_t data_of(const can::Frame& frame) noexcept {
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < 8; ++i) {
        bits |= std::uint64_t{frame.data[i]} << 8 * i;
    }
    return bits;
}

/// The pin of one field, an input of the sender or an output of a receiver.
template <template <hal::PinType> class Pin>
class FieldPin {
public:
    FieldPin(hal::Component& c, const hal::Function& f, const std::string& name, const Field& field)
        : field_(field) {
        const std::string doc = std::string("field ") + field.name + ", " + to_string(field.type);
        switch (field.type) {
        case FieldType::u8:
        case FieldType::u16:
        case FieldType::u32:
            u32_ = std::make_unique<Pin<std::uint32_t>>(c, f, name.c_str(), doc.c_str());
            break;
        case FieldType::s8:
        case FieldType::s16:
        case FieldType::s32:
            s32_ = std::make_unique<Pin<std::int32_t>>(c, f, name.c_str(), doc.c_str());
            break;
        case FieldType::f32:
        case FieldType::f64:
            real_ = std::make_unique<Pin<double>>(c, f, name.c_str(), doc.c_str());
            break;
        }
    }
    /// Writes the value of the pin, limited to the range of the field, into the data. [realtime]
    void encode(can::Frame& frame) const noexcept {
        std::uint64_t bits = 0;
        if (u32_) {
            bits = messages::unsigned_bits(u32_->get(), size_of(field_.type));
        } else if (s32_) {
            bits = messages::signed_bits(s32_->get(), size_of(field_.type));
        } else if (field_.type == FieldType::f64) {
            bits = std::bit_cast<std::uint64_t>(real_->get());
        } else {
            bits = messages::single_bits(real_->get());
        }
        for (std::uint32_t i = 0; i < size_of(field_.type); ++i) {
            frame.data[field_.at + i] = static_cast<std::uint8_t>(bits >> 8 * i);
        }
    }
    /// Writes the value in the data to the pin. [realtime]
    void decode(std::uint64_t data) noexcept
        requires requires(Pin<double>& p) { p = 1.0; }
    {
        const std::uint64_t bits = data >> 8 * field_.at;
        if (u32_) {
            *u32_ = static_cast<std::uint32_t>(bits) & mask_;
        } else if (s32_) {
            *s32_ = field_.type == FieldType::s8    ? static_cast<std::int8_t>(bits)
                    : field_.type == FieldType::s16 ? static_cast<std::int16_t>(bits)
                                                    : static_cast<std::int32_t>(bits);
        } else {
            *real_ = field_.type == FieldType::f64
                         ? std::bit_cast<double>(bits)
                         : std::bit_cast<float>(static_cast<std::uint32_t>(bits));
        }
    }

private:
    const Field field_;
    const std::uint32_t mask_ =
        size_of(field_.type) >= 4 ? UINT32_MAX : (1U << 8 * size_of(field_.type)) - 1;
    std::unique_ptr<Pin<std::uint32_t>> u32_;
    std::unique_ptr<Pin<std::int32_t>> s32_;
    std::unique_ptr<Pin<double>> real_;
};

/// A message that this node sends.
class SentMessage {
public:
    SentMessage(hal::Component& c, const hal::Function& f, const hal::Function& receive,
                const Message& m)
        : message_(m),
          send_(c, f, (m.name + ".send").c_str(),
                m.event ? "rising edge: queues the message" : "the message is sent in its turn",
                {.initial = !m.event}),
          sent_(c, receive, (m.name + ".sent").c_str(), "frames of this message sent") {
        for (const Field& field : m.fields) {
            fields_.emplace_back(c, f, m.name + "." + field.name, field);
        }
        if (m.fields.empty() && m.bytes > 0) {
            data_ = std::make_unique<hal::In<std::uint64_t>>(c, f, (m.name + ".data").c_str(),
                                                             "data, little endian");
        }
    }
    std::uint32_t id() const noexcept { return message_.id; }
    void begin() noexcept {
        next_ = INT64_MIN;
        was_sending_ = false;
    }
    void sent() noexcept { sent_ = sent_ + 1; }

    /// Queues the message when it is due. [realtime]
    void transmit(Station& station, Time now) noexcept {
        const bool send = send_.get();
        const bool rises = send && !was_sending_;
        was_sending_ = send;
        if (message_.event) {
            if (rises) {
                station.send(frame(), false);
            }
            return;
        }
        if (!send) {
            next_ = INT64_MIN;
            return station.withdraw(message_.id);
        }
        if (message_.period > 0 && station.table().owner(station.mode(), message_.id) == nullptr) {
            if (next_ == INT64_MIN) {
                next_ = now;
            }
            if (now < next_) return;
            next_ += (now - next_) / message_.period * message_.period + message_.period;
        }
        if (station.state() == State::running) {
            station.send(frame(), true);
        }
    }

private:
    can::Frame frame() const noexcept {
        can::Frame f;
        f.id = message_.id;
        f.length = static_cast<std::uint8_t>(message_.bytes);
        for (const auto& field : fields_) {
            field.encode(f);
        }
        if (data_) {
            for (std::uint32_t i = 0; i < message_.bytes; ++i) {
                f.data[i] = static_cast<std::uint8_t>(data_->get() >> 8 * i);
            }
        }
        return f;
    }
    const Message& message_;
    hal::In<bool> send_;
    hal::Out<std::uint32_t> sent_;
    std::deque<FieldPin<hal::In>> fields_;
    std::unique_ptr<hal::In<std::uint64_t>> data_;
    Time next_ = INT64_MIN;
    bool was_sending_ = false;
};

/// A message of another node.
class ReceivedMessage {
public:
    ReceivedMessage(hal::Component& c, const hal::Function& f, const Message& m)
        : message_(m),
          fresh_(c, f, (m.name + ".fresh").c_str(), "the message has arrived since the last cycle",
                 {.safe = false}),
          received_(c, f, (m.name + ".received").c_str(), "frames of this message received"),
          age_(c, f, (m.name + ".age").c_str(),
               "time since the message was sent; 0: never received", {.unit = "s"}),
          interval_(c, f, (m.name + ".interval").c_str(),
                    "time between the begins of the last two frames", {.unit = "us"}) {
        for (const Field& field : m.fields) {
            fields_.emplace_back(c, f, m.name + "." + field.name, field);
        }
        if (m.fields.empty() && m.bytes > 0) {
            data_ = std::make_unique<hal::Out<std::uint64_t>>(c, f, (m.name + ".data").c_str(),
                                                              "data, little endian");
        }
    }
    void begin() noexcept {
        last_ = INT64_MIN;
        is_fresh_ = false;
    }

    void arrived(const can::Frame& frame, Time begin) noexcept {
        if (frame.length < message_.bytes || frame.remote) return;
        const std::uint64_t data = data_of(frame);
        for (auto& field : fields_) {
            field.decode(data);
        }
        if (data_) {
            *data_ =
                message_.bytes >= 8 ? data : data & ((std::uint64_t{1} << 8 * message_.bytes) - 1);
        }
        if (last_ != INT64_MIN) {
            interval_ = static_cast<double>(begin - last_) * 1e-3;
        }
        last_ = begin;
        is_fresh_ = true;
        received_ = received_ + 1;
    }
    /// Shows the age, once a cycle behind all arrivals. [realtime]
    void show(Time now) noexcept {
        fresh_ = is_fresh_;
        is_fresh_ = false;
        if (last_ != INT64_MIN) {
            age_ = static_cast<double>(now - last_) * 1e-9;
        }
    }

private:
    const Message& message_;
    hal::Out<bool> fresh_;
    hal::Out<std::uint32_t> received_;
    hal::Out<double> age_, interval_;
    std::deque<FieldPin<hal::Out>> fields_;
    std::unique_ptr<hal::Out<std::uint64_t>> data_;
    Time last_ = INT64_MIN;
    bool is_fresh_ = false;
};

}  // namespace hal::scocan
