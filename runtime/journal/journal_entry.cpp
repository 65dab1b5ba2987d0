// SPDX-License-Identifier: MIT
#include "journal/journal_entry.hpp"

#include <nlohmann/json.hpp>

namespace hal {
namespace {

using Json = nlohmann::json;
using Kind = ExecutionEntry::Kind;

constexpr std::pair<Kind, const char*> kinds[] = {
    {Kind::edit, "edit"},         {Kind::withdrawn, "withdrawn"},
    {Kind::written, "written"},   {Kind::start, "start"},
    {Kind::stop, "stop"},         {Kind::opened, "opened"},
    {Kind::sampled, "sampled"},   {Kind::end, "end"},
    {Kind::rejected, "rejected"},
};

const char* name_of(Kind kind) {
    for (const auto& [known, name] : kinds) {
        if (known == kind) return name;
    }
    return "";
}

std::optional<Kind> kind_of(const std::string& name) {
    for (const auto& [kind, known] : kinds) {
        if (name == known) return kind;
    }
    return std::nullopt;
}

}  // namespace

std::string to_json(const ExecutionEntry& entry) {
    Json json{{"kind", name_of(entry.kind)}};
    switch (entry.kind) {
    case Kind::edit: {
        json["epoch"] = entry.epoch;
        json["commands"] = entry.commands;
        Json files = Json::array();
        for (const JournaledFile& file : entry.files) {
            files.push_back(
                {{"component", file.component}, {"path", file.path}, {"hash", file.hash}});
        }
        json["files"] = std::move(files);
        json["calls"] = entry.calls;
        break;
    }
    case Kind::written: json["values"] = entry.values; break;
    case Kind::opened:
        json["instance"] = entry.instance;
        json["component"] = entry.component;
        json["resources"] = entry.resources;
        json["threads"] = entry.threads;
        json["helpers"] = entry.helpers;
        json["links"] = entry.links;
        json["streams"] = entry.streams;
        break;
    case Kind::sampled: json["names"] = entry.names; break;
    case Kind::rejected:
        json["epoch"] = entry.epoch;
        json["commands"] = entry.commands;
        json["starts"] = entry.starts;
        json["calls"] = entry.calls;
        break;
    case Kind::withdrawn:
        json["epoch"] = entry.epoch;
        json["commands"] = entry.commands;
        json["calls"] = entry.calls;
        break;
    case Kind::start:
    case Kind::stop:
    case Kind::end: break;
    }
    return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::optional<ExecutionEntry> execution_entry(std::string_view text) {
    try {
        const Json json = Json::parse(text);
        const auto kind = kind_of(json.at("kind").get<std::string>());
        if (!kind) return std::nullopt;
        ExecutionEntry entry{.kind = *kind};
        switch (*kind) {
        case Kind::edit:
            json.at("epoch").get_to(entry.epoch);
            json.at("commands").get_to(entry.commands);
            for (const Json& file : json.at("files")) {
                entry.files.push_back({file.at("component").get<std::string>(),
                                       file.at("path").get<std::string>(),
                                       file.at("hash").get<std::string>()});
            }
            entry.calls = json.value("calls", entry.calls);  // none in earlier versions
            break;
        case Kind::written: json.at("values").get_to(entry.values); break;
        case Kind::opened:
            json.at("instance").get_to(entry.instance);
            json.at("component").get_to(entry.component);
            json.at("resources").get_to(entry.resources);
            json.at("threads").get_to(entry.threads);
            json.at("helpers").get_to(entry.helpers);
            json.at("links").get_to(entry.links);
            json.at("streams").get_to(entry.streams);
            break;
        case Kind::sampled: json.at("names").get_to(entry.names); break;
        case Kind::rejected:
            json.at("epoch").get_to(entry.epoch);
            json.at("commands").get_to(entry.commands);
            json.at("starts").get_to(entry.starts);
            json.at("calls").get_to(entry.calls);
            break;
        case Kind::withdrawn:  // without members in earlier versions
            entry.epoch = json.value("epoch", entry.epoch);
            entry.commands = json.value("commands", entry.commands);
            entry.calls = json.value("calls", entry.calls);
            break;
        case Kind::start:
        case Kind::stop:
        case Kind::end: break;
        }
        return entry;
    } catch (const Json::exception&) {
        return std::nullopt;
    }
}

}  // namespace hal
