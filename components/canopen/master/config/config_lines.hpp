// SPDX-License-Identifier: MIT
// The text below a configuration: sections and keys, each with its place; and what values are spelled like.
#pragma once

#include <deque>
#include <string>
#include <string_view>
#include <vector>

#include "master_config.hpp"

namespace hal::canopen::config {

/// A word of the file and where it stands.
struct Word {
    std::string text;
    Place       at;
    bool        empty() const { return text.empty(); }
};

struct Line {
    Word        key, value;          ///< key: lower case, dashes; value: as it is
    std::string written{};    ///< the key as it is
    bool        used = false;
};

struct Section {
    std::vector<Word> words;  ///< of its header
    Place             at;
    std::deque<Line>  lines;
};

/// Collects messages.
class Report {
public:
    void error(Topic topic, Place at, std::string sentence, std::string help = {}, std::string label = {}) {
        messages.push_back({Severity::error, topic, at, std::move(sentence), std::move(label), std::move(help)});
    }
    void warning(Topic topic, Place at, std::string sentence, std::string help = {}, std::string label = {}) {
        messages.push_back({Severity::warning, topic, at, std::move(sentence), std::move(label), std::move(help)});
    }
    void note(Topic topic, Place at, std::string sentence, std::string help = {}) {
        messages.push_back({Severity::note, topic, at, std::move(sentence), {}, std::move(help)});
    }
    std::vector<Message> messages;
};

std::vector<Section> split(std::string_view text, Report&);

/// "a, b, c" in its parts, each with its place.
std::vector<Word> list_of(const Word& value, char by = ',');
std::vector<Word> words_of(const Word& value);

/// Lower case; what is neither letter nor digit becomes one dash.
std::string dashed(std::string_view name);
std::string lower(std::string_view text);
/// Decimal, or hexadecimal with 0x.
std::optional<std::uint64_t> natural(std::string_view text);
/// 1M, 500k, 125000
std::optional<std::uint32_t> rate(std::string_view text);
/// 1ms, 250us, 2s, 0.5s; none without a unit, except 0.
std::optional<Time> duration(std::string_view text);
std::optional<bool> yes_or_no(std::string_view text);
/// "0x6040", "0x6099:1"
std::string object_label(std::uint16_t index, unsigned sub, bool single = false);

/// "did you mean 'x'?", or empty. `candidates` are compared as they are.
std::string did_you_mean(std::string_view word, const std::vector<std::string>& candidates);
/// "a, b, c, … (12 more)"
std::string listed(const std::vector<std::string>& names, std::size_t most = 12);

}  // namespace hal::canopen::config
