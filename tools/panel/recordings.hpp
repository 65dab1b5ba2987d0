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

    struct Added {
        std::string problem;  // why it cannot be shown, with its name; "" when it is shown
        std::vector<std::string> notes;  // what is missing of a cut or damaged file, and why
    };

    /// Of a file with more than `max_bytes` of values, none is shown.
    explicit Recordings(std::uint64_t max_bytes = std::uint64_t{1} << 30) : max_bytes_(max_bytes) {}
    /// Loads a file (.mcap, .csv).
    Added add(const std::string& path);
    /// Returns the names by which pages choose recordings: that of the file, or the path when an
    /// earlier one has that name.
    std::vector<std::string> names() const;
    /// Returns the recordings for the greeting of a page: their names, notes, and the names of
    /// their values.
    nlohmann::json list() const;
    /// Answers `{"id":7,"recording":0,"names":["speed"]}`. `number` is unique among the answers of
    /// a page. Of more than 64 MiB of rows, the newest are sent.
    Answer answer(const nlohmann::json& request, std::uint64_t number) const;

private:
    struct Loaded {
        std::string name;
        std::string path;
        mcap::Recording recording;
    };
    bool is_taken(const std::string& name) const;
    std::string unique_name(const std::string& path) const;
    std::string same_file_as(const std::string& path) const;

    std::uint64_t max_bytes_;
    std::vector<Loaded> all_;
};

}  // namespace hal::tools
