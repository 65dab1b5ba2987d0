// SPDX-License-Identifier: MIT
// The program `haltcl`: a Tcl script or lines of Tcl, whose commands go to a running machine. User
// interfaces run it for .tcl files of [HAL]POSTGUI_HALFILE.
#include <filesystem>
#include <fmt/core.h>
#include <unistd.h>

#include "cli/output.hpp"
#include "control/client.hpp"
#include "tcl/tcl.hpp"
#include "text/diagnostic.hpp"

namespace hal::tools {

namespace {

constexpr const char* haltcl_usage =
    "usage: haltcl [-i INIFILE] [FILE.tcl [ARG…]]\n\n"
    "Runs a Tcl script on a running machine: each command of halcmd is a Tcl command, and `hal "
    "COMMAND …` too.\n"
    "Without a file, reads commands from standard input.\n\n"
    "  -i INIFILE  makes an array of each section: $::SECTION(KEY)\n"
    "  -h          this text\n";

}  // namespace

int haltcl(int argc, char** argv) {
    Options options;
    options.program = "haltcl";
    TclScript script{};
    int at = 1;
    for (; at < argc && argv[at][0] == '-'; ++at) {
        const std::string_view option(argv[at]);
        if (option == "-h" || option == "--help") return exit_code(print(haltcl_usage));
        if (option != "-i" && option != "-ini") {
            return fail(options, fmt::format("unknown option '{}'; see: haltcl -h", option));
        }
        if (++at == argc) {
            return fail(options, fmt::format("missing INI file; type: haltcl {} FILE.ini", option));
        }
        script.ini_path = argv[at];
    }
    if (at < argc) {
        script.path = argv[at++];
    }
    script.arguments.assign(argv + at, argv + argc);
    Sources sources;
    Diagnostics diagnostics;
    Ini ini;
    if (!script.ini_path.empty()) {
        ini = Ini::read(sources, script.ini_path, diagnostics);
    }
    write_all(STDERR_FILENO, render(diagnostics, sources, colours(STDERR_FILENO)));
    if (diagnostics.failed()) return 1;
    script.ini = &ini;
    std::string problem;
    const auto client = Client::connect(instance_wanted(""), problem);
    if (!client) return fail(options, problem);
    Client::Options how;
    std::error_code unknown;
    how.directory = std::filesystem::current_path(unknown).string();
    for (const Ini::Entry& entry : ini.entries()) {
        how.ini.push_back(
            {entry.section, entry.key, entry.value, sources.location(entry.at, false)});
    }
    if (!client->set_options(how)) {
        return fail(options, fmt::format("instance '{}' does not respond", client->instance()));
    }
    const int status = run_tcl(script, [&](const std::vector<std::string>& words) {
        Client::Answer answer = client->run(words, "<haltcl>");
        return TclAnswer{answer.status, std::move(answer.out), std::move(answer.err)};
    }, -1, problem);
    return status < 0 ? fail(options, problem) : status;
}

}  // namespace hal::tools
