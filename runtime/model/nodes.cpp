// SPDX-License-Identifier: MIT
#include "model/nodes.hpp"

#include <algorithm>
#include <map>
#include <set>

#include "model/edit.hpp"
#include "text/characters.hpp"
#include "text/quoting.hpp"

namespace hal {
namespace {

/// One signal of one node.
struct Seen {
    std::size_t node;
    const Signal* signal;
};

class Sorter {
public:
    Sorter(const std::vector<NodePart>& nodes, Diagnostics& diagnostics)
        : nodes_(nodes), diagnostics_(diagnostics) {}

    std::vector<NodeTopic> run() {
        std::map<std::string_view, std::vector<Seen>> signals;
        for (std::size_t i = 0; i < nodes_.size(); ++i) {
            for (const auto& signal : nodes_[i].model->signals) {
                if (!signal->pins.empty()) {
                    signals[signal->name].push_back({i, signal.get()});
                }
            }
        }
        for (const auto& [name, seen] : signals) {
            if (seen.size() > 1) {
                one_signal(seen);
            }
        }
        std::vector<NodeTopic> topics;
        for (auto& [key, topic] : topics_) {
            topics.push_back(std::move(topic));
        }
        return topics;
    }

private:
    Span place(const Seen& on, Span span) const {
        return nodes_[on.node].place ? nodes_[on.node].place(span) : span;
    }
    const std::string& node(const Seen& on) const { return nodes_[on.node].name; }

    void refuse(Code code, std::string message, std::vector<Label> labels, std::string help) {
        Diagnostic d{Severity::error, code, std::move(message), std::move(labels), {}};
        d.help.push_back(std::move(help));
        diagnostics_.add(std::move(d));
    }

    /// Decides what a signal that several nodes know is: written by one and read by others, it
    /// crosses between them. Several writers, I/O pins and ports cannot cross.
    void one_signal(const std::vector<Seen>& seen) {
        std::vector<Seen> writers, readers, shared;
        for (const Seen& one : seen) {
            if (one.signal->writer) {
                writers.push_back(one);
            } else if (one.signal->ios != 0) {
                shared.push_back(one);
            } else {
                readers.push_back(one);
            }
        }
        if (readers.empty() && shared.empty()) {
            return;  // each node has its own
        }
        if (writers.empty()) return unwritten(readers, shared);
        const std::string signal = "signal '" + writers[0].signal->name + "'";
        const Pin& writer = *writers[0].signal->writer;
        if (writers.size() > 1) {
            return refuse("two-writers",
                          signal + " is written by nodes '" + node(writers[0]) + "' and '" +
                              node(writers[1]) + "', and read by '" +
                              node(readers.empty() ? shared[0] : readers[0]) + "'",
                          {{place(writers[1], writers[1].signal->writer->linked_at),
                            "output of " + node(writers[1])},
                           {place(writers[0], writer.linked_at), "output of " + node(writers[0])}},
                          "a signal has one output pin; in a part that belongs to several nodes, "
                          "use $(NODE) for a unique name: $(NODE)-" +
                              writers[0].signal->name);
        }
        if (!shared.empty()) {
            return refuse("node-crossing",
                          signal + " cannot pass from node '" + node(writers[0]) +
                              "' to an I/O pin of node '" + node(shared[0]) + "'",
                          {{place(shared[0], shared[0].signal->pins[0]->linked_at), "I/O pin"},
                           {place(writers[0], writer.linked_at), "output"}},
                          "only outputs and inputs may be on different nodes");
        }
        if (writer.type == HAL_TYPE_PORT) {
            return refuse("node-crossing",
                          signal + " is a byte stream and cannot pass from node '" +
                              node(writers[0]) + "' to node '" + node(readers[0]) + "'",
                          {{place(readers[0], readers[0].signal->pins[0]->linked_at), "input"},
                           {place(writers[0], writer.linked_at), "output"}},
                          "all pins of a port signal must be on one node");
        }
        cross(writers[0], readers);
    }

    void unwritten(const std::vector<Seen>& readers, const std::vector<Seen>& shared) {
        std::vector<Seen> all = readers;
        all.insert(all.end(), shared.begin(), shared.end());
        // lines of all nodes, or of several: each has its own on purpose
        std::set<std::pair<std::uint32_t, std::uint32_t>> places;
        for (const Seen& one : all) {
            const Span at = place(one, one.signal->pins[0]->linked_at);
            places.emplace(at.source, at.begin);
        }
        if (places.size() < 2) return;
        Diagnostic d{Severity::warning,
                     "node-crossing",
                     "signal '" + all[0].signal->name + "' is on nodes '" + node(all[0]) +
                         "' and '" + node(all[1]) + "', and no node writes it: each has its own",
                     {},
                     {}};
        d.labels = {{place(all[0], all[0].signal->pins[0]->linked_at), "on " + node(all[0])},
                    {place(all[1], all[1].signal->pins[0]->linked_at), "on " + node(all[1])}};
        d.help.emplace_back(
            "link an output to it on one node, or give the signals different names");
        diagnostics_.add(std::move(d));
    }

    void cross(const Seen& writer, const std::vector<Seen>& readers) {
        const Signal& written = *writer.signal;
        if (!std::ranges::all_of(written.name, is_name_character)) {
            return refuse("node-crossing",
                          "signal '" + written.name + "' passes from node '" + node(writer) +
                              "' to node '" + node(readers[0]) + "', but its name cannot be sent",
                          {{place(readers[0], readers[0].signal->pins[0]->linked_at), "input"},
                           {place(writer, written.writer->linked_at), "output"}},
                          "give it a name of letters, digits, -, _ and .");
        }
        NodeField field{written.name, written.type, written.writer, {}};
        for (const Seen& reader : readers) {
            const Signal& read = *reader.signal;
            if (read.type != written.type) {
                const std::string convert = conversion(written.type, read.type);
                refuse("type-mismatch",
                       "signal '" + written.name + "' carries " + name(written.type) +
                           " on node '" + node(writer) + "' and " + name(read.type) + " on node '" +
                           node(reader) + "'",
                       {{place(reader, read.pins[0]->linked_at), name(read.type)},
                        {place(writer, written.writer->linked_at), name(written.type)}},
                       convert.empty() ? "link it to pins of one type"
                                       : "convert with " + convert + " on one of the two nodes");
                return;
            }
            if (!has_thread(reader, *read.pins[0])) return;
            NodeReader row{reader.node, read.value, {}};
            for (const Pin* const pin : read.pins) {
                row.pins.push_back(pin);
            }
            field.readers.push_back(std::move(row));
        }
        if (!has_thread(writer, *written.writer)) return;
        const Thread* const thread = thread_for(*nodes_[writer.node].model, {written.writer});
        NodeTopic& topic = topics_[{nodes_[writer.node].name, thread->name}];
        topic.from = writer.node;
        topic.thread = thread->name;
        // not faster than the thread itself
        topic.rate_ns = std::max(nodes_[writer.node].rate_ns, thread->options.period_ns);
        topic.deadline_ns = std::max(nodes_[writer.node].deadline_ns, 3 * topic.rate_ns);
        topic.fields.push_back(std::move(field));  // signals come sorted
    }

    bool has_thread(const Seen& on, const Pin& pin) {
        if (!nodes_[on.node].model->threads.empty()) return true;
        if (said_.insert(on.node).second) {
            diagnostics_.error("node-crossing", place(on, pin.linked_at),
                               "node '" + node(on) +
                                   "' has no thread to send and receive signals; '" +
                                   on.signal->name + "' is shared with another node",
                               "", "create one: newthread servo 1000000");
        }
        return false;
    }

    const std::vector<NodePart>& nodes_;
    Diagnostics& diagnostics_;
    std::map<std::pair<std::string, std::string>, NodeTopic> topics_;
    std::set<std::size_t> said_;
};

}  // namespace

bool NodeTopic::read_by(std::size_t node) const {
    return std::any_of(fields.begin(), fields.end(), [&](const NodeField& field) {
        return std::any_of(field.readers.begin(), field.readers.end(),
                           [&](const NodeReader& reader) { return reader.node == node; });
    });
}

std::string NodeTopic::layout() const {
    std::string text;
    for (const NodeField& field : fields) {
        append_item(text, field.signal + ":" + name(field.type));
    }
    return text;
}

const Thread* thread_for(const Model& model, const std::vector<const Pin*>& pins) {
    const Thread* found = nullptr;
    for (const Pin* const pin : pins) {
        if (const Thread* const thread = thread_of(*pin);
            thread && (!found || thread->options.period_ns < found->options.period_ns)) {
            found = thread;
        }
    }
    return found || model.threads.empty() ? found : model.threads.front().get();
}

std::vector<NodeTopic> topics_between(const std::vector<NodePart>& nodes,
                                      Diagnostics& diagnostics) {
    return Sorter(nodes, diagnostics).run();
}

}  // namespace hal
