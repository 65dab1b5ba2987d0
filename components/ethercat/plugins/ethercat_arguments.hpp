// SPDX-License-Identifier: MIT
// The load arguments of the ethercat component, and the configuration they select.
#pragma once

#include <stdexcept>
#include <string>
#include <utility>

#include <unistd.h>

#include "bus/component/message_report.hpp"
#include "ethercat/config/config.hpp"
#include "ethercat/config/igh_conf.hpp"
#include "ethercat/config/lcec_handover.hpp"
#include "hal/assumed.h"
#include "hal/component.hpp"
#include "hal/naming.hpp"
#include "hal/texts.hpp"
#include "hal/unstarted.h"
#include "text/numbers.hpp"

namespace hal::ethercat {

struct EthercatArguments {
    /// `lcec`: the file is that of `loadusr lcec_conf FILE`, and there is an instance for each of
    /// its masters.
    EthercatArguments(hal::Component& component, const char* usual_file, bool lcec)
        : component_(component), usual_file_(usual_file), lcec_(lcec) {}

    hal::Component& component_;
    const char* usual_file_;  ///< without `config`
    const bool lcec_;
    hal::TextArgument file{component_,
                           "config",
                           usual_file_,
                           "configuration file NAME.ethercat, or LinuxCNC's ethercat-conf.xml; a "
                           "list makes an instance of each",
                           {.per_instance = true}};
    hal::TextArgument link{component_,
                           "link",
                           "",
                           "link address, overrides the configuration: eth:enp3s0, sim:NAME, …",
                           {.per_instance = true}};
    hal::TextArgument backup{
        component_,
        "backup",
        "",
        "link address of the port that closes a ring, overrides the configuration",
        {.per_instance = true}};
    hal::TextArgument gateway{component_,
                              "gateway",
                              "",
                              "address of the mailbox gateway, overrides the configuration: "
                              "127.0.0.1, 127.0.0.1:34980, none",
                              {.per_instance = true}};
    hal::Argument number{component_,
                         "master",
                         lcec_ ? -1 : 0,
                         lcec_ ? "which master of the configuration, from 0; -1: lcec.N drives "
                                 "number N, and there is an instance for each"
                               : "of a configuration with several masters: which one, from 0",
                         {.per_instance = true, .min = lcec_ ? -1 : 0, .max = 63}};

    hal::Argument cycle{component_,
                        "cycle",
                        0,
                        "cycle time in ns, overrides the configuration; 0: as there",
                        {.per_instance = true, .min = 0, .max = 1'000'000'000}};

    /// Reads the configuration. Reports every problem with its place in the file where the host can
    /// show it. Throws hal::ArgumentError, or the exception that ends the constructor once the
    /// problems are reported. [setup]
    config::Bus read() const {
        const hal::Texts texts(component_);
        // only its documentation is wanted
        if (!texts.offered() && file.get() == usual_file_) {
            return {};
        }
        if (file.get().empty()) {
            throw std::invalid_argument(
                "missing configuration; type: loadrt ethercat config=FILE.ethercat");
        }
        const std::string path = path_of_file(texts);
        std::string text;
        if (!config::read_from_disk(path, text)) {
            throw hal::ArgumentError(
                "config", origin_of(path) + "cannot read file '" + path + "': " + text,
                lcec_ ? "write its name: loadusr -W lcec_conf FILE.xml, or loadrt lcec "
                        "config=FILE.xml"
                      : "");
        }
        config::ReadResult reading =
            config::read(text, path, config::read_from_disk, [](const std::string& slave) {
            const auto* const assumed = hal::extension<hal_assumed>(HAL_ASSUMED);
            return assumed != nullptr && assumed->is_assumed(hal::detail::creating, slave.c_str());
        });
        hal::bus::report(texts, reading.messages, path, text);
        const auto wanted =
            number >= 0 ? static_cast<std::size_t>(number) : own_master(reading.buses.size());
        if (wanted >= reading.buses.size()) {
            throw hal::ArgumentError(
                "master", "master=" + std::to_string(wanted) + ": the configuration has " +
                              std::to_string(reading.buses.size()) +
                              (reading.buses.size() == 1 ? " master" : " masters"));
        }
        config::Bus bus = std::move(reading.buses[wanted]);
        const std::int64_t cycle_ns = cycle;
        if (cycle_ns != 0 && reading.lcec) {
            throw hal::ArgumentError(
                "cycle", "cycle=" + std::to_string(cycle_ns) +
                             ": the cycle of this format is appTimePeriod; change it in the file");
        }
        if (cycle_ns != 0) {
            check_samples(bus, cycle_ns);
            bus.setup.cycle_ns = cycle_ns;
        }
        if (!link.get().empty()) {
            bus.link = link.get();
        } else if (reading.lcec && texts.offered()) {
            find_links(path, bus);
        }
        if (!backup.get().empty()) {
            bus.backup = backup.get();
        }
        if (!gateway.get().empty() && !config::read_gateway(gateway.get(), bus)) {
            throw hal::ArgumentError("gateway",
                                     "gateway=" + gateway.get() +
                                         ": expected none, or an IPv4 address and perhaps a port",
                                     "write gateway=127.0.0.1:34980");
        }
        return bus;
    }

private:
    /// Returns what named the file, as the beginning of an error.
    std::string origin_of(const std::string& path) const {
        const bool is_named_elsewhere =
            lcec_ && file.get() == usual_file_ && !path.ends_with(usual_file_);
        return is_named_elsewhere ? "lcec_conf: " : "config=" + file.get() + ": ";
    }

    /// Returns the path of the configuration: as written, or for `lcec` that of `lcec_conf`, which
    /// `hal check` does not start.
    std::string path_of_file(const hal::Texts& texts) const {
        if (!lcec_ || file.get() != usual_file_) return texts.find(file.get());
        const std::string handed = config::lcec_configuration(getpid());
        if (!handed.empty()) return handed;
        const auto* const unstarted = hal::extension<hal_unstarted>(HAL_UNSTARTED);
        const char* const checked =
            unstarted ? unstarted->argument(hal::detail::creating, "lcec_conf") : nullptr;
        return texts.find(checked ? checked : file.get());
    }

    /// Rejects a cycle that is not the one whose parts are the samples of a slave.
    static void check_samples(const config::Bus& bus, std::int64_t cycle_ns) {
        if (cycle_ns == bus.setup.cycle_ns) return;
        for (const master::Slave& slave : bus.setup.slaves) {
            if (slave.oversampling < 2) continue;
            throw hal::ArgumentError("cycle",
                                     "cycle=" + std::to_string(cycle_ns) + ": '" + slave.name +
                                         "' has " + std::to_string(slave.oversampling) +
                                         " samples in the cycle of the file, " +
                                         std::to_string(bus.setup.cycle_ns) + " ns",
                                     "change cycle in [bus]");
        }
    }
    /// Returns which master an instance lcec.N drives: N. The first one lets the host make one for
    /// each. [setup]
    static std::size_t own_master(std::size_t masters) {
        const std::string name = hal::own_name("lcec.0");
        const auto n = name.starts_with("lcec.") ? parse_natural(std::string_view(name).substr(5))
                                                 : std::nullopt;
        if (!n) {
            return 0;  // names= has another name
        }
        if (const auto* naming = hal::extension<hal_naming>(HAL_NAMING);
            naming != nullptr && *n == 0 && masters > 1) {
            naming->count(hal::detail::creating, "master", masters);
        }
        return static_cast<std::size_t>(*n);
    }
    /// Finds the interface of LinuxCNC's format. Without one the netlist can be checked, but the
    /// master cannot start.
    static void find_links(const std::string& path, config::Bus& bus) {
        const std::size_t slash = path.rfind('/');
        config::IghLinks found =
            config::find_igh_links(slash == path.npos ? "." : path.substr(0, slash), bus.index);
        if (!found.problem.empty()) {
            throw hal::ArgumentError(
                "link", found.problem,
                "correct the file, or write link=eth:enp3s0; `ip link` lists the addresses");
        }
        if (found.file.empty()) {
            const std::string device = "MASTER" + std::to_string(bus.index) + "_DEVICE";
            bus.missing_link =
                "link= is missing: ethercat-conf.xml has no interface, and no file ethercat.conf "
                "has " +
                device +
                "; write loadrt lcec link=eth:enp3s0, or link=sim:NAME for an emulated line; or " +
                device + "=\"enp3s0\" in an ethercat.conf beside '" + path + "'";
            return;
        }
        bus.link = std::move(found.link);
        bus.backup = std::move(found.backup);
    }
};

}  // namespace hal::ethercat
