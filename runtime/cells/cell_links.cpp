// SPDX-License-Identifier: MIT
// What a node's own machine needs for the signals of the other nodes: components of components/dds,
// their links and functions.
#include <cstdlib>

#include "base/types.hpp"
#include "cells/cell.hpp"
#include "commands/files.hpp"
#include "dds/links/links.hpp"
#include "text/characters.hpp"

namespace hal {
namespace {

/// Returns FNV-1a (RFC 9923), the same on any machine.
std::uint64_t hash(std::string_view text) {
    std::uint64_t number = 0xcbf29ce484222325u;
    for (const char c : text) {
        number = (number ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
    }
    return number;
}

std::string hex(std::uint64_t number) {
    std::string text(16, '0');
    for (auto digit = text.rbegin(); digit != text.rend(); ++digit, number >>= 4) {
        *digit = "0123456789abcdef"[number & 15];
    }
    return text;
}

const std::string& from(const Cell& cell, const NodeTopic& topic) {
    return cell.nodes()[topic.from].name;
}

std::string topic_name(const Cell& cell, const NodeTopic& topic) {
    return "halcyon/" + cell.name() + "/" + from(cell, topic) + "/" + topic.thread;
}

/// The type name contains a hash of the signals: nodes with different versions of the netlist never
/// exchange data.
std::string type_name(const Cell& cell, const NodeTopic& topic) {
    return "halcyon::nodes::" + from(cell, topic) + "_" + hex(hash(topic.layout()));
}

/// The layout without blanks, for an argument.
std::string compact(const NodeTopic& topic) {
    std::string text;
    for (const char c : topic.layout()) {
        if (c != ' ') {
            text += c;
        }
    }
    return text;
}

/// "every 10.0 ms over DDS"
std::string every(const NodeTopic& topic) {
    return format_duration(static_cast<double>(topic.rate_ns));
}
std::string deadline(const NodeTopic& topic) {
    return format_duration(static_cast<double>(topic.deadline_ns));
}

/// The number of topics that `reader` receives from this one's writer, or that the writer sends:
/// the name of a single one needs no thread.
std::size_t alike(const Cell& cell, const NodeTopic& topic, std::size_t reader) {
    std::size_t number = 0;
    for (const NodeTopic& other : cell.topics()) {
        number += other.from == topic.from && (reader == topic.from || other.read_by(reader));
    }
    return number;
}

std::string out_name(const Cell& cell, const NodeTopic& topic) {
    return alike(cell, topic, topic.from) == 1 ? "node-out" : "node-out." + topic.thread;
}
std::string in_name(const Cell& cell, const NodeTopic& topic, std::size_t reader) {
    return "node-in." + from(cell, topic) +
           (alike(cell, topic, reader) == 1 ? "" : "." + topic.thread);
}

const NodeReader* reader_of(const NodeField& field, std::size_t node) {
    for (const NodeReader& reader : field.readers) {
        if (reader.node == node) return &reader;
    }
    return nullptr;
}

using Words = std::vector<std::string>;

Words with(Words words, const Words& more) {
    words.insert(words.end(), more.begin(), more.end());
    return words;
}

void publish(const Cell& cell, const NodeTopic& topic, const Words& participant,
             std::vector<Words>& commands) {
    dds::PublishLink link{{out_name(cell, topic), topic_name(cell, topic), type_name(cell, topic)},
                          1e9 / static_cast<double>(topic.rate_ns)};
    for (const NodeField& field : topic.fields) {
        link.fields.push_back({field.signal, std::string(name(field.type))});
    }
    commands.push_back(with(link.arguments(), participant));
    for (const NodeField& field : topic.fields) {
        commands.push_back({"net", field.signal, "=>", link.instance + "." + field.signal});
    }
    commands.push_back({"addf", link.instance, topic.thread});
}

void subscribe(const Cell& cell, const NodeTopic& topic, std::size_t node, const Words& participant,
               std::vector<Words>& commands) {
    dds::SubscribeLink link{
        {in_name(cell, topic, node), topic_name(cell, topic), type_name(cell, topic)},
        (topic.deadline_ns + 999'999) / 1'000'000};
    std::vector<Words> nets;
    std::vector<const Pin*> pins;
    for (const NodeField& field : topic.fields) {
        link.fields.push_back({field.signal, std::string(name(field.type))});
        const NodeReader* const reader = reader_of(field, node);
        if (!reader) {
            continue;  // another node reads it
        }
        link.fields.back().safe = format_exact(field.type, reader->safe);
        nets.push_back({"net", field.signal, "<=", link.instance + "." + field.signal});
        pins.insert(pins.end(), reader->pins.begin(), reader->pins.end());
    }
    commands.push_back(with(link.arguments(), participant));
    commands.insert(commands.end(), nets.begin(), nets.end());
    commands.push_back(
        {"addf", link.instance, thread_for(cell.session(node).model(), pins)->name, "1"});
}

}  // namespace

std::string cell_name(const std::vector<std::string>& files) {
    std::string name = files.empty() ? "cell" : files.front();
    if (const auto slash = name.rfind('/'); slash != name.npos) {
        name.erase(0, slash + 1);
    }
    if (const auto dot = name.rfind('.'); dot != name.npos && dot != 0) {
        name.erase(dot);
    }
    for (char& c : name) {
        if (!is_name_character(c) || c == '.') {
            c = '_';
        }
    }
    return name;
}

std::vector<std::string> node_latencies(const Cell& cell, std::size_t node, bool simulated) {
    std::vector<std::string> lines;
    for (const NodeTopic& topic : cell.topics()) {
        for (const NodeField& field : topic.fields) {
            const std::string how =
                simulated ? "passed every " + every(topic) + " (hal sim)"
                          : "over DDS every " + every(topic) + ", deadline " + deadline(topic);
            if (topic.from == node) {
                for (const NodeReader& reader : field.readers) {
                    lines.push_back(field.signal + ": " + field.writer->name + " => node " +
                                    cell.nodes()[reader.node].name + "  " + how + " (sent by " +
                                    topic.thread + ")");
                }
            } else if (const NodeReader* const reader = reader_of(field, node)) {
                for (const Pin* const pin : reader->pins) {
                    lines.push_back(field.signal + ": node " + from(cell, topic) + " => " +
                                    pin->name + "  " + how + ", then " +
                                    format_value(field.type, reader->safe));
                }
            }
        }
    }
    return lines;
}

namespace {

/// Returns true when a line of the text begins with `node`, so that it is worth parsing.
bool has_node_line(std::string_view text) {
    for (std::size_t at = text.find("node"); at != text.npos; at = text.find("node", at + 1)) {
        const std::size_t before = text.substr(0, at).find_last_not_of(" \t");
        const bool begins = before == text.npos || text[before] == '\n';
        if (begins && (at + 4 == text.size() || text[at + 4] == ' ' || text[at + 4] == '\t' ||
                       text[at + 4] == '\n')) {
            return true;
        }
    }
    return false;
}

}  // namespace

std::vector<NodeLine> nodes_of(const std::vector<std::string>& files, const std::string& ini_file) {
    std::vector<NodeLine> nodes;
    Diagnostics reported_when_run;
    Sources texts;
    Ini ini;
    if (!ini_file.empty()) {
        ini = Ini::read(texts, ini_file, reported_when_run);
    }
    const auto anything = [](const std::string& name) -> std::optional<std::string> {
        const char* const value = std::getenv(name.c_str());
        return value ? value : name;
    };
    const auto collect = [&](const std::string& file) {
        std::string text, problem;
        if (file.ends_with(".tcl") || !read_text_file(resolve_path(file, ""), text, problem) ||
            !has_node_line(text)) {
            return;
        }
        const std::uint32_t source = texts.add(file, std::move(text));
        collect_nodes(parse(texts, source, {&ini, anything}, reported_when_run), nodes,
                      reported_when_run);
    };
    for (const std::string& file : files) {
        if (!file.ends_with(".ini")) {
            collect(file);
            continue;
        }
        ini = Ini::read(texts, resolve_path(file, ""), reported_when_run);
        for (const std::string& entry : ini.all("HAL", "HALFILE")) {
            collect(resolve_path(entry.substr(0, entry.find(' ')),
                                 folder_of(canonical_path(resolve_path(file, "")))));
        }
    }
    return nodes;
}

NodeLinks node_links(const Cell& cell, std::size_t node,
                     const std::vector<std::string>& participant) {
    dds::NodeLink own{cell.name(), cell.nodes()[node].name, {}, {}, {}};
    for (const NodeLine& other : cell.nodes()) {
        if (other.name != own.node) {
            own.others.push_back(other.name);
        }
    }
    NodeLinks links;
    std::vector<Words> sent, monitored;
    const Thread* const thread = thread_for(cell.session(node).model(), {});
    if (thread) {
        links.after.push_back({"addf", "node.watch", thread->name, "1"});
    }
    // Subscribers run before everything that reads their pins, and before node.watch: each addf
    // puts its function first.
    for (const NodeTopic& topic : cell.topics()) {
        const std::string named = from(cell, topic) + "/" + topic.thread;
        const std::string described = named + "=" + compact(topic) + ";";
        if (topic.from == node) {
            publish(cell, topic, participant, sent);
            own.offers += described;
        } else if (topic.read_by(node)) {
            subscribe(cell, topic, node, participant, links.after);
            own.wants += described;
            const std::string instance = in_name(cell, topic, node);
            const std::string signal = "node:" + from(cell, topic) + ":" + topic.thread;
            const auto monitor = [&](const char* suffix, const char* pin, const char* heard) {
                monitored.push_back({"net", signal + suffix, instance + "." + pin, "=>",
                                     "node." + dds::NodeLink::heard(named, heard)});
            };
            monitor(":heard", dds::pin::valid, dds::pin::heard);
            monitor(":age", dds::pin::age_ms, dds::pin::heard_age_ms);
        }
    }
    links.before.push_back(with(own.arguments(), participant));
    for (auto* const more : {&monitored, &sent}) {
        links.after.insert(links.after.end(), more->begin(), more->end());
    }
    return links;
}

}  // namespace hal
