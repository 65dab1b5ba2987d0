// SPDX-License-Identifier: MIT
// The load arguments, and the configuration that they name.
#pragma once

#include <stdexcept>
#include <string>

#include "bus/component/message_report.hpp"
#include "demo_bus/config/demo_config.hpp"
#include "hal/component.hpp"
#include "hal/texts.hpp"

namespace hal::demo {

struct DemoArguments {
    explicit DemoArguments(hal::Component& component) : c(component) {}

    hal::Component& c;
    hal::TextArgument config{c, "config", "", "configuration of the bus, NAME.demo"};
    hal::TextArgument link{c, "link", "", "the CAN bus: can:can0, sim:NAME"};

    // What load() reads.
    Bus bus;
    bool loaded = false;  ///< false in `hal doc`, which has no file

    /// Reads the configuration and reports what is wrong in it. [setup]
    void load() {
        const hal::Texts texts(c);
        if (config.get().empty()) {
            if (!texts.offered()) return;
            throw std::invalid_argument(
                "missing configuration; type: loadrt demo config=FILE.demo link=can:can0");
        }
        const std::string text = texts.read("config", config.get());
        ReadResult result = read(text);
        hal::bus::report(texts, result.messages, texts.find(config.get()), text);
        bus = std::move(result.bus);
        loaded = true;
    }
};

}  // namespace hal::demo
