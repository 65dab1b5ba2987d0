// SPDX-License-Identifier: MIT
// The nodes of a netlist as machines in this process, one session each: for `hal check`, for `hal sim`, which passes the signals between
// them itself, and for what `hal run --node` has to know of the others. [setup], one thread.
#pragma once

#include <deque>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "model/nodes.hpp"
#include "netlist/nodes.hpp"
#include "machine/session.hpp"
#include "commands/shell.hpp"

namespace hal {

class Cell {
public:
    /// `name` is what the topics between the nodes are called after.
    Cell(std::string name, std::vector<NodeLine> nodes, const SessionOptions& session, const ShellOptions& shell);
    ~Cell();

    /// Loads the files into every node and finds what passes between them. What several nodes would say is said once. False: something
    /// is wrong.
    bool load(const std::vector<std::string>& files, const std::string& ini, Output& output);

    const std::string& name() const { return name_; }
    const std::vector<NodeLine>& nodes() const { return nodes_; }
    const std::vector<NodeTopic>& topics() const { return topics_; }
    std::size_t size() const { return nodes_.size(); }
    Session& session(std::size_t node) { return *machines_[node].session; }
    const Session& session(std::size_t node) const { return *machines_[node].session; }
    Shell& shell(std::size_t node) { return *machines_[node].shell; }
    /// Its number, or size().
    std::size_t find(std::string_view node) const;

    // --- on the virtual clock ---------------------------------------------------------------------------------------------
    /// Links the signals of other nodes; each node starts its threads unless its netlist did.
    bool start(Output& output);
    /// Only this node goes on; the others are silent to it.
    void leave_alone(std::size_t node) { alone_ = node; }
    /// All nodes pass `ns` together; what they have written passes to its readers at each topic's rate.
    void advance(std::int64_t ns);

private:
    struct Machine {
        std::unique_ptr<Session> session;
        std::unique_ptr<Shell> shell;
        std::map<std::string, Pin*> pins;  ///< "robot.online", "robot.age-ms", "robot.SIGNAL": the outside ones
    };
    class Once;
    bool connect(Output& output);
    Span place(std::size_t node, Span span);
    void report(Diagnostics& found, Output& output) const;
    void greet();
    void deliver(const NodeTopic& topic);

    std::string name_;
    std::vector<NodeLine> nodes_;
    ShellOptions options_;
    std::vector<Machine> machines_;
    std::vector<NodeTopic> topics_;
    Sources texts_;  ///< of all nodes' texts that diagnostics between them show
    std::map<std::pair<std::string, std::uint32_t>, std::uint32_t> known_texts_;
    std::int64_t step_ns_ = 0, now_ns_ = 0;
    std::size_t alone_ = SIZE_MAX;
};

/// The nodes that the `node` lines of netlists (or of those that .ini files name) speak of, in order of first mention; none: they are of
/// one machine. What is wrong with the lines is said when they are run.
std::vector<NodeLine> nodes_of(const std::vector<std::string>& files, const std::string& ini);

/// The pins that say of every other node whether it is there: `node.NAME.online`, `node.NAME.age-ms`.
struct NodePins {
    static constexpr const char* component = "node";
};

/// "cell" of "machines/cell.hal": what the topics are called after.
std::string cell_name(const std::vector<std::string>& files);

/// Lines of `show latency`: the signals that `node` writes for others or reads from them.
std::vector<std::string> node_latencies(const Cell& cell, std::size_t node, bool simulated);

/// What `hal run --node` adds to the part of a node: before it the watch over the other nodes, behind it the topics.
struct NodeLinks {
    std::string before, behind;
};
/// `participant`: arguments of the DDS participant as they stand in a netlist, or empty.
NodeLinks node_links(const Cell& cell, std::size_t node, const std::string& participant);

}  // namespace hal
