// SPDX-License-Identifier: MIT
// LinuxCNC's component language: parse, check, translate, render.
#include <cstdint>
#include <string>

#include "tests/fuzz/driver/require.hpp"
#include "tools/comp/comp.hpp"
#include "tools/comp/syntax.hpp"

using hal::fuzz::require;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    hal::Sources sources;
    const auto source =
        sources.add("input.comp", std::string(reinterpret_cast<const char*>(data), size));

    hal::Diagnostics of_parser;
    const hal::comp::Tree tree = hal::comp::parse(sources, source, of_parser);
    for (const hal::comp::Item& item : tree.items) {
        require(item.name.given() && item.name.span.end <= size, "a name stands somewhere");
        require(item.name.c.find_first_of("#.-") == std::string::npos,
                "a name for C has no other letters");
        require(item.name.hal.find('_') == std::string::npos, "a name for netlists has dashes");
    }
    if (tree.code.known()) {
        require(tree.code.end == size && tree.code.begin <= size, "the code goes to the end");
    }
    for (const hal::comp::Text& text : tree.description) {
        hal::comp::markdown_of(text.text);
    }

    hal::Diagnostics found;
    const auto made = hal::comp::translate(sources, source, found);
    require(made.has_value() != found.failed(), "a text is translated or rejected");
    require(!of_parser.failed() || !made, "what cannot be read is not translated");
    if (made && tree.code.known()) {
        require(made->c.find(sources.text(tree.code)) != std::string::npos,
                "the code is taken as it is");
    }
    for (const char c : hal::render(found, sources)) {
        require(static_cast<unsigned char>(c) >= 0x20 || c == '\n',
                "nothing raw reaches the terminal");
    }
    return 0;
}
