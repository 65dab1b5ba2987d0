// SPDX-License-Identifier: MIT
// The load arguments of the ethercat component, and the configuration they select.
#pragma once

#include <stdexcept>
#include <string>
#include <utility>

#include "ethercat/config/config.hpp"
#include "hal/component.hpp"
#include "hal/texts.hpp"

namespace hal::ethercat {

struct EthercatArguments {
    EthercatArguments(hal::Component& component, const char* usual_file) : component_(component), usual_file_(usual_file) {}

    hal::Component&   component_;
    const char*       usual_file_;  ///< without `config`
    hal::TextArgument file{component_,
                           "config",
                           usual_file_,
                           "configuration file NAME.ethercat, or LinuxCNC's ethercat-conf.xml; a list makes an instance of each",
                           {.per_instance = true}};
    hal::TextArgument link{
        component_, "link", "", "link address, overrides the configuration: eth:enp3s0, sim:NAME, …", {.per_instance = true}};
    hal::TextArgument backup{
        component_, "backup", "", "link address of the port that closes a ring, overrides the configuration", {.per_instance = true}};
    hal::TextArgument gateway{component_,
                              "gateway",
                              "",
                              "address of the mailbox gateway, overrides the configuration: 127.0.0.1, 127.0.0.1:34980, none",
                              {.per_instance = true}};
    hal::Argument number{
        component_, "master", 0, "of a configuration with several masters: which one, from 0", {.per_instance = true, .min = 0, .max = 63}};

    hal::Argument cycle{component_,
                        "cycle",
                        0,
                        "cycle time in ns, overrides the configuration; 0: as there",
                        {.per_instance = true, .min = 0, .max = 1'000'000'000}};

    /// Reads the configuration. Reports every problem with its place in the file where the host can show it. Throws hal::ArgumentError, or the
    /// exception that ends the constructor once the problems are reported. [setup]
    config::Bus read() const {
        const hal::Texts texts(component_);
        if (!texts.offered() && file.get() == usual_file_) return {};  // only its documentation is wanted
        if (file.get().empty()) throw std::invalid_argument("missing configuration; type: loadrt ethercat config=FILE.ethercat");
        const std::string path = texts.find(file.get());
        std::string       text;
        if (!config::read_from_disk(path, text))
            throw hal::ArgumentError("config", "config=" + file.get() + ": cannot read file '" + path + "': " + text);
        config::Reading reading = config::read(text, path);
        report(texts, reading, path, text);
        const auto wanted = static_cast<std::size_t>(number);
        if (wanted >= reading.buses.size())
            throw hal::ArgumentError("master", "master=" + std::to_string(wanted) + ": the configuration has " +
                                                   std::to_string(reading.buses.size()) +
                                                   (reading.buses.size() == 1 ? " master" : " masters"));
        config::Bus        bus = std::move(reading.buses[wanted]);
        const std::int64_t cycle_ns = cycle;
        if (cycle_ns != 0 && reading.lcec)
            throw hal::ArgumentError(
                "cycle", "cycle=" + std::to_string(cycle_ns) + ": the cycle of this format is appTimePeriod; change it in the file");
        if (cycle_ns != 0) bus.setup.cycle_ns = cycle_ns;
        if (!link.get().empty()) bus.link = link.get();
        else if (reading.lcec && texts.offered())
            throw hal::ArgumentError("link", "link= is missing: this format has no interface",
                                     "write link=eth:enp3s0, or link=sim:NAME for an emulated line");
        if (!backup.get().empty()) bus.backup = backup.get();
        if (!gateway.get().empty() && !config::read_gateway(gateway.get(), bus))
            throw hal::ArgumentError("gateway", "gateway=" + gateway.get() + ": expected none, or an IPv4 address and perhaps a port",
                                     "write gateway=127.0.0.1:34980");
        return bus;
    }

private:
    static void report(const hal::Texts& texts, const config::Reading& reading, const std::string& path, const std::string& text) {
        if (!texts.offered() && !reading.good()) throw std::invalid_argument(config::to_string(reading, path));
        texts.begin(path, text);
        for (const config::Message& m : reading.messages)
            if (m.severity != hal::Severity::note)
                texts.report(static_cast<hal_severity>(m.severity), config::code_of(m.topic), m.at.offset, m.at.offset + m.at.length,
                             m.sentence, m.label, m.help);
        if (!reading.good()) hal::Texts::fail();
    }
};

}  // namespace hal::ethercat
