// SPDX-License-Identifier: MIT
// The pins of one message: its fields, and those with which its sender sends it and its receivers
// see it.
#pragma once

#include <algorithm>
#include <memory>

#include "fieldbus/messages/field_pins.hpp"
#include "fieldbus/scocan/station/station.hpp"
#include "hal/age.hpp"
#include "hal/component.hpp"

namespace hal::scocan {

/// Returns how a field is coded. [any]
inline PinCodec codec_of(FieldType type) noexcept {
    using Format = PinCodec::Format;
    const unsigned bits = 8 * size_of(type);
    switch (type) {
    case FieldType::s8:
    case FieldType::s16:
    case FieldType::s32: return {Format::signed_integer, bits};
    case FieldType::f32:
    case FieldType::f64: return {Format::real, bits};
    default: return {Format::unsigned_integer, bits};
    }
}

/// Declares the pins of the fields of a message. [setup]
template <hal_dir direction>
void declare_fields(messages::FieldPins<direction>& pins, hal::Component& c, const hal::Function& f,
                    const Message& m) {
    for (const Field& field : m.fields) {
        pins.declare(c, &f, m.name + "." + field.name,
                     std::string("field ") + field.name + ", " + to_string(field.type), field.at,
                     codec_of(field.type));
    }
}

/// Returns the counter of a message that has real fields, else nullptr. [setup]
template <hal_dir direction>
std::unique_ptr<hal::Out<std::uint32_t>> invalid_counter(
    hal::Component& c, const hal::Function& f, const Message& m,
    const messages::FieldPins<direction>& fields, const char* doc) {
    if (!fields.has_reals()) return nullptr;
    return std::make_unique<hal::Out<std::uint32_t>>(c, f, (m.name + ".invalid").c_str(), doc);
}

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
        declare_fields(fields_, c, f, m);
        invalid_ = invalid_counter(
            c, f, m, fields_, "messages with a field that was not finite: its last value was sent");
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
    can::Frame frame() noexcept {
        can::Frame f;
        f.id = message_.id;
        f.length = static_cast<std::uint8_t>(message_.bytes);
        if (fields_.transmit(f.data)) {
            *invalid_ = *invalid_ + 1;
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
    messages::FieldPins<HAL_DIR_IN> fields_;
    std::unique_ptr<hal::Out<std::uint32_t>> invalid_;
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
          age_(
              c, f, (m.name + ".age").c_str(),
              "time since the message was sent; infinite: never received, or the thread is stopped",
              {.initial = infinite_age, .unit = "s", .safe = infinite_age}),
          interval_(c, f, (m.name + ".interval").c_str(),
                    "time between the begins of the last two frames", {.unit = "us"}) {
        declare_fields(fields_, c, f, m);
        invalid_ = invalid_counter(c, f, m, fields_,
                                   "messages with a field that was not finite: its pin was kept");
        if (m.fields.empty() && m.bytes > 0) {
            data_ = std::make_unique<hal::Out<std::uint64_t>>(c, f, (m.name + ".data").c_str(),
                                                              "data, little endian");
        }
    }
    void begin() noexcept {
        last_ = INT64_MIN;
        is_fresh_ = false;
    }

    void receive(const can::Frame& frame, Time begin) noexcept {
        if (frame.length < message_.bytes || frame.remote) return;
        if (fields_.show(frame.data)) {
            *invalid_ = *invalid_ + 1;
        }
        if (data_) {
            *data_ = read_bits(frame.data, 0, 8 * std::min(message_.bytes, 8U));
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
    messages::FieldPins<HAL_DIR_OUT> fields_;
    std::unique_ptr<hal::Out<std::uint32_t>> invalid_;
    std::unique_ptr<hal::Out<std::uint64_t>> data_;
    Time last_ = INT64_MIN;
    bool is_fresh_ = false;
};

}  // namespace hal::scocan
