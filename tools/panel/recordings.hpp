// SPDX-License-Identifier: MIT
// Recordings that pages show in the scope: of `hal record`, its flight recorder, or a journal with
// values.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "recording/mcap/recording.hpp"

namespace hal::tools {

class Recordings {
public:
    /// What a page gets for a request: a reply and, unless that is an error, the rows as the
    /// machine would send them for a probe, docs/protocol.md.
    struct Answer {
        std::string problem;
        std::string reply, event, rows;
    };

    /// Loads a file (.mcap, .csv). Returns a sentence with its name when it cannot be shown, or "".
    std::string add(const std::string& path);
    /// Returns the recordings for the greeting of a page: their names, and those of their values.
    nlohmann::json list() const;
    /// Answers `{"id":7,"recording":0,"names":["speed"]}`. `number` is unique among the answers of
    /// a page. Of more than 64 MiB of rows, the newest are sent.
    Answer answer(const nlohmann::json& request, std::uint64_t number) const;

private:
    struct Loaded {
        std::string name;
        mcap::Recording recording;
    };
    std::vector<Loaded> all_;
};

}  // namespace hal::tools
