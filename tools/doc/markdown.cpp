// SPDX-License-Identifier: MIT
#include "doc/markdown.hpp"

#include <cstdlib>
#include <memory>

#ifdef HALCYON_CMARK
#include <cmark-gfm-core-extensions.h>
#include <cmark-gfm.h>
#endif

namespace hal::tools {

#ifdef HALCYON_CMARK
namespace {

using Text = std::unique_ptr<char, decltype(&std::free)>;

template <class Render>
std::optional<std::string> rendered(const std::string& text, Render render) {
    cmark_gfm_core_extensions_ensure_registered();
    const std::unique_ptr<cmark_parser, decltype(&cmark_parser_free)> parser(
        cmark_parser_new(CMARK_OPT_DEFAULT), cmark_parser_free);
    if (cmark_syntax_extension* const table = cmark_find_syntax_extension("table")) {
        cmark_parser_attach_syntax_extension(parser.get(), table);
    }
    cmark_parser_feed(parser.get(), text.data(), text.size());
    const std::unique_ptr<cmark_node, decltype(&cmark_node_free)> document(
        cmark_parser_finish(parser.get()), cmark_node_free);
    const Text result(render(document.get(), parser.get()), std::free);
    return result.get();
}

}  // namespace

// Raw HTML is left out (the library's default): the texts of a plugin are not trusted.
std::optional<std::string> markdown_as_html(const std::string& text) {
    return rendered(text, [](cmark_node* document, cmark_parser* parser) {
        return cmark_render_html(document, CMARK_OPT_DEFAULT,
                                 cmark_parser_get_syntax_extensions(parser));
    });
}

std::optional<std::string> markdown_as_man(const std::string& text) {
    return rendered(text, [](cmark_node* document, cmark_parser*) {
        return cmark_render_man(document, CMARK_OPT_DEFAULT, 0);
    });
}
#else
std::optional<std::string> markdown_as_html(const std::string&) { return std::nullopt; }
std::optional<std::string> markdown_as_man(const std::string&) { return std::nullopt; }
#endif

}  // namespace hal::tools
