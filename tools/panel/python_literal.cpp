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

    std::optional<Json> sum() {
        auto left = product();
        while (left && (next() == '+' || next() == '-')) {
            const char sign = text_[at_++];
            const auto right = product();
            if (!right) return std::nullopt;
            if (sign == '+' && left->is_string() && right->is_string()) {
                left = left->get<std::string>() + right->get<std::string>();
                continue;
            }
            left = calculate(*left, *right, sign);
        }
        return left;
    }

    std::optional<Json> product() {
        auto left = value();
        while (left && (next() == '*' || next() == '/')) {
            const char sign = text_[at_++];
            const auto right = value();
            if (!right) return std::nullopt;
            left = calculate(*left, *right, sign);
        }
        return left;
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
        if (!left.is_number() || !right.is_number()) return std::nullopt;
        const double result = applied(left.get<double>(), sign, right.get<double>());
        if (!std::isfinite(result)) return std::nullopt;
        if (left.is_number_integer() && right.is_number_integer() && sign != '/' &&
            std::abs(result) < 1e15) {
            return Json(static_cast<std::int64_t>(result));
        }
        return Json(result);
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
            const char quote = text_[at_++];
            while (at_ < text_.size() && text_[at_] != quote) {
                char c = text_[at_++];
                if (c == '\\' && at_ < text_.size()) {
                    c = text_[at_++];
                    if (c == 'n') {
                        c = '\n';
                    } else if (c == 't') {
                        c = '\t';
                    } else if (c != '\\' && c != '"' && c != '\'') {
                        all += '\\';
                    }
                }
                all += c;
            }
            if (!take(quote)) return std::nullopt;
        }
        return all;
    }

    std::optional<Json> number() {
        const char* const begin = text_.data() + at_;
        const char* const end = text_.data() + text_.size();
        double real = 0;
        const auto [stop, error] = std::from_chars(begin, end, real);
        if (error != std::errc{} || !std::isfinite(real)) return std::nullopt;
        const std::string_view digits(begin, static_cast<std::size_t>(stop - begin));
        at_ += digits.size();
        if (at_ < text_.size() && text_[at_] == '.' &&
            digits.find_first_of(".eE") == digits.npos) {  // 1.
            ++at_;
            return Json(real);
        }
        if (digits.find_first_of(".eE") == digits.npos && real < 1e15) {
            return Json(static_cast<std::int64_t>(real));
        }
        return Json(real);
    }

    std::optional<Json> word() {
        const std::size_t begin = at_;
        while (at_ < text_.size() && (is_letter(text_[at_]) || text_[at_] == '_')) {
            ++at_;
        }
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
