// SPDX-License-Identifier: MIT
#include "text/suggest.hpp"

#include <algorithm>
#include <array>

#include "text/characters.hpp"

namespace hal {

namespace {

/// Ignores what people confuse: the case of letters, and which separator a name has.
char folded(char c) { return c == '_' || c == '.' ? '-' : lower(c); }

constexpr int most_edits = 5;
constexpr int typed_in_part = most_edits + 2;  // ranks below any mistyped name

/// Counts the insertions, deletions, replacements and swaps of neighbours that lead from `a` to `b`; `limit` + 1 stands for more.
/// Only the diagonal band that can stay within `limit` is computed, so the time is linear in the length.
int edits(std::string_view a, std::string_view b, int limit) {
    const int n = static_cast<int>(a.size()), m = static_cast<int>(b.size()), far = limit + 1;
    if (n - m > limit || m - n > limit) return far;
    const auto at = [](std::string_view text, int i) { return folded(text[static_cast<std::size_t>(i)]); };
    std::array<int, 2 * most_edits + 3> rows[3];  // cell d of row i is column i + d - 1 - limit; a border on both sides
    for (auto& row : rows) row.fill(far);
    for (int i = 0; i <= n; ++i) {
        auto &now = rows[i % 3], &before = rows[(i + 2) % 3], &two_before = rows[(i + 1) % 3];
        now.fill(far);
        int best = far;
        for (int d = 1; d <= 2 * limit + 1; ++d) {
            const auto k = static_cast<std::size_t>(d);
            const int j = i + d - 1 - limit;
            if (j < 0 || j > m) continue;
            int cost = i == 0 ? j : j == 0 ? i : far;
            if (i > 0 && j > 0) {
                cost = std::min({before[k] + (at(a, i - 1) != at(b, j - 1)), before[k + 1] + 1, now[k - 1] + 1});
                if (i > 1 && j > 1 && at(a, i - 1) == at(b, j - 2) && at(a, i - 2) == at(b, j - 1))
                    cost = std::min(cost, two_before[k] + 1);
            }
            now[k] = std::min(cost, far);
            best = std::min(best, now[k]);
        }
        if (best == far) return far;
    }
    const int last = m - n + 1 + limit;
    return rows[n % 3][static_cast<std::size_t>(last)];
}

bool starts_with(std::string_view text, std::string_view prefix) {
    return text.size() > prefix.size() &&
           std::equal(prefix.begin(), prefix.end(), text.begin(), [](char a, char b) { return folded(a) == folded(b); });
}

}  // namespace

std::vector<std::string> similar(std::string_view name, const std::vector<std::string>& candidates, std::size_t most) {
    struct Found {
        int distance;
        const std::string* name;
    };
    std::vector<Found> found;
    const int limit = name.size() < 2 ? 0 : std::min(most_edits, 1 + static_cast<int>(name.size()) / 5);
    for (const std::string& candidate : candidates) {
        if (candidate == name) continue;
        int distance = edits(name, candidate, limit);
        if (distance > limit && name.size() >= 3 && starts_with(candidate, name)) distance = typed_in_part;
        if (distance <= limit || distance == typed_in_part) found.push_back({distance, &candidate});
    }
    const auto better = [](const Found& a, const Found& b) {
        return a.distance != b.distance ? a.distance < b.distance : *a.name < *b.name;
    };
    const auto kept = std::min(most, found.size());
    std::partial_sort(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(kept), found.end(), better);
    std::vector<std::string> names;
    for (const Found& one : found) {
        if (names.size() == kept) break;
        // Beside a name that is one slip away the others are noise.
        if (one.distance > found[0].distance && found[0].distance <= 1) break;
        names.push_back(*one.name);
    }
    return names;
}

std::string did_you_mean(std::string_view name, const std::vector<std::string>& candidates) {
    const std::vector<std::string> names = similar(name, candidates);
    if (names.empty()) return {};
    std::string text = "did you mean '" + names[0] + "'";
    for (std::size_t i = 1; i < names.size(); ++i) text += (i + 1 == names.size() ? " or '" : ", '") + names[i] + "'";
    return text + "?";
}

std::string listed(const std::vector<std::string>& names, std::size_t most) {
    constexpr std::size_t width = 100;
    std::string text;
    std::size_t shown = 0;
    for (; shown < names.size() && shown < most; ++shown) {
        if (shown > 0 && text.size() + names[shown].size() > width) break;
        text += (shown == 0 ? "" : ", ") + names[shown];
    }
    if (shown == names.size()) return text;
    return text + (shown == 0 ? "… (" : ", … (") + std::to_string(names.size() - shown) + " more)";
}

std::string suggestion(std::string_view name, const std::vector<std::string>& candidates, std::string_view kinds) {
    std::string text = did_you_mean(name, candidates);
    return text.empty() && !candidates.empty() ? std::string(kinds) + ": " + listed(candidates, candidates.size()) : text;
}

}  // namespace hal
