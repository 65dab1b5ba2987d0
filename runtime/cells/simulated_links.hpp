// SPDX-License-Identifier: MIT
// The signals between the nodes of a cell that `hal sim` runs in one process, on their common
// virtual clock: values pass at the rate of their topic. A node whose thread does not run sends
// nothing, so that the others find it offline after their deadline, as over DDS. A node whose
// threads are deleted is like one whose process has ended. [setup], one thread.
#pragma once

#include <cstdint>
#include <deque>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "machine/session.hpp"
#include "model/nodes.hpp"

namespace hal {

class SimulatedLinks {
public:
    struct Node {
        std::string name;
        Session* session = nullptr;
        std::int64_t deadline_ns = 0;  ///< of a node that sends nothing
    };
    /// Outlives the sessions, whose faults keep the address of its texts. Every node has the pins
    /// `node.OTHER.online`, `node.OTHER.age-ms` and, for each signal that it reads,
    /// `node.OTHER.SIGNAL`. `topics` outlives the links.
    SimulatedLinks(std::vector<Node> nodes, const std::vector<NodeTopic>& topics);

    /// All nodes have advanced by `step_ns` to `now_ns`: passes the values that are due, and
    /// updates which nodes are online.
    void update(std::int64_t now_ns, std::int64_t step_ns);

private:
    static constexpr std::int64_t never = std::numeric_limits<std::int64_t>::min();
    /// A topic as one of its readers receives it.
    struct Reception {
        const NodeTopic* topic = nullptr;
        std::string thread;  ///< of the reader, which receives it; empty: it has none
        std::string fault;
        std::int64_t received_ns = never;  ///< when its values arrived last
        bool valid = false;
    };
    /// A node as another one knows it.
    struct Partner {
        std::size_t reader = 0;
        std::size_t other = 0;
        std::deque<Reception> receptions = {};  ///< empty: `other` sends nothing to `reader`
        std::int64_t seen_ns = never;  ///< when `other` was alive last
        bool online = false;
        double age_ms = std::numeric_limits<double>::infinity();
    };
    using Values = std::vector<std::optional<Reading>>;
    using Writes = std::vector<std::pair<Pin*, hal_value>>;

    /// Returns the values of a topic, nothing while its node does not send.
    std::optional<Values> values_of(const NodeTopic& topic);
    void update(Partner& partner, std::int64_t step_ns, Writes& writes);
    /// Receives the values that are due. Returns whether those of all topics are valid.
    bool receive(Partner& partner, bool runs, Writes& writes);
    bool is_online(const Partner& partner) const;
    /// Returns the age of the oldest values of a partner, or of its last sign of life; infinite
    /// without one.
    double age_ms(const Partner& partner) const;
    void receive(const Partner& partner, Reception& reception, const Values& values,
                 Writes& writes);
    void check_deadline(const Partner& partner, Reception& reception, Writes& writes);
    void make_safe(const Partner& partner, Reception& reception, Writes& writes);
    void forget(Partner& partner, Writes& writes);
    void write(const Partner& partner, const std::string& name, hal_value value, Writes& writes);
    bool is_due(const NodeTopic& topic, std::int64_t step_ns) const {
        return now_ns_ % topic.rate_ns < step_ns;
    }

    const std::vector<Node> nodes_;
    const std::vector<NodeTopic>& topics_;
    std::vector<bool> had_threads_;  ///< by node: at the start
    std::vector<bool> is_alive_;  ///< by node: its threads are not deleted
    std::vector<std::optional<Values>> sent_;  ///< by topic: what is due in this step
    std::deque<Partner> partners_;  ///< by reader
    std::int64_t now_ns_ = 0;
};

}  // namespace hal
