// SPDX-License-Identifier: MIT
// Formulas, compiled when they are read and evaluated in the cycle together with their derivatives.
#pragma once

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <numbers>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "text/config_text.hpp"

namespace hal::estimation {

inline constexpr int max_slopes = 8;  ///< states of a nonlinear model at most

/// A number and its derivatives by the states: forward differentiation is exact, not a difference.
struct Dual {
    double value = 0.0;
    std::array<double, max_slopes> slope{};
};

/// One formula as steps on a stack. Evaluating it takes no memory.
class Expression {
public:
    static constexpr std::size_t deepest = 24;

    using Problem = text::Problem;
    /// Returns the number of a variable, or nothing.
    using Lookup = std::function<std::optional<std::uint16_t>(std::string_view)>;

    /// Precedence from weak to strong: + -, * /, sign, ^ (to the right). `at` is the offset of
    /// `text` in its file. [setup]
    static std::optional<Problem> compile(std::string_view text, std::uint32_t at,
                                          const Lookup& lookup, Expression& to) {
        Parser parser{text, at, lookup, to, 0, {}, 0};
        to.steps_.clear();
        parser.sum();
        parser.skip();
        if (!parser.problem && parser.offset < text.size()) {
            parser.fail(parser.offset, parser.offset + 1,
                        "'" + std::string(1, text[parser.offset]) + "' is not an operator",
                        "write one of + - * / ^ between two values");
        }
        if (!parser.problem && parser.deep > deepest) {
            parser.fail(0, text.size(), "the formula is nested too deeply",
                        "split it with constants, or use fewer brackets");
        }
        return parser.problem;
    }

    /// `n` of the slopes are computed. [realtime]
    Dual operator()(const Dual* variables, std::size_t n) const noexcept {
        std::array<Dual, deepest> stack;
        std::size_t top = 0;
        for (const Step& s : steps_) {
            switch (s.kind) {
            case Kind::number: stack[top++] = Dual{s.number}; break;
            case Kind::variable: stack[top++] = variables[s.index]; break;
            case Kind::one: stack[top - 1] = one(s.index, stack[top - 1], n); break;
            case Kind::two:
                --top;
                stack[top - 1] = two(s.index, stack[top - 1], stack[top], n);
                break;
            }
        }
        return top > 0 ? stack[0] : Dual{};
    }

private:
    enum class Kind : std::uint8_t { number, variable, one, two };
    struct Step {
        Kind kind;
        std::uint16_t index;
        double number;
    };
    static constexpr const char* ones[] = {"-",   "sin", "cos",  "tan",  "sqrt", "exp",
                                           "log", "abs", "tanh", "asin", "acos", "atan"};
    static constexpr const char* twos[] = {"+", "-", "*", "/", "^", "atan2", "min", "max"};

    static Dual chain(const Dual& x, double value, double factor, std::size_t n) noexcept {
        Dual result{value};
        for (std::size_t i = 0; i < n; ++i) {
            result.slope[i] = factor * x.slope[i];
        }
        return result;
    }
    static Dual chain(const Dual& x, const Dual& y, double value, double by_x, double by_y,
                      std::size_t n) noexcept {
        Dual result{value};
        for (std::size_t i = 0; i < n; ++i) {
            result.slope[i] = by_x * x.slope[i] + by_y * y.slope[i];
        }
        return result;
    }
    static Dual one(std::uint16_t which, const Dual& x, std::size_t n) noexcept {
        const double v = x.value;
        switch (which) {
        case 0: return chain(x, -v, -1.0, n);
        case 1: return chain(x, std::sin(v), std::cos(v), n);
        case 2: return chain(x, std::cos(v), -std::sin(v), n);
        case 3: return chain(x, std::tan(v), 1.0 + std::tan(v) * std::tan(v), n);
        case 4: return chain(x, std::sqrt(v), 0.5 / std::sqrt(v), n);
        case 5: return chain(x, std::exp(v), std::exp(v), n);
        case 6: return chain(x, std::log(v), 1.0 / v, n);
        case 7: return chain(x, std::fabs(v), v < 0.0 ? -1.0 : 1.0, n);
        case 8: return chain(x, std::tanh(v), 1.0 - std::tanh(v) * std::tanh(v), n);
        case 9: return chain(x, std::asin(v), 1.0 / std::sqrt(1.0 - v * v), n);
        case 10: return chain(x, std::acos(v), -1.0 / std::sqrt(1.0 - v * v), n);
        default: return chain(x, std::atan(v), 1.0 / (1.0 + v * v), n);
        }
    }
    static Dual two(std::uint16_t which, const Dual& x, const Dual& y, std::size_t n) noexcept {
        const double a = x.value;
        const double b = y.value;
        switch (which) {
        case 0: return chain(x, y, a + b, 1.0, 1.0, n);
        case 1: return chain(x, y, a - b, 1.0, -1.0, n);
        case 2: return chain(x, y, a * b, b, a, n);
        case 3: return chain(x, y, a / b, 1.0 / b, -a / (b * b), n);
        case 4: {
            const double power = std::pow(a, b);
            return chain(x, y, power, b == 0.0 ? 0.0 : b * std::pow(a, b - 1.0),
                         a > 0.0 ? power * std::log(a) : 0.0, n);
        }
        case 5: return chain(x, y, std::atan2(a, b), b / (a * a + b * b), -a / (a * a + b * b), n);
        case 6: return a <= b ? x : y;
        default: return a >= b ? x : y;
        }
    }

    struct Parser {
        static constexpr const char* a_value =
            "a value is a number, a name, a function such as sin(x), or a formula in brackets";

        std::string_view text;
        std::uint32_t at;
        const Lookup& lookup;
        Expression& to;
        std::size_t offset;
        std::optional<Problem> problem;
        std::size_t deep, now = 0, nested = 0;

        void fail(std::size_t begin, std::size_t end, std::string sentence, std::string help) {
            if (!problem) {
                problem = Problem{at + static_cast<std::uint32_t>(begin),
                                  at + static_cast<std::uint32_t>(end), std::move(sentence),
                                  std::move(help)};
            }
        }
        void skip() {
            while (offset < text.size() &&
                   (text[offset] == ' ' || text[offset] == '\t' || text[offset] == '\r')) {
                ++offset;
            }
        }
        bool take(char c) {
            skip();
            if (problem || offset >= text.size() || text[offset] != c) return false;
            ++offset;
            return true;
        }
        void push(Step s) {
            to.steps_.push_back(s);
            if (s.kind == Kind::number || s.kind == Kind::variable) {
                deep = std::max(deep, ++now);
            }
            if (s.kind == Kind::two) {
                --now;
            }
        }
        void sum() {
            product();
            while (!problem) {
                if (take('+')) {
                    product();
                    push({Kind::two, 0, 0.0});
                } else if (take('-')) {
                    product();
                    push({Kind::two, 1, 0.0});
                } else {
                    return;
                }
            }
        }
        void product() {
            sign();
            while (!problem) {
                if (take('*')) {
                    sign();
                    push({Kind::two, 2, 0.0});
                } else if (take('/')) {
                    sign();
                    push({Kind::two, 3, 0.0});
                } else {
                    return;
                }
            }
        }
        void sign() {
            if (++nested > 200) {
                return fail(offset, offset + 1, "the formula is nested too deeply",
                            "use fewer brackets");
            }
            if (take('-')) {
                sign();
                push({Kind::one, 0, 0.0});
            } else if (take('+')) {
                sign();
            } else {
                power();
            }
            --nested;
        }
        void power() {
            value();
            if (take('^')) {
                sign();
                push({Kind::two, 4, 0.0});
            }
        }
        void value() {
            skip();
            if (problem) return;
            if (offset >= text.size()) {
                return fail(text.empty() ? 0 : text.size() - 1, text.size(),
                            "missing value at the end of the formula", a_value);
            }
            const std::size_t begin = offset;
            if (take('(')) {
                sum();
                if (!problem && !take(')')) {
                    fail(begin, begin + 1, "unclosed bracket", "write the closing )");
                }
                return;
            }
            const unsigned char c = static_cast<unsigned char>(text[offset]);
            if (std::isdigit(c) || c == '.') return number();
            if (std::isalpha(c) || c == '_') return word();
            fail(begin, begin + 1, "'" + std::string(1, text[begin]) + "' is not a value", a_value);
        }
        void number() {
            const std::string rest(text.substr(offset));
            char* end = nullptr;
            const double v = std::strtod(rest.c_str(), &end);
            if (end == rest.c_str()) {
                return fail(offset, offset + 1, "'.' is not a number",
                            "write numbers as in 9.81 or 2e-3");
            }
            offset += static_cast<std::size_t>(end - rest.c_str());
            push({Kind::number, 0, v});
        }
        /// Parses a name: a function with its arguments, pi, or a variable.
        void word() {
            const std::size_t begin = offset;
            while (
                offset < text.size() &&
                (std::isalnum(static_cast<unsigned char>(text[offset])) || text[offset] == '_')) {
                ++offset;
            }
            const std::string name(text.substr(begin, offset - begin));
            if (take('(')) {
                const auto find = [&](const auto& table, std::size_t from) -> int {
                    for (std::size_t i = from; i < std::size(table); ++i) {
                        if (name == table[i]) return static_cast<int>(i);
                    }
                    return -1;
                };
                if (const int i = find(ones, 1); i >= 0) {
                    sum();
                    if (!problem && !take(')')) {
                        fail(begin, begin + name.size(), name + " takes one value in brackets",
                             "write " + name + "(x)");
                    }
                    return push({Kind::one, static_cast<std::uint16_t>(i), 0.0});
                }
                if (const int i = find(twos, 5); i >= 0) {
                    sum();
                    const bool comma = take(',');
                    if (comma) {
                        sum();
                    }
                    if (!problem && !(comma && take(')'))) {
                        fail(begin, begin + name.size(), name + " takes two values",
                             "write " + name + "(y, x)");
                    }
                    return push({Kind::two, static_cast<std::uint16_t>(i), 0.0});
                }
                return fail(begin, begin + name.size(), "unknown function '" + name + "'",
                            "the functions are sin cos tan asin acos atan atan2 sqrt exp log abs "
                            "tanh min max");
            }
            if (name == "pi") {
                return push({Kind::number, 0, std::numbers::pi});
            }
            if (const auto i = lookup(name)) {
                return push({Kind::variable, *i, 0.0});
            }
            fail(begin, begin + name.size(), "unknown name '" + name + "'",
                 "define states, inputs and constants above this line");
        }
    };

    std::vector<Step> steps_;
};

}  // namespace hal::estimation
