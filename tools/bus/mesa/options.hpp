// SPDX-License-Identifier: MIT
// Options of `hal mesa` and `hal node mesa`.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "cli/option_set.hpp"

namespace hal::tools {

/// Options of commands that speak to a card.
struct MesaLinkOptions : Options {
    std::int64_t timeout_ns = 50'000'000;

    void declare_link(OptionSet& set) {
        set.duration("--timeout", timeout_ns,
                     "timeout of an answer: 20ms, 1s … (default 50ms); a request is tried 3 times",
                     1'000'000);
    }
};

struct MesaScanOptions : MesaLinkOptions {
    void declare(OptionSet& set) override {
        set.words("HOST|NETWORK/BITS",
                  "where to look: 10.10.10.10, 192.168.1.0/24 (default: 10.10.10.10 and "
                  "192.168.1.121, as cards are delivered)",
                  false);
        declare_link(set);
        timeout_ns = 100'000'000;
    }
};

struct MesaCardOptions : MesaLinkOptions {
    bool json = false;

    void declare(OptionSet& set) override {
        set.word("HOST", "the card, as in 10.10.10.10");
        set.flag("--json", json, "print JSON");
        declare_link(set);
    }
};

struct MesaAccessOptions : MesaLinkOptions {
    int space = 0;

    void declare(OptionSet& set) override {
        set.words("HOST ADDRESS [COUNT | VALUE…]",
                  "the card, as in 10.10.10.10; the address of a register, as in 0x1000; of read a "
                  "count, of write the values");
        set.value("--space", space, "N",
                  "memory space: 0 HostMot2 in 32 bits (default), 2 EEPROM, 4 timers, 6 status, 7 "
                  "card, in 16 bits");
        declare_link(set);
    }
};

struct MesaDoctorOptions : MesaLinkOptions {
    bool json = false;
    int count = 1000;
    std::int64_t period_ns = 1'000'000;

    void declare(OptionSet& set) override {
        set.word("HOST", "the card, as in 10.10.10.10");
        set.value("--count", count, "N", "requests (default 1000)");
        set.duration("--every", period_ns, "time between two requests (default 1ms)", 50'000);
        set.flag("--json", json, "print JSON");
        declare_link(set);
    }
};

struct MesaNodeOptions : Options {
    std::string address;
    std::vector<std::string> faults, settings;
    std::int64_t for_ns = -1;
    std::string loss;
    bool verbose = false;

    void declare(OptionSet& set) override {
        set.word("FILE", "configuration of a card, NAME.mesa");
        set.value("--address", address, "HOST[:PORT]",
                  "IP address of this computer on which the card answers; default: that of the "
                  "file, or 127.0.0.1");
        set.values(
            "--fault", faults, "FAULT",
            "drop-request, drop-reply, delay, duplicate, swap, wrong-length, wrong-cookie, "
            "stuck-counter, remote-lost, bite, reset, quadrature-error or other-master, with "
            "options: "
            "delay:every=50:delay=2ms:from=1s:for=2s; may be repeated");
        set.value("--loss", loss, "SHARE", "datagrams lost at random in each direction: 0.01, 1%");
        set.values("--set", settings, "INPUT=yes|no", "set an input of the file; may be repeated");
        set.flag("--verbose", verbose, "print the machine and the watchdog as they change");
        set.for_how_long(for_ns, "end after 10s, 2min … (default: until Ctrl-C)");
    }
};

/// The commands. Each returns the exit code.
int run_mesa_scan(const MesaScanOptions&);
int run_mesa_info(const MesaCardOptions&);
int run_mesa_pins(const MesaCardOptions&);
int run_mesa_read(const MesaAccessOptions&);
int run_mesa_write(const MesaAccessOptions&);
int run_mesa_doctor(const MesaDoctorOptions&);
int run_node_mesa(const MesaNodeOptions&);

}  // namespace hal::tools
