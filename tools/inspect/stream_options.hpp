// SPDX-License-Identifier: MIT
// Options common to `hal record` and `hal play`.
#pragma once

#include <string>
#include <vector>

#include "cli/option_set.hpp"

namespace hal::tools {

struct StreamOptions : Options {
    std::string name;               ///< --name: of the instance; empty: not given
    /// when it is not among the words: a number or the name of an instance
    std::string channel;
    std::string name_as_component;  ///< halsampler -N
    bool classic = false;           ///< as halsampler or halstreamer: no channel among the words
    std::vector<std::string> line;  ///< the whole command line, if classic
};

}  // namespace hal::tools
