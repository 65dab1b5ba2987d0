// SPDX-License-Identifier: MIT
#include "recording/mcap/csv_loader.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <set>
#include <sstream>
#include <type_traits>

#include "hal/pin_type.hpp"
#include "recording/mcap/missing_rows.hpp"
#include "recording/mcap/reader.hpp"
#include "text/numbers.hpp"
#include "text/quoting.hpp"

namespace hal::mcap {
namespace {

std::vector<std::string> csv_words(const std::string& line) {
    std::vector<std::string> words(1);
    bool quoted = false;
    for (std::size_t i = 0; i < line.size(); ++i) {
        if (line[i] == '"') {
            if (quoted && i + 1 < line.size() && line[i + 1] == '"') {
                words.back() += line[i++];
            } else {
                quoted = !quoted;
            }
        } else if (line[i] == ',' && !quoted) {
            words.emplace_back();
        } else if (line[i] != '\r') {
            words.back() += line[i];
        }
    }
    return words;
}

template <class Int>
bool whole_number(const std::string& text, std::uint64_t& word) {
    Int value = 0;
    if (parse_whole(text, value)) {
        word = static_cast<std::uint64_t>(
            static_cast<std::conditional_t<std::is_signed_v<Int>, std::int64_t, std::uint64_t>>(
                value));
        return true;
    }
    double real = 0;  // "1.0", "1e3": of another program
    if (!parse_whole(text, real) || real != std::floor(real) || std::abs(real) > 0x1p53)
        return false;
    if (real < static_cast<double>(std::numeric_limits<Int>::min()) ||
        real > static_cast<double>(std::numeric_limits<Int>::max())) {
        return false;
    }
    word = static_cast<std::uint64_t>(static_cast<std::int64_t>(real));
    return true;
}

/// Reads a value of that type into `word`. Returns false, and keeps `word`, when the text is
/// invalid.
bool word_of(const std::string& text, hal_type type, std::uint64_t& word) {
    return visit_type(type, [&]<class T>(std::type_identity<T>) {
        if constexpr (std::is_same_v<T, bool>) {
            std::uint64_t bit = 0;
            if (!whole_number<std::uint8_t>(text, bit) || bit > 1) return false;
            word = bit;
        } else if constexpr (std::is_same_v<T, double>) {
            double real = 0;
            if (!parse_whole(text, real)) return false;
            word = std::bit_cast<std::uint64_t>(real);
        } else {
            return whole_number<T>(text, word);
        }
        return true;
    });
}

/// What a reader of a table must know, though it was read; empty: nothing.
std::string note_of_csv(std::size_t equal) {
    if (equal == 0) return "";
    return counted(equal, "row has", "rows have") + " the time of the row before";
}

/// Columns of which a row has values together: those of one thread. Columns that share a row, or
/// are connected by such columns, are a group.
class ColumnGroups {
public:
    explicit ColumnGroups(std::size_t columns) : parents_(columns) {
        std::iota(parents_.begin(), parents_.end(), std::size_t{0});
    }
    void join(std::size_t a, std::size_t b) { parents_[group(b)] = group(a); }
    /// Returns the group of a column: one of its columns.
    std::size_t group(std::size_t column) {
        while (parents_[column] != column) {
            parents_[column] = parents_[parents_[column]];
            column = parents_[column];
        }
        return column;
    }

private:
    std::vector<std::size_t> parents_;
};

/// Returns a table per group. `first_filled` has, for each row, a column that it has a value of; a
/// row without any is in the first table.
std::vector<Table> split(const Table& whole, const std::vector<std::size_t>& first_filled,
                         ColumnGroups& groups) {
    std::vector<Table> tables;
    std::vector<std::vector<std::size_t>> columns;  // of each table, in the whole
    std::map<std::size_t, std::size_t> table_of;  // group to table
    std::set<std::size_t> filled;  // groups
    for (const std::size_t column : first_filled) {
        filled.insert(groups.group(column));
    }
    for (std::size_t c = 0; c < whole.columns.size(); ++c) {
        std::size_t group = groups.group(c);
        if (!filled.empty() && !filled.contains(group)) {
            group = *filled.begin();  // a column without any value keeps its initial one
        }
        const auto [at, added] = table_of.try_emplace(group, tables.size());
        if (added) {
            tables.push_back({whole.topic, {}, {}, {}});
            columns.emplace_back();
        }
        tables[at->second].columns.push_back(whole.columns[c]);
        columns[at->second].push_back(c);
    }
    for (std::size_t row = 0; row < whole.rows(); ++row) {
        const std::size_t t = table_of.at(groups.group(first_filled[row]));
        tables[t].times_ns.push_back(whole.times_ns[row]);
        for (const std::size_t c : columns[t]) {
            tables[t].words.push_back(whole.word(row, c));
        }
    }
    return tables;
}

/// Returns the number of rows with the time of the row before.
std::size_t equal_times(const std::vector<Table>& tables) {
    std::size_t count = 0;
    for (const Table& table : tables) {
        for (std::size_t row = 1; row < table.rows(); ++row) {
            count += table.times_ns[row] == table.times_ns[row - 1];
        }
    }
    return count;
}

class CsvLoader {
public:
    CsvLoader(const std::string& path, const LoadOptions& options, Recording& to,
              std::string& problem)
        : path_(path), options_(options), to_(to), problem_(problem) {}

    bool load() {
        std::string text;
        if (!read_file(text)) return false;
        std::istringstream file(text);
        std::string line;
        std::getline(file, line);
        if (!read_head(line)) return false;
        bool is_cut = false;
        for (number_ = 2; to_.missing.empty() && std::getline(file, line); ++number_) {
            is_cut = file.eof();  // the line has no line end
            if (!read_row(line, is_cut)) return false;
        }
        to_.tables = split(table_, first_filled_, *groups_);
        note(is_cut);
        return true;
    }

private:
    bool fail(std::string problem) {
        problem_ = std::move(problem);
        return false;
    }
    bool fail_here(const std::string& problem) { return fail(location() + problem); }
    std::string location() const {
        return "'" + path_ + "', line " + std::to_string(number_) + ": ";
    }
    bool not_numbers() {
        return fail_here("not a row of " + std::to_string(names_.size()) + " numbers");
    }

    bool read_file(std::string& text) {
        const auto source = open_file(path_, problem_);
        if (!source) return false;
        // on 32 bit less than the limit
        constexpr std::uint64_t addressable = std::numeric_limits<std::size_t>::max() / 2;
        const std::uint64_t size = source->size();
        const bool fits = size <= std::min(4 * options_.max_bytes, addressable);
        if (fits && source->read(0, static_cast<std::size_t>(size), text)) return true;
        return fail("'" + path_ + "' is too large, or cannot be read");
    }

    bool read_head(const std::string& line) {
        names_ = csv_words(line);
        if (names_.size() < 2 || names_[0] != "time_s") {
            return fail("'" + path_ + "' is not a recording: its first column must be time_s");
        }
        for (std::size_t i = 1; i < names_.size(); ++i) {
            const auto here = names_.begin() + static_cast<std::ptrdiff_t>(i);
            if (std::find(names_.begin(), here, names_[i]) != here) {
                return fail("'" + path_ + "', line 1: column '" + names_[i] + "' occurs twice");
            }
            const auto type = options_.types.find(names_[i]);
            const bool is_known = type != options_.types.end();
            table_.columns.push_back({names_[i], is_known ? type->second : HAL_TYPE_FLOAT, ""});
        }
        held_.resize(table_.columns.size());
        groups_.emplace(table_.columns.size());
        return true;
    }

    /// Adds a row. A row that is cut off ends the table: `missing` begins with it.
    bool read_row(const std::string& line, bool is_cut) {
        const std::vector<std::string> words = csv_words(line);
        if (is_cut && words.size() < names_.size()) return end_here();
        double time_s = 0;
        const bool is_row = words.size() == names_.size() && parse_whole(words[0], time_s);
        if (!is_row || !(std::abs(time_s) < 9e9)) return not_numbers();

        std::size_t first_filled = 0;  // column
        bool any = false;
        for (std::size_t c = 0; c < held_.size(); ++c) {
            const std::string& word = words[c + 1];
            if (word.empty()) continue;  // as before
            if (!any) {
                first_filled = c;
                any = true;
            }
            if (word_of(word, table_.columns[c].type, held_[c])) {
                groups_->join(first_filled, c);
            } else if (is_cut && c + 1 == held_.size()) {
                return end_here();
            } else {
                return not_a_value(word, c);
            }
        }
        return add_row(static_cast<std::int64_t>(std::llround(time_s * 1e9)), first_filled);
    }

    bool end_here() {
        to_.missing = location() + "the line is cut off; ";
        return true;
    }

    bool not_a_value(const std::string& word, std::size_t column) {
        const Column& its = table_.columns[column];
        if (its.type == HAL_TYPE_FLOAT) return not_numbers();
        return fail_here("'" + word.substr(0, 40) + "' of '" + its.name +
                         "' is not a value of type " + std::string(word_of_type(its.type)));
    }

    bool add_row(std::int64_t time_ns, std::size_t first_filled) {
        if (time_ns < options_.begin_ns || time_ns >= options_.end_ns) return true;
        first_filled_.push_back(first_filled);
        table_.times_ns.push_back(time_ns);
        table_.words.insert(table_.words.end(), held_.begin(), held_.end());
        if (table_.words.size() * 8 <= options_.max_bytes) return true;
        return fail("'" + path_ + "' has more than " + std::to_string(options_.max_bytes >> 20) +
                    " MiB of values; " + options_.too_large_help);
    }

    void note(bool is_cut) {
        if (!to_.missing.empty()) {
            to_.missing += missing_rows(to_);
        } else if (is_cut) {
            to_.missing = "'" + path_ + "': the last line has no line end; its value of '" +
                          names_.back() + "' may be cut, and rows after it may be missing";
        }
        if (const std::string note = note_of_csv(equal_times(to_.tables)); !note.empty()) {
            to_.note = "'" + path_ + "': " + note;
        }
    }

    const std::string& path_;
    const LoadOptions& options_;
    Recording& to_;
    std::string& problem_;
    std::size_t number_ = 1;  // of the line
    std::vector<std::string> names_;
    Table table_{"", {}, {}, {}};
    std::vector<std::uint64_t> held_;  // the newest value of each column
    std::optional<ColumnGroups> groups_;
    std::vector<std::size_t> first_filled_;  // of each row: a column that it has a value of
};

}  // namespace

bool load_csv(const std::string& path, Recording& to, std::string& problem,
              const LoadOptions& options) {
    return CsvLoader(path, options, to, problem).load();
}

}  // namespace hal::mcap
