// SPDX-License-Identifier: MIT
#include "machine/load/source_tree.hpp"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <spawn.h>
#include <sstream>
#include <sys/wait.h>
#include <unistd.h>

namespace hal {
namespace {

std::atomic<bool> forbidden = false;

}  // namespace

std::map<std::string, ComponentSummary> listed_components(const std::vector<std::string>& folders) {
    std::map<std::string, ComponentSummary> all;
    for (const std::string& folder : folders) {
        std::ifstream file(folder + "/groups");
        for (std::string line; std::getline(file, line);) {
            std::istringstream words(line);
            std::string name;
            ComponentSummary about;
            words >> name >> about.group >> std::ws;
            std::getline(words, about.summary);
            if (!name.empty()) {
                all.emplace(std::move(name), std::move(about));
            }
        }
    }
    return all;
}

std::string debian_package(std::string_view group) {
    constexpr std::string_view packaged[] = {"dds", "estimation", "vision"};
    const bool has_own = std::ranges::find(packaged, group) != std::end(packaged);
    return has_own ? "halcyon-" + std::string(group) : std::string();
}

bool build_on_demand(const std::string& name) {
    const char* const script = std::getenv("HALCYON_BUILD");
    if (!script || !*script || forbidden.load()) return false;
    std::string program = script;
    std::string command = "build";
    std::string argument = name;
    char* const arguments[] = {program.data(), command.data(), argument.data(), nullptr};
    posix_spawn_file_actions_t actions;
    if (posix_spawn_file_actions_init(&actions) != 0) return false;
    posix_spawn_file_actions_adddup2(&actions, STDERR_FILENO, STDOUT_FILENO);
    pid_t child = 0;
    const int problem = posix_spawn(&child, script, &actions, nullptr, arguments, environ);
    posix_spawn_file_actions_destroy(&actions);
    if (problem != 0) return false;
    int status = 0;
    while (waitpid(child, &status, 0) < 0) {
        if (errno != EINTR) return false;
    }
    return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

void forbid_builds() noexcept { forbidden.store(true); }

}  // namespace hal
