// SPDX-License-Identifier: MIT
// Options of `hal modbus` and `hal node modbus`.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "cli/option_set.hpp"

namespace hal::tools {

struct ModbusCheckOptions : Options {
    void declare(OptionSet& set) override {
        set.words("FILE", "configuration of a bus, NAME.modbus");
    }
};

struct ModbusPlanOptions : Options {
    bool json = false;
    std::int64_t thinking_ns = 5'000'000;

    void declare(OptionSet& set) override {
        set.word("FILE", "configuration of a bus, NAME.modbus");
        set.flag("--json", json, "print JSON");
        set.duration("--answer", thinking_ns,
                     "time after which a slave begins to answer (default 5ms)");
    }
};

/// Options of commands that open a line.
struct ModbusLineOptions : Options {
    std::int64_t timeout_ns = 200'000'000;
    bool rtu = false;

    void declare_line(OptionSet& set) {
        set.duration("--timeout", timeout_ns, "timeout of an answer: 50ms, 1s … (default 200ms)",
                     1'000'000);
        set.flag("--rtu", rtu, "RTU frames on a TCP connection, as serial servers carry them");
    }
};

struct ModbusAccessOptions : ModbusLineOptions {
    void declare(OptionSet& set) override {
        set.words("LINE SLAVE TABLE ADDRESS [COUNT | VALUE…]",
                  "the line, as in serial:/dev/ttyUSB0?baud=9600&format=8E1 or tcp:HOST:502; the "
                  "slave, 1..247, or 0 to write to all; coil, discrete, holding or input; an "
                  "address on the wire; of "
                  "read a count, of write the values");
        declare_line(set);
    }
};

struct ModbusScanOptions : ModbusLineOptions {
    int first = 1;
    int last = 247;

    void declare(OptionSet& set) override {
        set.word("LINE", "the line, as in serial:/dev/ttyUSB0?baud=9600&format=8E1");
        set.value("--first", first, "N", "first address (default 1)");
        set.value("--last", last, "N", "last address (default 247)");
        declare_line(set);
    }
};

struct ModbusMonitorOptions : Options {
    std::int64_t for_ns = -1;

    void declare(OptionSet& set) override {
        set.word("LINE", "a serial line: serial:/dev/ttyUSB0?baud=9600&format=8E1");
        set.for_how_long(for_ns, "end after 10s, 2min … (default: until Ctrl-C)");
    }
};

struct ModbusMb2halOptions : Options {
    std::string name;  ///< of the instance; empty: the one that started this program
    bool check = false;

    void declare(OptionSet& set) override {
        set.words("FILE", "LinuxCNC's configuration of mb2hal, or config=FILE");
        set.value("--name", name, "NAME",
                  "instance of the machine (default: the one that started this program)");
        set.flag("--check", check, "only check the file");
    }
};

struct ModbusNodeOptions : Options {
    std::string link;
    std::vector<std::string> faults, settings;
    std::int64_t for_ns = -1;
    std::int64_t thinking_ns = 2'000'000;
    bool verbose = false;

    void declare(OptionSet& set) override {
        set.word("FILE", "configuration of a bus, NAME.modbus");
        set.value("--link", link, "ADDRESS",
                  "the line: pty:/tmp/modbus, listen:5020, serial:/dev/ttyUSB1; default: that of "
                  "the file, whose tcp:HOST:PORT is listened on");
        set.values("--fault", faults, "FAULT",
                   "silence, late, corrupt, wrong-unit, exception or half, with options: "
                   "late:unit=2:every=50:late=120ms:from=1s:for=2s; may be repeated");
        set.values("--set", settings, "SLAVE.NAME=VALUE",
                   "set a value that the master reads; may be repeated");
        set.duration("--answer", thinking_ns,
                     "time after which a slave begins to answer (default 2ms)");
        set.flag("--verbose", verbose, "print the command and the speed of drives as they change");
        set.for_how_long(for_ns, "end after 10s, 2min … (default: until Ctrl-C)");
    }
};

/// The commands. Each returns the exit code.
int run_modbus_check(const ModbusCheckOptions&);
int run_modbus_plan(const ModbusPlanOptions&);
int run_modbus_read(const ModbusAccessOptions&);
int run_modbus_write(const ModbusAccessOptions&);
int run_modbus_scan(const ModbusScanOptions&);
int run_modbus_monitor(const ModbusMonitorOptions&);
int run_modbus_mb2hal(const ModbusMb2halOptions&);
int run_node_modbus(const ModbusNodeOptions&);

}  // namespace hal::tools
