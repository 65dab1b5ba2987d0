// SPDX-License-Identifier: MIT
// The load arguments of both components, and the configuration that they name.
#pragma once

#include <stdexcept>
#include <string>

#include "bus/component/message_report.hpp"
#include "hal/component.hpp"
#include "hal/texts.hpp"
#include "modbus/config/plan.hpp"

namespace hal::modbus {

struct ModbusArguments {
    explicit ModbusArguments(hal::Component& component) : c(component) {}

    hal::Component& c;
    hal::TextArgument config{c,
                             "config",
                             "",
                             "configuration of the bus, NAME.modbus; a list makes an instance of "
                             "each",
                             {.per_instance = true}};
    hal::TextArgument link{c,
                           "link",
                           "",
                           "the line, overrides the configuration: serial:/dev/ttyUSB0, "
                           "tcp:HOST:PORT, sim:NAME",
                           {.per_instance = true}};

    // What load() reads.
    std::string file;  ///< path
    std::string text;
    Bus bus;
    Plan plan;
    bool loaded = false;

    /// Reads the configuration and reports what is wrong in it. `component` is for the help text.
    /// [setup]
    void load(const char* component) {
        const hal::Texts texts(c);
        if (config.get().empty()) {
            if (!texts.offered()) return;
            throw std::invalid_argument(std::string("missing configuration; type: loadrt ") +
                                        component + " config=FILE.modbus");
        }
        file = texts.find(config.get());
        text = texts.read("config", config.get());
        ReadResult result = read(text, config.get());
        hal::bus::report(texts, result.messages, file, text);
        bus = std::move(result.bus);
        if (!link.get().empty()) {
            bus.link = link.get();
        }
        if (bus.link.empty()) {
            throw std::invalid_argument(
                "missing line; write link = serial:/dev/ttyUSB0 in [bus] of " + config.get() +
                ", or link=sim:NAME behind it");
        }
        plan = make_plan(bus);
        loaded = true;
    }
};

}  // namespace hal::modbus
