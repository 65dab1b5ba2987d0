// SPDX-License-Identifier: MIT
#include "lsp/semantic_tokens.hpp"

#include <algorithm>
#include <array>
#include <iterator>
#include <optional>
#include <string_view>
#include <vector>

#include "lsp/protocol.hpp"
#include "netlist/line.hpp"

namespace hal::tools {

using protocol::Json;

namespace {

/// In the order of the legend.
constexpr std::array<const char*, 9> type_names{"keyword",  "class",    "namespace",
                                                "property", "variable", "function",
                                                "event",    "number",   "comment"};
enum Type {
    keyword,
    class_type,
    namespace_type,
    property,
    variable,
    function,
    event,
    number,
    comment
};

struct Piece {
    std::size_t begin;
    std::size_t end;
    Type type;
};

std::optional<Type> type_of(const Occurrence& one) {
    switch (one.kind) {
    case NameKind::command: return keyword;
    case NameKind::component: return class_type;
    case NameKind::instance: return one.verbatim ? std::optional(namespace_type) : std::nullopt;
    case NameKind::pin: return property;
    case NameKind::signal: return variable;
    case NameKind::function: return function;
    case NameKind::thread: return event;
    case NameKind::value: return number;
    case NameKind::file: return std::nullopt;
    }
    return std::nullopt;
}

/// The comments of the lines of a range.
void add_comments(const TextDocument& document, TextRange range, std::vector<Piece>& pieces) {
    const std::uint32_t last = std::min(range.end.line, document.line_count() - 1);
    for (std::uint32_t line = range.begin.line; line <= last; ++line) {
        const std::string_view text = document.line(line);
        const std::size_t begin = scan_quotes(text).comment;
        if (begin < text.size()) {
            const std::size_t start = document.line_start(line);
            pieces.push_back({start + begin, start + text.size(), comment});
        }
    }
}

/// Tokens relative to the one before: Language Server Protocol 3.17, textDocument/semanticTokens.
Json encoded(const TextDocument& document, const std::vector<Piece>& pieces) {
    Json data = Json::array();
    TextPosition last;
    for (const Piece& piece : pieces) {
        const TextRange range = document.range(piece.begin, piece.end);
        if (range.end.line != range.begin.line || range.end == range.begin) continue;
        const bool same_line = range.begin.line == last.line;
        data.push_back(range.begin.line - last.line);
        data.push_back(same_line ? range.begin.character - last.character : range.begin.character);
        data.push_back(range.end.character - range.begin.character);
        data.push_back(static_cast<int>(piece.type));
        data.push_back(0);
        last = range.begin;
    }
    return data;
}

}  // namespace

Json semantic_legend() { return {{"tokenTypes", type_names}, {"tokenModifiers", Json::array()}}; }

Json semantic_tokens(const NetlistIndex& index, const TextDocument& document,
                     const std::string& path, TextRange range) {
    const std::size_t begin = document.offset(range.begin);
    const std::size_t end = document.offset(range.end);
    std::vector<Piece> pieces;
    for (const Occurrence& one : index.in_text(path)) {
        if (one.end < begin || one.begin >= end) continue;
        if (const auto type = type_of(one)) {
            pieces.push_back({one.begin, one.end, *type});
        }
    }
    add_comments(document, range, pieces);
    std::stable_sort(pieces.begin(), pieces.end(),
                     [](const Piece& a, const Piece& b) { return a.begin < b.begin; });
    std::vector<Piece> apart;
    for (const Piece& piece : pieces) {
        if (apart.empty() || piece.begin >= apart.back().end) {
            apart.push_back(piece);
        }
    }
    return {{"data", encoded(document, apart)}};
}

}  // namespace hal::tools
