// SPDX-License-Identifier: MIT
// A master on a line of emulated slaves, in one thread and virtual time.
#pragma once

#include <gtest/gtest.h>

#include <deque>
#include <map>

#include "ethercat/esc/line.hpp"
#include "ethercat/master/master.hpp"
#include "ethercat/wire/registers.hpp"
#include "ethercat/wire/sii.hpp"

namespace master_world {

using namespace hal::ethercat;
using namespace hal::ethercat::master;
using hal::Task;

/// Follows every request; in SAFE-OP and OP it returns its outputs, plus one, as inputs.
struct Firmware : esc::Application {
    std::uint16_t refuse = 0;
    std::uint16_t code = 0;  ///< state that is rejected
    std::uint16_t ignore = 0;            ///< state whose request is never answered
    bool echo = true;
    std::uint16_t device_id = 0;
    std::array<std::uint8_t, 64> bytes{};
    std::size_t inputs = 2;
    void power_on(esc::Pdi&) noexcept override { bytes.fill(0); }
    void run(esc::Pdi& pdi, std::int64_t) noexcept override {
        if (const auto control = pdi.take_al_control()) {
            const auto state = static_cast<std::uint16_t>(*control & 0x0f);
            if ((*control & al_identify) != 0) {
                pdi.set_al_status(static_cast<std::uint16_t>(state | al_identify), device_id);
            } else if (state == ignore) {
                return;
            } else if (state == refuse) {
                pdi.set_al_status(static_cast<std::uint16_t>((pdi.al_status() & 0x0f) | 0x10),
                                  code);
            } else {
                pdi.set_al_status(state, 0);
            }
        }
        if ((pdi.al_status() & 0x0f) < 4 || !echo) return;
        std::array<std::uint8_t, 64> out{};
        if (pdi.read_sync_manager(2, out) != 0) {
            bytes = out;
        }
        std::array<std::uint8_t, 64> in{};
        for (std::size_t i = 0; i < inputs; ++i) {
            in[i] = static_cast<std::uint8_t>(bytes[i] + 1);
        }
        pdi.write_sync_manager(3, {in.data(), inputs});
    }
};

inline std::vector<std::uint8_t> image(std::uint32_t product, std::uint16_t alias = 0,
                                       bool mailbox = false) {
    sii::Contents c;
    c.configuration[4] = alias;
    c.vendor = 0x1234;
    c.product = product;
    c.revision = 0x10000;
    c.serial = 7;
    if (mailbox) {
        c.mailboxes = {{0x1000, 128}, {0x1080, 128}};
        c.protocols = bit_of(MailboxType::coe);
    }
    c.has_general = true;
    c.general.coe_details = 0x0f;
    c.sync_managers = {{0x1000, 128, 0x26, 0, 1, sii::SmType::mailbox_out},
                       {0x1080, 128, 0x22, 0, 1, sii::SmType::mailbox_in},
                       {0x1100, 2, 0x64, 0, 1, sii::SmType::outputs},
                       {0x1400, 2, 0x20, 0, 1, sii::SmType::inputs}};
    return sii::build(c);
}

inline Slave drive(std::uint16_t position, std::uint16_t bytes = 2) {
    Slave s;
    s.position = position;
    s.identity.vendor = 0x1234;
    s.identity.product = 0x100U + position;
    SyncManager out, in;
    out.number = 2;
    out.output = true;
    out.pdos.push_back({0x1600, {}, false});
    in.number = 3;
    in.pdos.push_back({0x1a00, {}, false});
    for (std::uint16_t n = 0; n < bytes; ++n) {
        Entry e;
        e.index = static_cast<std::uint16_t>(0x7000 + n);
        e.sub = 1;
        e.bits = 8;
        out.pdos[0].entries.push_back(e);
        e.index = static_cast<std::uint16_t>(0x6000 + n);
        in.pdos[0].entries.push_back(e);
    }
    s.sync_managers = {out, in};
    return s;
}

/// One end of the line.
struct EndPort final : hal::ethernet::Port {
    esc::Line& line;
    esc::End end;
    EndPort* other = nullptr;         ///< at the other end of a ring
    EndPort* other_master = nullptr;  ///< on the same cable
    bool up = true;
    bool stalled = false;  ///< stalled: what arrives is received later
    std::deque<std::vector<std::uint8_t>> arrived;
    std::vector<std::uint8_t> current;
    hal::ethernet::Address mine{2, 0, 0, 0, 0, 1};
    hal::ethernet::Description about;
    std::uint64_t sent = 0;
    std::uint64_t lose_every = 0;
    std::uint64_t double_every = 0;
    std::int64_t last_ns = 0;
    explicit EndPort(esc::Line& l, esc::End e) : line(l), end(e) {}
    const hal::ethernet::Address& address() const noexcept override { return mine; }
    hal::ethernet::Sent send(std::span<const std::uint8_t> frame, const hal::ethernet::Launch&,
                             std::int64_t now_ns) noexcept override {
        ++sent;
        if (now_ns == hal::ethernet::unclocked) {
            now_ns = last_ns;
        }
        last_ns = now_ns;
        if (!up) return hal::ethernet::Sent::down;
        std::vector<std::uint8_t> copy(frame.begin(), frame.end());
        const auto passage = line.process(copy, end, now_ns);
        if (passage.lost || (lose_every != 0 && sent % lose_every == 0)) {
            return hal::ethernet::Sent::queued;
        }
        EndPort* to = passage.end == end ? this : other;
        if (to == nullptr) return hal::ethernet::Sent::queued;
        to->arrived.push_back(copy);
        if (other_master != nullptr) {
            other_master->arrived.push_back(copy);
        }
        if (double_every != 0 && sent % double_every == 0) {
            to->arrived.push_back(copy);
        }
        return hal::ethernet::Sent::queued;
    }
    std::optional<hal::ethernet::Arrival> receive(std::int64_t now_ns) noexcept override {
        if (stalled || arrived.empty()) return std::nullopt;
        current = std::move(arrived.front());
        arrived.pop_front();
        return hal::ethernet::Arrival{current, now_ns};
    }
    bool wait(std::int64_t) noexcept override { return false; }
    hal::ethernet::Statistics statistics() const noexcept override {
        hal::ethernet::Statistics s;
        s.up = up;
        return s;
    }
    const hal::ethernet::Description& description() const noexcept override { return about; }
};

/// An object dictionary in memory: no mailbox is needed to test what is read and written.
struct Objects final : CoeAccess {
    std::map<std::uint32_t, std::vector<std::uint8_t>> values;
    std::vector<std::uint32_t> written;
    std::uint32_t refuse = 0;
    Task<SdoResult> upload(Channel& c, BusSlave&, std::uint16_t index, std::uint8_t sub, bool,
                           std::span<std::uint8_t> to) noexcept override {
        co_await c.sleep(0);
        const auto found = values.find(static_cast<std::uint32_t>(index << 8 | sub));
        if (found == values.end()) {
            co_return SdoResult{SdoResult::Outcome::aborted, 0x06020000};
        }
        std::copy(found->second.begin(), found->second.end(), to.begin());
        co_return SdoResult{SdoResult::Outcome::done, 0, found->second.size()};
    }
    Task<SdoResult> download(Channel& c, BusSlave&, std::uint16_t index, std::uint8_t sub, bool,
                             std::span<const std::uint8_t> from) noexcept override {
        co_await c.sleep(0);
        const auto object = static_cast<std::uint32_t>(index << 8 | sub);
        if (object == refuse) {
            co_return SdoResult{SdoResult::Outcome::aborted, 0x06090030};
        }
        written.push_back(object);
        values[object].assign(from.begin(), from.end());
        co_return SdoResult{SdoResult::Outcome::done};
    }
};

struct Log final : Events {
    struct Record {
        Event event;
        std::uint32_t slave;
        std::int64_t first, second;
    };
    std::vector<Record> all;
    void on_event(Event event, std::uint32_t slave, std::int64_t first,
                  std::int64_t second) noexcept override {
        all.push_back({event, slave, first, second});
    }
    std::size_t count(Event event) const {
        return static_cast<std::size_t>(std::count_if(
            all.begin(), all.end(), [&](const Record& r) { return r.event == event; }));
    }
    const Record* last(Event event) const {
        for (auto r = all.rbegin(); r != all.rend(); ++r) {
            if (r->event == event) return &*r;
        }
        return nullptr;
    }
    std::string text() const {
        std::string s;
        for (const Record& r : all) {
            s += std::to_string(static_cast<int>(r.event)) + "(" +
                 std::to_string(static_cast<int>(r.slave)) + ": " + std::to_string(r.first) + ", " +
                 std::to_string(r.second) + ") ";
        }
        return s;
    }
};

struct World {
    esc::Line line;
    std::deque<Firmware> firmware;
    EndPort primary{line, esc::End::primary};
    EndPort backup{line, esc::End::secondary};
    Objects objects;
    Log log;
    std::unique_ptr<hal::ethercat::master::Master> master;
    std::int64_t now_ns = 0;
    std::int64_t cycle_ns = 1'000'000;
    std::uint64_t cycles = 0;

    /// Checks that the tasks of the master had memory to spare.
    ~World() {
        if (master != nullptr) {
            EXPECT_LT(master->max_task_share(), 0.75);
        }
    }
    Firmware& add(std::uint32_t product, std::uint16_t alias = 0, bool mailbox = false,
                  esc::Settings settings = {}) {
        firmware.emplace_back();
        line.add({.controller = settings,
                  .sii = image(product, alias, mailbox),
                  .application = &firmware.back()});
        return firmware.back();
    }
    void begin(Setup setup, bool ring = false) {
        primary.other = &backup;
        backup.other = &primary;
        line.power_on(0);
        master = std::make_unique<hal::ethercat::master::Master>(std::move(setup), primary.mine,
                                                                 log, objects);
        master->attach(primary, ring ? &backup : nullptr);
    }
    void cycle() {
        now_ns += cycle_ns;
        line.advance(now_ns);
        master->receive(now_ns);
        master->transmit(now_ns);
        ++cycles;
    }
    void run(unsigned n) {
        while (n-- > 0) {
            cycle();
        }
    }
    /// Runs until `done` or for at most n cycles. Returns whether it was done.
    template <class Done>
    bool until(Done done, unsigned n = 3000) {
        while (n-- > 0 && !done()) {
            cycle();
        }
        return done();
    }
    bool operational(unsigned n = 3000) {
        return until([&] { return master->status().operational; }, n);
    }
};

inline Setup drives(unsigned count, std::uint16_t bytes = 2) {
    Setup setup;
    for (unsigned n = 0; n < count; ++n) {
        setup.slaves.push_back(drive(static_cast<std::uint16_t>(n), bytes));
    }
    return setup;
}

}  // namespace master_world
