// SPDX-License-Identifier: MIT
// An emulated device behind its emulated controller, driven datagram by datagram.
#pragma once

#include "ethercat/devices/registry.hpp"
#include "tests/unit/ethercat/esc_world.hpp"

namespace esc_world {

using namespace hal::ethercat::devices;
using Bytes = std::vector<std::uint8_t>;

struct DeviceBench {
    World w;
    Device device;
    sii::Contents sii;
    std::uint8_t counter = 0;

    void start(std::string_view name, const DeviceOptions& options = {}) {
        device = *make(name, options);
        sii = sii::parse(device.sii);
        EXPECT_TRUE(sii.problems.empty()) << sii.problems.front();
        w.line.add({.controller = {.dc = device.dc},
                    .sii = device.sii,
                    .application = device.firmware.get()});
        w.line.power_on(0);
    }
    void write(std::uint16_t address, Bytes bytes) {
        w.send(Command::apwr, at_position(0, address), std::move(bytes));
    }
    Bytes read(std::uint16_t address, std::size_t bytes) {
        w.send(Command::aprd, at_position(0, address), Bytes(bytes));
        return w.data;
    }
    void sync_manager(unsigned n, std::uint16_t start, std::size_t length, std::uint8_t control) {
        Bytes b(8);
        put(&b[0], start);
        put(&b[2], static_cast<std::uint16_t>(length));
        b[4] = control;
        b[6] = length != 0;
        write(registers::sync_manager_at(n), b);
    }
    /// Returns AL status, with the code in the upper half.
    std::uint32_t request(State s, unsigned extra = 0) {
        write(registers::al_control,
              {static_cast<std::uint8_t>(static_cast<unsigned>(s) | extra), 0});
        return status();
    }
    std::uint32_t status() {
        const Bytes b = read(registers::al_status, 6);
        return get<std::uint16_t>(&b[0]) | static_cast<std::uint32_t>(get<std::uint16_t>(&b[4]))
                                               << 16;
    }
    void mailboxes(const sii::Mailboxes& m) {
        sync_manager(0, m.receive.start, m.receive.size, 0x26);

        sync_manager(1, m.send.start, m.send.size, 0x22);
    }
    void to_preop() {
        if (sii.has_mailbox()) {
            mailboxes(sii.mailboxes);
        }
        ASSERT_EQ(request(State::preop), 2U);
    }
    void process_data() {
        for (unsigned n = 0; n < sii.sync_managers.size(); ++n) {
            if (const auto& sm = sii.sync_managers[n];
                sm.type == sii::SmType::outputs || sm.type == sii::SmType::inputs) {
                sync_manager(n, sm.start, sm.length, sm.control);
            }
        }
    }
    const sii::SyncManager& area(sii::SmType type) {
        for (const auto& sm : sii.sync_managers) {
            if (sm.type == type) return sm;
        }
        return sii.sync_managers.front();
    }
    void outputs(const Bytes& b) { write(area(sii::SmType::outputs).start, b); }
    Bytes inputs() {
        return read(area(sii::SmType::inputs).start, area(sii::SmType::inputs).length);
    }
    void to_op(const Bytes& out) {
        to_preop();
        process_data();
        ASSERT_EQ(request(State::safeop), 4U);
        if (!out.empty()) {
            outputs(out);
        }
        request(State::op);
        ASSERT_EQ(status(), 8U);
    }
    void post(MailboxType type, const Bytes& payload) {
        Bytes b(sii.mailboxes.receive.size);
        write_mailbox_header(b.data(), payload.size(), 0, type,
                             counter = next_mailbox_counter(counter));
        std::copy(payload.begin(), payload.end(), b.begin() + mailbox_header_bytes);
        EXPECT_EQ(w.send(Command::apwr, at_position(0, sii.mailboxes.receive.start), b), 1);
    }
    /// Returns the payload of the next answer; empty when the mailbox has no answer.
    Bytes fetch(MailboxType type) {
        if (w.send(Command::aprd, at_position(0, sii.mailboxes.send.start),
                   Bytes(sii.mailboxes.send.size)) != 1) {
            return {};
        }
        const auto m = read_mailbox(w.data);
        if (!m) {
            return {};
        }
        EXPECT_EQ(m->type, type);
        return {m->payload.begin(), m->payload.end()};
    }
    Bytes ask(MailboxType type, const Bytes& payload) {
        post(type, payload);
        return fetch(type);
    }
    Bytes sdo(std::uint8_t command, std::uint16_t index, std::uint8_t sub, std::uint32_t value = 0,
              const Bytes& data = {}) {
        Bytes b(coe::sdo_bytes);
        coe::write_sdo(b.data(), coe::Service::sdo_request, {command, index, sub, value});
        b.insert(b.end(), data.begin(), data.end());
        return ask(MailboxType::coe, b);
    }
    /// Returns the abort code of a download of up to 4 bytes; 0: accepted.
    std::uint32_t download(std::uint16_t index, std::uint8_t sub, std::uint32_t value,
                           std::size_t bytes) {
        const auto r = coe::read_sdo(
            sdo(coe::expedited_command(coe::command::download, bytes), index, sub, value));
        return r && r->is(coe::command::abort) ? r->value : 0;
    }
    std::uint32_t upload(std::uint16_t index, std::uint8_t sub) {
        const auto r = coe::read_sdo(sdo(coe::command::upload, index, sub));
        return r ? r->value : 0xdeadbeef;
    }
};

}  // namespace esc_world
