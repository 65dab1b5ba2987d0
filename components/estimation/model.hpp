// SPDX-License-Identifier: MIT
// A nonlinear plant in formulas: states with their derivatives, inputs, constants and measurements.
#pragma once

#include <algorithm>
#include <map>
#include <numbers>
#include <string>
#include <string_view>
#include <vector>

#include "estimation/expression.hpp"

namespace hal::estimation {

/// The lines of a model: `constant NAME = FORMULA`, `input NAME`, `state NAME = START sigma S noise
/// N`, `NAME' = FORMULA`,
/// `measure NAME = FORMULA sigma S`, with `wrap` behind an angle, `wrap PERIOD` behind a counter.
/// [setup]
class Model {
public:
    static constexpr std::size_t max_inputs = 8;

public:
    static constexpr std::size_t max_measures = 12;

public:
    static constexpr std::size_t max_constants = 32;

    struct State {
        std::string name;
        double start, sigma, noise;
        std::uint32_t begin, end;
        bool moves = false;
        Expression rate;
    };
    struct Measure {
        std::string name;
        double sigma, wrap;  // wrap: period of a value that wraps around; 0: none
        Expression value;
    };

    std::vector<State> states;
    std::vector<std::string> inputs;
    std::vector<Measure> measures;
    std::vector<double> constants;
    std::vector<Expression::Problem> problems;

    void read(std::string_view text) {
        text_ = text;
        text::Lines lines(text);
        while (const auto line = lines.next()) {
            read_line(line->at.offset, line->at.offset + line->at.length);
        }
        for (const State& s : states) {
            if (!s.moves) {
                report_at(s.begin, s.end, "state '" + s.name + "' has no derivative",
                          "write " + s.name + "' = FORMULA; 0 for a random walk");
            }
        }
        if (states.empty()) {
            report_at(0, 1, "the model has no states",
                      "write state NAME = START sigma S noise N for each");
        }
        if (measures.empty() && problems.empty()) {
            report_at(0, 1, "the model has no measurement", "write measure NAME = FORMULA sigma S");
        }
    }
    /// Returns the number of variables: states, inputs, constants, in this order. [realtime]
    std::size_t variables() const noexcept { return max_slopes + max_inputs + constants.size(); }

private:
    struct Words {
        std::size_t begin, end;
    };
    std::string_view piece(Words w) const { return text_.substr(w.begin, w.end - w.begin); }
    Words trim(std::size_t begin, std::size_t end) const {
        while (begin < end && std::isspace(static_cast<unsigned char>(text_[begin]))) {
            ++begin;
        }
        while (end > begin && std::isspace(static_cast<unsigned char>(text_[end - 1]))) {
            --end;
        }
        return {begin, end};
    }
    Words word(std::size_t begin, std::size_t end) const {
        const Words all = trim(begin, end);
        std::size_t stop = all.begin;
        while (stop < all.end &&
               (std::isalnum(static_cast<unsigned char>(text_[stop])) || text_[stop] == '_')) {
            ++stop;
        }
        return {all.begin, stop};
    }
    void report_at(std::size_t begin, std::size_t end, std::string sentence, std::string help) {
        add({static_cast<std::uint32_t>(begin), static_cast<std::uint32_t>(end),
             std::move(sentence), std::move(help)});
    }
    /// At least a letter wide, if there is one.
    void add(Expression::Problem problem) {
        const auto size = static_cast<std::uint32_t>(text_.size());
        problem.begin = std::min(problem.begin, std::max(size, 1u) - 1);
        problem.end = std::min(std::max(problem.end, problem.begin + 1), size);
        text::add(problems, std::move(problem));
    }
    void read_line(std::size_t begin, std::size_t end) {
        const Words line = trim(begin, end);
        if (line.begin == line.end) return;
        const Words first = word(line.begin, line.end);
        const std::string_view what = piece(first);
        if (what == "input") return input(first.end, line.end);
        const std::size_t equals = text_.substr(line.begin, line.end - line.begin).find('=');
        if (equals == std::string_view::npos) {
            return report_at(line.begin, line.end, "invalid line",
                             "write constant, input, state, measure or NAME' = FORMULA");
        }
        const std::size_t sign = line.begin + equals;
        if (what == "constant") return constant(first.end, sign, line.end);
        if (what == "state") return state(first.end, sign, line.end);
        if (what == "measure") return measure(first.end, sign, line.end);
        if (first.end < line.end && text_[first.end] == '\'') return rate(first, sign, line.end);
        report_at(first.begin, first.end, "unknown keyword '" + std::string(what) + "'",
                  "the keywords are constant, input, state, measure, NAME'");
    }
    bool fresh(Words name, std::size_t limit, std::size_t count, const char* what) {
        const std::string text(piece(name));
        if (text.empty()) {
            report_at(name.begin, name.end, "missing name",
                      "names consist of letters, digits and _");

            return false;
        }
        if (count >= limit) {
            report_at(name.begin, name.end, "more than " + std::to_string(limit) + " " + what,
                      "reduce the model");

            return false;
        }
        if (index_.contains(text) || text == "pi") {
            report_at(name.begin, name.end, "duplicate name '" + text + "'", "choose another name");

            return false;
        }
        return true;
    }
    void input(std::size_t begin, std::size_t end) {
        const Words name = word(begin, end);
        if (!fresh(name, max_inputs, inputs.size(), "inputs")) return;
        index_[std::string(piece(name))] =
            static_cast<std::uint16_t>(static_cast<std::size_t>(max_slopes) + inputs.size());
        inputs.emplace_back(piece(name));
    }
    /// A formula of constants only.
    double fixed(Words formula) {
        Expression e;
        const auto constants_only = [this](std::string_view name) -> std::optional<std::uint16_t> {
            const auto found = index_.find(std::string(name));
            return found != index_.end() && found->second >= max_slopes + max_inputs
                       ? std::optional(found->second)
                       : std::nullopt;
        };
        if (auto problem = Expression::compile(
                piece(formula), static_cast<std::uint32_t>(formula.begin), constants_only, e)) {
            add(*problem);
            return 1.0;
        }
        std::vector<Dual> values(variables() + 1);
        for (std::size_t i = 0; i < constants.size(); ++i) {
            values[max_slopes + max_inputs + i].value = constants[i];
        }
        const double v = e(values.data(), 0).value;
        if (!std::isfinite(v)) {
            report_at(formula.begin, formula.end, "the value is not finite",
                      "check for a division by 0 or the root of a negative number");
        }
        return v;
    }
    void constant(std::size_t begin, std::size_t sign, std::size_t end) {
        const Words name = word(begin, sign);
        if (!fresh(name, max_constants, constants.size(), "constants")) return;
        const double v = fixed(trim(sign + 1, end));
        index_[std::string(piece(name))] =
            static_cast<std::uint16_t>(max_slopes + max_inputs + constants.size());
        constants.push_back(v);
    }
    /// Where a keyword begins, or `end`.
    std::size_t keyword(std::size_t begin, std::size_t end, std::string_view key) const {
        for (std::size_t at = begin; at + key.size() <= end; ++at) {
            const bool before =
                at == begin || std::isspace(static_cast<unsigned char>(text_[at - 1]));
            const bool after = at + key.size() == end ||
                               std::isspace(static_cast<unsigned char>(text_[at + key.size()]));
            if (before && after && text_.substr(at, key.size()) == key) return at;
        }
        return end;
    }
    void state(std::size_t begin, std::size_t sign, std::size_t end) {
        const Words name = word(begin, sign);
        if (!fresh(name, max_slopes, states.size(), "states")) return;
        const std::size_t sigma = keyword(sign + 1, end, sigma_key);
        const std::size_t noise = keyword(sign + 1, end, noise_key);
        if (sigma == end || noise == end || noise < sigma) {
            return report_at(name.begin, end, "a state needs a start value, sigma and noise",
                             "write state " + std::string(piece(name)) + " = 0 sigma 1 noise 0.1");
        }
        const double start = fixed(trim(sign + 1, sigma));
        const double wide = fixed(trim(sigma + sigma_key.size(), noise));
        const double wanders = fixed(trim(noise + noise_key.size(), end));
        if (wide < 0.0 || wanders < 0.0) {
            report_at(sigma, end, "sigma or noise is negative",
                      "write 0 for an exact start value, and for a state without noise");
        }
        index_[std::string(piece(name))] = static_cast<std::uint16_t>(states.size());
        states.push_back({std::string(piece(name)),
                          start,
                          wide,
                          wanders,
                          static_cast<std::uint32_t>(name.begin),
                          static_cast<std::uint32_t>(name.end),
                          false,
                          {}});
    }
    void formula(Words words, Expression& to) {
        const auto any = [this](std::string_view name) -> std::optional<std::uint16_t> {
            const auto found = index_.find(std::string(name));
            return found != index_.end() ? std::optional(found->second) : std::nullopt;
        };
        if (auto problem = Expression::compile(piece(words),
                                               static_cast<std::uint32_t>(words.begin), any, to)) {
            add(*problem);
        }
    }
    void rate(Words name, std::size_t sign, std::size_t end) {
        for (State& s : states) {
            if (s.name != piece(name)) continue;
            if (s.moves) {
                return report_at(name.begin, name.end, "'" + s.name + "' has two derivatives",
                                 "delete one of them");
            }
            s.moves = true;
            return formula(trim(sign + 1, end), s.rate);
        }
        report_at(name.begin, name.end, "unknown state '" + std::string(piece(name)) + "'",
                  "write state NAME = START sigma S noise N above this one");
    }
    void measure(std::size_t begin, std::size_t sign, std::size_t end) {
        const Words name = word(begin, sign);
        if (piece(name).empty()) {
            return report_at(begin, sign, "missing name", "names consist of letters, digits and _");
        }
        if (measures.size() >= max_measures) {
            return report_at(name.begin, name.end, "more than 12 measurements", "reduce the model");
        }
        const std::string start = "write measure " + std::string(piece(name)) + " = FORMULA ";
        const std::size_t sigma = keyword(sign + 1, end, sigma_key);
        const std::size_t wrap = keyword(sign + 1, end, wrap_key);
        if (sigma == end) {
            return report_at(name.begin, end, "a measurement needs a sigma", start + "sigma 0.01");
        }
        if (wrap < sigma) {
            return report_at(wrap, end, "wrap is the last part of a measurement",
                             start + "sigma 0.01 wrap");
        }
        Measure m{std::string(piece(name)), fixed(trim(sigma + sigma_key.size(), wrap)), 0.0, {}};
        if (!(m.sigma > 0.0)) {
            report_at(sigma, end, "sigma must be positive",
                      "write the noise of the measurement, as in sigma 0.01");
        }
        if (wrap != end) {
            const Words period = trim(wrap + wrap_key.size(), end);
            m.wrap = period.begin == period.end ? 2.0 * std::numbers::pi : fixed(period);
            if (!(m.wrap > 0.0)) {
                report_at(wrap, end, "the wrap period must be positive",
                          "write wrap for an angle, wrap 65536 for a 16-bit counter");
            }
        }
        formula(trim(sign + 1, sigma), m.value);
        measures.push_back(std::move(m));
    }

    static constexpr std::string_view sigma_key = "sigma";
    static constexpr std::string_view noise_key = "noise";
    static constexpr std::string_view wrap_key = "wrap";

    std::string_view text_;
    std::map<std::string, std::uint16_t> index_;
};

}  // namespace hal::estimation
