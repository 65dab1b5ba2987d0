// SPDX-License-Identifier: MIT
// The language server: an input is what an editor sends. Messages are the same however the stream is
// cut, every answer is one JSON object, and positions in a text are consistent. No document is
// opened: the input would choose which files are read.
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "tests/fuzz/driver/require.hpp"
#include "tools/lsp/framing.hpp"
#include "tools/lsp/language_server.hpp"
#include "tools/lsp/text_document.hpp"

namespace {

using hal::fuzz::require;
using hal::tools::framed;
using hal::tools::LanguageServer;
using hal::tools::MessageReader;
using hal::tools::TextDocument;
using hal::tools::TextPosition;

std::vector<std::string> messages(std::string_view stream, std::size_t piece, bool& failed) {
    MessageReader reader;
    std::vector<std::string> found;
    for (std::size_t at = 0; at < stream.size(); at += piece) {
        reader.feed(stream.substr(at, piece));
        while (auto body = reader.next()) {
            found.push_back(std::move(*body));
        }
    }
    failed = reader.failed();
    require(failed == !reader.problem().empty(), "a failure has a reason", stream);
    return found;
}

void check_server(const std::vector<std::string>& bodies) {
    LanguageServer server({}, [](const std::string& body) {
        const auto json = nlohmann::json::parse(body, nullptr, false);
        require(json.is_object() && json.contains("jsonrpc"), "an answer is a message", body);
    });
    server.handle(R"({"id":0,"method":"initialize","params":{}})");
    for (const std::string& body : bodies) {
        const bool opens = body.find("didOpen") != body.npos || body.find("\\u") != body.npos;
        // settings name files
        if (opens || body.find("onfig") != body.npos || body.find("ini") != body.npos) continue;
        server.handle(body);
    }
}

void check_text(std::string_view text) {
    TextDocument document{std::string(text)};
    for (std::size_t offset = 0; offset <= text.size(); offset += 1 + text.size() / 64) {
        const TextPosition at = document.position(offset);
        require(at.line < document.line_count(), "a position is in a line", text);
        require(document.offset(at) <= offset, "a position is not behind its offset", text);
        require(document.position(document.offset(at)) == at, "a position is stable", text);
    }
    const std::size_t middle = text.size() / 2;
    document.replace(document.range(middle, middle), "x\r\ny");
    require(document.text().size() == text.size() + 4, "an insertion keeps the rest", text);
    require(document.line_count() >= 2, "an inserted line end makes a line", text);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    setenv("XDG_RUNTIME_DIR", "/nonexistent", 1);
    const std::string_view input(reinterpret_cast<const char*>(data), size);
    bool failed = false;
    bool failed_in_pieces = false;
    const auto whole = messages(input, input.size() + 1, failed);
    const auto pieces = messages(input, 3, failed_in_pieces);
    require(whole == pieces && failed == failed_in_pieces, "the cuts make no difference", input);
    check_server(whole);
    check_text(input);
    bool never = false;
    const auto again = messages(framed(input), 7, never);
    require(!never && again.size() == 1 && again[0] == input, "a framed body is read back", input);
    return 0;
}
