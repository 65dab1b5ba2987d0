// SPDX-License-Identifier: MIT
// `hal ethercat lcec-conf`, and lcec_conf in netlists for LinuxCNC: checks the configuration of the
// component lcec before that is loaded, and shows its size as pins. It gives the path of the file
// to the component.
#include <fmt/core.h>
#include <nlohmann/json.hpp>

#include "bus/ethercat/bus_file.hpp"
#include "bus/ethercat/options.hpp"
#include "cli/output.hpp"
#include "cli/signals.hpp"
#include "control/client.hpp"
#include "ethercat/config/lcec_handover.hpp"
#include "machine/processes/address.hpp"

namespace hal::tools {

int run_ethercat_lcec_conf(const EthercatLcecOptions& options) {
    using nlohmann::json;
    if (options.words.size() != 1) {
        return fail(options, "exactly one file is required: lcec_conf ethercat-conf.xml");
    }
    StopRequest stop;
    ethercat::config::ReadResult reading;
    if (!read_bus_file(options, options.words.front(), reading)) return 1;
    if (!reading.lcec) {
        return fail(options,
                    fmt::format("'{}' is not LinuxCNC's ethercat-conf.xml", options.words.front()));
    }
    std::string problem;
    const auto client = Client::connect(instance_wanted(options.name), problem);
    if (!client) return fail(options, problem);
    const ethercat::config::LcecHandover handover(static_cast<long>(client->pid()),
                                                  options.words.front());
    if (!handover.problem().empty()) return fail(options, handover.problem());
    std::size_t slaves = 0;
    for (const auto& bus : reading.buses) {
        slaves += bus.setup.slaves.size();
    }
    const auto pin = [](const char* name, std::size_t value, const char* doc) {
        return json{
            {"name", name}, {"type", "u32"}, {"dir", "out"}, {"value", value}, {"doc", doc}};
    };
    const json reply = client->request(
        {{"component", "lcec_conf"},
         {"prefix", "lcec.conf"},
         {"pins",
          json::array({pin("master-count", reading.buses.size(), "masters of the configuration"),
                       pin("slave-count", slaves, "slaves of the configuration")})}});
    if (!reply.value("ok", false)) {
        return fail(options, reply.value("error", "the machine rejects the component"));
    }
    // It stays, as LinuxCNC's does, until the machine or unloadusr ends it.
    while (!stop.wait_ns(500'000'000)) {
        if (!client->look()) return 0;
    }
    client->request({{"exit", "lcec_conf"}});
    return 0;
}

}  // namespace hal::tools
