// SPDX-License-Identifier: MIT
// The C source, in this order: the tables and the constructor, then the macros for the user's
// names, then the user's code. Nothing of ours stands behind the macros, so a pin may be called
// `host` or `memory`.
#include <algorithm>

#include <fmt/format.h>

#include "comp/comp.hpp"
#include "comp/syntax.hpp"

namespace hal::comp {
namespace {

// How C sees a pin's value, in the order of hal_type.
struct CType {
    const char *older, *newer, *handle, *constant, *member;
};
constexpr CType c_types[] = {
    {"hal_bit_t", "rtapi_bool", "hal_bool_t", "HAL_TYPE_BIT", "bit"},
    {"hal_float_t", "rtapi_real", "hal_real_t", "HAL_TYPE_FLOAT", "real"},
    {"hal_s32_t", "rtapi_s32", "hal_sint_t", "HAL_TYPE_S32", "s32"},
    {"hal_u32_t", "rtapi_u32", "hal_uint_t", "HAL_TYPE_U32", "u32"},
    {"hal_s64_t", "rtapi_s64", "hal_sint_t", "HAL_TYPE_S64", "s64"},
    {"hal_u64_t", "rtapi_u64", "hal_uint_t", "HAL_TYPE_U64", "u64"},
    {"void", "void", "hal_port_t", "HAL_TYPE_PORT", "port"},
};
constexpr const char* c_dirs[] = {"HAL_DIR_IN", "HAL_DIR_OUT", "HAL_DIR_IO", "HAL_DIR_PARAM"};

const CType& c_type(const Item& item) { return c_types[static_cast<std::size_t>(item.type)]; }
std::string value_type(const Item& item) {
    return std::string(item.settable ? c_type(item).newer : c_type(item).older) +
           (item.settable ? " volatile" : "");
}

std::string literal(std::string_view text) {
    std::string out = "\"";
    for (const char c : text) {
        if (c == '\n') {
            out += "\\n\"\n    \"";
        } else if (c == '"' || c == '\\') {
            (out += '\\') += c;
        } else if (c == '?') {
            out += "\\?";  // no trigraphs
        } else if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F) {
            out += ' ';
        } else {
            out += c;
        }
    }
    return out + '"';
}

class Emitter {
public:
    Emitter(const Tree& tree, const Sources& sources) : tree_(tree), sources_(sources) {}
    std::string emit();

private:
    template <class... Args>
    void add(fmt::format_string<Args...> format, Args&&... args) {
        fmt::format_to(std::back_inserter(out_), format, std::forward<Args>(args)...);
    }
    // From the next line on the compiler's messages are about the place of `span`.
    void from(Span span) {
        add("#line {} {}\n", sources_.place(span).line, literal(sources_.get(span.source).name));
    }
    // … are about the emitted text itself.
    void from_here() {
        const auto lines = std::count(out_.begin(), out_.end(), '\n');
        add("#line {} {}\n", lines + 2, literal("<" + tree_.name.text + ".comp as C>"));
    }
    bool program() const { return tree_.has("userspace"); }
    bool own_main() const {
        const Option* const option = tree_.option("rtapi_app");
        return option && !option->on();
    }
    bool period() const {
        const Option* const option = tree_.option("period");
        return !option || option->on();
    }

    void head();
    void state();
    void prototypes();
    void tables();
    void begin_instance();
    bool personal() const;
    void counts();
    void make();
    void create();
    void start_values();
    void variable_values();
    void plugin();
    void macros();
    void value_macro(const Item& item);
    void code();

    const Tree& tree_;
    const Sources& sources_;
    std::string out_;
};

void Emitter::head() {
    add("/* Made by hal compile from {}.comp. */\n#include \"linuxcnc/comp_instance.h\"\n",
        tree_.name.text);
    for (const Text& header : tree_.includes) {
        from(header.span);
        add("#include {}\n", header.text);
    }
    for (const Parameter& parameter : tree_.parameters) {
        if (parameter.dummy) continue;
        from(parameter.name.span);
        add("static int {0}{1};\nRTAPI_MP_INT({0}, {2})\n", parameter.name.text,
            parameter.start.given() ? " = " + parameter.start.text : "",
            literal(line_of(parameter.doc.text)));
    }
    from_here();
    // LinuxCNC's own load argument; some components borrow the variable
    const bool taken =
        std::any_of(tree_.functions.begin(), tree_.functions.end(),
                    [](const Function& function) { return function.name.c == "count"; });
    if (program()) {
        add("extern int count;\nextern char *names[16];\nvoid user_mainloop(void);\n{}",
            tree_.has("userinit") ? "void userinit(int argc, char **argv);\n" : "");
    } else if (!taken && !tree_.has("singleton") && !tree_.has("count_function")) {
        add("static int count __attribute__((unused)) = 1;\n");
    }
}

void Emitter::state() {
    add("struct __comp_state {{\n");
    for (const Item& item : tree_.items) {
        add("    union {{ hal_pin pin; {1} *__comp_at; }} __comp_{0}{2};\n", item.name.c,
            value_type(item), item.size == 0 ? "" : fmt::format("[{}]", item.size));
    }
    for (const Variable& variable : tree_.variables) {
        from(variable.name.span);
        add("    {} {}{}{};\n", variable.type.text, variable.stars, variable.name.c,
            variable.size.given() ? "[" + variable.size.text + "]" : "");
    }
    from_here();
    if (tree_.has("data")) {
        add("    void *_data; /* its type may be the code's */\n");
    }
    add("    int _personality;\n    struct __comp_state *_next;\n}};\nstatic struct __comp_state "
        "*__comp_first_inst, *__comp_last_inst;\n\n");
}

void Emitter::prototypes() {
    const char* const parameters = period() ? "struct __comp_state *__comp_inst, long period"
                                            : "struct __comp_state *__comp_inst";
    for (const Function& function : tree_.functions) {
        add("static void {}({});\n", function.name.c, parameters);
        add("static void __comp_step_{0}(void *self, const hal_cycle *cycle) {{ (void)cycle; "
            "{0}(self{1}); }}\n",
            function.name.c, period() ? ", (long)cycle->period_ns" : "");
    }
    if (tree_.has("extra_setup")) {
        add("static int extra_setup(struct __comp_state *, char *, long);\n");
    }
    if (tree_.has("post_export")) {
        add("static int post_export(struct __comp_state *, char *, long);\n");
    }
    if (tree_.has("extra_cleanup")) {
        add("static void extra_cleanup(void){};\n", own_main() ? " __attribute__((unused))" : "");
    }
    if (tree_.has("count_function")) {
        add("static int get_count(void);\n");
    }
    if (tree_.has("data")) {
        add("static size_t __comp_data_size(void);\n");
    }
    add("\n");
}

void Emitter::tables() {
    if (!tree_.items.empty()) {
        add("static const __comp_item __comp_items[] = {{\n");
    }
    for (const Item& item : tree_.items) {
        add("    {{offsetof(struct __comp_state, {}), {}, {}, {}, {}, {}, {}}},\n",
            "__comp_" + item.name.c, std::max(item.size, 1u), c_type(item).constant,
            c_dirs[static_cast<std::size_t>(item.dir)], item.read_only ? "HAL_PIN_READ_ONLY" : "0",
            literal(item.name.hal), literal(line_of(item.doc.text)));
    }
    if (!tree_.items.empty()) {
        add("}};\n");
    }
    if (!tree_.functions.empty()) {
        add("static const __comp_function __comp_functions[] = {{\n");
    }
    for (const Function& function : tree_.functions) {
        add("    {{{}, {}, __comp_step_{}}},\n", literal(function.name.hal),
            literal(line_of(function.doc.text)), function.name.c);
    }
    if (!tree_.functions.empty()) {
        add("}};\n");
    }
    add("\n");
}

void Emitter::variable_values() {
    for (const Variable& variable : tree_.variables) {
        if (!variable.start.given()) continue;
        from(variable.start.span);
        if (variable.size.given()) {
            add("    for (unsigned i = 0; i < sizeof inst->{0} / sizeof inst->{0}[0]; ++i) "
                "inst->{0}[i] = {1};\n",
                variable.name.c, variable.start.text);
        } else {
            add("    inst->{} = {};\n", variable.name.c, variable.start.text);
        }
    }
    from_here();
}

void Emitter::start_values() {
    for (const Item& item : tree_.items) {
        if (!item.start.given()) continue;
        from(item.start.span);
        if (item.size == 0) {
            add("    inst->__comp_{}.pin.own.{} = {};\n", item.name.c, c_type(item).member,
                item.start.text);
        } else {
            add("    for (unsigned i = 0; i < {}; ++i) inst->__comp_{}[i].pin.own.{} = {};\n",
                item.size, item.name.c, c_type(item).member, item.start.text);
        }
    }
    from_here();
}

void Emitter::begin_instance() {
    std::string stem = spelled(tree_.name).hal;
    // by what stands at its end: trail_ makes trail.0
    const bool shortened = stem.size() != tree_.name.text.size();
    const bool renamed = stem.starts_with("hal-") || shortened;
    if (stem.starts_with("hal-")) {
        stem.erase(0, 4);
    }
    add("static bool __comp_make(const hal_host *host, struct __comp_state *inst{}) {{\n    "
        "__comp_context context = {{host, {{0}}, 0, 0}};\n    (void)inst;\n",
        own_main() ? ", const char *prefix, long extra_arg" : "");
    if (own_main()) {
        add("    __comp_begin_as(&context, prefix, extra_arg);\n");
    } else {
        add("    if (!__comp_begin(&context, \"{}\", {}, !__comp_first_inst)) return false;\n",
            stem, renamed);
    }
}

/// Returns true when what an instance has depends on its personality.
bool Emitter::personal() const {
    if (tree_.option("personality") || tree_.option("default_personality")) return true;
    if (find_word(sources_.text(tree_.code), "personality") != std::string::npos) return true;
    return std::ranges::any_of(
        tree_.items, [](const Item& item) { return item.condition.given() || item.count.given(); });
}

/// The number of elements of each item, an array in the order of the items.
void Emitter::counts() {
    add("    const long counts[] = {{\n");
    for (const Item& item : tree_.items) {
        std::string count = "-1";
        if (item.count.given()) {
            count = "__comp_count(" + item.count.text + ")";
        } else if (item.size != 0) {
            count = std::to_string(item.size);
        }
        const Span written = item.condition.given() ? item.condition.span : item.count.span;
        if (written.known()) {
            from(written);
        }
        if (item.condition.given()) {
            add("        ({}) ? {} : 0,\n", item.condition.text, count);
        } else {
            add("        {},\n", count);
        }
    }
    from_here();
    add("    }};\n");
}

/// The function that makes an instance: its values, then its pins, then its functions.
void Emitter::make() {
    begin_instance();
    if (tree_.has("count_function")) {
        add("    if (!__comp_counted(&context, get_count())) return false;\n");
    }
    if (personal()) {
        const Option* const usual = tree_.option("default_personality");
        add("    if (!__comp_personality(&context, \"{}\", &inst->_personality)) return false;\n",
            usual ? usual->value.text : "0");
    }
    if (tree_.has("data")) {
        add("    if (!(inst->_data = host->allocate(host, __comp_data_size(), 16))) return "
            "false;\n");
    }
    const bool pins = !tree_.items.empty();
    if (pins) {
        add("    __comp_prepare(inst, __comp_items, sizeof __comp_items / sizeof "
            "__comp_items[0]);\n");
    }
    start_values();
    if (tree_.has("extra_setup")) {
        add("    if (!__comp_called(\"EXTRA_SETUP\", extra_setup(inst, context.prefix, "
            "context.number))) return false;\n");
    }
    variable_values();  // EXTRA_SETUP sees zeros, as in LinuxCNC
    add("    const long personality = inst->_personality;\n    (void)personality;\n");
    if (pins) {
        counts();
        add("    if (!__comp_pins(&context, inst, __comp_items, counts, sizeof counts / "
            "sizeof counts[0])) return false;\n");
    }
    if (!tree_.functions.empty()) {
        add("    if (!__comp_export(&context, inst, __comp_functions, sizeof __comp_functions / "
            "sizeof __comp_functions[0])) return false;\n");
    }
    if (tree_.has("post_export")) {
        add("    if (!__comp_called(\"POST_EXPORT\", post_export(inst, context.prefix, "
            "context.number))) return false;\n");
    }
    add("    if (__comp_last_inst) __comp_last_inst->_next = inst;\n    else __comp_first_inst = "
        "inst;\n    __comp_last_inst = inst;\n    return true;\n}}\n\n");
}

void Emitter::create() {
    make();
    if (own_main()) {
        add("static int export(char *prefix, long extra_arg) {{\n    struct __comp_state *const "
            "inst = hal_malloc(sizeof *inst);\n"
            "    if (!inst) return -ENOMEM;\n    return __comp_make(halcyon_host(), inst, prefix, "
            "extra_arg) ? 0 : -EINVAL;\n}}\n\n");
        return;
    }
    add("static bool __comp_create(const hal_host *host, void *memory) {{\n    if "
        "(halcyon_leave(__comp_make(host, memory))) return true;\n");
    if (tree_.has("extra_cleanup")) {
        add("    if (!__comp_first_inst) extra_cleanup();\n");
    }
    add("    halcyon_gone();\n    return false;\n}}\n\n");

    add("static void __comp_destroy(void *self) {{\n    struct __comp_state *before = 0;\n"
        "    for (struct __comp_state **at = &__comp_first_inst; *at; at = &(*at)->_next) {{\n     "
        "   if (*at == self) {{\n            *at = (*at)->_next;\n"
        "            if (__comp_last_inst == self) __comp_last_inst = before;\n            "
        "break;\n        }}\n        before = *at;\n    }}\n");
    if (tree_.has("extra_cleanup")) {
        add("    if (!__comp_first_inst) extra_cleanup();\n");
    }
    add("    halcyon_gone();\n}}\n\n");
}

void Emitter::plugin() {
    if (own_main()) { // component.c has the plugin
        add("MODULE_DESCRIPTION({})\n", literal(line_of(tree_.summary.text)));
        if (!tree_.license.empty()) {
            add("MODULE_LICENSE({})\n", literal(tree_.license[0].text));
        }
        return;
    }
    const Option* const count = tree_.option("default_count");
    std::string flags = tree_.has("singleton") ? "HAL_COMPONENT_SINGLETON" : "0";
    // they may be in different threads, as in LinuxCNC
    if (tree_.functions.size() > 1) {
        flags += " | HAL_COMPONENT_LOOSE_PINS";
    }
    const std::string fields = fmt::format(
        "sizeof(hal_component), HAL_ABI_MAJOR, HAL_ABI_MINOR, \"{}\", {}, {},\n    {}, {}, "
        "sizeof(struct __comp_state), _Alignof(struct __comp_state),\n"
        "    __comp_create, halcyon_start, halcyon_stop, __comp_destroy",
        tree_.name.text, literal(line_of(tree_.summary.text)), literal(manual(tree_)), flags,
        count ? count->value.text : "1");
    add("HAL_EXPORT const hal_component hal_plugin = {{{}}};\n\n", fields);
}

void Emitter::value_macro(const Item& item) {
    const std::string& name = item.name.c;
    const std::string at =
        "__comp_inst->__comp_" + name + (item.size == 0 ? "" : "[i]") + ".__comp_at";
    const char* const index = item.size == 0 ? "" : "(i)";
    const bool assignable = item.writable && !item.settable;
    if (item.type == HAL_TYPE_PORT) {
        return add(
            "#define {0}{1} (({2})(void *){3})\n#define {0}_ptr{1} (({2} const *)(void *)&{3})\n",
            name, index, c_type(item).handle, at);
    }
    add("#define {}{} (*{}{})\n", name, index,
        assignable ? "" : fmt::format("({} const *)", value_type(item)), at);
    add("#define {}_ptr{} ({}{})\n", name, index,
        item.settable ? fmt::format("({})(void *)", c_type(item).handle) : "", at);
    if (item.writable && item.settable) {
        add("#define {}_set({}v) __comp_set_{}({}, (v))\n", name, item.size == 0 ? "" : "i, ",
            c_type(item).member, at);
    }
}

void Emitter::macros() {
    const char* const parameters = period() ? "struct __comp_state *__comp_inst, long period"
                                            : "struct __comp_state *__comp_inst";
    add("#define FUNCTION(name) static void name({})\n", parameters);
    add("#define EXTRA_SETUP() static int extra_setup(struct __comp_state *__comp_inst, char "
        "*prefix, long extra_arg)\n"
        "#define POST_EXPORT() static int post_export(struct __comp_state *__comp_inst, char "
        "*prefix, long extra_arg)\n"
        "#define EXTRA_CLEANUP() static void extra_cleanup(void)\n"
        "#define FOR_ALL_INSTS() for (struct __comp_state *__comp_inst = __comp_first_inst; "
        "__comp_inst; __comp_inst = __comp_inst->_next)\n"
        "#define personality (__comp_inst->_personality)\n");
    if (period()) {
        add("#define fperiod (period * 1e-9)\n");
    }
    if (tree_.has("no_convenience_defines")) return;
    if (tree_.has("data")) {
        add("#define data (*({} *)__comp_inst->_data)\n", tree_.option("data")->value.text);
    }
    for (const Item& item : tree_.items) {
        value_macro(item);
    }
    for (const Variable& variable : tree_.variables) {
        add("#define {0} (__comp_inst->{0})\n", variable.name.c);
    }
}

void Emitter::code() {
    if (!tree_.code.known()) return;
    const std::string_view text = sources_.text(tree_.code);
    const bool implicit = implicit_function(tree_, text);
    if (implicit) {
        add("FUNCTION({}) {{\n", tree_.functions[0].name.c);
    }
    from(tree_.code);
    out_ += text;
    if (!text.ends_with('\n')) {
        out_ += '\n';
    }
    if (implicit) {
        add("}}\n");
    }
    if (tree_.has("data")) {
        add("static size_t __comp_data_size(void) {{ return sizeof({}); }}\n",
            tree_.option("data")->value.text);
    }
}

std::string Emitter::emit() {
    head();
    state();
    prototypes();
    tables();
    create();
    plugin();
    macros();
    code();
    return std::move(out_);
}

}  // namespace

std::string emit(const Tree& tree, const Sources& sources) { return Emitter(tree, sources).emit(); }

bool is_program(std::string_view c) {
    const std::size_t at = find_word(c, "main");

    const std::size_t open =
        at == std::string_view::npos ? at : c.find_first_not_of(" \t\r\n", at + 4);
    return open != std::string_view::npos && c[open] == '(' &&
           find_word(c, "rtapi_app_main") == std::string_view::npos;
}

std::optional<Translation> translate(const Sources& sources, std::uint32_t source,
                                     Diagnostics& diagnostics) {
    const std::size_t before = diagnostics.errors();
    const Tree tree = parse(sources, source, diagnostics);
    if (diagnostics.errors() == before) {
        check(tree, sources, source, diagnostics);
    }
    if (diagnostics.errors() != before) {
        return {};
    }
    const Option* const app = tree.option("rtapi_app");
    Translation made{
        tree.name.text, tree.has("userspace"), app && !app->on(), emit(tree, sources), {}, {}};
    const auto words = [&](const char* option, std::vector<std::string>& to) {
        const Option* const given = tree.option(option);
        for (std::size_t at = 0, end = 0; given && at < given->value.text.size(); at = end + 1) {
            end = std::min(given->value.text.find(' ', at), given->value.text.size());
            if (end > at) {
                to.push_back(given->value.text.substr(at, end - at));
            }
        }
    };
    words("extra_compile_args", made.compile_args);
    words("extra_link_args", made.link_args);
    return made;
}

}  // namespace hal::comp
