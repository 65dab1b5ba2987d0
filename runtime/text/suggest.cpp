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

/// Counts the insertions, deletions, replacements and swaps of neighbours that lead from `a` to
/// `b`; `limit` + 1 stands for more. Only the diagonal band that can stay within `limit` is
/// computed, so the time is linear in the length.
int edits(std::string_view a, std::string_view b, int limit) {
    const int n = static_cast<int>(a.size());
    const int m = static_cast<int>(b.size());
    const int far = limit + 1;
    if (n - m > limit || m - n > limit) return far;
    const auto at = [](std::string_view text, int i) {
        return folded(text[static_cast<std::size_t>(i)]);
    };
    // cell d of row i is column i + d - 1 - limit; a border on both sides
    std::array<int, 2 * max_edits + 3> rows[3];
    for (auto& row : rows) {
        row.fill(far);
    }
    for (int i = 0; i <= n; ++i) {
        auto &now = rows[i % 3], &before = rows[(i + 2) % 3], &two_before = rows[(i + 1) % 3];
        now.fill(far);
        int best = far;
        for (int d = 1; d <= 2 * limit + 1; ++d) {
            const auto k = static_cast<std::size_t>(d);
            const int j = i + d - 1 - limit;
            if (j < 0 || j > m) continue;
            int cost = i == 0 ? j : i;  // against an empty beginning
            if (i > 0 && j > 0) {
                cost = std::min({before[k] + (at(a, i - 1) != at(b, j - 1)), before[k + 1] + 1,
                                 now[k - 1] + 1});
                if (i > 1 && j > 1 && at(a, i - 1) == at(b, j - 2) &&
                    at(a, i - 2) == at(b, j - 1)) {
                    cost = std::min(cost, two_before[k] + 1);
                }
            }
            now[k] = std::min(cost, far);
            best = std::min(best, now[k]);
        }
        if (best == far) return far;
    }
    const int last = m - n + 1 + limit;
    return rows[n % 3][static_cast<std::size_t>(last)];
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
    for (const std::string& candidate : candidates) {
        if (candidate == name) continue;
        int distance = edits(name, candidate, limit);
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
    for (const char c : name) {
        folded_ += hal::folded(c);
    }
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

// The table of edits() with a row for each character of the candidate. Sorted names share
// beginnings, so the rows of a shared beginning are computed once; and where a beginning is already
// too different, so are all names that have it.
std::vector<NameIndex::Found> NameIndex::within(std::string_view name, int limit,
                                                std::uint32_t before,
                                                const std::stop_token& stop) const {
    using Row = std::array<int, 2 * max_edits + 3>;
    const int far = limit + 1;
    const int m = static_cast<int>(name.size());
    std::vector<Found> found;
    std::vector<Row> rows(1);
    rows[0].fill(far);
    for (int d = 1; d <= 2 * limit + 1; ++d) {
        if (const int j = d - 1 - limit; j >= 0 && j <= m) {
            rows[0][static_cast<std::size_t>(d)] = std::min(j, far);
        }
    }
    // rows that belong to the beginning of the candidate
    std::size_t valid = 0;
    std::size_t hopeless = std::string_view::npos;  // length of a beginning that is too different
    std::uint64_t steps = 0;
    for (std::uint32_t i = 0; i < names_.size() && !stop.stop_requested(); ++i) {
        ++steps;
        const std::size_t common = i == 0 ? 0 : common_[i];
        if (common >= hopeless) continue;
        hopeless = std::string_view::npos;
        valid = std::min(valid, common);
        const std::string_view candidate = folded(i);
        for (; valid < candidate.size(); ++valid) {
            ++steps;
            const std::size_t row = valid + 1;
            if (rows.size() <= row) {
                rows.resize(row + 1);
            }
            rows[row].fill(far);
            int best = far;
            for (int d = 1; d <= 2 * limit + 1; ++d) {
                const auto k = static_cast<std::size_t>(d);
                const int j = static_cast<int>(row) + d - 1 - limit;
                if (j < 0 || j > m) continue;
                int cost = static_cast<int>(row);
                if (j > 0) {
                    const auto column = static_cast<std::size_t>(j);
                    const bool differs = candidate[row - 1] != name[column - 1];
                    cost = std::min({rows[row - 1][k] + differs, rows[row - 1][k + 1] + 1,
                                     rows[row][k - 1] + 1});
                    const bool swapped = row > 1 && j > 1 &&
                                         candidate[row - 1] == name[column - 2] &&
                                         candidate[row - 2] == name[column - 1];
                    if (swapped) {
                        cost = std::min(cost, rows[row - 2][k] + 1);
                    }
                }
                rows[row][k] = std::min(cost, far);
                best = std::min(best, cost);
            }
            if (best < far) continue;
            hopeless = row;
            break;
        }
        if (hopeless != std::string_view::npos) {
            valid = hopeless;
            continue;
        }
        const int last = m - static_cast<int>(candidate.size()) + 1 + limit;
        if (last < 1 || last > 2 * limit + 1 || names_[i].number >= before) continue;
        const int distance = rows[candidate.size()][static_cast<std::size_t>(last)];
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
    std::string folded_name;
    for (const char c : name) {
        folded_name += hal::folded(c);
    }
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
