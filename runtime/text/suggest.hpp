// SPDX-License-Identifier: MIT
// Names that a message offers instead of an unknown one. Everything here is [setup].
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

namespace hal {

/// Returns the names of `candidates` close to `name` (edit distance, prefixes, swapped separators),
/// best first, at most `max_count`.
std::vector<std::string> similar(std::string_view name, const std::vector<std::string>& candidates,
                                 std::size_t max_count = 3);

/// Many names, indexed for many searches. Once all are added, any thread may search; the first
/// search sorts them. Sorting and searching end early once their `stop` is requested; an index that
/// was not sorted to the end offers nothing.
class NameIndex {
public:
    static constexpr std::uint32_t all = 0xFFFF'FFFF;

    /// `number` increases with the age of the name: a search can be limited to names that were there at some time.
    void add(std::string_view name, std::uint32_t number = 0);
    std::size_t size() const { return names_.size(); }
    /// Returns what the function similar() returns for the names with a number below `before`;
    /// nothing once `stop` is requested.
    std::vector<std::string> similar(std::string_view name, std::size_t max_count = 3,
                                     std::uint32_t before = all,
                                     const std::stop_token& stop = {}) const;
    /// The number of names and parts of names that all searches so far have compared: what a search
    /// costs, for tests. [any]
    std::uint64_t steps() const;

private:
    struct Name {
        std::uint32_t begin, size, number;
    };
    /// A name that is close enough, and how close it is.
    struct Found {
        int distance;
        std::uint32_t name;
    };
    void sort(const std::stop_token& stop) const;
    std::string_view text(std::uint32_t i) const {
        return std::string_view(texts_).substr(names_[i].begin, names_[i].size);
    }
    std::string_view folded(std::uint32_t i) const {
        return std::string_view(folded_).substr(names_[i].begin, names_[i].size);
    }
    std::vector<Found> within(std::string_view folded_name, int limit, std::uint32_t before,
                              const std::stop_token& stop) const;
    void add_longer(std::string_view folded_name, std::uint32_t before,
                    std::vector<Found>& found) const;

    // the names one after the other; the same without the differences that are ignored
    std::string texts_, folded_;
    mutable std::vector<Name> names_;  // sorted by their folded texts after sort()
    // how many characters a name shares with the one before it
    mutable std::vector<std::uint32_t> common_;
    mutable std::once_flag sorted_;
    mutable std::atomic<std::uint64_t> steps_{0};
};

/// Returns "did you mean 'x'?" or "did you mean 'x' or 'y'?", or nothing if no candidate is close.
std::string did_you_mean(std::string_view name, const std::vector<std::string>& candidates);
std::string did_you_mean(std::string_view name, const NameIndex& candidates,
                         std::uint32_t before = NameIndex::all, const std::stop_token& stop = {});

/// Joins names with commas, cut to the width of a line: "a, b, c, … (17 more)".
std::string listed(const std::vector<std::string>& names, std::size_t max_count = 12);

/// The same, but offers all names if none is close: "did you mean 'x'?" or "KINDS: a, b, c".
std::string suggestion(std::string_view name, const std::vector<std::string>& candidates,
                       std::string_view kinds);

}  // namespace hal
