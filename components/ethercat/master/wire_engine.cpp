// SPDX-License-Identifier: MIT
#include "ethercat/master/wire_engine.hpp"

#include <algorithm>
#include <utility>

#include "ethercat/wire/registers.hpp"

namespace hal::ethercat::master {

namespace {

constexpr std::size_t first_datagram = ethernet_header_bytes + ecat_header_bytes;
constexpr std::size_t frame_overhead = 24;
                      /// preamble, check sequence, gap; header and counter

constexpr std::size_t datagram_overhead = datagram_header_bytes + 2;
constexpr std::int64_t acyclic_timeout_ns = 2'000'000;

constexpr bool counts_positions(Command c) noexcept {
    return c == Command::aprd || c == Command::apwr || c == Command::aprw || c == Command::armw;
}
/// The data sent does not matter, and bytes that no slave touches must return as zeros.
constexpr bool only_reads(Command c) noexcept {
    return c == Command::aprd || c == Command::fprd || c == Command::brd || c == Command::lrd ||
           c == Command::nop;
}

/// Returns whether a frame of another program is that of a master: it exchanges process data,
/// distributes time or sets registers. `hal ethercat` beside a running master only reads, for which
/// it sets those of the EEPROM and latches receive times.
bool controls_slaves(std::span<const std::uint8_t> bytes) noexcept {
    const auto command = static_cast<Command>(bytes[first_datagram]);
    if (is_logical(command) || command == Command::frmw || command == Command::armw) return true;
    const auto address = get<std::uint16_t>(&bytes[first_datagram + 4]);
    const bool of_reading =
        (address >= registers::eeprom_configuration && address < registers::eeprom_data + 8) ||
        address == registers::dc_receive_time;
    return !only_reads(command) && !of_reading;
}

/// Returns whether an answer has the Ethertype, type and length of a frame.
bool has_length_of(std::span<const std::uint8_t> answer,
                   std::span<const std::uint8_t> frame) noexcept {
    return std::memcmp(&answer[ethernet_header_bytes - 2], &frame[ethernet_header_bytes - 2], 4) ==
           0;
}

/// Returns whether a slave counted in the frame.
bool passed_a_slave(std::span<const std::uint8_t> bytes) noexcept {
    for (std::size_t at = first_datagram; at + datagram_overhead <= bytes.size();) {
        const auto length = get<std::uint16_t>(&bytes[at + 6]);
        const std::size_t counter = at + datagram_header_bytes + (length & 0x7ff);
        if (counter + 2 > bytes.size()) return false;
        if (get<std::uint16_t>(&bytes[counter]) != 0) return true;
        if ((length & 0x8000) == 0) return false;
        at = counter + 2;
    }
    return false;
}

/// Returns whether a frame is one of those that Master::shut_down() sends.
bool asks_for_safeop(std::span<const std::uint8_t> bytes) noexcept {
    if (bytes.size() < first_datagram + datagram_overhead) return false;
    const auto command = static_cast<Command>(bytes[first_datagram]);
    const auto address = get<std::uint16_t>(&bytes[first_datagram + 4]);
    const auto state = get<std::uint16_t>(&bytes[first_datagram + datagram_header_bytes]);
    return command == Command::fpwr && address == registers::al_control &&
           state == static_cast<std::uint16_t>(State::safeop);
}

}  // namespace

void WireEngine::attach(ethernet::Port& primary, ethernet::Port* backup) {
    primary_ = &primary;
    backup_ = backup;
    // Slaves work at 100 Mbit/s; only an emulated line is faster. What does not fit into a cycle
    // would delay the process data of the next.
    const std::int64_t speed = primary.statistics().speed != 0 ? primary.statistics().speed : 100;
    wire_bytes_ = static_cast<std::size_t>(setup_.cycle_ns * speed / 8000 * 4 / 5);
    // Masters that begin at the same time must not take each other's frames for their own.
    for (const std::uint8_t byte : primary.address()) {
        next_index_ = static_cast<std::uint8_t>(next_index_ * 31 + byte);
    }
    if (backup != nullptr) {
        halves_.resize(image_.datagrams().size() + 1 + setup_.slaves.size());
    }
}

void WireEngine::add(Channel& channel) { channels_.push_back(&channel); }

double WireEngine::max_task_share() const noexcept {
    double share = 0;
    for (const Channel* channel : channels_) {
        share = std::max(share, channel->max_task_share());
    }
    return share;
}

void WireEngine::ready() {
    active_.assign((channels_.size() + 7) / 8 * 8, 0);
    for (std::size_t n = 0; n < channels_.size(); ++n) {
        channels_[n]->set_active_flag(&active_[n]);
    }
    acyclic_.resize(4 * max_acyclic);
}

int WireEngine::take_index() noexcept {
    for (std::size_t tries = 0; tries < indexes; ++tries) {
        const std::uint8_t index = next_index_++;
        Flight& f = flights_[index];
        if (f.kind != Flight::Kind::none && f.kind != Flight::Kind::expired) continue;
        f = {};
        return index;
    }
    return -1;
}

bool WireEngine::idle() const noexcept {
    return std::none_of(flights_.begin(), flights_.end(),
                        [](const Flight& f) { return f.kind == Flight::Kind::cyclic; });
}

std::uint8_t WireEngine::send(std::span<const std::uint8_t> frame, bool backup) noexcept {
    std::uint8_t copies = 0;
    const auto out = [&](ethernet::Port* port) {
        if (port->send(frame, {}, now_ns_) == ethernet::Sent::queued) {
            ++copies;
            ++status_.frames_sent;
        } else {
            ++status_.send_failures;
        }
    };
    out(primary_);
    if (backup && backup_ != nullptr) {
        out(backup_);
    }
    return copies;
}

void WireEngine::transmit(std::int64_t now_ns, bool process_data, bool all_domains,
                          unsigned acyclic_frames, std::uint64_t dc_time_ns) noexcept {
    // Another thread takes the slaves out of OP at this moment.
    if (sending_.test_and_set(std::memory_order_acquire)) return;
    sent_after_ns_ = now_ns - cycle_start_ns_;
    now_ns_ = now_ns;
    Allowance allowance{acyclic_frames, wire_bytes_, true};
    if (process_data) {
        send_process_data(all_domains, dc_time_ns, allowance);
        ++cycle_;
    }
    send_acyclic(allowance);
    sending_.clear(std::memory_order_release);
}

bool WireEngine::is_due(const ProcessImage::Frame& frame, bool all_domains) const noexcept {
    return all_domains || frame.every <= 1 || cycle_ % frame.every == 0;
}

void WireEngine::send_process_data(bool all_domains, std::uint64_t dc_time_ns,
                                   Allowance& allowance) noexcept {
    const auto frames = image_.frames();
    std::size_t last = 0;
    for (std::size_t n = 0; n < frames.size(); ++n) {
        if (is_due(frames[n], all_domains)) {
            last = n;
        }
    }
    // Frames behind the first one leave later than at this time, and slaves before the reference
    // clock follow it. They distribute it all the same while the first one may be lost.
    const bool first_returned = clock_.fresh;
    std::optional<std::uint64_t> time = dc_time_ns;
    // While slaves start, so much waits that frames are full anyway.
    const bool carries = !all_domains;
    for (std::size_t n = 0; n <= last; ++n) {
        ProcessImage::Frame& frame = frames[n];
        if (!is_due(frame, all_domains)) continue;
        const int index = take_index();
        if (index < 0) return;
        image_.fill(frame, static_cast<std::uint8_t>(index), time);
        if (first_returned) {
            time.reset();
        }
        allowance.bytes -= std::min<std::size_t>(allowance.bytes, frame.size + frame_overhead);
        Flight& f = flights_[static_cast<std::size_t>(index)];
        f.place = static_cast<std::uint16_t>(n);
        if (n == last && carries) {
            f.carrier = load(frame, static_cast<std::uint8_t>(index), allowance);
        }
        send_process_data(f);
    }
}

void WireEngine::send_process_data(Flight& f) noexcept {
    f.sent_ns = now_ns_;
    if (f.carrier != nullptr) {
        f.copies = send({f.carrier->bytes.data(), f.carrier->size}, false);
    } else {
        const ProcessImage::Frame& frame = image_.frames()[f.place];
        f.copies = send({frame.bytes.data(), frame.size}, true);
    }
    if (f.copies != 0) {
        f.kind = Flight::Kind::cyclic;
        ++in_flight_;
    } else if (f.carrier != nullptr) {
        await_carried(f);
        ++in_flight_;
    }
}

/// Goes on to wait for the datagrams of channels that a frame carries, without its process data.
void WireEngine::await_carried(Flight& f) noexcept {
    f.kind = Flight::Kind::acyclic;
    f.place = static_cast<std::uint16_t>(f.carrier - acyclic_.data());
}

void WireEngine::send_now(std::span<const std::uint8_t> frame) noexcept {
    if (sending_.test_and_set(std::memory_order_acquire)) return;
    for (ethernet::Port* port : {primary_, backup_}) {
        if (port == nullptr) continue;
        const ethernet::Sent sent = port->send(frame, {}, ethernet::unclocked);
        if (sent == ethernet::Sent::queued) {
            unmatched_.fetch_add(1, std::memory_order_relaxed);
        }
    }
    sending_.clear(std::memory_order_release);
}

WireEngine::AcyclicFrame* WireEngine::free_frame() noexcept {
    const auto found = std::find_if(acyclic_.begin(), acyclic_.end(),
                                    [](const AcyclicFrame& frame) { return frame.free; });
    return found == acyclic_.end() ? nullptr : &*found;
}

/// Returns a copy of a frame with process data and waiting datagrams behind it; nullptr: none waits
/// that has space there.
WireEngine::AcyclicFrame* WireEngine::load(const ProcessImage::Frame& cyclic, std::uint8_t index,
                                           Allowance& allowance) noexcept {
    AcyclicFrame* const carrier = backup_ == nullptr ? free_frame() : nullptr;
    if (carrier == nullptr || !any_waits()) return nullptr;
    std::copy_n(cyclic.bytes.begin(), cyclic.size, carrier->bytes.begin());
    FrameWriter writer = FrameWriter::behind(carrier->bytes, setup_.frame_bytes);
    bool backup = false;
    if (!pack(*carrier, writer, index, backup, allowance)) return nullptr;
    const std::size_t added = carrier->size - cyclic.size;
    allowance.bytes -= std::min(allowance.bytes, added);
    allowance.any = false;
    carrier->free = false;
    return carrier;
}

void WireEngine::send_acyclic(Allowance allowance) noexcept {
    constexpr std::size_t overhead = first_datagram + frame_overhead;
    for (; allowance.frames > 0; --allowance.frames, allowance.any = false) {
        AcyclicFrame* const frame = any_waits() ? free_frame() : nullptr;
        if (frame == nullptr) return;
        const int index = take_index();
        if (index < 0) return;
        allowance.bytes -= std::min(allowance.bytes, overhead);
        FrameWriter writer(frame->bytes, primary_->address());
        bool backup = false;
        if (!pack(*frame, writer, static_cast<std::uint8_t>(index), backup, allowance)) return;
        const std::size_t datagrams = frame->size - first_datagram;
        allowance.bytes -= std::min(allowance.bytes, datagrams);
        Flight& f = flights_[static_cast<std::size_t>(index)];
        f.copies = send({frame->bytes.data(), frame->size}, backup);
        f.place = static_cast<std::uint16_t>(frame - acyclic_.data());
        f.sent_ns = now_ns_;
        f.kind = Flight::Kind::acyclic;
        ++in_flight_;
        frame->free = false;
    }
}

bool WireEngine::any_waits() const noexcept {
    for (std::size_t block = 0; block < active_.size(); block += 8) {
        if (get<std::uint64_t>(&active_[block]) == 0) continue;
        for (std::size_t n = block; n < std::min(block + 8, channels_.size()); ++n) {
            if (active_[n] != 0 && channels_[n]->stage() == Channel::Stage::waiting) return true;
        }
    }
    return false;
}

/// Adds waiting datagrams to a frame, in turn. Those that count positions do not share a frame with
/// others that leave on both ports.
bool WireEngine::pack(AcyclicFrame& frame, FrameWriter& writer, std::uint8_t index, bool& backup,
                      Allowance allowance) noexcept {
    frame.count = 0;
    std::size_t bytes = 0;
    const std::size_t channels = channels_.size();
    const std::size_t begin = next_channel_ < channels ? next_channel_ : 0;
    std::size_t next = begin;
    for (std::size_t n = 0; n < channels && frame.count < max_items; ++n) {
        const std::size_t at = begin + n < channels ? begin + n : begin + n - channels;
        if (active_[at] == 0) continue;
        Channel& channel = *channels_[at];
        if (channel.stage() != Channel::Stage::waiting) continue;
        const bool is_alone = frame.count == 0;
        const bool on_backup = may_use_backup(channel.command());
        if (!is_alone && on_backup != backup) continue;
        const std::size_t needed = channel.length() + datagram_overhead;
        if (bytes + needed > allowance.bytes && !(allowance.any && is_alone)) continue;
        if (first_datagram + bytes + needed > setup_.frame_bytes && !is_alone) continue;
        if (!add_datagram(frame, writer, index, channel)) continue;
        backup = on_backup;
        bytes += needed;
        next = at + 1;
    }
    next_channel_ = next;
    if (frame.count == 0) return false;
    frame.size = static_cast<std::uint16_t>(writer.finish().size());
    return true;
}

/// Datagrams that count positions leave on one port, and do not share a frame with others.
bool WireEngine::may_use_backup(Command command) const noexcept {
    return use_backup_ && backup_ != nullptr && !counts_positions(command);
}

/// Adds the datagram of a channel to a frame. Returns false if it has no space for it.
bool WireEngine::add_datagram(AcyclicFrame& frame, FrameWriter& writer, std::uint8_t index,
                              Channel& channel) noexcept {
    const std::size_t length = channel.length();
    if (length > writer.space() || writer.space() == 0) return false;
    std::uint8_t* const data =
        writer.add(channel.command(), index, channel.address(), channel.length());
    if (data == nullptr) return false;
    if (!only_reads(channel.command())) {
        std::memcpy(data, channel.data(), length);
    }
    const bool counts_slaves = channel.command() == Command::brd &&
                               channel.address() == at_position(0, registers::al_status);
    if (counts_slaves) {
        primary_wkc_ = -1;
    }
    channel.set_sent(now_ns_);
    const auto offset = static_cast<std::uint16_t>(data - frame.bytes.data());
    frame.items[frame.count++] = {&channel, channel.generation(), offset, channel.length()};
    return true;
}

void WireEngine::receive(std::int64_t now_ns) noexcept {
    now_ns_ = cycle_start_ns_ = now_ns;
    clock_.fresh = false;
    receive_frames(*primary_, 0);
    if (backup_ != nullptr) {
        receive_frames(*backup_, 1);
    }
    if (in_flight_ != 0) {
        expire();
    }
    image_.settle();
    wake();
}

void WireEngine::receive_frames(ethernet::Port& port, unsigned number) noexcept {
    while (const auto arrival = port.receive(now_ns_)) {
        arrived(arrival->bytes, number);
    }
}

void WireEngine::arrived(std::span<const std::uint8_t> bytes, unsigned number) noexcept {
    if (bytes.size() < ethernet::smallest_frame || bytes[12] != ethertype >> 8 ||
        bytes[13] != (ethertype & 0xff)) {
        return;
    }
    const std::uint8_t index = bytes[first_datagram + 1];
    Flight& f = flights_[index];
    switch (f.kind) {
    case Flight::Kind::none:
        if (f.merged && is_own(bytes)) {
            ++status_.duplicates;
        } else {
            count_foreign(bytes);
        }
        return;
    case Flight::Kind::expired: return count_late();
    case Flight::Kind::cyclic:
        if (!answers(f, index, bytes)) break;
        if (accept(f, number)) {
            arrived_cyclic(f, bytes);
        }
        return;
    case Flight::Kind::complete:  // the frame that it would be compared with may have left again
        if (accept(f, number)) {
            f.kind = Flight::Kind::none;
            --in_flight_;
        }
        return;
    case Flight::Kind::acyclic: return arrived_acyclic(f, bytes, number);
    }
    count_foreign(bytes);
}

/// Returns whether a frame is a copy of the process data in flight under an index. With a
/// `frame-timeout` longer than a cycle it may have left in an earlier one; the halves of a ring are
/// those of the newest cycle.
bool WireEngine::answers(const Flight& f, std::uint8_t index,
                         std::span<const std::uint8_t> bytes) const noexcept {
    const ProcessImage::Frame& frame = image_.frames()[f.place];
    if (backup_ != nullptr && ProcessImage::left_again(frame, index)) return false;
    if (f.carrier != nullptr) {
        return answers(*f.carrier, bytes) && image_.matches(frame, index, bytes);
    }
    return bytes.size() >= frame.size && has_length_of(bytes, frame.bytes) &&
           image_.matches(frame, index, bytes);
}

void WireEngine::count_late() noexcept {
    ++status_.late;
    missing_ -= missing_ != 0 ? 1 : 0;
}

/// Returns whether a frame has the address of this master as its source.
bool WireEngine::is_own(std::span<const std::uint8_t> bytes) const noexcept {
    // ETG.1000.4: the first slave marks it as locally administered
    constexpr std::uint8_t set_by_slaves = 0x02;
    const auto& address = primary_->address();
    return ((bytes[6] ^ address[0]) & ~set_by_slaves) == 0 &&
           std::equal(address.begin() + 1, address.end(), bytes.begin() + 7);
}

/// Counts a frame whose index is free, or that of another frame. As long as own frames are missing,
/// one with the own address is taken for one of them: it returned after its index was used again.
/// One with another address that passed no slave comes from a master at the far end.
void WireEngine::count_foreign(std::span<const std::uint8_t> bytes) noexcept {
    const bool own = is_own(bytes);
    const bool passed = passed_a_slave(bytes);
    if (own && asks_for_safeop(bytes) && unmatched_.load(std::memory_order_relaxed) != 0) {
        unmatched_.fetch_sub(1, std::memory_order_relaxed);
        return;
    }
    if (missing_ != 0 && passed && own) return count_late();
    ++status_.foreign;
    status_.foreign_control += controls_slaves(bytes) || (!own && !passed) ? 1 : 0;
}

/// Counts a copy of a frame in flight; the second one at the same port is a duplicate.
bool WireEngine::accept(Flight& f, unsigned number) noexcept {
    if ((f.arrivals & 1U << number) != 0 || f.copies == 0) {
        ++status_.duplicates;
        return false;
    }
    ++status_.frames_received;
    f.arrivals = static_cast<std::uint8_t>(f.arrivals | 1U << number);
    --f.copies;
    return true;
}

void WireEngine::arrived_cyclic(Flight& f, std::span<const std::uint8_t> bytes) noexcept {
    const ProcessImage::Frame& frame = image_.frames()[f.place];
    if (backup_ == nullptr) {
        AcyclicFrame* const carrier = f.carrier;
        complete_cyclic(f, bytes.data());
        if (carrier != nullptr) {
            note_reach(*carrier, bytes.data());
            deliver(*carrier, bytes.data());
        }
        return;
    }
    auto& half = halves_[f.place];
    if (!f.merged) {
        std::memcpy(half.data(), bytes.data(), frame.size);
    } else {
        image_.merge(frame, half.data(), bytes.data());
    }
    f.merged = true;
    if (f.copies == 0) {
        complete_cyclic(f, half.data());
    }
}

void WireEngine::complete_cyclic(Flight& f, const std::uint8_t* answer) noexcept {
    const ProcessImage::Frame& frame = image_.frames()[f.place];
    image_.take(frame, answer);
    const std::uint8_t* time = answer + frame.clock_read + datagram_header_bytes;
    if (get<std::uint16_t>(time + 8) != 0 && !clock_.fresh) {
        clock_ = {true, get<std::uint64_t>(time), f.sent_ns, sent_after_ns_};
    }
    f.merged = true;
    if (f.copies != 0) {
        f.kind = Flight::Kind::complete;
        return;
    }
    f.kind = Flight::Kind::none;
    --in_flight_;
}

/// Returns whether a frame is the answer to datagrams of channels.
bool WireEngine::answers(const AcyclicFrame& frame, std::span<const std::uint8_t> bytes) noexcept {
    const auto same = [&](const Item& item) {
        const std::size_t at = item.offset - datagram_header_bytes;
        return bytes[at] == frame.bytes[at] && bytes[at + 1] == frame.bytes[at + 1] &&
               get<std::uint16_t>(&bytes[at + 4]) == get<std::uint16_t>(&frame.bytes[at + 4]) &&
               (get<std::uint16_t>(&bytes[at + 6]) & 0x87ff) ==
                   get<std::uint16_t>(&frame.bytes[at + 6]);
    };
    return bytes.size() >= frame.size && has_length_of(bytes, frame.bytes) &&
           std::all_of(frame.items.begin(),
                       frame.items.begin() + static_cast<std::ptrdiff_t>(frame.count), same);
}

/// Notes how far the primary port reaches.
void WireEngine::note_reach(const AcyclicFrame& frame, const std::uint8_t* answer) noexcept {
    for (std::size_t n = 0; n < frame.count; ++n) {
        const Item& item = frame.items[n];
        const std::uint8_t* const data = answer + item.offset;
        const std::uint8_t* const header = data - datagram_header_bytes;
        if (header[0] == static_cast<std::uint8_t>(Command::brd) &&
            get<std::uint16_t>(header + 4) == registers::al_status) {
            primary_wkc_ = get<std::uint16_t>(data + item.length);
        }
    }
}

void WireEngine::arrived_acyclic(Flight& f, std::span<const std::uint8_t> bytes,
                                 unsigned number) noexcept {
    AcyclicFrame& frame = acyclic_[f.place];
    if (!answers(frame, bytes)) return count_foreign(bytes);
    if (!accept(f, number)) return;
    if (f.overdue) {
        ++status_.late;
    }
    if (number == 0) {
        note_reach(frame, bytes.data());
    }
    if (!f.merged) {
        std::memcpy(frame.answer.data(), bytes.data(), frame.size);
    } else {
        merge_acyclic(frame, bytes.data());
    }
    f.merged = true;
    if (f.copies == 0) {
        complete_acyclic(f);
    }
}

void WireEngine::merge_acyclic(AcyclicFrame& frame, const std::uint8_t* second) noexcept {
    for (std::size_t n = 0; n < frame.count; ++n) {
        const Item& item = frame.items[n];
        std::uint8_t* to = &frame.answer[item.offset];
        const std::uint8_t* from = second + item.offset;
        const auto wkc = get<std::uint16_t>(to + item.length);

        const auto more = get<std::uint16_t>(from + item.length);
        if (frame.bytes[item.offset - datagram_header_bytes] ==
            static_cast<std::uint8_t>(Command::brd)) {
            for (std::size_t i = 0; i < item.length; ++i) {
                to[i] |= from[i];
            }
        } else if (wkc == 0 && more != 0) {
            std::memcpy(to, from, item.length);
        }
        put(to + item.length, static_cast<std::uint16_t>(wkc + more));
    }
}

void WireEngine::complete_acyclic(Flight& f) noexcept {
    AcyclicFrame& frame = acyclic_[f.place];
    f.kind = Flight::Kind::none;
    --in_flight_;
    deliver(frame, frame.answer.data());
}

/// Continues the tasks whose datagrams a frame has, with their answers.
void WireEngine::deliver(AcyclicFrame& frame, const std::uint8_t* answer) noexcept {
    for (std::size_t n = 0; n < frame.count; ++n) {
        const Item& item = frame.items[n];
        Channel& c = *item.channel;
        if (c.stage() != Channel::Stage::sent || c.generation() != item.generation ||
            c.length() != item.length) {
            continue;
        }
        c.set_now(now_ns_);
        std::memcpy(c.data(), answer + item.offset, item.length);
        ++resumed_;
        c.arrive(get<std::uint16_t>(answer + item.offset + item.length));
    }
    frame.free = true;
}

/// Continues the tasks whose datagrams a frame has, without answers.
void WireEngine::lose(AcyclicFrame& frame) noexcept {
    frame.free = true;
    for (std::size_t n = 0; n < frame.count; ++n) {
        const Item& item = frame.items[n];
        Channel& c = *item.channel;
        if (c.stage() != Channel::Stage::sent || c.generation() != item.generation) continue;
        c.set_now(now_ns_);
        ++resumed_;
        c.lose();
    }
}

void WireEngine::expire(Flight& f) noexcept {
    f.kind = Flight::Kind::expired;
    --in_flight_;
    missing_ += f.copies;
}

/// Gives up the process data of a frame. Datagrams of channels have more time than the cycle.
void WireEngine::give_up_process_data(Flight& f) noexcept {
    ++status_.lost;
    if (f.carrier == nullptr) return expire(f);
    f.overdue = true;
    await_carried(f);
}

/// Gives up frames that have been on the way for too long. Of a frame with two copies, one on each
/// port of a ring, the copy that arrived is used. The tasks whose datagrams are lost continue with
/// that result. [realtime]
void WireEngine::expire() noexcept {
    const std::int64_t timeout =
        std::max({acyclic_timeout_ns, 2 * setup_.cycle_ns, setup_.frame_timeout_ns});
    for (Flight& f : flights_) {
        if (f.kind == Flight::Kind::cyclic) {
            // the other copy is late or lost: this cycle does without it
            if (f.merged && backup_ != nullptr) {
                complete_cyclic(f, halves_[f.place].data());
            } else if (now_ns_ - f.sent_ns >= setup_.frame_timeout_ns) {
                give_up_process_data(f);
            }
        } else if (f.kind == Flight::Kind::complete) {
            if (now_ns_ - f.sent_ns < setup_.frame_timeout_ns + setup_.cycle_ns) continue;
            expire(f);
            ++status_.lost;
        } else if (f.kind == Flight::Kind::acyclic &&
                   (f.copies == 0 || now_ns_ - f.sent_ns >= timeout)) {
            if (f.copies != 0 && !f.overdue) {
                ++status_.lost;
            }
            if (f.merged) {
                complete_acyclic(f);
                continue;
            }
            expire(f);
            lose(acyclic_[f.place]);
        }
    }
}

void WireEngine::wake() noexcept {
    for (std::size_t block = 0; block < active_.size(); block += 8) {
        if (get<std::uint64_t>(&active_[block]) == 0) continue;
        for (std::size_t n = block; n < std::min(block + 8, channels_.size()); ++n) {
            if (active_[n] == 0) continue;
            Channel& c = *channels_[n];
            c.set_now(now_ns_);
            if (c.stage() == Channel::Stage::sleeping && c.until_ns() <= now_ns_) {
                ++resumed_;
                c.wake();
            }
            if (c.stage() == Channel::Stage::idle) {
                active_[n] = 0;
            }
        }
    }
}

}  // namespace hal::ethercat::master
