// SPDX-License-Identifier: MIT
// The nodes of a netlist as machines in this process, one session each: for `hal check`, for `hal
// sim`, which passes the signals between them itself, and for `hal run --node`, which needs to know
// the signals of the other nodes. [setup], one thread.
#pragma once

#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "cells/simulated_links.hpp"
#include "commands/shell.hpp"
#include "machine/session.hpp"
#include "model/nodes.hpp"
#include "netlist/nodes.hpp"

namespace hal {

class Cell {
public:
    /// `name` is part of the names of the topics between the nodes.
    Cell(std::string name, std::vector<NodeLine> nodes, const SessionOptions& session,
         const ShellOptions& shell);
    ~Cell();

    /// Loads the files into every node and determines the topics between them. A diagnostic that
    /// several nodes share is printed once. Returns false after any error.
    bool load(const std::vector<std::string>& files, const std::string& ini, Output& output);

    const std::string& name() const { return name_; }
    const std::vector<NodeLine>& nodes() const { return nodes_; }
    const std::vector<NodeTopic>& topics() const { return topics_; }
    std::size_t size() const { return nodes_.size(); }
    Session& session(std::size_t node) { return *machines_[node].session; }
    const Session& session(std::size_t node) const { return *machines_[node].session; }
    Shell& shell(std::size_t node) { return *machines_[node].shell; }
    /// Returns the index of a node, or size() when it is unknown.
    std::size_t find(std::string_view node) const;

    // --- on the virtual clock --------------------------------------------------------------------
    /// Links the signals of other nodes and starts the threads of each node whose netlist did not.
    /// Returns false after any error.
    bool start(Output& output);
    /// Runs only this node; the others are offline to it.
    void isolate(std::size_t node) { isolated_ = node; }
    /// Advances all nodes by `ns`; signals pass to their readers at the rate of their topic.
    void advance(std::int64_t ns);

private:
    struct Machine {
        std::unique_ptr<Session> session;
        std::unique_ptr<Shell> shell;
    };
    class UniqueOutput;
    bool connect(Output& output);
    Span place(std::size_t node, Span span);
    void report(Diagnostics& found, Output& output) const;

    std::string name_;
    std::vector<NodeLine> nodes_;
    ShellOptions options_;
    std::vector<NodeTopic> topics_;
    std::optional<SimulatedLinks> links_;  ///< from start() on
    std::vector<Machine> machines_;
    Sources texts_;  ///< texts of all nodes that diagnostics between them show
    std::map<std::pair<std::string, std::uint32_t>, std::uint32_t> known_texts_;
    std::int64_t step_ns_ = 0;
    std::int64_t now_ns_ = 0;
    std::size_t isolated_ = SIZE_MAX;
};

/// Returns the nodes in the `node` lines of netlists, or of the netlists that .ini files name, in
/// order of first mention; none: a netlist for one machine. Errors in these lines are reported when
/// the netlist is run.
std::vector<NodeLine> nodes_of(const std::vector<std::string>& files, const std::string& ini);

/// The component whose pins show the state of every other node: `node.NAME.online`,
/// `node.NAME.age-ms`.
struct NodePins {
    static constexpr const char* component = "node";
};

/// Returns "cell" for "machines/cell.hal": the name of the cell in its topics.
std::string cell_name(const std::vector<std::string>& files);

/// Returns lines of `show latency`: the signals that `node` writes for others or reads from them.
std::vector<std::string> node_latencies(const Cell& cell, std::size_t node, bool simulated);

/// The commands that `hal run --node` adds to the part of a node, as words: before it the component
/// that monitors the other nodes, after it the topics.
struct NodeLinks {
    std::vector<std::vector<std::string>> before, after;
};
/// Returns the commands for `node`; `participant` are further arguments NAME=VALUE of each DDS
/// component. [setup]
NodeLinks node_links(const Cell& cell, std::size_t node,
                     const std::vector<std::string>& participant);

}  // namespace hal
