// SPDX-License-Identifier: MIT
#include "inspect/remedies.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fmt/core.h>
#include <pwd.h>
#include <sys/wait.h>
#include <unistd.h>

#include "cli/output.hpp"
#include "text/quoting.hpp"

namespace hal::tools {

namespace {

bool found_in_path(const std::string& program) {
    const char* const path = std::getenv("PATH");
    std::string folders = path ? path : "";
    for (std::size_t begin = 0; begin <= folders.size();) {
        const std::size_t end = std::min(folders.find(':', begin), folders.size());
        if (end > begin &&
            ::access((folders.substr(begin, end - begin) + "/" + program).c_str(), X_OK) == 0) {
            return true;
        }
        begin = end + 1;
    }
    return false;
}

/// Returns the command as root types it.
std::string without_sudo(std::string command) {
    for (std::size_t at = 0; (at = command.find("sudo ", at)) != std::string::npos;) {
        command.erase(at, 5);
    }
    return command;
}

/// Returns the command with the name of this user for $USER, which is root in a shell of root.
std::string for_this_user(std::string command) {
    const passwd* const user = ::getpwuid(::getuid());
    const std::string variable = "$USER";
    for (std::size_t at = 0; user && (at = command.find(variable, at)) != std::string::npos;) {
        command.replace(at, variable.size(), user->pw_name);
    }
    return command;
}

/// Adds what remains to be done to the list `later`, unless it is there.
void add_later(std::string& later, const Remedy& remedy) {
    if (!remedy.then.empty() && later.find(remedy.then) == std::string::npos) {
        append_item(later, remedy.then, ", and ");
    }
}

/// Reads a line of standard input. Returns true for y or yes.
bool agreed() {
    std::string line;
    for (int c = std::getchar(); c != EOF && c != '\n'; c = std::getchar()) {
        line += static_cast<char>(c);
    }
    return line == "y" || line == "Y" || line == "yes";
}

}  // namespace

std::vector<Remedy> remedies_of(const std::vector<Finding>& findings) {
    std::vector<Remedy> remedies;
    for (const Finding& finding : findings) {
        const Remedy remedy{finding.remedy, finding.then};
        if (finding.remedy.starts_with("sudo ") &&
            std::find(remedies.begin(), remedies.end(), remedy) == remedies.end()) {
            remedies.push_back(remedy);
        }
    }
    return remedies;
}

int carry_out(const DoctorOptions& options, const std::vector<Remedy>& remedies) {
    if (remedies.empty()) return exit_code(print("\nnothing to fix by a command\n"));
    const bool root = ::geteuid() == 0;
    if (!root && !found_in_path("sudo")) {
        std::string text = "\nsudo is not installed; as root (su -), type:\n";
        std::string later;
        for (const Remedy& remedy : remedies) {
            text += "  " + for_this_user(without_sudo(remedy.command)) + "\n";
            add_later(later, remedy);
        }
        print(text +
              (later.empty() ? "" : fmt::format("for the change to take effect: {}\n", later)));
        return fail(options, "the fixes need root");
    }
    // $USER of the commands is the user who operates the machine, also under sudo and su.
    const std::string user = root ? "USER=${SUDO_USER:-$(logname 2>/dev/null || id -un)}; "
                                  : "USER=${USER:-$(id -un)}; ";
    int status = 0;
    std::string later;
    for (const Remedy& remedy : remedies) {
        const std::string command = root ? without_sudo(remedy.command) : remedy.command;
        if (!print(fmt::format("\n  {}\n", command))) return 1;
        if (!options.yes && (!print("run it? [y/N] ") || !agreed())) {
            print("left as it is\n");
            continue;
        }
        std::fflush(stdout);
        const int result = std::system(("set -e; " + user + command).c_str());
        if (result == 0) {
            print("done\n");
            add_later(later, remedy);
        } else {
            status = fail(options,
                          fmt::format("failed with status {}: {}",
                                      WIFEXITED(result) ? WEXITSTATUS(result) : result, command));
        }
    }
    if (!later.empty()) {
        print(fmt::format("\nfor the change to take effect: {}\n", later));
    }
    return status;
}

}  // namespace hal::tools
