// SPDX-License-Identifier: MIT
// What completion answers: shared by the shell, which computes it, and the client, which asks for
// it over the socket.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace hal {

struct Candidate {
    std::string text;  ///< the whole word, to put in place of the one being typed
    std::string hint;  ///< a word or two about it: "s32 in", "and2", "1 ms"; may be empty
};

struct Completion {
    std::size_t begin = 0;              ///< byte in the line where the word being typed starts
    std::vector<Candidate> candidates;  ///< those that begin with what is typed, sorted by name
};

}  // namespace hal
