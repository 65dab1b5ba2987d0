// SPDX-License-Identifier: MIT
// Completion of a line: what the shell computes, and the client asks for over the socket.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace hal {

class Session;
struct ShellOptions;

struct Candidate {
    std::string text;  ///< the whole word, to put in place of the one being typed
    std::string hint;  ///< a word or two about it: "s32 in", "and2", "1 ms"; may be empty
};

struct Completion {
    std::size_t begin = 0;              ///< byte in the line where the word being typed starts
    std::vector<Candidate> candidates;  ///< those that begin with what is typed, in natural order
};

/// Returns what could stand at `cursor` (a byte offset) of the line: only what the command would
/// take there. Takes the session's lock. [setup]
Completion complete_line(Session& session, const ShellOptions& options, std::string_view line,
                         std::size_t cursor);

}  // namespace hal
