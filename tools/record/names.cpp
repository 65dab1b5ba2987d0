// SPDX-License-Identifier: MIT
#include "record/names.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <unordered_set>

namespace hal::tools {
namespace {

using nlohmann::json;

/// Names of values of a kind, with those of them that a signal carries when `linked`.
std::vector<std::string> described(Client& client, const char* kind, const json& patterns,
                                   bool linked) {
    std::vector<std::string> names;
    const json reply = client.request({{"describe", kind}, {"patterns", patterns}});
    for (const json& object : reply.value("objects", json::array())) {
        if (object.value("type", "") != "port" && (linked || !object.contains("signal"))) {
            names.push_back(object.value("name", ""));
        }
    }
    return names;
}

}  // namespace

std::vector<std::string> probed_names(Client& client, const std::vector<std::string>& wanted,
                                      std::string& problem) {
    std::vector<std::string> names;
    std::unordered_set<std::string> seen;
    const auto add = [&](const std::string& name) {
        if (seen.insert(name).second) {
            names.push_back(name);
        }
    };
    for (const std::string& word : wanted) {
        if (word.find_first_of("*?[") == std::string::npos) {
            add(word);
            continue;
        }
        bool any = false;
        for (const char* kind : {"sig", "pin", "param"}) {
            for (const std::string& name : described(client, kind, json::array({word}), true)) {
                add(name);
                any = true;
            }
        }
        if (any) continue;
        problem =
            "no pin, parameter or signal matches '" + word + "'; hal shell show pin lists them";
        return {};
    }
    return names;
}

std::vector<std::string> group_names(Client& client, const std::string& group,
                                     std::string& problem) {
    std::vector<std::string> names;
    std::unordered_set<std::string> seen;
    for (const char* kind : {"pin", "param"}) {
        for (const json& object :
             client.request({{"describe", kind}}).value("objects", json::array())) {
            const std::string file = object.value("file", "");
            const bool of_it = object.value("component", "") == group ||
                               object.value("instance", "") == group ||
                               object.value("thread", "") == group || file == group ||
                               file.substr(file.rfind('/') + 1) == group;
            if (!of_it || object.value("type", "") == "port") continue;
            std::string name = object.value("signal", object.value("name", ""));
            if (seen.insert(name).second) {
                names.push_back(std::move(name));
            }
        }
    }
    if (names.empty()) {
        problem = "--group: '" + group +
                  "' is not a component, an instance, a thread or a netlist file with values; hal "
                  "shell show all lists them";
    }
    return names;
}

std::vector<std::string> all_names(Client& client) {
    std::vector<std::string> names = described(client, "sig", json::array(), true);
    for (const char* kind : {"pin", "param"}) {
        for (std::string& name : described(client, kind, json::array(), false)) {
            names.push_back(std::move(name));
        }
    }
    return names;
}

}  // namespace hal::tools
