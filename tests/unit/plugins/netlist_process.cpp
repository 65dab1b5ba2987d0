// SPDX-License-Identifier: MIT
// netlist_process PLUGINS real|virtual NETLIST: loads the netlist, starts the threads, runs 200
// cycles. Status 3: the netlist was rejected.
#include <iostream>
#include <string_view>

#include "commands/table.hpp"
#include "machine/session.hpp"

int main(int argc, char** argv) {
    if (argc != 4) return 2;
    hal::SessionOptions options;
    options.plugin_path = {argv[1]};
    options.virtual_clock = std::string_view(argv[2]) == "virtual";
    hal::Session session(options);
    hal::Diagnostics diagnostics;
    const auto source = session.sources.add("netlist", argv[3]);
    hal::Transaction transaction = session.begin();
    for (const hal::Command& command :
         hal::parse(session.sources, source, {&session.ini, {}}, diagnostics)) {
        hal::apply_edit(transaction, command, diagnostics);
    }
    if (!transaction.commit(diagnostics)) {
        std::cerr << hal::render(diagnostics, session.sources);
        return 3;
    }
    session.threads().start();
    session.threads().advance_cycles(200);
    return 0;
}
