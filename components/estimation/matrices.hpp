// SPDX-License-Identifier: MIT
// Matrices given by the user: as load arguments (`a=0,1;-2,-3`) or in a file (`file=rig.matrices`).
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "estimation/matrix.hpp"
#include "hal/texts.hpp"
#include "text/characters.hpp"
#include "text/config_text.hpp"
#include "text/numbers.hpp"
#include "text/quoting.hpp"

namespace hal::estimation {

/// A matrix and its span.
struct Given {
    std::string name;
    Eigen::MatrixXd value;
    bool in_file = false;
    std::uint32_t begin = 0;
    std::uint32_t end = 0;  ///< its name in the file
    std::string argument;  ///< NAME=TEXT, shortened, if a load argument gave it
};

/// NAME = rows, a line or a `;` between rows, spaces or commas between numbers, `diag` before the
/// numbers of a diagonal, `#` before a comment. Names are not case sensitive. [setup]
class MatrixText {
public:
    std::vector<Given> found;
    std::vector<text::Problem> problems;

    /// Reads a whole file. [setup]
    void read_file(std::string_view text) {
        text_ = text;
        text::Lines lines(text, "#");  // a `;` separates rows
        while (const auto line = lines.next()) {
            read_line(line->at.offset, line->at.offset + line->at.length);
        }
        finish();
        in_files();
    }
    /// Reads the rows of one matrix from a load argument. [setup]
    void read_rows(std::string name, std::string_view text) {
        text_ = text;
        open(std::move(name), 0, 0);
        rows(0, text.size());
        finish();
    }

private:
    static bool is_separator(char c) { return c == ' ' || c == '\t' || c == ',' || c == '\r'; }

    void in_files() {
        for (Given& given : found) {
            given.in_file = true;
        }
    }
    /// A line `NAME = rows` begins a matrix, any other continues it.
    void read_line(std::size_t begin, std::size_t end) {
        const std::size_t equals = text_.substr(begin, end - begin).find('=');
        if (equals == std::string_view::npos) {
            rows(begin, end);
            return;
        }
        begin_matrix(begin, begin + equals);
        rows(begin + equals + 1, end);
    }
    /// Reads the name, which stands between blanks.
    void begin_matrix(std::size_t begin, std::size_t end) {
        while (begin < end && is_separator(text_[begin])) {
            ++begin;
        }
        while (end > begin && is_separator(text_[end - 1])) {
            --end;
        }
        finish();
        const std::string name(text_.substr(begin, end - begin));
        if (!is_matrix_name(name)) {
            report_at(begin, std::max(end, begin + 1), "'" + name + "' is not a name of a matrix",
                      "write NAME = numbers, as in: A = 0 1");
        }
        const std::string key = lower(name);
        if (++defined_[key] == 2) {
            report_at(begin, end, "duplicate matrix '" + name + "'", "delete all but one of them");
        }
        open(name, begin, end);
    }
    static bool is_matrix_name(std::string_view name) {
        return !name.empty() && is_letter(name[0]) && std::ranges::all_of(name, [](char c) {
            return is_alphanumeric(c) || c == '_' || c == '-';
        });
    }
    /// Reads the numbers of a line; its end and each `;` end a row.
    void rows(std::size_t at, std::size_t end) {
        while (at < end) {
            if (is_separator(text_[at])) {
                ++at;
                continue;
            }
            if (text_[at] == ';') {
                row();
                ++at;
                continue;
            }
            std::size_t stop = at;
            while (stop < end && !is_separator(text_[stop]) && text_[stop] != ';') {
                ++stop;
            }
            word(at, stop);
            at = stop;
        }
        row();
    }
    void word(std::size_t at, std::size_t stop) {
        const std::string token(text_.substr(at, stop - at));
        if (!open_) {
            if (!outside_reported_) {
                report_at(at, stop, "'" + token + "' outside a matrix",
                          "write NAME = before the numbers, as in: A = 0 1");
            }
            outside_reported_ = true;
            return;
        }
        if (token == "diag" && numbers_.empty() && rows_.empty() && !diagonal_) {
            diagonal_ = true;
            return;
        }
        const auto real = parse_real(token);
        const double number = real.value_or(0.0);
        const bool is_number = real && !std::isnan(number);
        if (is_number && std::fabs(number) >= 1e300) {
            report_at(at, stop, "'" + token + "' is too large",
                      "write numbers below 1e300");
        } else if (!is_number) {
            report_at(at, stop, "'" + token + "' is not a number",
                      "write numbers as in -1.5 or 2e-3");
        }
        if (numbers_.empty()) {
            row_begin_ = at;
        }
        row_end_ = stop;
        numbers_.push_back(number);
    }
    void row() {
        if (numbers_.empty()) return;
        if (!rows_.empty() && rows_[0].size() != numbers_.size()) {
            report_at(row_begin_, row_end_,
                      "row " + std::to_string(rows_.size() + 1) + " of " + current_.name + " has " +
                          counted(numbers_.size(), "number") + ", its first has " +
                          std::to_string(rows_[0].size()),
                      "all rows of a matrix must have the same length");
        }
        rows_.push_back(std::move(numbers_));
        numbers_.clear();
    }
    void open(std::string name, std::size_t begin, std::size_t end) {
        current_ = {std::move(name),
                    {},
                    false,
                    static_cast<std::uint32_t>(begin),
                    static_cast<std::uint32_t>(end),
                    {}};
        open_ = true;
        diagonal_ = outside_reported_ = false;
    }
    /// Ends the matrix that is open. Its value is set only as long as there are no problems.
    void finish() {
        if (!open_) return;
        row();
        open_ = false;
        if (rows_.empty()) {
            report_at(current_.begin, current_.end, "'" + current_.name + "' has no numbers",
                      help_for_none());
        }
        if (diagonal_ && rows_.size() > 1) {
            report_at(current_.begin, current_.end,
                      "'" + current_.name + "' has several rows after diag",
                      "write one row after diag: diag 1 2 3");
        }
        if (problems.empty()) {
            current_.value = diagonal_ ? diagonal_matrix(rows_[0]) : matrix_of(rows_);
            report_size(current_);
        }
        rows_.clear();
        found.push_back(std::move(current_));
    }
    const char* help_for_none() const {
        if (diagonal_) return "write them after diag, as in: diag 1 2 3";
        return "write them after the =, or in the lines below it";
    }
    using Row = std::vector<double>;
    static Eigen::MatrixXd diagonal_matrix(const Row& diagonal) {
        const auto size = static_cast<Eigen::Index>(diagonal.size());
        Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(size, size);
        for (Eigen::Index i = 0; i < size; ++i) {
            matrix(i, i) = diagonal[static_cast<std::size_t>(i)];
        }
        return matrix;
    }
    static Eigen::MatrixXd matrix_of(const std::vector<Row>& rows) {
        Eigen::MatrixXd matrix(static_cast<Eigen::Index>(rows.size()),
                               static_cast<Eigen::Index>(rows[0].size()));
        for (std::size_t i = 0; i < rows.size(); ++i) {
            for (std::size_t j = 0; j < rows[i].size(); ++j) {
                matrix(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = rows[i][j];
            }
        }
        return matrix;
    }
    void report_size(const Given& matrix) {
        const Eigen::Index rows = matrix.value.rows();
        const Eigen::Index columns = matrix.value.cols();
        if (rows <= max && columns <= max) return;
        report_at(matrix.begin, matrix.end,
                  matrix.name + " is " + std::to_string(rows) + " x " + std::to_string(columns),
                  "matrices have at most " + std::to_string(max) + " rows and columns");
    }
    void report_at(std::size_t begin, std::size_t end, std::string sentence, std::string help) {
        text::add(problems, begin, end, std::move(sentence), std::move(help));
    }

    std::string_view text_;
    Given current_;
    std::map<std::string, unsigned> defined_;  // by name in lower case: how often
    bool open_ = false;
    bool diagonal_ = false;
    bool outside_reported_ = false;  // once, until the next matrix begins
    Row numbers_;  // of the row that is read
    std::vector<Row> rows_;
    std::size_t row_begin_ = 0;
    std::size_t row_end_ = 0;
};

/// A matrix that a component needs.
struct Wanted {
    const char* name;  ///< in a file; the load argument is the same in lower case
    const char* example;  ///< default for a `loadrt` without any matrix; "" for none
    const char* doc;
};

/// The matrices of one instance. In a component's constructor only.
class Matrices {
public:
    /// Declares the load arguments, reads the file, then the arguments, which replace matrices of
    /// the file. The examples apply only if there is neither a file nor an argument. Throws for an
    /// invalid matrix. [setup]
    Matrices(hal::Component& component, std::initializer_list<Wanted> wanted)
        : texts_(component),
          file_(component, "file", "",
                "file with the matrices, beside the netlist; an argument takes precedence") {
        std::vector<std::pair<const Wanted*, std::string>> arguments;
        bool user_gives_one = !file_.get().empty();
        for (const Wanted& matrix : wanted) {
            std::string text = hal::Argument::ask(lower(matrix.name).c_str(), "", matrix.doc, {});
            user_gives_one = user_gives_one || !text.empty();
            arguments.emplace_back(&matrix, std::move(text));
        }
        if (!file_.get().empty()) {
            read_file();
        }
        for (const auto& [matrix, text] : arguments) {
            const std::string example = user_gives_one ? "" : matrix->example;
            if (!text.empty()) {
                read_argument(matrix->name, text, shortened(text));
            } else if (!example.empty()) {
                read_argument(matrix->name, example, "");
            }
        }
    }
    bool has(const char* name) const { return given_.contains(lower(name)); }
    /// Returns a matrix; throws if it is missing. [setup]
    const Given& at(const char* name) const {
        const auto found = given_.find(lower(name));
        if (found == given_.end()) {
            throw std::invalid_argument(std::string(name) + " is missing: give it as " +
                                        lower(name) + "=1,0;0,1 or, in a file, as " + name +
                                        " = 1 0");
        }
        return found->second;
    }
    /// Returns a matrix that must have this size. [setup]
    const Eigen::MatrixXd& at(const char* name, Eigen::Index rows, Eigen::Index columns,
                              const std::string& why) const {
        const Given& given = at(name);
        if (given.value.rows() != rows || given.value.cols() != columns) {
            refuse(given,
                   given.name + " is " + size(given.value.rows(), given.value.cols()) + ", not " +
                       size(rows, columns),
                   why);
        }
        return given.value;
    }
    /// Returns a square matrix; its size is the number of states. [setup]
    const Eigen::MatrixXd& square(const char* name) const {
        const Given& given = at(name);
        if (given.value.rows() != given.value.cols()) {
            refuse(
                given,
                given.name + " is " + size(given.value.rows(), given.value.cols()) + ", not square",
                "it has a row and a column per state");
        }
        return given.value;
    }
    /// Returns a matrix that must have this many rows. [setup]
    const Eigen::MatrixXd& with_rows(const char* name, Eigen::Index rows,
                                     const std::string& why) const {
        return at(name, rows, at(name).value.cols(), why);
    }
    /// Returns a matrix that must have this many columns. [setup]
    const Eigen::MatrixXd& with_columns(const char* name, Eigen::Index columns,
                                        const std::string& why) const {
        return at(name, at(name).value.rows(), columns, why);
    }
    /// Returns a symmetric matrix that must have this size. `why_size` and `why_symmetric` explain
    /// the rule to the user. [setup]
    const Eigen::MatrixXd& symmetric(const char* name, Eigen::Index size,
                                     const std::string& why_size,
                                     const std::string& why_symmetric) const {
        const Eigen::MatrixXd& matrix = at(name, size, size, why_size);
        if ((matrix - matrix.transpose()).norm() > 1e-12 * matrix.norm()) {
            refuse(name, std::string(name) + " is not symmetric", why_symmetric);
        }
        return matrix;
    }
    /// Returns a vector of `count` values, written as a row or as a column. [setup]
    Eigen::VectorXd vector(const char* name, Eigen::Index count, const std::string& why) const {
        const Given& given = at(name);
        if (given.value.size() != count || (given.value.rows() != 1 && given.value.cols() != 1)) {
            refuse(given,
                   given.name + " is " + size(given.value.rows(), given.value.cols()) +
                       ", not a row of " + std::to_string(count),
                   why);
        }
        return given.value.reshaped();
    }
    /// Reports an error of a matrix that was read and ends the constructor. [setup]
    [[noreturn]] void refuse(const Given& given, const std::string& sentence,
                             const std::string& help) const {
        if (given.in_file && texts_.offered()) {
            texts_.report(HAL_SEVERITY_ERROR, "matrix-value", given.begin, given.end, sentence, "",
                          help);
            hal::Texts::fail();
        }
        if (given.argument.empty()) throw std::invalid_argument(sentence + "; " + help);
        throw hal::ArgumentError(lower(given.name), given.argument + ": " + sentence + "; " + help);
    }
    [[noreturn]] void refuse(const char* name, const std::string& sentence,
                             const std::string& help) const {
        refuse(at(name), sentence, help);
    }

private:
    static std::string size(Eigen::Index rows, Eigen::Index columns) {
        return std::to_string(rows) + " x " + std::to_string(columns);
    }

    void read_file() {
        const std::string text = texts_.read("file", file_.get());
        texts_.begin(file_.get(), text);  // for later messages about its matrices
        MatrixText reader;
        reader.read_file(text);
        texts_.reject(file_.get(), text, "matrix-text", reader.problems);
        for (Given& given : reader.found) {
            given_[lower(given.name)] = std::move(given);
        }
    }

    /// Reads the rows of one matrix. `shown` stands for them in messages.
    void read_argument(const char* name, const std::string& rows, const std::string& shown) {
        MatrixText reader;
        reader.read_rows(name, rows);
        const std::string key = lower(name);
        const std::string argument = key + "=" + shown;
        if (!reader.problems.empty()) {
            const text::Problem& problem = reader.problems.front();
            throw hal::ArgumentError(key, argument + ": " + problem.sentence + "; " + problem.help);
        }
        Given& matrix = reader.found.front();
        matrix.argument = argument;
        given_[key] = std::move(matrix);
    }
    static std::string shortened(std::string text) {
        constexpr std::size_t max_shown = 40;
        if (text.size() > max_shown) {
            text.resize(max_shown - 3);
            text += "...";
        }
        return text;
    }

    hal::Texts texts_;
    hal::TextArgument file_;
    std::map<std::string, Given> given_;  // by name in lower case
};

}  // namespace hal::estimation
