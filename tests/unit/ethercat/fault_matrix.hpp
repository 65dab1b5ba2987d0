// SPDX-License-Identifier: MIT
// A master on a line of emulated drives and I/O whose frames fail by kind: each n-th one lost,
// doubled, late, cut or damaged.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cstdlib>
#include <memory>
#include <vector>

#include "ethercat/config/config.hpp"
#include "ethercat/devices/registry.hpp"
#include "ethercat/devices/servo.hpp"
#include "ethercat/esc/line.hpp"
#include "ethercat/master/coe_client.hpp"
#include "ethercat/master/master.hpp"
#include "ethercat/wire/registers.hpp"

namespace fault_matrix {

using namespace hal::ethercat;

enum class Kind : std::uint8_t { any, process_data, mailbox, state, clock, last = clock };
inline const char* name(Kind k) {
    return std::array{"any", "process data", "mailbox", "state",
                      "clock"}[static_cast<std::size_t>(k)];
}

/// `lost_back`: the slaves have executed the frame. `damaged`: a wrong check sequence from a slave on. `foreign`: a header that nobody sent.
enum class Fault : std::uint8_t {
    none,
    lost,
    lost_back,
    doubled,
    executed_twice,
    late,
    cut,
    damaged,
    foreign,
    last = foreign
};
inline const char* name(Fault f) {
    return std::array{"none", "lost", "lost back", "doubled", "executed twice",
                      "late", "cut",  "damaged",   "foreign"}[static_cast<std::size_t>(f)];
}

/// Returns whether a frame has a datagram of a kind.
inline bool has(std::span<std::uint8_t> frame, Kind kind) {
    FrameReader reader(frame);
    while (const auto d = reader.next()) {
        const std::uint16_t at = d->register_address();
        const bool logical = is_logical(d->command);
        const bool cyclic_clock = d->command == Command::frmw || d->command == Command::armw;
        switch (kind) {
        case Kind::any: return true;
        case Kind::process_data:
            if (logical) return true;
            break;
        case Kind::mailbox:
            if (!logical && at >= 0x1000) return true;
            break;
        case Kind::state:
            if (!logical && at >= registers::al_control && at < 0x0140) return true;
            break;
        case Kind::clock:
            if (!logical && (cyclic_clock || (at >= registers::dc_receive_time && at < 0x0a00))) {
                return true;
            }
            break;
        }
    }
    return false;
}

/// The primary end of the line.
class FaultyPort final : public hal::ethernet::Port {
public:
    explicit FaultyPort(esc::Line& line) : line_(line) {
        for (Held& h : held_) {
            h.bytes.reserve(2048);
        }
        current_.reserve(2048);
        copy_.reserve(2048);
        spare_.reserve(2048);
    }
    Fault fault = Fault::none;
    Kind kind = Kind::any;
    unsigned every = 2;  ///< each n-th frame of `kind`
    unsigned late_cycles = 2;
    std::uint64_t hits = 0;

    const hal::ethernet::Address& address() const noexcept override { return mine_; }
    hal::ethernet::Sent send(std::span<const std::uint8_t> frame, const hal::ethernet::Launch&,
                             std::int64_t now_ns) noexcept override {
        if (now_ns == hal::ethernet::unclocked) {
            now_ns = last_ns_;
        }
        last_ns_ = now_ns;
        copy_.assign(frame.begin(), frame.end());
        const bool hit = fault != Fault::none && has(copy_, kind) && ++seen_ % every == 0;
        hits += hit ? 1 : 0;
        const Fault now = hit ? fault : Fault::none;
        if (now == Fault::lost) return hal::ethernet::Sent::queued;
        if (now == Fault::executed_twice) {
            spare_ = copy_;
            pass(spare_, now_ns, now, now_ns);
        }
        if (now == Fault::damaged) {
            line_.disturb({.fault = esc::LineFault::corruption,
                           .slave = static_cast<int>(hits % line_.size()),
                           .count = 1});
        }
        pass(copy_, now_ns, now, now == Fault::late ? now_ns + late_cycles * 1'000'000LL : now_ns);
        if (now == Fault::damaged) {
            line_.calm();
        }
        return hal::ethernet::Sent::queued;
    }
    std::optional<hal::ethernet::Arrival> receive(std::int64_t now_ns) noexcept override {
        Held* first = nullptr;
        for (Held& h : held_) {
            if (h.used && h.at_ns <= now_ns && (first == nullptr || h.order < first->order)) {
                first = &h;
            }
        }
        if (first == nullptr) return std::nullopt;
        first->used = false;
        current_ = first->bytes;
        return hal::ethernet::Arrival{current_, now_ns};
    }
    bool wait(std::int64_t) noexcept override { return false; }
    hal::ethernet::Statistics statistics() const noexcept override { return {}; }
    const hal::ethernet::Description& description() const noexcept override { return about_; }

private:
    struct Held {
        std::vector<std::uint8_t> bytes;
        std::int64_t at_ns = 0;
        std::uint64_t order = 0;
        bool used = false;
    };
    void pass(std::vector<std::uint8_t>& frame, std::int64_t now_ns, Fault now,
              std::int64_t at_ns) noexcept {
        const auto passage = line_.process(frame, esc::End::primary, now_ns);
        if (passage.lost || passage.end != esc::End::primary || now == Fault::lost_back) return;
        if (now == Fault::cut) {
            frame.resize(frame.size() - 1 - hits * 7 % (frame.size() - 1));
        }
        if (now == Fault::foreign) {
            frame[14 + hits * 5 % 11] ^= static_cast<std::uint8_t>(1 + hits % 255);
        }
        for (unsigned copies = now == Fault::doubled ? 2 : 1; copies > 0; --copies) {
            hold(frame, at_ns);
        }
    }
    void hold(const std::vector<std::uint8_t>& frame, std::int64_t at_ns) noexcept {
        for (Held& h : held_) {
            if (h.used) continue;
            h.bytes = frame;
            h.at_ns = at_ns;
            h.order = ++order_;
            h.used = true;
            return;
        }
    }

    esc::Line& line_;
    hal::ethernet::Address mine_{2, 0, 0, 0, 0, 1};
    hal::ethernet::Description about_;
    std::array<Held, 64> held_;
    std::vector<std::uint8_t> current_, copy_, spare_;
    std::uint64_t seen_ = 0;
    std::uint64_t order_ = 0;
    std::int64_t last_ns_ = 0;
};

/// Keeps the newest events only, in one place of memory.
class LastEvents final : public master::Events {
public:
    void on_event(master::Event event, std::uint32_t slave, std::int64_t first,
                  std::int64_t second) noexcept override {
        events_[count_++ % events_.size()] = {event, slave, first, second};
        if (event == master::Event::reference_clock) {
            reference = slave;
        }
    }
    std::uint64_t count() const { return count_; }
    std::string text(const master::Setup& setup) const;
    std::uint32_t reference = 0;  ///< index in the setup

private:
    struct Record {
        master::Event event;
        std::uint32_t slave;
        std::int64_t first, second;
    };
    std::array<Record, 24> events_{};
    std::uint64_t count_ = 0;
};

/// Three drives with DC, mailbox and a mapping of their own, and outputs and inputs behind them.
struct Machine {
    static constexpr std::size_t drives = 3;
    static constexpr std::size_t slaves = 5;
    static constexpr std::size_t io = 3;

    Machine();
    /// Checks that the tasks of the master had memory to spare.
    ~Machine();
    /// Runs one cycle of 1 ms, and checks that no drive is in OP that may not be there.
    void cycle();
    void run(unsigned cycles) {
        while (cycles-- > 0) {
            cycle();
        }
    }
    /// Runs until the bus is operational and its outputs arrive. Returns the cycles it took; 0:
    /// never within `most`.
    unsigned recover(unsigned max = 60'000);
    /// Makes whole what is broken.
    void repair();
    std::int64_t deviation_ns(std::size_t drive);

    std::vector<devices::Device> devices;
    esc::Line line;
    FaultyPort port{line};
    LastEvents events;
    master::Setup setup;
    std::unique_ptr<master::Mailboxes> mailboxes;
    std::unique_ptr<master::CoeClient> client;
    std::unique_ptr<master::Master> master;
    std::span<std::uint8_t> io_data;
    std::int64_t now_ns = 0;
    std::int64_t jumped_ns = -1'000'000'000;
    std::string wrong;  ///< the first breach; empty: none

private:
    std::array<bool, drives> was_op_{};
};

}  // namespace fault_matrix
