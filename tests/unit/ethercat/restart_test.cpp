// SPDX-License-Identifier: MIT
// A machine that is stopped while its slaves are started, at every cycle of the start-up.
#include <gtest/gtest.h>

#include <array>

#include "ethercat/config/config.hpp"
#include "ethercat/devices/registry.hpp"
#include "ethercat/master/request_queue.hpp"
#include "tests/unit/ethercat/fault_matrix.hpp"

namespace {

using namespace hal::ethercat;
using fault_matrix::FaultyPort;
using fault_matrix::LastEvents;
using Kind = master::MailboxRequest::Kind;

constexpr std::int64_t millisecond = 1'000'000;
constexpr unsigned stopped_ms = 10;

/// A drive whose mapping is written, and a slave with all mailbox protocols.
struct Machine {
    static constexpr const char* description = "servo\nmailbox_device\n";
    static constexpr const char* configuration =
        "[bus]\ncycle = 1ms\n"
        "[slave 0 x]\ndevice = cia402\nvendor = 0x00ffffff\n"
        "outputs = 6040 6060 60FF\ninputs = 6041 6061 6064 606C\n"
        "[slave 1 box]\nvendor = 0x00ffffff\n"
        "outputs = 7000 u64\ninputs = 6000 u64\n"
        "sdo 2001:0 s16 = 5\nidn S-0-15 = 07 00\n";

    explicit Machine(std::int64_t mailbox_delay_ns = 0) {
        devices = devices::make_line(devices::read_line(description));
        for (devices::Device& device : devices) {
            line.add({.controller = {.dc = device.dc},
                      .sii = device.sii,
                      .application = device.firmware.get()});
            device.firmware->faults().mailbox_delay_ns = mailbox_delay_ns;
        }
        const config::ReadResult read = config::read(configuration, "line.ethercat");
        EXPECT_EQ(config::to_string(read, "line.ethercat"), "");
        setup = read.buses.at(0).setup;
        line.power_on(0);
        master = std::make_unique<master::Master>(setup, port.address(), events, server.coe());
        for (std::size_t n = 0; n < server.workers(); ++n) {
            master->add(server.channel(n));
        }
        master->attach(port);
    }
    ~Machine() { server.stop(); }

    void cycle() {
        now_ns += millisecond;
        line.advance(now_ns);
        master->receive(now_ns);
        if (std::exchange(stopped, false)) {
            master->restart();
        }
        server.step(now_ns);
        master->transmit(now_ns);
    }
    void run(unsigned cycles) {
        while (cycles-- > 0) {
            cycle();
        }
    }
    /// Stops the cycles for a time; the next one starts the slaves again.
    void stop() {
        master->shut_down();
        stopped = true;
        for (unsigned n = 0; n < stopped_ms; ++n) {
            now_ns += millisecond;
            line.advance(now_ns);
        }
    }
    /// Returns the cycles after which `done()` is true; `most`: it never is.
    template <class Done>
    unsigned until(Done done, unsigned max) {
        unsigned n = 0;
        while (n < max && !done()) {
            cycle();
            ++n;
        }
        return n;
    }
    unsigned until_operational(unsigned max) {
        return until([&] { return !stopped && master->status().operational; }, max);
    }
    bool finished(master::MailboxRequest& request, unsigned max) {
        return until([&] { return requests.finished(request); }, max) < max;
    }
    std::string text() const { return events.text(setup); }

    std::vector<devices::Device> devices;
    esc::Line line;
    FaultyPort port{line};
    LastEvents events;
    master::Setup setup;
    master::Mailboxes mailboxes{8};
    master::RequestServer server{mailboxes,
                                 [this](std::uint16_t n) { return master->numbered(n); }};
    master::RequestPort& requests{server.open()};
    std::unique_ptr<master::Master> master;
    std::int64_t now_ns = 0;
    bool stopped = false;
};

/// Returns the time of the next stop: each millisecond at first, then some 50 more.
unsigned next_stop(unsigned after, unsigned whole) {
    constexpr unsigned each_millisecond = 60;
    if (after < each_millisecond) return after + 1;
    return after + std::max(1U, whole / 50);
}

struct EthercatRestart : testing::TestWithParam<unsigned> {};

TEST_P(EthercatRestart, Is_operational_again_whenever_the_start_up_before_was_stopped) {
    Machine m(GetParam() * millisecond);
    ASSERT_LT(m.until_operational(20'000), 20'000U) << m.text();
    m.stop();
    const unsigned usual = m.until_operational(20'000);
    ASSERT_LT(usual, 20'000U) << m.text();
    for (unsigned after = 1; after <= usual; after = next_stop(after, usual)) {
        m.stop();
        m.run(after);
        m.stop();
        const unsigned took = m.until_operational(20'000);
        ASSERT_LE(took, usual + 50) << "stopped " << after << " ms after the start" << m.text();
    }
}

TEST_P(EthercatRestart, Is_operational_whenever_the_first_start_up_was_stopped) {
    Machine undisturbed(GetParam() * millisecond);
    const unsigned usual = undisturbed.until_operational(20'000);
    ASSERT_LT(usual, 20'000U) << undisturbed.text();
    for (unsigned after = 1; after <= usual; after = next_stop(after, usual)) {
        Machine m(GetParam() * millisecond);
        m.run(after);
        m.stop();
        const unsigned took = m.until_operational(20'000);
        ASSERT_LE(took, usual + 50) << "stopped " << after << " ms after power-on" << m.text();
    }
}

INSTANTIATE_TEST_SUITE_P(MailboxDelay, EthercatRestart, testing::Values(0, 5, 20, 100));

/// A request of a user that is under way when the slaves are started again.
struct UserRequest {
    const char* name;
    Kind kind;
    std::uint16_t index;
    std::size_t bytes;
    const char* file;
};

std::ostream& operator<<(std::ostream& out, const UserRequest& r) { return out << r.name; }

struct EthercatRestartWithRequest : testing::TestWithParam<UserRequest> {};

TEST_P(EthercatRestartWithRequest, Neither_delays_the_start_up_nor_spoils_the_next_request) {
    const UserRequest& how = GetParam();
    Machine m(5 * millisecond);
    ASSERT_LT(m.until_operational(20'000), 20'000U) << m.text();
    m.stop();
    const unsigned usual = m.until_operational(20'000);
    for (unsigned after = 1; after <= 60; ++after) {
        std::vector<std::uint8_t> data(how.bytes);
        master::MailboxRequest request;
        request.kind = how.kind;
        request.slave = 1;
        request.index = how.index;
        request.name = how.file;
        request.data = data;
        ASSERT_TRUE(m.requests.submit(request));
        m.run(after);
        m.stop();
        const unsigned took = m.until_operational(20'000);
        ASSERT_LE(took, usual + 1'000) << "stopped " << after << " ms after it" << m.text();
        ASSERT_TRUE(m.finished(request, 20'000)) << "stopped " << after << " ms after it";

        std::array<std::uint8_t, 2> value{};
        master::MailboxRequest next;
        next.kind = Kind::sdo_upload;
        next.slave = 1;
        next.index = 0x2001;
        next.data = value;
        ASSERT_TRUE(m.requests.submit(next));
        ASSERT_TRUE(m.finished(next, 20'000));
        ASSERT_TRUE(next.result) << "stopped " << after << " ms after it";
        ASSERT_EQ(get<std::uint16_t>(value.data()), 5);
    }
}

INSTANTIATE_TEST_SUITE_P(
    Protocols, EthercatRestartWithRequest,
    testing::Values(UserRequest{"sdo_upload", Kind::sdo_upload, 0x2000, 2000, ""},
                    UserRequest{"sdo_download", Kind::sdo_download, 0x2000, 2000, ""},
                    UserRequest{"object_list", Kind::object_list, 1, 2000, ""},
                    UserRequest{"foe_read", Kind::foe_read, 0, 4000, "firmware"},
                    UserRequest{"foe_write", Kind::foe_write, 0, 2000, "firmware"},
                    UserRequest{"soe_read", Kind::soe_read, 17, 2000, ""},
                    UserRequest{"get_ip", Kind::get_ip, 0, 0, ""}),
    [](const auto& tested) { return tested.param.name; });

}  // namespace
