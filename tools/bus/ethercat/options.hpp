// SPDX-License-Identifier: MIT
// Options of the `hal ethercat` commands. Compiled into `hal` for its help: no bus library here.
#pragma once

#include <cstdint>
#include <string>

#include "cli/option_set.hpp"

namespace hal::tools {

/// Options of all commands: which bus, and the form of the output.
struct EthercatOptions : Options {
    std::string emulate;  ///< description of an emulated line, or a file with one; empty: not given
    bool json = false;

    void declare(OptionSet& set) override {
        set.words("ADDRESS", "eth:enp3s0; not with --emulate", false);
        declare_bus(set);
    }

protected:
    void declare_bus(OptionSet& set) {
        set.value("--emulate", emulate, "LINE",
                  "emulate these devices instead of a bus: \"coupler, servo axes=2\", or a file "
                  "with one device per line");
        set.flag("--json", json, "print JSON");
    }
};

/// Options of `config`, which writes files for a bus or for descriptions.
struct EthercatConfigOptions : EthercatOptions {
    std::string esi;
    std::string descriptions;

    void declare(OptionSet& set) override {
        set.words("ADDRESS NAME",
                  "eth:enp3s0, not with --emulate; then the name of the files: NAME.ethercat and "
                  "NAME.hal",
                  false);
        declare_bus(set);
        set.value("--esi", esi, "LIST",
                  "write the files for these descriptions instead of the slaves on a bus: "
                  "FILE.xml, or FILE.xml:DEVICE, separated by commas; between single quotes if it "
                  "contains commas");
        set.value("--descriptions", descriptions, "FOLDER",
                  "take what the makers' files (ESI) of this folder, or this file, have on the "
                  "slaves of the bus instead of what their EEPROMs have");
    }
};

/// Options of the commands that concern one slave.
struct EthercatPositionOptions : EthercatOptions {
    int position = -1;  ///< -1: not given

    void declare(OptionSet& set) override {
        set.words("ADDRESS ARG",
                  "eth:enp3s0, not with --emulate; then the arguments of the command: numbers in "
                  "decimal, 0x… or 0…",
                  false);
        declare_bus(set);
        set.value("-p,--position", position, "N",
                  "position of the slave, counted from 0; not needed for a single slave")
            .in(0, 65535);
    }
};

/// Options of the commands for files.
struct EthercatFileOptions : EthercatPositionOptions {
    bool boot = false;
    std::uint32_t password = 0;

    void declare(OptionSet& set) override {
        EthercatPositionOptions::declare(set);
        set.flag("--boot", boot, "in BOOT instead of PRE-OP: firmware");
        set.value("--password", password, "N", "password of the file (default 0)");
    }
};

/// Options of the commands for values.
struct EthercatValueOptions : EthercatPositionOptions {
    std::string type;

    void declare(OptionSet& set) override {
        EthercatPositionOptions::declare(set);
        set.value("-t,--type", type, "TYPE",
                  "type of the value: bool, int8 … int64, uint8 … uint64, float, double, string, "
                  "octet_string");
    }
};

/// Options of `check` and `plan`, which need no bus.
struct EthercatCheckOptions : Options {
    bool json = false;

    void declare(OptionSet& set) override {
        set.words("FILE", "configurations, NAME.ethercat or LinuxCNC's ethercat-conf.xml");
        set.flag("--json", json, "print JSON");
    }
};
struct EthercatPlanOptions : Options {
    std::string svg;
    bool json = false;

    void declare(OptionSet& set) override {
        set.words("FILE",
                  "configuration of the bus, NAME.ethercat or LinuxCNC's ethercat-conf.xml");
        set.value("--svg", svg, "FILE",
                  "draw the timing of a cycle to this file; -: standard output");
        set.flag("--json", json, "print JSON");
    }
};

struct EthercatLcecOptions : Options {
    std::string name;  ///< of the instance; empty: the one that started this program

    void declare(OptionSet& set) override {
        set.words("FILE", "LinuxCNC's ethercat-conf.xml");
        set.value("--name", name, "NAME",
                  "instance of the machine (default: the one that started this program)");
    }
};

struct EthercatDumpOptions : Options {
    std::string filter;
    std::int64_t for_ns = -1;  ///< -1: not given
    std::uint64_t count = 0;  ///< 0: not given
    bool json = false;

    void declare(OptionSet& set) override {
        set.words("ADDRESS|FILE", "eth:enp3s0, or a capture of Wireshark: FILE.pcapng, FILE.pcap");
        set.value("--filter", filter, "WORD",
                  "only datagrams with this word in the line: FPRD, CoE, 'AL status', 0x1001");
        set.for_how_long(for_ns, "end after 5s, 500ms … (default: on Ctrl-C)");
        set.value("-n,--count", count, "N", "end after N datagrams");
        set.flag("--json", json, "print a JSON object per line");
    }
};

/// Each returns the exit code.
int run_ethercat_scan(const EthercatOptions&);
int run_ethercat_slaves(const EthercatOptions&);
int run_ethercat_states(const EthercatPositionOptions&);
int run_ethercat_crc(const EthercatOptions&);
int run_ethercat_upload(const EthercatValueOptions&);
int run_ethercat_download(const EthercatValueOptions&);
int run_ethercat_reg_read(const EthercatPositionOptions&);
int run_ethercat_reg_write(const EthercatPositionOptions&);
int run_ethercat_sii_read(const EthercatPositionOptions&);
int run_ethercat_sii_write(const EthercatPositionOptions&);
int run_ethercat_alias(const EthercatPositionOptions&);
int run_ethercat_pdos(const EthercatOptions&);
int run_ethercat_sdos(const EthercatPositionOptions&);
int run_ethercat_foe_read(const EthercatFileOptions&);
int run_ethercat_foe_write(const EthercatFileOptions&);
int run_ethercat_config(const EthercatConfigOptions&);
int run_ethercat_xml(const EthercatPositionOptions&);
int run_ethercat_graph(const EthercatOptions&);
int run_ethercat_dc(const EthercatOptions&);
int run_ethercat_dump(const EthercatDumpOptions&);
int run_ethercat_check(const EthercatCheckOptions&);
int run_ethercat_plan(const EthercatPlanOptions&);
int run_ethercat_lcec_conf(const EthercatLcecOptions&);

}  // namespace hal::tools
