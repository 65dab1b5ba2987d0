// SPDX-License-Identifier: MIT
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <vector>

#include "link/ethernet.hpp"
#include "link/system.hpp"

namespace hal::ethernet {

/// A shell command; false when it failed.
bool command(const std::string& line);
/// Why this program has no namespace of its own; empty: it has.
extern std::string no_namespace;

using Bytes = std::vector<std::uint8_t>;

/// Two interfaces joined by a cable, with names of their own in every test.
class Raw : public testing::Test {
protected:
    void SetUp() override {
        if (!no_namespace.empty()) {
            GTEST_SKIP() << no_namespace;
        }
        static int count = 0;
        a_ = "va" + std::to_string(++count);
        b_ = "vb" + std::to_string(count);
        make();
    }
    void TearDown() override { command("ip link del " + a_); }
    void make() const {
        ASSERT_TRUE(command("ip link add " + a_ + " type veth peer name " + b_));
        // Nothing but what the tests send.
        for (const auto& name : {a_, b_}) {
            command("sysctl -qw net.ipv6.conf." + name + ".disable_ipv6=1");
        }
        ASSERT_TRUE(command("ip link set " + a_ + " up") && command("ip link set " + b_ + " up"));
    }

    static std::unique_ptr<Port> open_or_fail(const std::string& address,
                                              const Options& options = {}) {
        auto opened = open(address, options);
        EXPECT_TRUE(opened) << opened.problem;
        EXPECT_TRUE(!opened || eventually([&] { return opened.port->statistics().up; }));
        return std::move(opened.port);
    }
    std::unique_ptr<Port> a(const Options& options = quick()) const {
        return open_or_fail("eth:" + a_, options);
    }
    std::unique_ptr<Port> b(const Options& options = quick()) const {
        return open_or_fail("eth:" + b_, options);
    }
    static Options quick() { return {.types = {0x88b5}, .policy = Policy::block}; }

    static Bytes frame(const Address& to, const Port& from, std::uint16_t type,
                       const Bytes& payload) {
        Bytes f(to.begin(), to.end());
        f.insert(f.end(), from.address().begin(), from.address().end());
        f.push_back(static_cast<std::uint8_t>(type >> 8));

        f.push_back(static_cast<std::uint8_t>(type));
        f.insert(f.end(), payload.begin(), payload.end());
        return f;
    }
    /// Whether it comes true while others may work; a test fails by this only when it never does.
    static bool eventually(const std::function<bool()>& condition) {
        for (int i = 0; i < 2000; ++i) {
            if (condition()) return true;
            usleep(5000);
        }
        return false;
    }
    /// The first payload byte of the next `count` frames; what comes is waited for, what does not
    /// is '-'.
    static std::string firsts(Port& port, int count) {
        std::string s;
        for (int i = 0; i < count; ++i) {
            if (!port.wait(link::monotonic_ns() + 5'000'000'000)) {
                s += '-';
                break;
            }
            const auto arrival = port.receive(link::monotonic_ns());
            s += arrival && arrival->bytes.size() > 14 ? static_cast<char>('0' + arrival->bytes[14])
                                                       : '?';
        }
        return s;
    }
    /// Nothing more is there. What a veth pair carries has arrived when send() returns.
    static bool silent(Port& port) { return !port.receive(link::monotonic_ns()); }

    std::string a_, b_;
};

}  // namespace hal::ethernet
