// SPDX-License-Identifier: MIT
// `scope` in a replay shell: values around the present cycle, drawn as the scope draws them.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "machine/session.hpp"
#include "scope/samples.hpp"

namespace hal::tools {

/// The words of the command: scope NAME... [--pre TIME] [--post TIME] [--svg FILE] [--csv FILE].
struct ScopeCommand {
    std::vector<std::string> names;
    std::int64_t pre_ns = 50'000'000;
    std::int64_t post_ns = 50'000'000;
    std::string svg;
    std::string csv;

    /// Returns words as one text, from one process to another.
    static std::string joined(const std::vector<std::string>& words);
    /// `text`: from joined(). Returns why the words are invalid, or "".
    std::string parse(const std::string& text);
    /// Returns the words again as one text, with other names.
    std::string text_for(const std::vector<std::string>& values) const;
};

/// Collects the values while cycles are executed. [setup] with the session's lock held
class ReplayedTraces {
public:
    /// `moment_ns`: time 0 of the picture. Patterns in the names are replaced by what they match
    /// now.
    ReplayedTraces(Session& session, ScopeCommand command, std::int64_t moment_ns);

    /// States which name is unknown; "" when all are known.
    std::string problem() const;
    const std::vector<std::string>& names() const { return names_; }
    std::int64_t end_ns() const { return moment_ns_ + command_.post_ns; }
    /// Reads the values at the end of the cycle that woke at `time_ns`.
    void sample(std::int64_t time_ns);
    /// Returns the picture as text, or writes the files and returns the names of those that are
    /// written. Sets `problem` when one cannot be.
    std::string drawn(std::string& problem) const;

private:
    Channel channel_of(const std::string& name) const;

    Session& session_;
    const ScopeCommand command_;
    const std::int64_t moment_ns_;
    std::vector<std::string> names_;
    std::vector<Samples> samples_;  // by channel
};

}  // namespace hal::tools
