// SPDX-License-Identifier: MIT
// What a drawing of a netlist shows: which instances, in which clusters, and which signals as
// edges.
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "model/model.hpp"
#include "text/source.hpp"

namespace hal::tools {

enum class Cluster { none, component, file, thread };

/// What the user asked for.
struct GraphRequest {
    Cluster cluster = Cluster::none;
    /// a pin, signal or instance: draw its neighbourhood only; empty: the whole netlist
    std::string around;
    std::size_t depth = 1;           ///< how many signals away from it
    /// draws unlinked pins too; nothing: up to 40 instances of a whole netlist
    std::optional<bool> all_pins;
};

/// A signal with more readers is drawn as a label at its writer and at each reader, and a
/// neighbourhood does not extend across it.
constexpr std::size_t max_edges = 8;

/// The selection of a drawing. References the model.
class GraphView {
public:
    /// Selects what `request` asks for. On failure nothing is selected and problem() is the reason.
    GraphView(const Model& model, const Sources& sources, const GraphRequest& request);

    const std::string& problem() const { return problem_; }
    /// Returns the clusters in the order of the netlist with their instances; one without a name
    /// holds what belongs to none.
    const std::vector<std::pair<std::string, std::vector<const Instance*>>>& clusters() const {
        return clusters_;
    }
    bool shows(const Instance& instance) const { return shown_.contains(&instance); }
    /// Returns true for a pin that is drawn: its instance is, or it belongs to a thread or a
    /// function and its signal is drawn.
    bool shows(const Pin& pin) const;
    /// Returns the signals with at least one drawn pin of an instance (the whole netlist: all
    /// signals), sorted by name.
    const std::vector<const Signal*>& signals() const { return signals_; }
    /// Returns true when unlinked pins are drawn.
    bool all_pins() const { return all_pins_; }
    /// Returns true when this is the pin, or a pin of the signal or instance, that the
    /// neighbourhood is about.
    bool centre(const Instance& instance) const { return centre_ == &instance; }
    bool centre(const Pin& pin) const {
        return centre_ == &pin || (pin.signal && centre_ == pin.signal);
    }

private:
    void select_around(const Model& model, const GraphRequest& request);
    void select_signals(const Model& model, bool whole);
    void make_clusters(const Model& model, const Sources& sources, Cluster cluster);

    std::string problem_;
    std::set<const Instance*> shown_;
    std::vector<const Signal*> signals_;
    std::vector<std::pair<std::string, std::vector<const Instance*>>> clusters_;
    const void* centre_ = nullptr;
    bool all_pins_ = true;
};

/// Returns the pin that writes the signal; without one the first I/O pin, or nullptr.
const Pin* source_of(const Signal& signal);
/// Returns true for a signal with more than `max_edges` readers.
bool is_hub(const Signal& signal);

}  // namespace hal::tools
