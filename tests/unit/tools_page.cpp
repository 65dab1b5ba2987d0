// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include "tools/doc/page.hpp"

namespace hal::tools {
namespace {

Page::Pin pin(std::string name, hal_type type = HAL_TYPE_BIT, hal_dir dir = HAL_DIR_IN) {
    Page::Pin made;
    made.name = std::move(name);
    made.doc = "what it is";
    made.type = type;
    made.dir = dir;
    return made;
}

Page example() {
    Page page;
    page.name = "thing";
    page.summary = "Does things";
    page.arguments = {{"size", "how big", "4", true}};
    page.functions = {{"read", "reads", false}, {"write", "writes | all", true}};
    page.pins = {pin("in-08"), pin("in-09"), pin("in-10"), pin("out", HAL_TYPE_FLOAT, HAL_DIR_OUT),
                 pin("gain", HAL_TYPE_FLOAT, HAL_DIR_PARAM)};
    page.pins[3].unit = "V";
    page.pins[3].has_safe = page.pins[3].finite = true;
    page.pins[3].function = "thing.N.read";
    page.pins[4].initial.real = 1.5;
    page.doc = "Two\n\n    lines\n";
    return page;
}

TEST(Page, text_has_every_declaration_once) {
    EXPECT_EQ(as_text(example()), R"(NAME
    thing: Does things

SYNOPSIS
    loadrt thing [count=N | names=NAME,…] [size=VALUE,…]

ARGUMENTS
    size=  how big, one per instance (default 4)

FUNCTIONS
    thing.N.read  reads
    thing.write   writes | all (one for all instances)
    Each function also has .time, .tmax (ns) and .tmax-increased.

PINS
    thing.N.in-08 … in-10  bit   in  what it is
    thing.N.out            float out what it is (V; safe 0; finite; used by thing.N.read)

PARAMETERS
    thing.N.gain  float rw what it is (initial 1.5)

DESCRIPTION
    Two

        lines
)");
}

TEST(Page, markdown_escapes_the_bar) {
    EXPECT_NE(as_markdown(example()).find("writes \\| all"), std::string::npos);
}

TEST(Page, numbered_pins_stay_apart_when_they_differ) {
    Page page = example();
    page.pins[1].doc = "another";
    EXPECT_EQ(as_text(page).find("…  bit"), std::string::npos);
    EXPECT_NE(as_text(page).find("thing.N.in-09"), std::string::npos);
}

TEST(Page, troff_keeps_dots_and_backslashes) {
    Page page = example();
    page.doc = ".dangerous \\n\n";
    EXPECT_NE(as_man(page).find("\\&.dangerous \\en\n"), std::string::npos);
}

/// A component in C: what it declares, and how it fails.
extern "C" bool declare(const hal_host* host, void* memory) {
    const hal_function_decl function{
        sizeof function, 0, "", "runs", [](void*, const hal_cycle*) {}, memory, memory, nullptr};
    if (!host->function(host, &function)) return false;
    hal_pin_decl decl{};
    decl.size = sizeof decl;
    decl.type = HAL_TYPE_S32;
    decl.dir = HAL_DIR_OUT;
    decl.name = "count";
    decl.doc = "counts";
    decl.function = memory;
    return host->allocate(host, 100, 64) != nullptr &&
           host->pin(host, &decl, static_cast<hal_pin*>(memory));
}
extern "C" bool refuse(const hal_host* host, void*) {
    host->fail(host, "not today");
    return false;
}
hal_component component(bool (*create)(const hal_host*, void*)) {
    hal_component made{};
    made.size = sizeof made;
    made.name = "in_c";
    made.summary = "Written in C";
    made.doc = "";
    made.default_count = 1;
    made.instance_size = sizeof(hal_pin);
    made.instance_align = 64;
    made.create = create;
    made.destroy = [](void*) {};
    return made;
}

TEST(Gather, hosts_the_constructor) {
    Page page;
    std::string problem;
    ASSERT_TRUE(gather(component(&declare), page, problem)) << problem;
    EXPECT_EQ(page.name, "in-c");
    ASSERT_EQ(page.pins.size(), 1u);
    EXPECT_EQ(page.pins[0].function, "in-c.N");
    ASSERT_EQ(page.functions.size(), 1u);
    EXPECT_EQ(page.full_name(page.functions[0]), "in-c.N");
}

TEST(Gather, says_why_the_constructor_failed) {
    Page page;
    std::string problem;
    EXPECT_FALSE(gather(component(&refuse), page, problem));
    EXPECT_EQ(problem, "not today");
}

}  // namespace
}  // namespace hal::tools
