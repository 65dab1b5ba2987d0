// SPDX-License-Identifier: MIT
// The rules over the whole model, checked when a transaction commits. A warning is printed once,
// not with every later edit for which it still holds.
#pragma once

#include <map>
#include <string>

#include "model/model.hpp"
#include "text/diagnostic.hpp"

namespace hal {

/// [setup]
class CommitChecks {
public:
    /// What is checked.
    struct Scope {
        bool whole = false;     ///< a whole text: what a single line may leave incomplete, too
        bool complete = false;  ///< of `hal check`: nothing follows
        bool open = false;      ///< something is missing that may be defined elsewhere
    };

    /// Adds what is new, and all errors unless `complete`.
    void run(const Model& model, Scope scope, Diagnostics& diagnostics);

private:
    void forget_fixed(const Diagnostics& found, bool whole);
    void report_removed_functions(const Model& model, Diagnostics& diagnostics);

    /// printed and not fixed since; TRUE: of a check of a whole text
    std::map<std::string, bool> reported_;
};

}  // namespace hal
