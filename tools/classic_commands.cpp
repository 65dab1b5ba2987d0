// SPDX-License-Identifier: MIT
// halcmd, halrun and lcec_conf.
#include "classic_commands.hpp"

#include <algorithm>
#include <cstdlib>
#include <fmt/core.h>
#include <getopt.h>
#include <vector>

#include "cli/output.hpp"
#include "command_line.hpp"
#include "control/client.hpp"
#include "inspect/shell.hpp"
#include "machine/processes/address.hpp"
#include "run/run.hpp"

namespace hal::tools {

namespace {

constexpr int bad_option = 255;

/// Handles an option letter of halcmd, also valid for halrun. Returns false for any other letter.
bool halcmd_letter(int letter, ExecutionOptions& options) {
    switch (letter) {
    case 'f': options.from_file = true; return true;
    case 'i': options.ini = ::optarg; return true;
    case 'k': options.keep_going = true; return true;
    case 'q': options.loudness = Loudness::errors; return true;
    case 'Q': options.loudness = Loudness::nothing; return true;
    case 'v':
    case 'V': options.loudness = Loudness::results; return true;
    case 's': options.script = true; return true;
    case 'e': options.echo = true; return true;
    default: return false;
    }
}

void move_words(Options& options, int argc, char** argv) {
    options.words.assign(argv + ::optind, argv + argc);
}

constexpr const char* halcmd_usage =
    "usage: halcmd [OPTION…] [COMMAND…]\n"
    "       halcmd [OPTION…] -f [FILE]\n\n"
    "  -f [FILE]   read commands from a file, or from standard input\n"
    "  -i INIFILE  INI file for [SECTION]KEY, with -f\n"
    "  -k          continue after an error\n"
    "  -q -Q -v    print errors only (the default), nothing, every result\n"
    "  -s          output for scripts\n"
    "  -e          echo each line on stderr\n"
    "  -R          accepted and ignored: no lock needs to be released\n"
    "  -h [NAME]   this text, or the help of a command; halcmd help lists the commands\n";

}  // namespace

int complete_word() {
    const char* line = std::getenv("COMP_LINE");
    const char* point = std::getenv("COMP_POINT");
    if (!line) return 0;
    std::string typed(line);
    if (point && *point) {
        typed.resize(
            std::min(typed.size(), static_cast<std::size_t>(std::strtoul(point, nullptr, 10))));
    }
    const auto command = typed.find_first_of(" \t");
    const auto begin =
        command == std::string::npos ? command : typed.find_first_not_of(" \t", command);
    typed = begin == std::string::npos ? "" : typed.substr(begin);
    std::string problem;
    const auto client = Client::connect(instance_wanted(""), problem);
    if (!client) return 1;
    std::string text;
    for (const Candidate& candidate : client->complete(typed, typed.size()).candidates) {
        text += candidate.text + "\n";
    }
    return exit_code(print(text));
}

int halcmd(int argc, char** argv) {
    RemoteShellOptions options;
    options.program = "halcmd";
    options.classic = true;
    for (int letter; (letter = ::getopt(argc, argv, "+RCfi:kqQsvVhe")) != -1;) {
        if (halcmd_letter(letter, options)) continue;
        if (letter == 'R') return 0;
        if (letter == 'C') return complete_word();
        if (letter != 'h') return bad_option;
        move_words(options, argc, argv);
        if (options.words.empty()) return exit_code(print(halcmd_usage));
        options.words.insert(options.words.begin(), "help");
        return run_shell(options);
    }
    move_words(options, argc, argv);
    if (options.words.empty() && !options.from_file) return exit_code(print(halcmd_usage));
    if (!options.ini.empty() && !options.from_file) {
        fail(options, "-i needs -f");
        return bad_option;
    }
    // a command as well is ignored
    if (options.from_file && options.words.size() > 1) {
        options.words.resize(1);
    }
    return run_shell(options);
}

namespace {

constexpr const char* halrun_usage =
    "usage: halrun [-I | -T] [HALCMD-OPTION…] [FILE.hal | FILE.tcl | FILE.ini]\n"
    "       halrun -U\n\n"
    "  -I          open the shell after the file\n"
    "  -T          read lines of Tcl after the file\n"
    "  -U          end the running instance\n"
    "Without a file, commands are read from the terminal or from standard input.\n";

int end_running(const Options& options) {
    std::string problem;
    const auto client = Client::connect(instance_wanted(""), problem);
    if (!client) {
        return 0;  // nothing runs: that is what was asked for
    }
    const Client::Answer answer = client->stop();
    if (answer.status != 0) {
        fail(options, answer.err);
    }
    return answer.status;
}

}  // namespace

int halrun(int argc, char** argv) {
    RunOptions options;
    options.program = "halrun";
    options.classic = true;
    for (int letter; (letter = ::getopt(argc, argv, "+IUTfi:kqQsvVhe")) != -1;) {
        if (halcmd_letter(letter, options)) continue;
        switch (letter) {
        case 'I': options.interactive = true; break;
        case 'U': return end_running(options);
        case 'T': options.tcl = true; break;
        case 'h': return exit_code(print(halrun_usage));
        default: return 1;
        }
    }
    move_words(options, argc, argv);
    if (options.words.size() > 1) {
        options.arguments.assign(options.words.begin() + 1, options.words.end());
        options.words.resize(1);
    }
    if (!options.words.empty()) {
        const std::string& file = options.words.front();
        if (!options.from_file && !file.ends_with(".hal") && !file.ends_with(".tcl") &&
            !file.ends_with(".ini")) {
            return fail(options, fmt::format("'{}': the name of a netlist must end with .hal, .tcl "
                                             "or .ini; or type: halrun -f {}",
                                             file, file));
        }
    }
    return run_run(options);
}

namespace {

/// Runs `hal GROUP COMMAND` with the arguments of another program.
int run_as(std::string group, std::string command, int argc, char** argv) {
    std::string hal = "hal";
    std::vector<char*> line{hal.data(), group.data(), command.data()};
    line.insert(line.end(), argv + std::min(argc, 1), argv + argc);
    const int words = static_cast<int>(line.size());
    line.push_back(nullptr);
    return run_command_line(words, line.data());
}

}  // namespace

/// The configuration program of LinuxCNC's EtherCAT component.
int lcec_conf(int argc, char** argv) { return run_as("ethercat", "lcec-conf", argc, argv); }

/// LinuxCNC's Modbus program.
int mb2hal(int argc, char** argv) { return run_as("modbus", "mb2hal", argc, argv); }

}  // namespace hal::tools
