// SPDX-License-Identifier: MIT
#include "text/suggest.hpp"

#include <algorithm>
#include <array>

#include "text/characters.hpp"
#include "text/sort_in_steps.hpp"

namespace hal {

namespace {

/// Ignores what people confuse: the case of letters, and which separator a name has.
char folded(char c) { return c == '_' || c == '.' ? '-' : lower(c); }

constexpr int max_edits = 5;
constexpr int typed_in_part = max_edits + 2;  // ranks below any mistyped name

/// Counts the edits (insertions, deletions, replacements and swaps of neighbours) that lead from a
/// name to a candidate, whose characters are appended one after the other: candidates with a common
/// beginning share the rows of it. All texts are folded.
///
/// Row i is that of the first i characters of the candidate, column j that of the first j
/// characters of the name (Levenshtein, with the swap of Damerau). Only the diagonal band that can stay within
/// the limit is stored, so the time is linear in the length: cell d of row i is column
/// i + d - 1 - limit, with a border on both sides.
class EditTable {
public:
    EditTable(std::string_view name, int limit)
        : name_(name), limit_(limit), above_limit_(limit + 1) {
        append_row();
    }

    std::size_t length() const { return candidate_.size(); }

    /// Removes the characters of the candidate after the first `length`.
    void truncate(std::size_t length) {
        if (length >= candidate_.size()) return;
        candidate_.resize(length);
        rows_.resize(length + 1);
    }
    /// Appends a character. Returns false when every candidate with this beginning has more edits
    /// than the limit.
    bool append(char c) {
        candidate_ += c;
        return append_row() <= limit_;
    }
    /// Returns the number of edits; limit + 1 stands for more.
    int edits() const {
        const int cell = cell_of(static_cast<int>(length()), static_cast<int>(name_.size()));
        const bool is_in_band = cell >= 1 && cell <= width();
        return is_in_band ? rows_.back()[static_cast<std::size_t>(cell)] : above_limit_;
    }

private:
    using Row = std::array<int, 2 * max_edits + 3>;

    int width() const { return 2 * limit_ + 1; }
    int cell_of(int row, int column) const { return column - row + 1 + limit_; }

    /// Computes the row behind the last one. Returns its smallest number of edits.
    int append_row() {
        const int row = static_cast<int>(rows_.size());
        rows_.emplace_back().fill(above_limit_);
        int min = above_limit_;
        for (int cell = 1; cell <= width(); ++cell) {
            const int column = row + cell - 1 - limit_;
            if (column < 0 || column > static_cast<int>(name_.size())) continue;
            const int edits = std::min(edits_at(row, column), above_limit_);
            rows_.back()[static_cast<std::size_t>(cell)] = edits;
            min = std::min(min, edits);
        }
        return min;
    }
    /// Returns the edits of a cell from those before it, which are computed already.
    int edits_at(int row, int column) const {
        if (row == 0) return column;  // insert all
        if (column == 0) return row;  // delete all
        const auto i = static_cast<std::size_t>(row);
        const auto j = static_cast<std::size_t>(column);
        const auto d = static_cast<std::size_t>(cell_of(row, column));
        const bool differ = candidate_[i - 1] != name_[j - 1];
        const int replaced = rows_[i - 1][d] + (differ ? 1 : 0);
        const int deleted = rows_[i - 1][d + 1] + 1;
        const int inserted = rows_[i][d - 1] + 1;
        const int least = std::min({replaced, deleted, inserted});
        const bool are_swapped = i > 1 && j > 1 && candidate_[i - 1] == name_[j - 2] &&
                                 candidate_[i - 2] == name_[j - 1];
        return are_swapped ? std::min(least, rows_[i - 2][d] + 1) : least;
    }

    const std::string_view name_;
    const int limit_;
    const int above_limit_;
    std::string candidate_;
    std::vector<Row> rows_;  // one more than the candidate has characters
};

/// Returns the edits from the name of a new table to a candidate; limit + 1 stands for more.
int edits_to(std::string_view candidate, EditTable& table) {
    table.truncate(0);
    for (const char c : candidate) {
        if (!table.append(folded(c))) break;
    }
    return table.edits();
}

std::string folded(std::string_view text) {
    std::string result;
    for (const char c : text) {
        result += folded(c);
    }
    return result;
}

/// The number of edits up to which a name is similar to this one.
int edit_limit(std::string_view name) {
    return name.size() < 2 ? 0 : std::min(max_edits, 1 + static_cast<int>(name.size()) / 5);
}

/// Beside a name that is one slip away, the others are noise.
bool is_noise(int distance, int best) { return distance > best && best <= 1; }

bool starts_with(std::string_view text, std::string_view prefix) {
    return text.size() > prefix.size() &&
           std::equal(prefix.begin(), prefix.end(), text.begin(),
                      [](char a, char b) { return folded(a) == folded(b); });
}

}  // namespace

std::vector<std::string> similar(std::string_view name, const std::vector<std::string>& candidates,
                                 std::size_t max) {
    struct Found {
        int distance;
        const std::string* name;
    };
    std::vector<Found> found;
    const int limit = edit_limit(name);
    const std::string folded_name = folded(name);
    EditTable table(folded_name, limit);
    for (const std::string& candidate : candidates) {
        if (candidate == name) continue;
        int distance = edits_to(candidate, table);
        if (distance > limit && name.size() >= 3 && starts_with(candidate, name)) {
            distance = typed_in_part;
        }
        if (distance <= limit || distance == typed_in_part) {
            found.push_back({distance, &candidate});
        }
    }
    const auto better = [](const Found& a, const Found& b) {
        return a.distance != b.distance ? a.distance < b.distance : *a.name < *b.name;
    };
    const auto kept = std::min(max, found.size());
    std::partial_sort(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(kept), found.end(),
                      better);
    std::vector<std::string> names;
    for (const Found& one : found) {
        if (names.size() == kept) break;
        if (is_noise(one.distance, found[0].distance)) break;
        names.push_back(*one.name);
    }
    return names;
}

void NameIndex::add(std::string_view name, std::uint32_t number) {
    names_.push_back({static_cast<std::uint32_t>(texts_.size()),
                      static_cast<std::uint32_t>(name.size()), number});
    texts_ += name;
    folded_ += hal::folded(name);
}

std::uint64_t NameIndex::steps() const { return steps_.load(std::memory_order_relaxed); }

void NameIndex::sort(const std::stop_token& stop) const {
    const std::string_view folded_texts = folded_;
    const auto folded_of = [&](const Name& name) {
        return folded_texts.substr(name.begin, name.size);
    };
    sort_in_steps(names_, [&](const Name& a, const Name& b) { return folded_of(a) < folded_of(b); },
                  [&] { return stop.stop_requested(); });
    common_.assign(names_.size(), 0);
    for (std::size_t i = 1; i < names_.size(); ++i) {
        const std::string_view before = folded_of(names_[i - 1]);
        const std::string_view now = folded_of(names_[i]);
        const auto differ = std::mismatch(before.begin(), before.end(), now.begin(), now.end());
        common_[i] = static_cast<std::uint32_t>(differ.first - before.begin());
    }
}

// Sorted names share beginnings, whose rows of the table are computed once; and where a beginning
// is already too different, so are all names that have it.
std::vector<NameIndex::Found> NameIndex::within(std::string_view name, int limit,
                                                std::uint32_t before,
                                                const std::stop_token& stop) const {
    constexpr std::size_t none = std::string_view::npos;
    std::vector<Found> found;
    EditTable table(name, limit);
    std::size_t rejected_length = none;  // of a beginning that is too different
    std::uint64_t steps = 0;
    for (std::uint32_t i = 0; i < names_.size() && !stop.stop_requested(); ++i) {
        ++steps;
        const std::size_t common = i == 0 ? 0 : common_[i];
        if (common >= rejected_length) continue;
        rejected_length = none;
        table.truncate(common);
        const std::string_view candidate = folded(i);
        while (table.length() < candidate.size() && rejected_length == none) {
            ++steps;
            if (!table.append(candidate[table.length()])) {
                rejected_length = table.length();
            }
        }
        if (rejected_length != none || names_[i].number >= before) continue;
        const int distance = table.edits();
        if (distance <= limit) {
            found.push_back({distance, i});
        }
    }
    steps_.fetch_add(steps, std::memory_order_relaxed);
    return found;
}

/// Adds the names that begin with `name`; they are neighbours in the order of the index.
void NameIndex::add_longer(std::string_view name, std::uint32_t before,
                           std::vector<Found>& found) const {
    const auto first = std::lower_bound(names_.begin(), names_.end(), name,
                                        [&](const Name& one, std::string_view to) {
        return std::string_view(folded_).substr(one.begin, one.size) < to;
    });
    std::vector<std::uint32_t> close;
    for (const Found& one : found) {
        close.push_back(one.name);
    }
    std::uint64_t steps = 0;
    for (auto i = static_cast<std::uint32_t>(first - names_.begin());
         i < names_.size() && folded(i).starts_with(name); ++i) {
        ++steps;
        const bool longer = names_[i].size > name.size() && names_[i].number < before;
        if (longer && !std::binary_search(close.begin(), close.end(), i)) {
            found.push_back({typed_in_part, i});
        }
    }
    steps_.fetch_add(steps, std::memory_order_relaxed);
}

std::vector<std::string> NameIndex::similar(std::string_view name, std::size_t max_count,
                                            std::uint32_t before,
                                            const std::stop_token& stop) const {
    std::call_once(sorted_, [&] { sort(stop); });
    const std::string folded_name = hal::folded(name);
    std::vector<Found> found = within(folded_name, edit_limit(name), before, stop);
    if (stop.stop_requested()) {
        return {};
    }
    std::erase_if(found, [&](const Found& one) { return text(one.name) == name; });
    if (name.size() >= 3 && found.size() < max_count) {
        add_longer(folded_name, before, found);
    }
    const auto better = [&](const Found& a, const Found& b) {
        return a.distance != b.distance ? a.distance < b.distance : text(a.name) < text(b.name);
    };
    const std::size_t kept = std::min(max_count, found.size());
    std::partial_sort(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(kept), found.end(),
                      better);
    std::vector<std::string> names;
    for (const Found& one : found) {
        if (names.size() == kept || is_noise(one.distance, found[0].distance)) break;
        names.emplace_back(text(one.name));
    }
    return names;
}

namespace {

std::string question(const std::vector<std::string>& names) {
    if (names.empty()) {
        return {};
    }
    std::string text = "did you mean '" + names[0] + "'";
    for (std::size_t i = 1; i < names.size(); ++i) {
        text += (i + 1 == names.size() ? " or '" : ", '") + names[i] + "'";
    }
    return text + "?";
}

}  // namespace

std::string did_you_mean(std::string_view name, const std::vector<std::string>& candidates) {
    return question(similar(name, candidates));
}

std::string did_you_mean(std::string_view name, const NameIndex& candidates, std::uint32_t before,
                         const std::stop_token& stop) {
    return question(candidates.similar(name, 3, before, stop));
}

std::string listed(const std::vector<std::string>& names, std::size_t max) {
    constexpr std::size_t width = 100;
    std::string text;
    std::size_t shown = 0;
    for (; shown < names.size() && shown < max; ++shown) {
        if (shown > 0 && text.size() + names[shown].size() > width) break;
        text += (shown == 0 ? "" : ", ") + names[shown];
    }
    if (shown == names.size()) return text;
    return text + (shown == 0 ? "… (" : ", … (") + std::to_string(names.size() - shown) + " more)";
}

std::string suggestion(std::string_view name, const std::vector<std::string>& candidates,
                       std::string_view kinds) {
    std::string text = did_you_mean(name, candidates);
    return text.empty() && !candidates.empty()
               ? std::string(kinds) + ": " + listed(candidates, candidates.size())
               : text;
}

}  // namespace hal
