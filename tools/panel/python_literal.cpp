// SPDX-License-Identifier: MIT
#include "panel/python_literal.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <string>

#include "text/characters.hpp"

namespace hal::tools {

namespace {

using Json = nlohmann::json;

constexpr std::array<std::string_view, 27> constants{
    "FLAT",  "SUNKEN", "RAISED", "GROOVE", "RIDGE", "SOLID", "HORIZONTAL", "VERTICAL", "LEFT",
    "RIGHT", "CENTER", "TOP",    "BOTTOM", "N",     "S",     "E",          "W",        "NE",
    "NW",    "SE",     "SW",     "NS",     "EW",    "NSEW",  "NORMAL",     "DISABLED", "BOTH"};

class Literal {
public:
    explicit Literal(std::string_view text) : text_(text) {}

    std::optional<Json> whole() {
        auto value = sequence('\0');
        skip();
        if (!value || at_ != text_.size()) return std::nullopt;
        return value;
    }

private:
    static constexpr int deepest = 20;

    void skip() { at_ = std::min(text_.find_first_not_of(" \t\n\r", at_), text_.size()); }
    bool take(char c) {
        skip();
        if (at_ >= text_.size() || text_[at_] != c) return false;
        ++at_;
        return true;
    }
    char next() {
        skip();
        return at_ < text_.size() ? text_[at_] : '\0';
    }

    /// Values separated by commas up to `end`; one without a comma is itself, unless it is in
    /// brackets [ ].
    std::optional<Json> sequence(char end) {
        Json all = Json::array();
        bool comma = false;
        while (next() != end && next() != '\0') {
            auto value = sum();
            if (!value) return std::nullopt;
            all.push_back(std::move(*value));
            if (!take(',')) break;
            comma = true;
        }
        if (end != '\0' && !take(end)) return std::nullopt;
        if (all.size() == 1 && !comma && end != ']') return all[0];
        if (all.empty() && end == '\0') return std::nullopt;
        return all;
    }

    std::optional<Json> sum() { return operations("+-", &Literal::product); }
    std::optional<Json> product() { return operations("*/", &Literal::value); }

    /// Operands with one of the signs between them.
    std::optional<Json> operations(std::string_view signs,
                                   std::optional<Json> (Literal::*operand)()) {
        auto left = (this->*operand)();
        while (left && signs.find(next()) != signs.npos) {
            const char sign = text_[at_++];
            const auto right = (this->*operand)();
            if (!right) return std::nullopt;
            left = calculate(*left, *right, sign);
        }
        return left;
    }

    static Json number_of(double value, bool whole) {
        if (whole && std::abs(value) < 1e15) return static_cast<std::int64_t>(value);
        return value;
    }

    static double applied(double a, char sign, double b) {
        switch (sign) {
        case '+': return a + b;
        case '-': return a - b;
        case '*': return a * b;
        default: return a / b;
        }
    }

    static std::optional<Json> calculate(const Json& left, const Json& right, char sign) {
        if (sign == '+' && left.is_string() && right.is_string()) {
            return left.get<std::string>() + right.get<std::string>();
        }
        if (!left.is_number() || !right.is_number()) return std::nullopt;
        const double result = applied(left.get<double>(), sign, right.get<double>());
        if (!std::isfinite(result)) return std::nullopt;
        const bool whole = left.is_number_integer() && right.is_number_integer() && sign != '/';
        return number_of(result, whole);
    }

    std::optional<Json> value() {
        if (++depth_ > deepest) return std::nullopt;
        auto result = plain_value();
        --depth_;
        return result;
    }

    std::optional<Json> plain_value() {
        const char c = next();
        if (take('(')) {
            return sequence(')');
        }
        if (take('[')) return sequence(']');
        if (take('{')) return dict();
        if (take('-')) {
            const auto number = value();
            return number ? calculate(0, *number, '-') : std::nullopt;
        }
        if (take('+')) return value();
        if (c == '"' || c == '\'') return string();
        if (is_digit(c) || c == '.') return number();
        return word();
    }

    std::optional<Json> dict() {
        Json all = Json::object();
        while (next() != '}') {
            const auto key = value();
            if (!key || !(key->is_string() || key->is_number()) || !take(':')) return std::nullopt;
            auto of = sum();
            if (!of) return std::nullopt;
            all[key->is_string() ? key->get<std::string>() : key->dump()] = std::move(*of);
            if (!take(',')) break;
        }
        if (!take('}')) return std::nullopt;
        return all;
    }

    std::optional<Json> string() {
        std::string all;
        while (next() == '"' || next() == '\'') {  // neighbours are joined
            if (!append_quoted(all)) return std::nullopt;
        }
        return all;
    }

    bool append_quoted(std::string& all) {
        const char quote = text_[at_++];
        while (at_ < text_.size() && text_[at_] != quote) {
            const char c = text_[at_++];
            if (c == '\\' && at_ < text_.size()) {
                append_escape(all, text_[at_++]);
            } else {
                all += c;
            }
        }
        return take(quote);
    }

    /// The backslash of an unknown escape stays.
    static void append_escape(std::string& all, char c) {
        switch (c) {
        case 'n': all += '\n'; return;
        case 't': all += '\t'; return;
        case '\\':
        case '"':
        case '\'': break;
        default: all += '\\';
        }
        all += c;
    }

    std::optional<Json> number() {
        const char* const begin = text_.data() + at_;
        const char* const end = text_.data() + text_.size();
        double real = 0;
        const auto [stop, error] = std::from_chars(begin, end, real);
        if (error != std::errc{} || !std::isfinite(real)) return std::nullopt;
        const std::string_view digits(begin, static_cast<std::size_t>(stop - begin));
        at_ += digits.size();
        bool whole = digits.find_first_of(".eE") == digits.npos;
        if (whole && text_.substr(at_).starts_with('.')) {  // 1.
            ++at_;
            whole = false;
        }
        return number_of(real, whole);
    }

    std::optional<Json> word() {
        const std::size_t begin = at_;
        at_ = end_of_run(text_, begin, [](char c) { return is_letter(c) || c == '_'; });
        const std::string_view name = text_.substr(begin, at_ - begin);
        if (name == "True") return Json(true);
        if (name == "False") return Json(false);
        if (name == "None") return Json();
        if (std::find(constants.begin(), constants.end(), name) != constants.end()) {
            return Json(std::string(name));
        }
        return std::nullopt;
    }

    std::string_view text_;
    std::size_t at_ = 0;
    int depth_ = 0;
};

}  // namespace

std::optional<nlohmann::json> python_literal(std::string_view text) {
    return Literal(text).whole();
}

}  // namespace hal::tools
