// SPDX-License-Identifier: MIT
#include "slave_bus.hpp"

#include <algorithm>

#include "modbus/config/plan.hpp"

namespace hal::modbus {

namespace {

constexpr std::int64_t tick_ns = 10'000'000;

}  // namespace

SlaveBus::SlaveBus(const Bus& bus) : bus_(bus) {
    for (const Slave& slave : bus.slaves) {
        slaves_.emplace_back(slave);
    }
}

void SlaveBus::attach(line::Line& line) {
    line_ = &line;
    framing_ = bus_.framing_on(line.description());
    silence_ns_ = line.description().is_stream ? 0 : silence_ns(bus_.line);
}

EmulatedSlave* SlaveBus::find(std::uint8_t unit) {
    for (EmulatedSlave& slave : slaves_) {
        if (slave.config().unit == unit) return &slave;
    }
    return nullptr;
}

bool SlaveBus::dialect(std::uint8_t unit) {
    const EmulatedSlave* const slave = find(unit);
    return slave != nullptr && slave->is_huanyang();
}

std::int64_t SlaveBus::work(std::int64_t now_ns) {
    if (begin_ns_ == 0) {
        begin_ns_ = now_ns;
    }
    for (EmulatedSlave& slave : slaves_) {
        slave.advance(now_ns);
    }
    if (!line_->is_open(now_ns)) {
        buffer_.clear();
        pending_.clear();
        return now_ns + tick_ns;
    }
    // bytes before a silence do not belong to the next frame
    const bool is_stale = framing_ == Framing::rtu && !buffer_.empty() &&
                          now_ns - last_byte_ns_ > std::max<std::int64_t>(silence_ns_, 20'000'000);
    if (is_stale) {
        buffer_.clear();
    }
    while (const std::size_t count = line_->receive(buffer_.free_space(), now_ns)) {
        last_byte_ns_ = now_ns;
        disturb(buffer_.free_space().first(count), now_ns);
        buffer_.added(count);
        if (buffer_.free_space().empty()) break;
    }
    while (!buffer_.empty()) {
        Found found;
        const Scan result =
            scan(framing_, Role::requests, dialect(buffer_.span()[0]), buffer_.span(), found);
        if (result == Scan::incomplete) break;
        if (result == Scan::corrupt) {
            buffer_.clear();
            break;
        }
        serve(found, now_ns);
        buffer_.drop(found.length);
    }
    if (buffer_.free_space().empty()) {
        buffer_.clear();
    }
    std::int64_t next = now_ns + tick_ns;
    for (auto at = pending_.begin(); at != pending_.end();) {
        if (at->at_ns <= now_ns) {
            disturb({at->frame.bytes.data(), at->frame.size}, now_ns);
            line_->send(at->frame.span(), now_ns);
            at = pending_.erase(at);
        } else {
            next = std::min(next, at->at_ns);
            ++at;
        }
    }
    return next;
}

bool SlaveBus::hits(SlaveFault& fault, std::uint8_t unit, std::int64_t now_ns) const {
    if (fault.unit != 0 && fault.unit != unit) return false;
    return is_in_time(fault, now_ns) && ++fault.matches % fault.every == 0;
}

bool SlaveBus::is_in_time(const SlaveFault& fault, std::int64_t now_ns) const {
    const std::int64_t since = now_ns - begin_ns_;
    return fault.is_active && since >= fault.from_ns && since < fault.until_ns;
}

/// Each byte that noise strikes gets another value.
void SlaveBus::disturb(std::span<std::uint8_t> bytes, std::int64_t now_ns) {
    for (const SlaveFault& fault : faults_) {
        if (fault.kind != FaultKind::noise || !is_in_time(fault, now_ns)) continue;
        for (std::uint8_t& byte : bytes) {
            if (!random_.draw_bool(fault.share)) continue;
            byte = static_cast<std::uint8_t>(byte ^ (1 + random_.draw() % 255));
        }
    }
}

/// Lets the slave that a request addresses answer it, with the faults that are active. A broadcast
/// reaches all of them and is not answered.
void SlaveBus::serve(const Found& found, std::int64_t now_ns) {
    if (found.unit == broadcast_unit) {  // a broadcast is not answered
        ++requests_;
        for (EmulatedSlave& slave : slaves_) {
            slave.answer(found.pdu);
        }
        return;
    }
    EmulatedSlave* const slave = find(found.unit);
    if (slave == nullptr) return;
    ++requests_;
    std::uint8_t unit = found.unit;
    std::int64_t at = now_ns + thinking_ns_ + silence_ns_;
    bool corrupt = false;
    bool half = false;
    Pdu exception;
    for (SlaveFault& fault : faults_) {
        if (!hits(fault, found.unit, now_ns)) continue;
        switch (fault.kind) {
        case FaultKind::noise: break;  // of the bytes
        case FaultKind::silence: return;
        case FaultKind::late: at += fault.late_ns; break;
        case FaultKind::corrupt: corrupt = true; break;
        case FaultKind::wrong_unit: unit = static_cast<std::uint8_t>(unit % max_unit + 1); break;
        case FaultKind::half: half = true; break;
        case FaultKind::exception:
            exception.add8(found.pdu[0] | exception_flag);
            exception.add8(4);
            break;
        }
    }
    const Pdu answer = exception.size != 0 ? exception : slave->answer(found.pdu);
    if (answer.size == 0) return;
    Frame frame = encode(framing_, unit, found.transaction, answer);
    if (corrupt) {
        frame.bytes[frame.size / 2] = static_cast<std::uint8_t>(frame.bytes[frame.size / 2] ^ 0x10);
    }
    if (half) {
        frame.size /= 2;
    }
    pending_.push_back({at, frame});
}

}  // namespace hal::modbus
