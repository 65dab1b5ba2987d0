// SPDX-License-Identifier: MIT
// What stands in a .comp file, in the order it was written; every word with its place.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hal/abi.h"
#include "text/diagnostic.hpp"
#include "text/source.hpp"

namespace hal::comp {

/// A word, a string's contents or an expression, and where it was written.
struct Text {
    std::string text;
    Span span;
    bool given() const { return span.known(); }
    bool operator==(std::string_view other) const { return text == other; }
};

/// A name in its three spellings: as written, as the netlist has it, and as the C code has it.
struct Name : Text {
    std::string hal, c;
};

/// A pin or a parameter.
struct Item {
    bool parameter = false;
    bool writable = false;    ///< by the component: out, io, and every parameter
    bool read_only = false;   ///< a parameter that only the component sets
    bool settable = false;    ///< newer types: written with NAME_set(), not by assignment
    hal_type type = HAL_TYPE_BIT;
    hal_dir dir = HAL_DIR_IN;
    Name name;
    unsigned size = 0;        ///< elements of an array; 0: none
    Text count;               ///< how many of them an instance has
    Text condition, start, doc;
};

struct Function {
    Name name;
    Text doc;
};

struct Variable {
    Text type;
    std::string stars;
    Name name;
    Text size, start;
};

struct Parameter {  ///< of the module: a load argument
    bool dummy = false;  ///< the C code declares it
    Text name, start, doc;
};

struct Option {
    Text name, value;
    bool on() const;
};

/// A whole file.
struct Tree {
    Text name, summary;
    std::vector<Item> items;
    std::vector<Function> functions;
    std::vector<Variable> variables;
    std::vector<Parameter> parameters;
    std::vector<Option> options;
    std::vector<Text> includes;  ///< with their quotes or brackets
    std::vector<Text> description, examples, notes, see_also, author, license;
    Span code;                   ///< all behind the `;;` line

    const Option* option(std::string_view name) const;
    bool has(std::string_view option) const;
};

/// Reads the declarations. What cannot be read is reported and left out.
Tree parse(const Sources& sources, std::uint32_t source, Diagnostics& diagnostics);

/// Checks a whole file: name clashes, missing parts, unsupported features.
void check(const Tree& tree, const Sources& sources, std::uint32_t source,
           Diagnostics& diagnostics);

/// Spells a written name for netlists and for C.
Name spelled(Text written);

/// `name` with its block of `#` as a number of the same width.
std::string numbered(const std::string& name, unsigned index);

/// Returns true when the code is the body of the only function, without a FUNCTION macro.
bool implicit_function(const Tree& tree, std::string_view code);

/// Where a whole word stands in C code, outside of comments and strings; npos if nowhere.
std::size_t find_word(std::string_view code, std::string_view word, std::size_t from = 0);

/// The C source.
std::string emit(const Tree& tree, const Sources& sources);

/// Returns the manual text in Markdown, from description, examples, notes, …
std::string manual(const Tree& tree);

/// Text in the macros of manual pages (groff's man) as Markdown; other text stays as it is.
std::string markdown_of(std::string_view text);
/// The same for the one line a pin has.
std::string line_of(std::string_view text);

}  // namespace hal::comp
