// SPDX-License-Identifier: MIT
#include "cli/cut_text.hpp"

#include "text/glyphs.hpp"

namespace hal::tools {

std::string cut_text(std::string_view text, std::size_t width) {
    std::string out;
    std::size_t used = 0;
    for (std::size_t at = 0; at < text.size();) {
        const Glyph glyph = glyph_at(text, at);
        used += glyph.columns;
        if (used > width) break;
        append_glyph(out, text, at, glyph);
        at += glyph.bytes;
    }
    return out;
}

std::string fit_text(std::string_view text, std::size_t width) {
    const std::string beginning = cut_text(text, width);
    return beginning + std::string(width - columns(beginning), ' ');
}

}  // namespace hal::tools
