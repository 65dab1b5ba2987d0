// SPDX-License-Identifier: MIT
#include "srdo.hpp"

#include <algorithm>

namespace hal::canopen {

namespace {
constexpr std::uint16_t gfc_index = 0x1300;
constexpr std::uint16_t communication = 0x1300;
constexpr std::uint16_t mapping_base = 0x1380;

constexpr std::uint16_t valid_index = 0x13fe;
constexpr std::uint16_t signatures = 0x13ff;
constexpr std::uint32_t gfc_id = 0x001;
// "communication"; the manufacturer bytes carry SRDO number and fault
constexpr std::uint16_t emergency = 0x8100;

std::uint64_t data_of(const Frame& f) noexcept { return load<std::uint64_t>(f.data.data()); }
}  // namespace

const char* to_string(SrdoFault fault) noexcept {
    constexpr const char* texts[] = {"no fault",
                                     "no SRDO within the SCT",
                                     "second frame missing within the SRVT",
                                     "frames out of order",
                                     "frame length does not match the mapping",
                                     "second frame is not the inverse of the first",
                                     "global fail-safe command received",
                                     "its objects are not complementary, so nothing is sent"};
    return texts[static_cast<std::size_t>(fault)];
}

Srdos::Srdos(Dictionary& dictionary, FrameQueue& out, Emcy& emcy)
    : dictionary_(dictionary), out_(out), emcy_(emcy) {
    of_number_.fill(-1);
    of_id_.fill(-1);
    for (unsigned n = 1; n <= max_srdos; ++n) {
        const auto index = static_cast<std::uint16_t>(communication + n);

        const auto mapping = static_cast<std::uint16_t>(mapping_base + n);
        if (dictionary.find(index, 1) == nullptr) continue;
        std::size_t capacity = 0;
        for (const auto& e : dictionary.object(mapping)) {
            capacity = std::max<std::size_t>(capacity, e.sub);
        }
        of_number_[n] = static_cast<std::int8_t>(srdos_.size());
        srdos_.emplace_back(n, (capacity + 1) / 2);
        dictionary.handle(index, *this);
        dictionary.handle(mapping, *this);
    }
    dictionary.handle(valid_index, *this);
    dictionary.handle(signatures, *this);
}

Srdos::Srdo* Srdos::find(unsigned number) noexcept {
    if (number >= of_number_.size() || of_number_[number] < 0) return nullptr;
    return &srdos_[static_cast<std::size_t>(of_number_[number])];
}

std::uint16_t Srdos::signature(unsigned number) const noexcept {
    const auto index = static_cast<std::uint16_t>(communication + number);

    const auto mapping = static_cast<std::uint16_t>(mapping_base + number);
    std::uint16_t crc = 0;
    const auto add = [&](std::uint16_t at, std::uint8_t sub) {
        if (const Entry* e = dictionary_.find(at, sub); e != nullptr) {
            crc = crc16(e->bytes(), crc);
        }
    };
    for (const std::uint8_t sub : std::initializer_list<std::uint8_t>{1, 2, 3, 5, 6}) {
        add(index, sub);
    }
    add(mapping, 0);
    const auto count = dictionary_.get<std::uint8_t>(mapping, 0, 0);
    for (unsigned n = 1; n <= count; ++n) {
        const auto sub = static_cast<std::uint8_t>(n);
        crc = crc16({&sub, 1}, crc);
        add(mapping, sub);
    }
    return crc;
}

Abort Srdos::configure(Srdo& s) noexcept {
    read_communication(s);
    s.plain.clear();
    s.inverted.clear();
    if (s.direction == SrdoDirection::none) return Abort::none;
    if (!is_valid(s)) return Abort::value;
    return map(s);
}

void Srdos::read_communication(Srdo& s) const noexcept {
    const auto index = static_cast<std::uint16_t>(communication + s.number);
    s.direction = static_cast<SrdoDirection>(dictionary_.get<std::uint8_t>(index, 1, 0));
    s.cycle = dictionary_.get<std::uint16_t>(index, 2, 0) * millisecond;
    s.validation = dictionary_.get<std::uint8_t>(index, 3, 0) * millisecond;
    s.cob = dictionary_.get<std::uint32_t>(index, 5, 0);
}

bool Srdos::is_valid(const Srdo& s) const noexcept {
    const bool in_range = s.cob >= first_id && s.cob < last_id && s.cob % 2 == 1;
    const auto index = static_cast<std::uint16_t>(communication + s.number);
    const auto inverted_cob = dictionary_.get<std::uint32_t>(index, 6, 0);
    if (!in_range || inverted_cob != s.cob + 1 || s.cycle == 0) return false;
    if (s.direction == SrdoDirection::receives && s.validation == 0) return false;
    return std::none_of(srdos_.begin(), srdos_.end(), [&](const Srdo& other) {
        return &other != &s && other.direction != SrdoDirection::none && other.cob == s.cob;
    });
}

Abort Srdos::map(Srdo& s) noexcept {
    const auto mapping = static_cast<std::uint16_t>(mapping_base + s.number);
    const unsigned count = dictionary_.get<std::uint8_t>(mapping, 0, 0);
    if (count == 0 || count % 2 != 0 || count > 128) return Abort::pdo_length;
    std::array<std::uint32_t, 64> plain{}, inverted{};
    for (unsigned n = 0; n < count / 2; ++n) {
        plain[n] = dictionary_.get<std::uint32_t>(mapping, static_cast<std::uint8_t>(2 * n + 1), 0);
        inverted[n] =
            dictionary_.get<std::uint32_t>(mapping, static_cast<std::uint8_t>(2 * n + 2), 0);
        // both objects of a pair have the same length
        if (((plain[n] ^ inverted[n]) & 0xff) != 0) return Abort::pdo_length;
    }
    const bool received = s.direction == SrdoDirection::receives;
    const Abort why = s.plain.build(dictionary_, {plain.data(), count / 2}, received);
    if (why != Abort::none) return why;
    return s.inverted.build(dictionary_, {inverted.data(), count / 2}, received);
}

Abort Srdos::configure() noexcept {
    of_id_.fill(-1);
    for (auto& s : srdos_) {
        s.direction = SrdoDirection::none;
    }
    for (std::size_t n = 0; n < srdos_.size(); ++n) {
        auto& s = srdos_[n];
        if (const auto why = configure(s); why != Abort::none) return why;
        if (s.direction == SrdoDirection::none) continue;
        if (dictionary_.get<std::uint16_t>(signatures, s.number, 0) != signature(s.number)) {
            return Abort::value;
        }
        if (s.direction != SrdoDirection::receives) continue;
        of_id_[s.cob - first_id] = of_id_[s.cob + 1 - first_id] = static_cast<std::int8_t>(n);
    }
    return Abort::none;
}

void Srdos::reset(std::uint8_t node_id) noexcept {
    operational_ = valid_ = false;
    if (srdos_.empty()) return;
    if (node_id >= 1 && node_id <= 64 &&
        dictionary_.get<std::uint32_t>(communication + 1, 5, 1) == 0) {
        dictionary_.set(communication + 1, 5, std::uint32_t{0xff} + 2U * node_id);
        dictionary_.set(communication + 1, 6, std::uint32_t{0x100} + 2U * node_id);
    }
    if (dictionary_.get<std::uint8_t>(valid_index, 0, 0) == valid_mark) {
        valid_ = configure() == Abort::none;
    }
    if (!valid_) {
        dictionary_.set(valid_index, 0, std::uint8_t{0});
    }
}

Abort Srdos::writing(Entry& e, std::span<const std::uint8_t> value) noexcept {
    if (operational_) return Abort::device_state;
    if (e.index == valid_index) {
        return value[0] == valid_mark ? configure() : abort_if(value[0] != 0, Abort::value);
    }
    if (e.index > mapping_base || e.sub == 0) return Abort::none;
    const auto is_srdo_id = [&](std::uint32_t odd) {
        const auto cob = load<std::uint32_t>(value.data());
        return cob >= first_id && cob <= last_id && cob % 2 == odd;
    };
    switch (e.sub) {
    case 1: return abort_if(value[0] > 2, Abort::value);
    case 2: return abort_if(load<std::uint16_t>(value.data()) == 0, Abort::value);
    case 5: return abort_if(!is_srdo_id(1), Abort::value);
    case 6: return abort_if(!is_srdo_id(0), Abort::value);
    default: return Abort::none;
    }
}

void Srdos::written(Entry& e) noexcept {
    if (e.index == valid_index) {
        valid_ = *e.data == valid_mark;
        return;
    }
    valid_ = false;  // EN 50325-5: after a parameter change 13FEh must be written again
    dictionary_.set(valid_index, 0, std::uint8_t{0});
}

void Srdos::begin(Srdo& s, Time now) noexcept {
    s.heard = s.half = false;
    s.last = now;
    s.next = now;
    if (s.fault != SrdoFault::none) {
        emcy_.clear(emergency, s.number);
    }
    s.fault = SrdoFault::none;
}

void Srdos::set_operational(bool operational, Time now) noexcept {
    now_ = now;
    if (operational == operational_) return;
    operational_ = operational;
    for (auto& s : srdos_) {
        begin(s, now);
    }
}

void Srdos::expect(unsigned number, bool on, Time now) noexcept {
    auto* s = find(number);
    if (s == nullptr || (on && s->strict) || (!on && s->ignored)) return;
    s->strict = on;
    s->ignored = !on;
    s->heard = s->half = false;
    s->last = now;
}

void Srdos::acknowledge(unsigned number, Time now) noexcept {
    if (auto* s = find(number); s != nullptr && s->fault != SrdoFault::none) {
        begin(*s, now);
    }
}

bool Srdos::trigger(unsigned number) noexcept {
    auto* s = find(number);
    return s != nullptr && s->direction == SrdoDirection::sends && (s->now = true);
}

void Srdos::derive_inverted(unsigned number) noexcept {
    if (auto* s = find(number); s != nullptr) {
        s->derived = true;
    }
}

void Srdos::fail(Srdo& s, SrdoFault fault, Time now) noexcept {
    s.half = false;
    if (s.fault != SrdoFault::none) return;
    s.fault = fault;
    emcy_.raise(emergency, error_communication, {s.number, static_cast<std::uint8_t>(fault)},
                s.number);
    if (events_ != nullptr) {
        events_->on_srdo_fault(s.number, fault, now);
    }
}

void Srdos::take(Srdo& s, const Frame& f, bool is_second, Time now) noexcept {
    if (f.length != s.plain.bytes()) return fail(s, SrdoFault::length, now);
    if (s.half != is_second) return fail(s, SrdoFault::order, now);
    s.half = !is_second;
    if (!is_second) {
        s.first = data_of(f);
        s.first_at = now;
        return;
    }
    if (now - s.first_at > s.validation) return fail(s, SrdoFault::incomplete, now);
    const auto data = data_of(f);
    if (((s.first ^ data) & ones(8U * f.length)) != ones(8U * f.length)) {
        return fail(s, SrdoFault::complement, now);
    }
    if (too_late(s, now)) return fail(s, SrdoFault::late, now);
    s.heard = true;
    s.last = now;
    ++s.count;
    s.plain.unpack(s.first);
    s.inverted.unpack(data);
    if (events_ != nullptr) {
        events_->on_srdo(s.number, now);
    }
}

bool Srdos::handle(const Frame& f, Time now) noexcept {
    if (srdos_.empty() || f.extended || f.remote || f.id > last_id) return false;
    now_ = now;
    if (f.id == gfc_id) {
        if (fail_safe_enabled() && f.length == 0) {
            on_fail_safe(now);
        }
        return true;
    }
    if (f.id < first_id || of_id_[f.id - first_id] < 0) return false;
    auto& s = srdos_[static_cast<std::size_t>(of_id_[f.id - first_id])];
    // After a fault all data is invalid until the fault is acknowledged.
    if (operational_ && valid_ && !s.suspended()) {
        take(s, f, f.id != s.cob, now);
    }
    return true;
}

/// Returns whether the global fail-safe command is sent and obeyed (1300h).
bool Srdos::fail_safe_enabled() const noexcept {
    return operational_ && dictionary_.get<std::uint8_t>(gfc_index, 0, 0) != 0;
}

void Srdos::on_fail_safe(Time now) noexcept {
    if (events_ != nullptr) {
        events_->on_fail_safe(now);
    }
    for (auto& s : srdos_) {
        if (s.direction == SrdoDirection::receives && !s.ignored) {
            fail(s, SrdoFault::fail_safe, now);
        }
    }
}

void Srdos::send(Srdo& s, Time now) noexcept {
    const auto bits = ones(8U * s.plain.bytes());
    const auto plain = s.plain.pack();
    // Bits beyond the mapping are sent as 0 and as 1, so that the frames are complementary in all
    // bits.
    const auto inverted =
        s.derived ? ~plain & bits : s.inverted.pack() | (bits & ~ones(s.inverted.bits()));
    if ((plain ^ inverted) != bits) return fail(s, SrdoFault::own_data, now);
    if (out_.space() < 2) {
        return;  // a single frame would be a fault at the receiver
    }
    Frame frame = make_frame(s.cob, s.plain.bytes());
    store(frame.data.data(), plain);
    out_.push(frame);
    frame.id = s.cob + 1;
    store(frame.data.data(), inverted);
    out_.push(frame);
    ++s.count;
    s.now = false;
    s.next = now >= s.next + s.cycle || now < s.next ? now + s.cycle : s.next + s.cycle;
}

void Srdos::poll(Time now) noexcept {
    if (srdos_.empty()) return;
    now_ = now;
    if (!operational_ || !valid_) return;
    for (auto& s : srdos_) {
        if (s.suspended()) continue;
        if (s.direction == SrdoDirection::receives) {
            check_times(s, now);
        } else if (s.direction == SrdoDirection::sends && (s.now || now >= s.next)) {
            send(s, now);
        }
    }
}

/// Fails if the second frame, or the next pair of frames, is overdue.
void Srdos::check_times(Srdo& s, Time now) noexcept {
    if (s.half && now - s.first_at > s.validation) {
        fail(s, SrdoFault::incomplete, now);
    } else if (too_late(s, now)) {
        fail(s, SrdoFault::late, now);
    }
}

bool Srdos::send_fail_safe() noexcept {
    return fail_safe_enabled() && out_.push(make_frame(gfc_id, 0));
}

Srdos::Status Srdos::status(unsigned number) const noexcept {
    const auto* s = const_cast<Srdos*>(this)->find(number);
    if (s == nullptr) return {};
    const bool active = valid_ && operational_ && s->direction != SrdoDirection::none;
    const bool good = active && s->heard && !s->suspended();
    return {true, active, good, s->direction, s->fault, s->count};
}

}  // namespace hal::canopen
