// SPDX-License-Identifier: MIT
#include "comp/scanner.hpp"

#include <algorithm>
#include <array>

#include "base/types.hpp"
#include "text/numbers.hpp"

namespace hal::comp {
namespace {

constexpr unsigned max_array_size = 1024;

// "no such type 'x'" and the like list what there is.
const std::vector<std::string>& type_names() {
    static const std::vector<std::string> names = [] {
        std::vector<std::string> all;
        for (const TypeRow& row : types) {
            all.push_back(row.name);
            if (*row.newer) {
                all.push_back(row.newer);
            }
        }
        all.insert(all.end(), {"signed", "unsigned"});
        return all;
    }();
    return names;
}

class Parser {
public:
    Parser(const Sources& sources, std::uint32_t source, Diagnostics& diagnostics)
        : in_(sources, source, diagnostics) {}
    Tree parse();

private:
    using Handler = bool (Parser::*)(const Text& keyword);
    struct Keyword {
        const char* name;
        Handler handler;
    };
    static const std::array<Keyword, 15> keywords;

    static const Keyword* find_keyword(std::string_view word);
    /// Parses a declaration with its `;`. Returns whether another one can be parsed here, after an
    /// error too; otherwise the rest up to the next `;` is to be skipped.
    bool declaration();
    void report_unknown_keyword(const Text& word);
    /// Reports a missing `;`. Returns whether another declaration, or the code, can be parsed here.
    bool semicolon();
    bool component(const Text& keyword);
    /// `pin` or `param`: DIRECTION TYPE NAME[SIZE] = START if CONDITION "DOC".
    bool item(const Text& keyword);
    bool function(const Text& keyword);
    bool variable(const Text& keyword);
    bool option(const Text& keyword);
    bool modparam(const Text& keyword);
    bool include(const Text& keyword);
    template <std::vector<Text> Tree::* list>
    bool prose(const Text& keyword);

    // Parts of declarations. False after reporting why the declaration is invalid.
    bool direction(Item& item);
    /// Parses `= START` and `if CONDITION`, in any order, each at most once.
    bool start_and_condition(Item& item);
    bool type(Item& item);
    bool array(Item& item);
    bool name(Name& name, const std::string& of);
    void doc(Text& doc);
    bool fail(std::string message, std::string help = "") {
        in_.error(in_.here(), std::move(message), "", std::move(help));
        return false;
    }

    Scanner in_;
    Tree tree_;
};

const std::array<Parser::Keyword, 15> Parser::keywords{{
    {"component", &Parser::component},
    {"pin", &Parser::item},
    {"param", &Parser::item},
    {"function", &Parser::function},
    {"variable", &Parser::variable},
    {"option", &Parser::option},
    {"modparam", &Parser::modparam},
    {"include", &Parser::include},
    {"description", &Parser::prose<&Tree::description>},
    {"examples", &Parser::prose<&Tree::examples>},
    {"notes", &Parser::prose<&Tree::notes>},
    {"see_also", &Parser::prose<&Tree::see_also>},
    {"author", &Parser::prose<&Tree::author>},
    {"license", &Parser::prose<&Tree::license>},
    {"special_format_doc", &Parser::prose<&Tree::notes>},
}};

Tree Parser::parse() {
    while (!in_.at_code() && !in_.at_end()) {
        if (!declaration()) {
            in_.recover();
        }
    }
    if (in_.at_code()) {
        tree_.code = in_.read_code();
    }
    return std::move(tree_);
}

const Parser::Keyword* Parser::find_keyword(std::string_view word) {
    const auto row = std::find_if(keywords.begin(), keywords.end(),
                                  [&](const Keyword& keyword) { return keyword.name == word; });
    return row == keywords.end() ? nullptr : &*row;
}

bool Parser::declaration() {
    if (in_.take(';')) {
        return true;  // an empty one
    }
    const Text word = in_.word();
    if (!word.given()) {
        return fail("a declaration starts with a word: pin, param, function, …",
                    "put C code after a line that consists of ;;");
    }
    const Keyword* const keyword = find_keyword(word.text);
    if (!keyword) {
        report_unknown_keyword(word);
        return false;
    }
    const bool parsed = (this->*keyword->handler)(word);
    const bool unterminated_string = in_.pop_broken();
    if (!parsed || unterminated_string) return false;
    return semicolon();
}

void Parser::report_unknown_keyword(const Text& word) {
    std::vector<std::string> names;
    for (const Keyword& keyword : keywords) {
        names.push_back(keyword.name);
    }
    std::string help = did_you_mean(word.text, names);
    if (help.empty()) {
        help = "declarations: " + listed(names, names.size()) +
               "; C code follows a line that consists of ;;";
    }
    in_.error(word.span, "unknown declaration '" + word.text + "'", "", help);
}

bool Parser::semicolon() {
    const bool code_follows = in_.at_code();
    if (!code_follows && in_.take(';')) return true;
    const Span marked = code_follows ? in_.behind() : in_.here();
    const bool marks_a_word = marked.end - marked.begin > 1;
    in_.error(marked, "unexpected text in the declaration",
              marks_a_word ? "missing ';' before this" : "missing ';'");
    return code_follows || find_keyword(in_.peek_word()) != nullptr;
}

bool Parser::component(const Text& keyword) {
    if (tree_.name.given()) {
        in_.error(keyword.span, "duplicate component declaration");
        return false;
    }
    tree_.name = in_.word();
    if (!tree_.name.given()) {
        return fail("missing component name", "component NAME \"what it does\";");
    }
    doc(tree_.summary);
    return true;
}

bool Parser::name(Name& name, const std::string& of) {
    const Text written = in_.hal_name();
    if (!written.given()) return fail("missing name of the " + of + "");
    name = spelled(written);
    return true;
}

void Parser::doc(Text& doc) {
    while (auto text = in_.string()) {  // strings that follow each other are one
        doc.span = doc.given() ? Span{doc.span.source, doc.span.begin, text->span.end} : text->span;
        doc.text += text->text;
    }
}

bool Parser::type(Item& item) {
    const Text word = in_.word();
    std::optional<hal_type> type = type_named(word.text);
    // halcompile rejects BIT
    if (type && word != row(*type).name && word != row(*type).newer) {
        type.reset();
    }
    if (word == "signed") {
        type = HAL_TYPE_S32;
    }
    if (word == "unsigned") {
        type = HAL_TYPE_U32;
    }
    if (!word.given() || !type) {
        if (!word.given()) {
            return fail("missing type", "types: " + listed(type_names(), type_names().size()));
        }
        std::string help = did_you_mean(word.text, type_names());
        if (help.empty()) {
            help = "types: " + listed(type_names(), type_names().size());
        }
        in_.error(word.span, "unknown type '" + word.text + "'", "", help);
        return false;
    }
    item.type = *type;
    item.settable = word == row(*type).newer;
    return true;
}

bool Parser::array(Item& item) {
    const Text size = in_.expression(":]");
    const std::uint64_t length = parse_natural(size.text).value_or(0);
    const bool valid = length != 0 && length <= max_array_size;
    item.size = valid ? static_cast<unsigned>(length) : 1;
    if (!valid) {
        in_.error(
            size.given() ? size.span : in_.here(),
            "the size of an array must be an integer, 1.." + std::to_string(max_array_size), "",
            "put the part that depends on the personality after it: [16 : personality & 0xff]");
    }
    if (in_.take(':')) {
        item.count = in_.expression("]");
        if (!item.count.given()) {
            return fail("missing number of elements", "[16 : personality & 0xff]");
        }
    }
    return in_.take(']') || fail("'[' without ']'");
}

bool Parser::direction(Item& item) {
    struct Direction {
        const char* name;
        bool parameter;
        hal_dir dir;
        bool writable, read_only;
    };
    static constexpr Direction directions[] = {{"in", false, HAL_DIR_IN, false, false},
                                               {"out", false, HAL_DIR_OUT, true, false},
                                               {"io", false, HAL_DIR_IO, true, false},
                                               {"r", true, HAL_DIR_PARAM, true, true},
                                               {"rw", true, HAL_DIR_PARAM, true, false}};
    const Text word = in_.word();
    for (const Direction& row : directions) {
        if (row.parameter != item.parameter || !(word == row.name)) continue;
        item.dir = row.dir;
        item.writable = row.writable;
        item.read_only = row.read_only;
        return true;
    }
    const Span at = word.given() ? word.span : in_.here();
    if (item.parameter) {
        in_.error(at, "invalid direction: a parameter is r (set by the component) or rw", "",
                  "param rw float gain = 1.0 \"what it is\";");
    } else {
        in_.error(at, "invalid direction: a pin is in, out or io", "",
                  "pin in float angle \"what it is\";");
    }
    return false;
}

bool Parser::start_and_condition(Item& item) {
    while (in_.next() == '=' || in_.peek_word() == "if") {
        const bool start = in_.take('=');
        Text& part = start ? item.start : item.condition;
        if (!start) {
            in_.word();
        }
        if (part.given()) {
            in_.error(part.span, start ? "duplicate initial value" : "duplicate condition");
            return false;
        }
        part = in_.expression(start ? "" : "=");
        if (!part.given()) return fail(start ? "missing initial value" : "missing condition");
    }
    return true;
}

bool Parser::item(const Text& keyword) {
    Item item;
    item.parameter = keyword == "param";
    if (!direction(item)) return false;
    if (!type(item) || !name(item.name, item.parameter ? "parameter" : "pin")) return false;
    if (in_.take('[') && !array(item)) return false;
    if (!start_and_condition(item)) return false;
    doc(item.doc);
    tree_.items.push_back(std::move(item));
    return true;
}

bool Parser::function(const Text&) {
    Function function;
    if (!name(function.name, "function")) return false;
    // all functions may calculate
    if (in_.peek_word() == "fp" || in_.peek_word() == "nofp") {
        in_.word();
    }
    doc(function.doc);
    tree_.functions.push_back(std::move(function));
    return true;
}

bool Parser::variable(const Text&) {
    Variable variable;
    variable.type = in_.word();
    if (!variable.type.given()) return fail("missing type of the variable", "variable double old;");
    while (in_.take('*')) {
        variable.stars += '*';
    }
    const Text written = in_.word();
    if (!written.given()) {
        return fail("missing name of the variable",
                    "the type is one word: use a typedef for struct, long long, …");
    }
    variable.name = spelled(written);
    variable.name.c = written.text;
    while (in_.take('[')) {  // several make a table
        const Text size = in_.expression("]");
        if (!size.given() || !in_.take(']')) return fail("missing size of the array");
        if (!variable.size.given()) {
            variable.size = size;
        } else {
            variable.size.text += "][" + size.text;
        }
    }
    if (in_.take('=')) {
        if (const auto text = in_.string()) {
            variable.start = *text;
            variable.start.text.insert(0, 1, '"').push_back('"');
        } else {
            variable.start = in_.expression("");
        }
        if (!variable.start.given()) return fail("missing initial value");
    }
    Text ignored;
    doc(ignored);
    tree_.variables.push_back(std::move(variable));
    return true;
}

bool Parser::option(const Text&) {
    Option option;
    option.name = in_.word();
    if (!option.name.given()) return fail("missing name of the option");
    doc(option.value);
    if (!option.value.given()) {
        option.value = in_.expression("");
    }
    tree_.options.push_back(std::move(option));
    return true;
}

bool Parser::modparam(const Text&) {
    Parameter parameter;
    const Text type = in_.word();
    if (!(type == "int") && !(type == "dummy")) {
        in_.error(type.given() ? type.span : in_.here(),
                  "a module parameter is int, or dummy when the C code declares it", "",
                  "modparam int channels = 4 \"what it is\";");

        return false;
    }
    parameter.dummy = type == "dummy";
    parameter.name = in_.word();
    if (!parameter.name.given()) return fail("missing name of the parameter");
    if (in_.take('=')) {
        parameter.start = in_.expression("");
        if (!parameter.start.given()) return fail("missing default value");
    }
    doc(parameter.doc);
    tree_.parameters.push_back(std::move(parameter));
    return true;
}

bool Parser::include(const Text&) {
    const auto header = in_.header();
    if (!header) return fail("missing file name", "include <rtapi_math.h>; or include \"mine.h\";");
    tree_.includes.push_back(*header);
    return true;
}

template <std::vector<Text> Tree::* list>
bool Parser::prose(const Text& keyword) {
    Text text;
    doc(text);
    if (!text.given()) {
        return fail("missing text", keyword.text + " \"a line\"; or " + keyword.text +
                                        " \"\"\"several lines\"\"\";");
    }
    (tree_.*list).push_back(std::move(text));
    return true;
}

}  // namespace

bool Option::on() const {
    return value.text != "no" && value.text != "No" && value.text != "NO" && value.text != "0" &&
           value.text != "false";
}

const Option* Tree::option(std::string_view wanted) const {
    const Option* found = nullptr;
    for (const Option& option : options) {
        if (option.name == wanted) {
            found = &option;
        }
    }
    return found;
}

bool Tree::has(std::string_view wanted) const {
    const Option* const found = option(wanted);
    return found && found->on();
}

Tree parse(const Sources& sources, std::uint32_t source, Diagnostics& diagnostics) {
    return Parser(sources, source, diagnostics).parse();
}

}  // namespace hal::comp
