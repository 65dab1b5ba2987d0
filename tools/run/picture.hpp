// SPDX-License-Identifier: MIT
// The small live picture of `hal run`: what is seen of a machine whose signals have names we know.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "machine/session.hpp"

namespace hal::tools {

/// What a picture is drawn from, all of one moment.
struct Scene {
    std::vector<double> values;  ///< in the order of Motif::signals
    double seconds = 0;          ///< since the start
    ThreadReport thread;         ///< the slowest one
    std::uint64_t missed = 0;
    std::uint64_t faults = 0;
};

/// A machine that can be drawn: which signals it needs, and its lines of text.
struct Motif {
    std::vector<std::string> signals;
    std::vector<std::string> (*draw)(const Scene&, bool unicode);
};

/// The motif whose signals the model has, or nullptr.
const Motif* motif_for(const Model& model);

/// Draws about 20 times a second on standard output, from a thread of its own, until destroyed;
/// then the cursor is below the last picture. Lines are cut to the width of the terminal, and the
/// picture stays in its place when the terminal is resized, except for what the terminal has scrolled
/// out of view while it was smaller. Changes no mode of the terminal, so there is nothing to
/// restore whatever happens.
class Picture {
public:
    /// Returns nullptr when standard output is not a terminal, it is too small, or the netlist has
    /// no motif.
    static std::unique_ptr<Picture> start(Session& session);
    ~Picture();
    /// Writes a line to standard error. In the terminal it replaces the picture, which is drawn
    /// again below it. [any]
    void print_above(const std::string& line);

private:
    Picture(Session& session, const Motif& motif);
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace hal::tools
