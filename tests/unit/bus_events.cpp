// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <string_view>

#include "components/bus/events/event_rows.hpp"

namespace bus_events_test {
namespace {

using hal::bus::Effect;
using hal::bus::EventRow;
using hal::bus::FaultTexts;
using hal::bus::Text;

enum class Event { running, lost, late };

constexpr EventRow<Event> rows[] = {
    {Event::running, Effect::ends, "running"},
    {Event::lost, Effect::raises, "{who}[ ({address})] lost for {s}[; check {who}]", "; stopped"},
    {Event::late, Effect::raises, "late"},
};
static_assert(hal::bus::in_order(rows));

constexpr EventRow<Event> swapped[] = {{Event::lost, Effect::none, ""},
                                       {Event::running, Effect::none, ""}};
static_assert(!hal::bus::in_order(swapped));

std::string value_of(std::string_view name) { return name == "who" ? "node 5" : "0x05"; }

TEST(EventRow, is_a_line_with_what_is_in_brackets_and_a_fault_without) {
    const auto value = [](std::string_view name) {
        return name == "s" ? std::string("2 s") : value_of(name);
    };
    EXPECT_EQ(hal::bus::format(rows[1].text, Text::line, value),
              "node 5 (0x05) lost for 2 s; check node 5");
    EXPECT_EQ(hal::bus::format(rows[1].text, Text::fault, value), "node 5 lost for 2 s");
}

TEST(FaultTexts, has_a_text_for_each_subject_and_an_unknown_one) {
    const FaultTexts faults(rows, 2, [](Event, std::size_t subject, std::string_view) {
        return subject < 2 ? "node " + std::to_string(subject) : std::string("a node");
    });
    EXPECT_EQ(faults.of(Event::lost, 0)->text, "node 0 lost for {} s; stopped");
    EXPECT_EQ(faults.of(Event::lost, 1)->text, "node 1 lost for {} s; stopped");
    EXPECT_EQ(faults.of(Event::lost, 2)->text, "a node lost for {} s; stopped");
    EXPECT_EQ(faults.of(Event::lost, SIZE_MAX)->text, "a node lost for {} s; stopped");
    EXPECT_EQ(faults.of(Event::running, 0), nullptr);
}

TEST(FaultTexts, scales_the_number_to_the_unit_of_its_text) {
    const FaultTexts faults(
        rows, 0, [](Event, std::size_t, std::string_view) { return std::string("a node"); });
    EXPECT_DOUBLE_EQ(faults.of(Event::lost, 0)->detail(4'000'000), 0.004);
    EXPECT_TRUE(std::isnan(faults.of(Event::late, 0)->detail(4'000'000)));
}

}  // namespace
}  // namespace bus_events_test
