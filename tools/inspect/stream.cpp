// SPDX-License-Identifier: MIT
#include "inspect/stream.hpp"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fmt/core.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include "base/types.hpp"
#include "cli/output.hpp"
#include "linuxcnc/find/programs.hpp"
#include "text/characters.hpp"

namespace hal::tools {

namespace {

bool number(const std::string& word) {
    return !word.empty() && std::ranges::all_of(word, is_digit);
}

/// Becomes LinuxCNC's program of the same name if the machine has LinuxCNC's compiled module, whose
/// stream only that program reads. Returns if there is no such module, or no such program.
void become_linuxcnc(const StreamOptions& options, const std::string& stream, Client& client) {
    const auto pins =
        client.request({{"describe", "pin"}, {"patterns", nlohmann::json::array({stream + "."})}});
    if (pins.value("objects", nlohmann::json::array()).empty()) return;
    const char* const home = std::getenv("LINUXCNC_HOME");
    const std::string program =
        (home && *home ? home : "/usr") + std::string("/bin/") + options.program;
    std::error_code none;
    if (std::filesystem::equivalent(program, "/proc/self/exe", none)) return;
    const char* const libraries = std::getenv("LD_LIBRARY_PATH");
    ::setenv(
        "LD_LIBRARY_PATH",
        (linuxcnc_folder() + (libraries && *libraries ? ":" + std::string(libraries) : "")).c_str(),
        1);
    std::vector<std::string> line = options.line;
    std::vector<char*> words;
    for (std::string& word : line) {
        words.push_back(word.data());
    }
    words.push_back(nullptr);
    ::execv(program.c_str(), words.data());
}

}  // namespace

bool Stream::open(const StreamOptions& options, const char* component) {
    std::vector<std::string> words = options.words;
    std::string channel = options.channel;
    if (!options.classic && !words.empty() && number(words.front()) && channel.empty()) {
        channel = words.front();
        words.erase(words.begin());
    }
    if (words.size() > 1) {
        fail(options,
             fmt::format("unexpected argument '{}'; a channel is a number, or --channel NAME",
                         words.size() == 2 ? words.front() : words.back()));
        return false;
    }
    if (channel.empty()) {
        if (!words.empty()) {
            file = words.front();
        }
        name = fmt::format("{}.0", component);
    } else if (number(channel)) {
        if (!words.empty()) {
            file = words.front();
        }
        name = fmt::format("{}.{}", component, channel);
    } else {
        if (!words.empty()) {
            file = words.front();
        }
        name = channel;
    }
    std::string problem;
    client = Client::connect(instance_wanted(options.name), problem);
    if (!client) {
        fail(options, problem);
        return false;
    }
    const nlohmann::json about = client->request({{"stream", name}});
    if (!about.value("ok", false)) {
        if (options.classic) {
            become_linuxcnc(options, name, *client);
        }
        fail(options, about.value("error", "no answer"));
        return false;
    }
    timed = about.value("timed", false);
    for (const char letter : about.value("types", "")) {
        for (const TypeRow& row : hal::types) {
            if (row.letter == letter) {
                types.push_back(row.type);
            }
        }
    }
    return !options.classic || announce(options);
}

std::string Stream::problem(const nlohmann::json& reply) const {
    const bool exists = client->request({{"stream", name}}).value("ok", false);
    if (!client->connected()) return fmt::format("instance '{}' has ended", client->instance());
    if (exists) return reply.value("error", "no answer");
    return fmt::format("'{}' has ended: it was unloaded, or its machine has exited", name);
}

bool Stream::announce(const StreamOptions& options) const {
    const std::string component = options.name_as_component.empty()
                                      ? fmt::format("{}{}", options.program, ::getpid())
                                      : options.name_as_component;
    const nlohmann::json reply = client->request({{"component", component}});
    if (!reply.value("ok", false)) {
        fail(options, reply.value("error", "no answer"));
    }
    return reply.value("ok", false);
}

}  // namespace hal::tools
