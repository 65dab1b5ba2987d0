// SPDX-License-Identifier: MIT
// What a node's own machine needs for the signals of others: components of components/dds, as commands.
#include <cstdlib>

#include "base/types.hpp"
#include "cells/cell.hpp"
#include "commands/files.hpp"

namespace hal {
namespace {

/// FNV-1a: equal texts, equal numbers, on any machine.
std::uint64_t hash(std::string_view text) {
    std::uint64_t number = 0xcbf29ce484222325u;
    for (const char c : text) number = (number ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
    return number;
}

std::string hex(std::uint64_t number) {
    std::string text(16, '0');
    for (auto digit = text.rbegin(); digit != text.rend(); ++digit, number >>= 4) *digit = "0123456789abcdef"[number & 15];
    return text;
}

std::string ms(std::int64_t ns) { return std::to_string((ns + 999'999) / 1'000'000); }
std::string hz(std::int64_t ns) { return format_exact(HAL_TYPE_FLOAT, hal_value{.real = 1e9 / static_cast<double>(ns)}); }

const std::string& from(const Cell& cell, const NodeTopic& topic) { return cell.nodes()[topic.from].name; }

std::string topic_name(const Cell& cell, const NodeTopic& topic) {
    return "halcyon/" + cell.name() + "/" + from(cell, topic) + "/" + topic.thread;
}

/// The name on the wire changes with the signals: nodes with other versions of the netlist never take each other's bytes.
std::string type_name(const Cell& cell, const NodeTopic& topic) {
    return "halcyon::nodes::" + from(cell, topic) + "_" + hex(hash(topic.layout()));
}

/// The layout without blanks: an argument.
std::string compact(const NodeTopic& topic) {
    std::string text;
    for (const char c : topic.layout())
        if (c != ' ') text += c;
    return text;
}

/// "every 10.0 ms over DDS"
std::string every(const NodeTopic& topic) { return format_duration(static_cast<double>(topic.rate_ns)); }
std::string deadline(const NodeTopic& topic) { return format_duration(static_cast<double>(topic.deadline_ns)); }

/// How many topics `node` has from the node that writes this one, or sends itself: one needs no further name.
std::size_t alike(const Cell& cell, const NodeTopic& topic, std::size_t reader) {
    std::size_t number = 0;
    for (const NodeTopic& other : cell.topics()) number += other.from == topic.from && (reader == topic.from || other.read_by(reader));
    return number;
}

std::string out_name(const Cell& cell, const NodeTopic& topic) {
    return alike(cell, topic, topic.from) == 1 ? "node-out" : "node-out." + topic.thread;
}
std::string in_name(const Cell& cell, const NodeTopic& topic, std::size_t reader) {
    return "node-in." + from(cell, topic) + (alike(cell, topic, reader) == 1 ? "" : "." + topic.thread);
}

const NodeReader* reader_of(const NodeField& field, std::size_t node) {
    for (const NodeReader& reader : field.readers)
        if (reader.node == node) return &reader;
    return nullptr;
}

std::string send(const Cell& cell, const NodeTopic& topic, const std::string& participant) {
    const std::string instance = out_name(cell, topic);
    std::string text = "loadrt dds_publish names=" + instance + " topic=" + topic_name(cell, topic) + " type=" + type_name(cell, topic) +
                       " fields=\"" + compact(topic) + "\" rate=" + hz(topic.rate_ns) + " reliable=0" + participant + "\n";
    for (const NodeField& field : topic.fields) text += "net " + field.signal + " => " + instance + "." + field.signal + "\n";
    return text + "addf " + instance + " " + topic.thread + "\n";
}

std::string take(const Cell& cell, const NodeTopic& topic, std::size_t node, const std::string& participant) {
    const std::string instance = in_name(cell, topic, node);
    std::string fields, nets;
    std::vector<const Pin*> pins;
    for (const NodeField& field : topic.fields) {
        const NodeReader* const reader = reader_of(field, node);
        fields += (fields.empty() ? "" : ",") + field.signal + ":" + name(field.type);
        if (!reader) continue;  // it comes along for another node
        fields += "=" + format_exact(field.type, reader->safe);
        nets += "net " + field.signal + " <= " + instance + "." + field.signal + "\n";
        pins.insert(pins.end(), reader->pins.begin(), reader->pins.end());
    }
    const Thread* const thread = thread_for(cell.session(node).model(), pins);
    return "loadrt dds_subscribe names=" + instance + " topic=" + topic_name(cell, topic) + " type=" + type_name(cell, topic) +
           " fields=\"" + fields + "\" timeout_ms=" + ms(topic.deadline_ns) + " reliable=0" + participant + "\n" + nets + "addf " +
           instance + " " + thread->name + " 1\n";
}

}  // namespace

std::string cell_name(const std::vector<std::string>& files) {
    std::string name = files.empty() ? "cell" : files.front();
    if (const auto slash = name.rfind('/'); slash != name.npos) name.erase(0, slash + 1);
    if (const auto dot = name.rfind('.'); dot != name.npos && dot != 0) name.erase(dot);
    for (char& c : name)
        if (!((c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_')) c = '_';
    return name;
}

std::vector<std::string> node_latencies(const Cell& cell, std::size_t node, bool simulated) {
    std::vector<std::string> lines;
    for (const NodeTopic& topic : cell.topics())
        for (const NodeField& field : topic.fields) {
            const std::string how = simulated ? "passed every " + every(topic) + " (hal sim)"
                                              : "over DDS every " + every(topic) + ", deadline " + deadline(topic);
            if (topic.from == node) {
                for (const NodeReader& reader : field.readers)
                    lines.push_back(field.signal + ": " + field.writer->name + " => node " + cell.nodes()[reader.node].name + "  " + how +
                                    " (sent by " + topic.thread + ")");
            } else if (const NodeReader* const reader = reader_of(field, node)) {
                for (const Pin* const pin : reader->pins)
                    lines.push_back(field.signal + ": node " + from(cell, topic) + " => " + pin->name + "  " + how + ", then " +
                                    format_value(field.type, reader->safe));
            }
        }
    return lines;
}

namespace {

/// A line of the text begins with the word: worth parsing.
bool has_node_line(std::string_view text) {
    for (std::size_t at = text.find("node"); at != text.npos; at = text.find("node", at + 1)) {
        const std::size_t before = text.substr(0, at).find_last_not_of(" \t");
        const bool begins = before == text.npos || text[before] == '\n';
        if (begins && (at + 4 == text.size() || text[at + 4] == ' ' || text[at + 4] == '\t' || text[at + 4] == '\n')) return true;
    }
    return false;
}

}  // namespace

std::vector<NodeLine> nodes_of(const std::vector<std::string>& files, const std::string& ini_file) {
    std::vector<NodeLine> nodes;
    Diagnostics said_when_run;
    Sources texts;
    Ini ini;
    if (!ini_file.empty()) ini = Ini::read(texts, ini_file, said_when_run);
    const auto anything = [](const std::string& name) -> std::optional<std::string> {
        const char* const value = std::getenv(name.c_str());
        return value ? value : name;
    };
    const auto look = [&](const std::string& file) {
        std::string text, problem;
        if (file.ends_with(".tcl") || !read_text_file(resolve_path(file, ""), text, problem) || !has_node_line(text)) return;
        const std::uint32_t source = texts.add(file, std::move(text));
        collect_nodes(parse(texts, source, {&ini, anything}, said_when_run), nodes, said_when_run);
    };
    for (const std::string& file : files) {
        if (!file.ends_with(".ini")) {
            look(file);
            continue;
        }
        ini = Ini::read(texts, resolve_path(file, ""), said_when_run);
        for (const std::string& entry : ini.all("HAL", "HALFILE"))
            look(resolve_path(entry.substr(0, entry.find(' ')), folder_of(canonical_path(resolve_path(file, "")))));
    }
    return nodes;
}

NodeLinks node_links(const Cell& cell, std::size_t node, const std::string& participant) {
    NodeLinks links;
    std::string peers, offers, wants, after;
    for (const NodeLine& other : cell.nodes())
        if (other.name != cell.nodes()[node].name) peers += (peers.empty() ? "" : ",") + other.name;
    const Thread* const thread = thread_for(cell.session(node).model(), {});
    std::set<std::size_t> heard;
    std::string takes;
    for (const NodeTopic& topic : cell.topics()) {
        const std::string described = from(cell, topic) + "/" + topic.thread + "=" + compact(topic) + ";";
        if (topic.from == node) {
            links.behind += send(cell, topic, participant);
            offers += described;
        } else if (topic.read_by(node)) {
            takes += take(cell, topic, node, participant);
            wants += described;
            if (!heard.insert(topic.from).second) continue;  // the first topic speaks for the node
            const std::string instance = in_name(cell, topic, node), name = from(cell, topic);
            after += "net node:" + name + ":heard " + instance + ".valid => node." + name + ".heard\n";
            after += "net node:" + name + ":age " + instance + ".age-ms => node." + name + ".heard-age-ms\n";
        }
    }
    links.before = "loadrt node cell=" + cell.name() + " node=" + cell.nodes()[node].name + (peers.empty() ? "" : " others=" + peers) +
                   (offers.empty() ? "" : " offers=\"" + offers + "\"") + (wants.empty() ? "" : " wants=\"" + wants + "\"") + participant +
                   "\n";
    // what comes from others is taken before anything reads it; the watch sees it just taken
    links.behind = (thread ? "addf node.watch " + thread->name + " 1\n" : "") + takes + after + links.behind;
    return links;
}

}  // namespace hal
