// SPDX-License-Identifier: MIT
// The load arguments of the canopen component, and the configuration they select.
#pragma once

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>

#include "bus/component/message_report.hpp"
#include "canopen/master/config/bus_schedule.hpp"
#include "canopen/master/config/config_lines.hpp"
#include "canopen/master/config/master_config.hpp"
#include "hal/component.hpp"
#include "hal/texts.hpp"

namespace hal::canopen {

struct ConfigurationArguments {
    explicit ConfigurationArguments(hal::Component& component) : component_(component) {}

    hal::Component& component_;
    hal::TextArgument file{component_,
                           "config",
                           "",
                           "configuration file NAME.canopen; a list makes an instance of each",
                           {.per_instance = true}};
    hal::TextArgument link{component_,
                           "link",
                           "",
                           "bus address, overrides the configuration: can:can0, sim:NAME, …",
                           {.per_instance = true}};
    hal::TextArgument inputs{component_, "inputs", "",
                             "without a configuration: objects the node receives, by index: "
                             "decimal or 0x…, INDEX:SUB, INDEX/BITS"};
    hal::TextArgument outputs{component_, "outputs", "",
                              "without a configuration: objects the node sends"};
    hal::Argument node_id{component_,
                          "slavenodeid",
                          0,
                          "without a configuration: node ID of the node",
                          {.per_instance = true, .min = 0, .max = 127}};
    hal::Argument own_id{component_,
                         "masternodeid",
                         127,
                         "without a configuration: node ID of the master",
                         {.min = 1, .max = 127}};
    hal::TextArgument bit_rate{
        component_, "bitrate", "",
        "without a configuration: bit rate of the bus in bit/s; 1000000 if not given"};
    hal::TextArgument eds{component_, "eds", "",
                          "without a configuration: device description of the node"};

    /// Returns true for a single node described by the indices of its objects, without a
    /// configuration file. [setup]
    bool by_index() const { return node_id != 0; }

    /// Reads the configuration; `path` becomes that of its file, empty without one. Reports every
    /// problem with its place in the file where the host can show it. Throws hal::ArgumentError, or
    /// the exception that ends the constructor once the problems are reported. [setup]
    config::MasterConfig read(std::string& path) const {
        const hal::Texts texts(component_);
        config::ReadResult reading;
        if (by_index() && file.get().empty()) {
            reading = read_by_index(texts);
        } else if (!file.get().empty()) {
            reject_unused();
            path = texts.find(file.get());
            std::string text;
            if (!config::read_from_disk(path, text)) {
                throw hal::ArgumentError("config", "config=" + file.get() + ": cannot read file '" +
                                                       path + "': " + text);
            }
            reading = config::read(text, path);
            if (reading.good() && reading.config.sync != config::SyncMode::cycle) {
                auto more = config::load_messages(
                    reading.config,
                    reading.config.sync_period != 0 ? reading.config.sync_period : millisecond,
                    path);
                std::move(more.begin(), more.end(), std::back_inserter(reading.messages));
            }
            hal::bus::report(texts, reading.messages, path, text);
        } else if (texts.offered()) {
            throw std::invalid_argument(
                "missing configuration; type: loadrt canopen config=FILE.canopen; or for a single "
                "node: loadrt canopen inputs=24831 "
                "outputs=24675 slavenodeid=2");
        }
        if (!link.get().empty()) {
            reading.config.link = link.get();
        }
        return std::move(reading.config);
    }

private:
    config::ReadResult read_by_index(const hal::Texts& texts) const {
        auto reading = config::read(config::ByIndex{
            inputs.get(), outputs.get(), eds.get().empty() ? "" : texts.find(eds.get()),
            static_cast<unsigned>(node_id), static_cast<unsigned>(own_id)});
        if (!reading.good()) {
            reject(reading);
        }
        if (reading.config.nodes.size() == 1 && reading.config.nodes[0].pdos.empty()) {
            throw std::invalid_argument(
                "missing objects of the node; write inputs=24831 outputs=24675");
        }
        if (const std::string& text = bit_rate.get(); !text.empty()) {
            const auto bits = config::rate(text);
            if (!bits) {
                throw hal::ArgumentError("bitrate", "bitrate=" + text + ": invalid bit rate '" +
                                                        text + "'; write 1M, 500k or 125000");
            }
            reading.config.bit_rate = *bits;
        }
        return reading;
    }

    [[noreturn]] static void reject(const config::ReadResult& reading) {
        const auto error = std::find_if(
            reading.messages.begin(), reading.messages.end(),
            [](const config::Message& m) { return m.severity == config::Severity::error; });
        const std::string text = error->sentence + (error->help.empty() ? "" : "; " + error->help);
        if (error->argument.empty()) throw std::invalid_argument(text);
        throw hal::ArgumentError(error->argument, text);
    }

    void reject_unused() const {
        if (by_index()) {
            throw hal::ArgumentError("slavenodeid",
                                     "slavenodeid= and config= are both given; remove "
                                     "slavenodeid=, the nodes are in the configuration");
        }
        for (const auto& [argument, name] : {std::pair{&inputs, "inputs"},
                                             {&outputs, "outputs"},
                                             {&eds, "eds"},
                                             {&bit_rate, "bitrate"}}) {
            if (!argument->get().empty()) {
                throw hal::ArgumentError(name, std::string(name) + "=" + argument->get() +
                                                   ": the configuration sets this; remove " + name +
                                                   "= or config=");
            }
        }
        if (own_id != 127) {
            throw hal::ArgumentError(
                "masternodeid", "masternodeid=" + std::to_string(static_cast<unsigned>(own_id)) +
                                    ": the configuration sets this with node-id in [bus]; remove "
                                    "masternodeid= or config=");
        }
    }
};

}  // namespace hal::canopen
