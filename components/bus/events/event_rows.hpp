// SPDX-License-Identifier: MIT
// The events of a bus in one wording: the line that is printed and the text of the fault are made
// of the same row.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace hal::bus {

/// What an event does to the fault of its subject.
enum class Effect : std::uint8_t { none, raises, ends };

/// A row of a table in the order of the enumeration. `{name}` stands for a value; what is in
/// brackets is only in the line that is printed: details that a cycle does not know in advance, and
/// what to do. `reaction` is only at the end of the fault: what the bus did.
template <class Event>
struct EventRow {
    Event event;
    Effect effect;
    std::string_view text;
    std::string_view reaction = {};
};

/// Returns true when the rows are in the order of the enumeration, so that an event is the index of
/// its row. [any]
template <class Event, std::size_t size>
constexpr bool in_order(const EventRow<Event> (&rows)[size]) noexcept {
    for (std::size_t n = 0; n < size; ++n) {
        if (rows[n].event != static_cast<Event>(n)) return false;
    }
    return true;
}

/// Which text of a row.
enum class Text : std::uint8_t { line, fault };

/// Returns a text of a row; `value_of` returns the value of a name. [setup]
template <class ValueOf>
std::string format(std::string_view row, Text which, ValueOf&& value_of) {
    std::string text;
    for (std::size_t at = 0; at < row.size(); ++at) {
        if (row[at] == '{') {
            const std::size_t end = row.find('}', at);
            text += value_of(row.substr(at + 1, end - at - 1));
            at = end;
        } else if (row[at] == '[' && which == Text::fault) {
            at = row.find(']', at);
        } else if (row[at] != '[' && row[at] != ']') {
            text += row[at];
        }
    }
    return text;
}

/// Returns the table of a page: the line of each event, and what it does to the fault. [setup]
template <class Event, std::size_t size>
std::string page_table(const EventRow<Event> (&rows)[size]) {
    std::string table = "| line | fault |\n| --- | --- |\n";
    for (const EventRow<Event>& row : rows) {
        constexpr const char* effects[] = {"", "begins", "ends"};
        table += "| `" + std::string(row.text) + "` | " +
                 effects[static_cast<std::size_t>(row.effect)] + " |\n";
    }
    return table;
}

/// The number of an event in the text of its fault, known only when the fault is raised.
struct EventNumber {
    std::string_view name;
    double factor;  ///< from the event's value
    std::string_view text;
};
inline constexpr EventNumber event_numbers[] = {
    {"value", 1.0, "{}"}, {"x", 1.0, "{x}"}, {"s", 1e-9, "{} s"}, {"us", 1e-3, "{} us"}};

/// The texts of faults, formatted before the cycle that may need them: of each row that raises one,
/// for each subject: a node, a slave, a station. The last subject is an unknown one.
class FaultTexts {
public:
    struct Fault {
        std::string text;  ///< empty: the event raises no fault
        double factor = 0.0;  ///< 0: the text has no number

        /// Returns the number that is raised with the text; NaN: none. [realtime]
        double detail(std::int64_t value) const noexcept {
            return factor == 0.0 ? std::numeric_limits<double>::quiet_NaN()
                                 : static_cast<double>(value) * factor;
        }
    };

    /// `value_of(event, subject, name)` returns the value of every name but those of
    /// event_numbers.
    /// [setup]
    template <class Event, std::size_t size, class ValueOf>
    FaultTexts(const EventRow<Event> (&rows)[size], std::size_t subjects, ValueOf&& value_of)
        : subjects_(subjects) {
        for (const EventRow<Event>& row : rows) {
            for (std::size_t subject = 0; subject <= subjects; ++subject) {
                Fault& fault = faults_.emplace_back();
                if (row.effect != Effect::raises) continue;
                const auto value = [&](std::string_view name) {
                    const EventNumber* const number = find_number(name);
                    if (number == nullptr) return value_of(row.event, subject, name);
                    fault.factor = number->factor;
                    return std::string(number->text);
                };
                fault.text = format(row.text, Text::fault, value);
                fault.text += format(row.reaction, Text::fault, value);
            }
        }
    }
    /// Returns the fault of an event; nullptr when it raises none. [realtime]
    template <class Event>
    const Fault* of(Event event, std::size_t subject) const noexcept {
        const std::size_t known = subject < subjects_ ? subject : subjects_;
        const Fault& fault = faults_[static_cast<std::size_t>(event) * (subjects_ + 1) + known];
        return fault.text.empty() ? nullptr : &fault;
    }

private:
    static const EventNumber* find_number(std::string_view name) noexcept {
        for (const EventNumber& number : event_numbers) {
            if (number.name == name) return &number;
        }
        return nullptr;
    }

    std::size_t subjects_;
    std::vector<Fault> faults_;
};

}  // namespace hal::bus
