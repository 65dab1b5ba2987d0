// SPDX-License-Identifier: MIT
// What is missing, and the lines that depend on it: they are counted instead of reported one by
// one.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "model/model.hpp"
#include "text/diagnostic.hpp"

namespace hal {

class Absences {
public:
    using Cause = std::size_t;
    enum class Scope : std::uint8_t {
        names,      ///< only names that are noted depend on it
        /// also any pin, function or thread that no loaded component has: the names of this one are
        /// unknown
        component,
        file,  ///< so does any signal
    };
    /// Enters what is missing: "component 'motmod'", "which is missing". `at` is the place of its
    /// error, or unknown without an error.
    Cause add(std::string what, std::string why, Span at, Scope scope);
    /// A name that is missing because of `cause`; without one, because of an error that was
    /// reported.
    void note(std::string name, std::optional<Cause> cause = {}) {
        names_.insert_or_assign(std::move(name), cause);
    }

    enum class Kind : std::uint8_t { pin, function, thread, signal };
    /// True when `name` is missing because something else is ('pid.0.output' is with 'pid.0' and
    /// with 'pid'). Counts the line.
    bool explains(std::string_view name, Kind kind, const Model& model);
    /// The cause of the last name that was explained.
    std::optional<Cause> last() const { return last_; }
    /// The command that the next look-ups belong to.
    void begin(Span command) { command_ = command; }

    /// A component, or the beginning of names, that exists elsewhere: neither it nor what depends
    /// on it is an error.
    void assume(const std::string& name);
    /// The cause of a component that is assumed and that loadrt names: from then on its pins may
    /// have any name.
    std::optional<Cause> assumed(const std::string& component);

    /// From now on only names that are noted depend on it.
    void narrow(Cause cause) { causes_[cause].scope = Scope::names; }

    /// Returns whether `name` was passed to assume().
    bool is_assumed(const std::string& name) const { return assumed_.contains(name); }

    /// `hal check` does not start programs: the names that this one would register as components,
    /// and its arguments without options.
    void note_program(const std::string& program, const std::vector<std::string>& names,
                      std::vector<std::string> arguments = {});
    bool has_programs() const { return !programs_.empty(); }
    /// Returns the first argument of the last program of this name; nullptr without one.
    const std::string* argument_of(const std::string& program) const;
    /// A netlist that cannot be read: names that it may define are not errors in the texts after
    /// it.
    void note_missing_text(const std::string& path);

    /// Returns how many lines were not checked, also those that were reported already.
    std::size_t unchecked_lines() const { return unchecked_lines_; }

    /// True when functions or signals may be in use by something that is missing.
    bool open() const { return open_; }
    /// Reports the lines counted since the last time: with the error about their cause when it is
    /// among `diagnostics`, else by a diagnostic of its own about the first of them.
    void report(Diagnostics& diagnostics);

private:
    struct Entry {
        std::string what, why;
        Span at;
        Scope scope;
        std::size_t lines = 0;
        Span first = {};
        Span counted = {};
    };
    bool foreign(std::string_view name, Kind kind, const Model& model);
    void count(Cause cause);
    void report(Entry& entry, std::vector<Diagnostic>& all) const;

    struct Program {
        std::string name;
        std::vector<std::string> arguments;
    };
    std::vector<Entry> causes_;
    std::vector<Program> programs_;
    std::unordered_map<std::string, std::optional<Cause>> names_;
    std::unordered_map<std::string, Cause> assumed_;
    std::optional<Cause> last_, several_;
    Span command_;
    std::unordered_set<std::string> heads_;  ///< the names of the model up to their first dot
    std::size_t heads_of_ = 0;  ///< how many names the model had
    std::size_t unchecked_lines_ = 0;
    Span unchecked_;  ///< the last of them
    bool open_ = false;
};

}  // namespace hal
