# SPDX-License-Identifier: MIT
"""Markdown as GitHub renders it, by the library libcmark-gfm."""

import ctypes
import html
import re

TABLE, STRIKETHROUGH = b"table", b"strikethrough"


class Markdown:
    def __init__(self, library, extensions):
        self.cmark = ctypes.CDLL(library, mode=ctypes.RTLD_GLOBAL)
        extra = ctypes.CDLL(extensions)
        extra.cmark_gfm_core_extensions_ensure_registered()
        pointer, text = ctypes.c_void_p, ctypes.c_char_p
        for name, result, arguments in (
            ("cmark_parser_new", pointer, [ctypes.c_int]),
            ("cmark_find_syntax_extension", pointer, [text]),
            ("cmark_parser_attach_syntax_extension", ctypes.c_int, [pointer, pointer]),
            ("cmark_parser_feed", None, [pointer, text, ctypes.c_size_t]),
            ("cmark_parser_finish", pointer, [pointer]),
            ("cmark_parser_get_syntax_extensions", pointer, [pointer]),
            ("cmark_parser_free", None, [pointer]),
            ("cmark_render_html", pointer, [pointer, ctypes.c_int, pointer]),
            ("cmark_node_free", None, [pointer]),
        ):
            function = getattr(self.cmark, name)
            function.restype, function.argtypes = result, arguments
        self.free = ctypes.CDLL(None).free
        self.free.argtypes = [pointer]

    def html(self, text):
        """The HTML of a page, without raw HTML, which no page uses."""
        data = with_file_names(text).encode()
        parser = self.cmark.cmark_parser_new(0)
        for name in (TABLE, STRIKETHROUGH):
            self.cmark.cmark_parser_attach_syntax_extension(
                parser, self.cmark.cmark_find_syntax_extension(name)
            )
        self.cmark.cmark_parser_feed(parser, data, len(data))
        document = self.cmark.cmark_parser_finish(parser)
        rendered = self.cmark.cmark_render_html(
            document, 0, self.cmark.cmark_parser_get_syntax_extensions(parser)
        )
        result = ctypes.string_at(rendered).decode()
        self.free(rendered)
        self.cmark.cmark_node_free(document)
        self.cmark.cmark_parser_free(parser)
        return (
            with_anchors(result)
            .replace("<table>", '<div class="wide"><table>')
            .replace("</table>", "</table></div>")
        )


def with_file_names(text):
    """The text with a line above each code block that is a file, `file=NAME` behind its language: its name."""
    return re.sub(r"^( *)(```\w+) file=(\S+)$", r"\1`\3`:\n\n\1\2", text, flags=re.MULTILINE)


def plain(fragment):
    """The text of a piece of HTML."""
    return html.unescape(re.sub(r"<[^>]*>", "", fragment))


def slug(title, used):
    """The anchor that GitHub gives a heading."""
    base = re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-")
    number = used.get(base, 0)
    used[base] = number + 1
    return f"{base}-{number}" if number else base


def with_anchors(text):
    used = {}

    def heading(found):
        anchor = slug(plain(found[2]), used)
        return f'<h{found[1]} id="{anchor}">{found[2]}<a class="anchor" href="#{anchor}" aria-label="link to this section">#</a></h{found[1]}>'

    return re.sub(r"<h([1-6])>(.*?)</h\1>", heading, text)
