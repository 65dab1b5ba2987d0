// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "cli/option_set.hpp"

namespace hal::tools {

struct PanelOptions : Options {
    std::string name;       ///< the instance; empty: not given
    std::string component;  ///< name of the panel's component; empty: by its file
    std::string listen;     ///< empty: loopback only
    std::vector<std::string> hosts, origins, recordings;
    std::uint16_t port = 8080;
    std::int64_t for_ns = -1;
    bool write = false;
    bool only = false;      ///< pages can choose no other machine

    void declare(OptionSet& set) override {
        set.words("FILE", "a user panel: a .panel file, or an XML file of LinuxCNC's PyVCP", false);
        set.value("-N,--name", name, "NAME", "the instance to show");
        set.flag("--only", only, "let pages choose no other machine of this user");
        set.value("-p,--port", port, "PORT", "TCP port (default: 8080; 0: any free port)");
        set.flag("--write", write, "allow clients with the token to set values");
        set.value(
            "--listen", listen, "ADDRESS",
            "listen on this IPv4 address instead of 127.0.0.1; all clients then need the token");
        set.values(
            "--host", hosts, "NAME",
            "further host name of this computer in the address bar of a browser; may be repeated");
        set.values("--allow-origin", origins, "ORIGIN",
                   "page that may connect as a Foxglove client: https://app.foxglove.dev; may be "
                   "repeated");
        set.value("-c,--component", component, "NAME",
                  "name of the user panel's component (default: from its file)");
        set.values("--recording", recordings, "FILE",
                   "show this recording in the scope: an .mcap or .csv of `hal record`, its flight "
                   "recorder, or a journal with values; may be repeated");
        set.for_how_long(for_ns, "end after 10s … (default: run until Ctrl-C)");
    }
};

/// Runs `hal panel`. Returns the exit code.
int run_panel(const PanelOptions&);

}  // namespace hal::tools
