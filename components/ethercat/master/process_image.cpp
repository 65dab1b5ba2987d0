// SPDX-License-Identifier: MIT
#include "ethercat/master/process_image.hpp"

#include <algorithm>
#include <optional>

#include "ethercat/wire/registers.hpp"

namespace hal::ethercat::master {

namespace {

constexpr std::uint16_t clock_bytes = 8;
constexpr std::size_t datagram_overhead = datagram_header_bytes + wkc_bytes;
// Longer than the master needs to notice that a slave does not answer.
constexpr std::uint32_t stale_exchanges = 30;
constexpr std::int64_t stale_after_ns = 30'000'000;

constexpr bool overlap(std::uint32_t a, std::uint32_t a_bytes, std::uint32_t b,
                       std::uint32_t b_bytes) noexcept {
    return a < b + b_bytes && b < a + a_bytes;
}

}  // namespace

ProcessImage::ProcessImage(const Setup& setup, const std::array<std::uint8_t, 6>& source)
    : slaves_(setup.slaves.size()),
      domains_(std::max<std::size_t>(setup.domains.size(), 1)),
      source_(source),
      max_(std::clamp<std::size_t>(setup.frame_bytes, 200, max_frame_bytes)),
      write_clock_(setup.lead == ClockLead::thread),
      cycle_ns_(std::max<std::int64_t>(setup.cycle_ns, 1)) {
    lay_out(setup);
    // Each block needs at most two datagrams and one per frame's worth of bytes; each of them could
    // need a frame of its own.
    std::size_t max = 1;
    for (const Block& b : blocks_) {
        max += 2 + 2 * (b.out_bytes / capacity() + b.in_bytes / capacity() + 2);
    }
    datagrams_.resize(max);
    frames_.resize(max);
    build();
}

/// Data bytes of one process datagram in a frame that also carries the clock, if two of them (LWR
/// and LRD) share the frame.
std::size_t ProcessImage::capacity() const noexcept {
    const std::size_t payload = max_ - ethernet_header_bytes - ecat_header_bytes;
    return payload - (write_clock_ ? 2 : 1) * (clock_bytes + datagram_overhead) -
           2 * datagram_overhead;
}

void ProcessImage::lay_out(const Setup& setup) {
    for (std::size_t n = 0; n < slaves_.size(); ++n) {
        measure(setup.slaves[n], slaves_[n]);
    }
    std::uint32_t at = 0;
    for (std::uint16_t d = 0; d < domains_.size(); ++d) {
        const unsigned every = d < setup.domains.size() ? std::max(setup.domains[d].every, 1U) : 1;
        for (const bool no_lrw : {false, true}) {
            fill_blocks(d, every, no_lrw, at);
        }
    }
    image_.resize(at + 1);
}

void ProcessImage::measure(const Slave& slave, SlaveImage& image) const {
    image.domain = slave.domain < domains_.size() ? slave.domain : std::uint16_t{0};
    image.no_lrw = !slave.use_lrw;
    for (const SyncManager& sm : slave.sync_managers) {
        std::uint32_t bits = 0;
        for (const Pdo& pdo : sm.pdos) {
            for (const Entry& entry : pdo.entries) {
                bits += entry.bits;
            }
        }
        image.areas.push_back({0, (bits + 7) / 8, sm.output});
        (sm.output ? image.out_bytes : image.in_bytes) += (bits + 7) / 8;
    }
    if (slave.mailbox_status && image.out_bytes + image.in_bytes != 0) {
        image.mailbox_status_at = 0;
        image.in_bytes++;
    }
}

void ProcessImage::fill_blocks(std::uint16_t domain, unsigned every, bool no_lrw,
                               std::uint32_t& at) {
    Block block;
    block.domain = domain;
    block.every = every;
    block.first = block.last = static_cast<std::uint16_t>(order_.size());
    for (std::uint16_t n = 0; n < slaves_.size(); ++n) {
        const SlaveImage& image = slaves_[n];
        const std::uint32_t bytes = image.out_bytes + image.in_bytes;
        if (image.domain != domain || image.no_lrw != no_lrw || bytes == 0) continue;
        if (block.out_bytes + block.in_bytes + bytes > capacity()) {
            close(block, at);
        }
        block.out_bytes += image.out_bytes;
        block.in_bytes += image.in_bytes;
        order_.push_back(n);
        block.last = static_cast<std::uint16_t>(order_.size());
    }
    close(block, at);
}

void ProcessImage::close(Block& block, std::uint32_t& at) {
    if (block.first != block.last) {
        block.at = at;
        std::uint32_t out = at;
        std::uint32_t in = at + block.out_bytes;
        for (std::uint16_t i = block.first; i < block.last; ++i) {
            SlaveImage& image = slaves_[order_[i]];
            image.out_at = out;
            image.in_at = in;
            for (Area& area : image.areas) {
                std::uint32_t& next = area.output ? out : in;
                area.at = next;
                next += area.bytes;
            }
            if (image.mailbox_status_at >= 0) {
                image.mailbox_status_at = in++;
            }
        }
        blocks_.push_back(block);
        at += block.out_bytes + block.in_bytes;
    }
    block.out_bytes = block.in_bytes = 0;
    block.first = block.last;
}

void ProcessImage::build() noexcept {
    datagrams_used_ = frames_used_ = 0;
    unsigned every = 0;
    while (true) {  // groups of equal rate, the fastest first
        unsigned next = UINT32_MAX;
        for (const Block& b : blocks_) {
            if (b.every > every) {
                next = std::min(next, b.every);
            }
        }
        if (next == UINT32_MAX) break;
        every = next;
        build_frames(every);
    }
    if (frames_used_ == 0) {
        build_frames(1);  // for the clock alone
    }
    recount();
    mark_stale_slaves();
}

void ProcessImage::build_frames(unsigned every) noexcept {
    std::optional<FrameWriter> writer;
    Frame* frame = nullptr;
    const auto finish = [&] {
        if (frame == nullptr) return;
        frame->last = static_cast<unsigned>(datagrams_used_);
        frame->size = static_cast<std::uint16_t>(writer->finish().size());
    };
    const auto open = [&](bool first) {
        finish();
        frame = &frames_[frames_used_++];
        frame->every = every;
        frame->first = static_cast<unsigned>(datagrams_used_);
        frame->clock_write = frame->clock_read = 0;
        writer.emplace(frame->bytes, source_, max_);
        const auto clock = [&] {
            return static_cast<std::uint16_t>(writer->add(Command::nop, 0,
                                                          at_station(0, registers::dc_system_time),
                                                          clock_bytes) -
                                              datagram_header_bytes - frame->bytes.data());
        };
        if (write_clock_ && first) {
            frame->clock_write = clock();
        }
        frame->clock_read = clock();
    };
    open(true);
    for (const Block& b : blocks_) {
        if (b.every != every) continue;
        bool lrw = b.out_bytes + b.in_bytes <= capacity() && b.out_bytes != 0 && b.in_bytes != 0;
        for (std::uint16_t i = b.first; i < b.last; ++i) {
            lrw &= !slaves_[order_[i]].no_lrw;
        }
        const auto piece = [&](Command command, std::uint32_t at, std::uint32_t length) {
            while (length != 0) {
                const auto part =
                    std::min<std::uint32_t>(length, static_cast<std::uint32_t>(capacity()));
                if (writer->space() < part) {
                    open(false);
                }
                add(*writer, *frame, command, at, part, b);
                at += part;
                length -= part;
            }
        };
        if (lrw) {
            piece(Command::lrw, b.at, b.out_bytes + b.in_bytes);
        } else {
            piece(Command::lwr, b.at, b.out_bytes);
            piece(Command::lrd, b.at + b.out_bytes, b.in_bytes);
        }
    }
    finish();
}

void ProcessImage::add(FrameWriter& writer, Frame& frame, Command command, std::uint32_t at,
                       std::uint32_t length, const Block& b) noexcept {
    Datagram& d = datagrams_[datagrams_used_++];
    d = {};
    const std::uint8_t* data = writer.add(command, 0, at, static_cast<std::uint16_t>(length));
    d.address = at;
    d.length = static_cast<std::uint16_t>(length);
    d.offset = static_cast<std::uint16_t>(data - datagram_header_bytes - frame.bytes.data());
    d.domain = b.domain;
    d.first_slave = b.first;
    d.last_slave = b.last;
    d.every = b.every;
    if (command == Command::lwr) {
        d.out_to = d.length;
    } else if (command == Command::lrw) {
        d.out_to = static_cast<std::uint16_t>(b.out_bytes);
    } else {
        d.out_to = std::uint16_t{0};
    }
    d.in_from = command == Command::lrw ? d.out_to : std::uint16_t{0};
    d.in_to = command == Command::lwr ? std::uint16_t{0} : d.length;
    if (command == Command::lwr) {
        d.in_from = 0;
    }
}

void ProcessImage::recount() noexcept {
    for (std::size_t n = 0; n < datagrams_used_; ++n) {
        Datagram& d = datagrams_[n];
        unsigned expected = 0;
        unsigned tolerance = 0;
        const unsigned write = d.in_to == 0 ? 1 : 2;  // LWR counts 1, the writing part of LRW 2
        for (std::uint16_t i = d.first_slave; i < d.last_slave; ++i) {
            const SlaveImage& s = slaves_[order_[i]];
            unsigned count = 0;
            if (d.out_to != 0 && overlap(d.address, d.out_to, s.out_at, s.out_bytes) && s.writes) {
                count += write;
            }
            if (d.in_to > d.in_from &&
                overlap(d.address + d.in_from, d.in_to - d.in_from, s.in_at, s.in_bytes) &&
                s.reads) {
                count += 1;
            }
            (s.starting ? tolerance : expected) += count;
        }
        d.expected = static_cast<std::uint16_t>(expected);

        d.tolerance = static_cast<std::uint16_t>(tolerance);
    }
}

void ProcessImage::set_counting(std::size_t slave, bool writes, bool reads,
                                bool starting) noexcept {
    SlaveImage& s = slaves_[slave];
    if (s.writes == writes && s.reads == reads && s.starting == starting) return;
    s.writes = writes;
    s.reads = reads;
    s.starting = starting;
    recount();
}

void ProcessImage::clear_mailbox_status(std::size_t slave) noexcept {
    if (slaves_[slave].mailbox_status_at >= 0) {
        image_[static_cast<std::size_t>(slaves_[slave].mailbox_status_at)] = 0;
    }
}

void ProcessImage::set_reference(std::uint16_t station, bool write_time) noexcept {
    reference_ = station;
    write_time_ = write_time;
}

void ProcessImage::fill(Frame& frame, std::uint8_t index,
                        std::optional<std::uint64_t> dc_time_ns) noexcept {
    const bool has_time = dc_time_ns && reference_ != 0;
    const auto clock = [&](std::uint16_t at, Command command) {
        if (at == 0) return;
        frame.bytes[at] = static_cast<std::uint8_t>(has_time ? command : Command::nop);
        frame.bytes[at + 1U] = index;
        put(&frame.bytes[at + 2U], at_station(reference_, registers::dc_system_time));
        put(&frame.bytes[at + datagram_header_bytes], dc_time_ns.value_or(0));
    };
    clock(frame.clock_write, write_time_ ? Command::fpwr : Command::nop);
    clock(frame.clock_read, Command::frmw);
    for (unsigned n = frame.first; n < frame.last; ++n) {
        Datagram& d = datagrams_[n];
        std::uint8_t* header = &frame.bytes[d.offset];
        header[1] = index;
        if (d.out_to != 0) {
            std::memcpy(header + datagram_header_bytes, &image_[d.address], d.out_to);
        }
        d.sent = true;
        d.answered = false;
    }
}

bool ProcessImage::matches(const Frame& frame, std::uint8_t index,
                           std::span<const std::uint8_t> answer) const noexcept {
    // Of each datagram: command, index, address and length; the circulating bit may have been set
    // on the way, and the last one states whether others follow.
    const auto length = [](const std::uint8_t* datagram) {
        return get<std::uint16_t>(datagram + 6) & 0x7ff;
    };
    const auto same = [&](std::uint16_t at) {
        return answer[at + 1U] == index &&
               std::memcmp(&answer[at + 2U], &frame.bytes[at + 2U], 4) == 0 &&
               length(&answer[at]) == length(&frame.bytes[at]);
    };
    // The frame that left before may have distributed the time, and the one in this cycle not.
    const bool earlier = left_again(frame, index);
    const auto same_command = [&](std::uint16_t at) { return answer[at] == frame.bytes[at]; };
    const auto clock = [&](std::uint16_t at) { return same(at) && (earlier || same_command(at)); };
    if (frame.clock_write != 0 && !clock(frame.clock_write)) return false;
    if (!clock(frame.clock_read)) return false;
    for (unsigned n = frame.first; n < frame.last; ++n) {
        const std::uint16_t at = datagrams_[n].offset;
        if (!same(at) || !same_command(at)) return false;
    }
    return true;
}

void ProcessImage::take(const Frame& frame, const std::uint8_t* answer) noexcept {
    for (unsigned n = frame.first; n < frame.last; ++n) {
        Datagram& d = datagrams_[n];
        const std::uint8_t* data = answer + d.offset + datagram_header_bytes;
        d.wkc = get<std::uint16_t>(data + d.length);
        d.answered = true;
        if (d.in_to <= d.in_from) continue;
        if (d.wkc >= d.expected && d.tolerance == 0) {
            std::memcpy(&image_[d.address + d.in_from], data + d.in_from,
                        static_cast<std::size_t>(d.in_to - d.in_from));
        } else {
            copy_present(d, data);
        }
    }
}

/// A slave that did not take part leaves the zeros that were sent. Those are not its inputs: the
/// last ones stay until its loss is known.
void ProcessImage::copy_present(const Datagram& d, const std::uint8_t* data) noexcept {
    for (std::uint16_t i = d.first_slave; i < d.last_slave; ++i) {
        const SlaveImage& s = slaves_[order_[i]];
        if (!s.reads || s.in_bytes == 0) continue;
        const std::uint32_t from = std::max(s.in_at, d.address + d.in_from);

        const std::uint32_t to = std::min(s.in_at + s.in_bytes, d.address + d.in_to);
        if (from >= to) continue;
        const std::uint8_t* inputs = data + (from - d.address);
        if (std::any_of(inputs, inputs + (to - from), [](std::uint8_t b) { return b != 0; })) {
            std::memcpy(&image_[from], inputs, to - from);
        }
    }
}

void ProcessImage::merge(const Frame& frame, std::uint8_t* first,
                         const std::uint8_t* second) const noexcept {
    const auto add_wkc = [&](std::size_t at) {
        put(first + at, static_cast<std::uint16_t>(get<std::uint16_t>(first + at) +
                                                   get<std::uint16_t>(second + at)));
    };
    const auto clock = [&](std::uint16_t at) {
        if (at == 0) return;
        const std::size_t wkc = at + datagram_header_bytes + clock_bytes;
        if (get<std::uint16_t>(second + wkc) > get<std::uint16_t>(first + wkc)) {
            std::memcpy(first + at + datagram_header_bytes, second + at + datagram_header_bytes,
                        clock_bytes);
        }
        add_wkc(wkc);
    };
    clock(frame.clock_write);
    clock(frame.clock_read);
    for (unsigned n = frame.first; n < frame.last; ++n) {
        const Datagram& d = datagrams_[n];
        const std::size_t data = d.offset + datagram_header_bytes;
        for (std::size_t i = d.in_from; i < d.in_to; ++i) {
            first[data + i] |= second[data + i];
        }
        add_wkc(data + d.length);
    }
}

/// Returns whether a datagram has process data of a slave.
bool ProcessImage::carries(const Datagram& d, const SlaveImage& s) const noexcept {
    return overlap(d.address, d.length, s.out_at, s.out_bytes) ||
           overlap(d.address, d.length, s.in_at, s.in_bytes);
}

/// Follows whether the data of a datagram is exchanged.
void ProcessImage::observe(Datagram& d, bool refreshed) noexcept {
    d.returned = d.answered;
    if (refreshed != d.stale) {
        d.contradictions = 0;
        return;
    }
    const auto limit =
        std::max<std::int64_t>(stale_exchanges, stale_after_ns / (cycle_ns_ * d.every));
    if (++d.contradictions < limit) return;
    d.contradictions = 0;
    d.stale = !d.stale;
    mark_stale_slaves();
}

void ProcessImage::mark_stale_slaves() noexcept {
    ++staleness_;
    for (SlaveImage& s : slaves_) {
        s.stale = std::any_of(datagrams().begin(), datagrams().end(),
                              [&](const Datagram& d) { return d.stale && carries(d, s); });
    }
}

bool ProcessImage::returns(std::size_t slave) const noexcept {
    const SlaveImage& s = slaves_[slave];
    return std::any_of(datagrams().begin(), datagrams().end(),
                       [&](const Datagram& d) { return d.returned && carries(d, s); });
}

void ProcessImage::settle() noexcept {
    if (!begin_domains()) return;
    for (std::size_t n = 0; n < datagrams_used_; ++n) {
        Datagram& d = datagrams_[n];
        if (!d.sent) continue;
        DomainStatus& s = domains_[d.domain];
        const std::uint16_t wkc = d.answered ? d.wkc : std::uint16_t{0};
        s.wkc = static_cast<std::uint16_t>(s.wkc + wkc);
        s.expected = static_cast<std::uint16_t>(s.expected + d.expected);
        s.ok &= d.answered && wkc >= d.expected && wkc <= d.expected + d.tolerance;
        observe(d, d.answered && wkc >= d.expected);
        d.sent = d.answered = false;
    }
    for (DomainStatus& s : domains_) {
        if (s.fresh) {
            count_exchange(s);
        }
    }
}

bool ProcessImage::begin_domains() noexcept {
    for (DomainStatus& s : domains_) {
        s.fresh = false;
    }
    bool any = false;
    for (std::size_t n = 0; n < datagrams_used_; ++n) {
        const Datagram& d = datagrams_[n];
        if (!d.sent) continue;
        DomainStatus& s = domains_[d.domain];
        if (!s.fresh) {
            s.wkc = s.expected = 0;
            s.fresh = true;
        }
        any = true;
    }
    if (!any) return false;
    for (DomainStatus& s : domains_) {
        s.ok = true;
    }
    return true;
}

void ProcessImage::count_exchange(DomainStatus& s) noexcept {
    ++s.exchanges;
    WkcState state = s.wkc == 0 ? WkcState::none : WkcState::part;
    if (s.ok && s.expected != 0) {
        state = WkcState::complete;
    }
    if (state == WkcState::complete) {
        if (!s.was_complete) {
            s.was_complete = true;
            s.min = s.wkc;
            s.changes = 0;
        }
        s.bad_cycles = 0;
    } else {
        if (s.expected != 0) {
            ++s.incomplete;
        }
        ++s.bad_cycles;
    }
    if (s.was_complete) {
        s.min = std::min(s.min, s.wkc);
        if (state != s.state) {
            ++s.changes;
        }
    }
    s.state = state;
}

}  // namespace hal::ethercat::master
