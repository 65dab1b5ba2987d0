// SPDX-License-Identifier: MIT
// halmeter, halscope and halshow: LinuxCNC's windows are views of ours, in the terminal or in a
// browser.
#include "classic_views.hpp"

#include <fmt/core.h>
#include <string>
#include <unistd.h>
#include <vector>

#include "cli/output.hpp"
#include "command_line.hpp"
#include "text/characters.hpp"

namespace hal::tools {
namespace {

int run_hal(std::vector<std::string> words) {
    words.insert(words.begin(), "hal");
    std::vector<char*> line;
    for (std::string& word : words) {
        line.push_back(word.data());
    }
    line.push_back(nullptr);
    return run_command_line(static_cast<int>(words.size()), line.data());
}

int complain(const char* program, const std::string& text) {
    write_all(STDERR_FILENO, fmt::format("{}: {}\n", program, text));
    return 1;
}

}  // namespace

// halmeter [-s] [-g X Y [WIDTH]] [pin|sig|param NAME]
int halmeter(int argc, char** argv) {
    std::string name;
    for (int i = 1; i < argc; ++i) {
        const std::string word = argv[i];
        if (word == "-s") continue;
        if (word == "-g") {
            while (i + 1 < argc && is_digit(argv[i + 1][0])) {
                ++i;
            }
            continue;
        }
        if ((word == "pin" || word == "sig" || word == "signal" || word == "par" ||
             word == "param" || word == "parameter") &&
            i + 1 < argc) {
            continue;
        }
        if (word.starts_with('-') || !name.empty()) {
            return complain(
                "halmeter",
                fmt::format("unexpected argument '{}'; usage: halmeter [pin|sig|param] NAME",
                            word));
        }
        name = word;
    }
    if (name.empty()) {
        return complain("halmeter",
                        "which value? Type: halmeter pin NAME; hal shell show pin lists the pins");
    }
    return run_hal({"meter", name});
}

// halscope [-h] [NAME…]: with names in the terminal, else in a browser.
int halscope(int argc, char** argv) {
    std::vector<std::string> words{"scope"};
    for (int i = 1; i < argc; ++i) {
        const std::string word = argv[i];
        if (word.starts_with('-')) {
            return complain(
                "halscope",
                fmt::format("option '{}' is not supported; type: hal scope NAME…, or hal panel",
                            word));
        }
        words.push_back(word);
    }
    return run_hal(words.size() > 1 ? words : std::vector<std::string>{"panel"});
}

// halshow [FILE]: its watch lists are files of Tcl's; the panel has its own.
int halshow(int argc, char** argv) {
    if (argc > 1) {
        return complain(
            "halshow",
            fmt::format("unexpected argument '{}'; type: hal panel, or hal watch NAME…", argv[1]));
    }
    return run_hal({"panel"});
}

}  // namespace hal::tools
