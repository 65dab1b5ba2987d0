// SPDX-License-Identifier: MIT
#include "doc/page_walk.hpp"

#include <algorithm>
#include <fmt/core.h>
#include <tuple>

#include "base/types.hpp"
#include "text/characters.hpp"
#include "text/quoting.hpp"

namespace hal::tools {

const char* direction(const Page::Pin& pin) {
    static constexpr const char* names[] = {"in", "out", "io", "rw"};
    return pin.read_only ? "ro" : names[static_cast<std::size_t>(pin.dir)];
}

namespace {

/// "V; initial 1; safe 0; used by encoder.update-counters"
std::string remarks(const Page::Pin& pin, bool several_functions) {
    std::string text;
    const auto add = [&](const std::string& remark) { append_item(text, remark, "; "); };
    if (!pin.unit.empty()) {
        add(pin.unit);
    }
    if (pin.type != HAL_TYPE_PORT && pin.initial.raw != 0) {
        add("initial " + format_value(pin.type, pin.initial));
    }
    if (pin.has_safe) {
        add("safe " + format_value(pin.type, pin.safe));
    }
    if (pin.finite) {
        add("finite");
    }
    if (several_functions && !pin.function.empty()) {
        add("used by " + pin.function);
    }
    return text;
}

/// A row of the pin table: one pin, or a run of numbered ones that differ in nothing else.
struct Row {
    std::string name;
    const Page::Pin* pin;
    std::string doc;
};

/// "kind of the thing in place 3" as "kind of the thing in place #", when the number is 3.
std::string without_number(const std::string& doc, const std::string& number) {
    std::string text = doc;
    for (std::size_t at = 0; (at = text.find(number, at)) != text.npos; ++at) {
        const std::size_t end = at + number.size();
        const bool part = (at != 0 && (is_digit(text[at - 1]) || text[at - 1] == '.')) ||
                          (end < text.size() && is_digit(text[end]));
        if (!part) {
            text.replace(at, number.size(), "#");
        }
    }
    return text;
}

/// The two names differ in one number only, and the second's is one more; their docs differ at most
/// in that number. `doc` is that of both.
bool follows(const Page::Pin& a, const Page::Pin& b, std::string& doc) {
    const auto traits = [](const Page::Pin& pin) {
        return std::tie(pin.type, pin.dir, pin.read_only, pin.unit, pin.function, pin.initial.raw);
    };
    if (traits(a) != traits(b)) return false;
    const auto difference = std::ranges::mismatch(a.name, b.name);
    auto from = static_cast<std::size_t>(difference.in1 - a.name.begin());
    while (from > 0 && is_digit(a.name[from - 1])) {
        --from;
    }
    const std::size_t a_end = end_of_run(a.name, from, is_digit);
    const std::size_t b_end = end_of_run(b.name, from, is_digit);
    const std::string first = a.name.substr(from, a_end - from);
    const std::string second = b.name.substr(from, b_end - from);
    constexpr std::size_t max = 9;
    if (first.empty() || second.empty() || std::max(first.size(), second.size()) > max) {
        return false;
    }
    if (a.name.substr(a_end) != b.name.substr(b_end)) return false;
    if (std::stoul(first) + 1 != std::stoul(second)) return false;
    if (a.doc == b.doc) {
        doc = a.doc;
        return true;
    }
    doc = without_number(a.doc, std::to_string(std::stoul(first)));
    return doc == without_number(b.doc, std::to_string(std::stoul(second)));
}

std::vector<Row> rows_of(const Page& page, bool parameters) {
    std::vector<const Page::Pin*> pins;
    for (const Page::Pin& pin : page.pins) {
        if ((pin.dir == HAL_DIR_PARAM) == parameters) {
            pins.push_back(&pin);
        }
    }
    std::vector<Row> rows;
    for (std::size_t i = 0; i < pins.size();) {
        std::size_t last = i;
        std::string doc, next;
        while (last + 1 < pins.size() && follows(*pins[last], *pins[last + 1], next) &&
               (last == i || next == doc)) {
            ++last;
            doc = next;
        }
        const std::string name =
            page.whole_names ? pins[i]->name : page.instance() + "." + pins[i]->name;
        if (last >= i + 2) {
            rows.push_back({name + " … " + pins[last]->name, pins[i], doc});
            i = last + 1;
        } else {
            rows.push_back({name, pins[i], pins[i]->doc});
            ++i;
        }
    }
    return rows;
}

bool several(const Page& page) { return page.functions.size() > 1; }

std::string synopsis(const Page& page) {
    std::string line = "loadrt " + page.name;
    std::replace(line.begin(), line.end(), '-', '_');  // the name of the file
    if (!page.singleton) {
        line += " [count=N | names=NAME,…]";
    }
    for (const auto& argument : page.arguments) {
        line += fmt::format(" [{}={}]", argument.name, argument.per_instance ? "VALUE,…" : "VALUE");
    }
    return line;
}

std::string described(const Page::Argument& argument) {
    std::string text = argument.doc;
    if (argument.per_instance) {
        text += ", one per instance";
    }
    return argument.fallback.empty() ? text
                                     : fmt::format("{} (default {})", text, argument.fallback);
}

constexpr const char* times_sentence =
    "Each function also has .time, .tmax (ns) and .tmax-increased.";

}  // namespace

void walk(const Page& page, PageWriter& to) {
    to.heading("Synopsis");
    to.code(synopsis(page));
    const auto table = [&](const char* title, const std::vector<std::vector<std::string>>& rows) {
        if (rows.empty()) return;
        to.heading(title);
        to.table(rows);
    };
    std::vector<std::vector<std::string>> rows;
    for (const auto& argument : page.arguments) {
        rows.push_back({argument.name + "=", described(argument)});
    }
    table("Arguments", rows);
    rows.clear();
    for (const auto& function : page.functions) {
        rows.push_back({page.full_name(function),
                        function.doc + (function.shared ? " (one for all instances)" : "")});
    }
    table("Functions", rows);
    if (!rows.empty()) {
        to.prose(times_sentence);
    }
    for (const bool parameters : {false, true}) {
        rows.clear();
        for (const Row& row : rows_of(page, parameters)) {
            const std::string more = remarks(*row.pin, several(page));
            rows.push_back({row.name, name(row.pin->type), direction(*row.pin),
                            row.doc + (more.empty() ? "" : " (" + more + ")")});
        }
        table(parameters ? "Parameters" : "Pins", rows);
    }
    if (!page.doc.empty()) {
        to.heading("Description");
        to.markdown(page.doc);
    }
}

}  // namespace hal::tools
