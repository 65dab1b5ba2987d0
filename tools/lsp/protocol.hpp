// SPDX-License-Identifier: MIT
// Parts of the messages of the Language Server Protocol 3.17.
#pragma once

#include <cstdint>
#include <functional>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <string_view>

#include "lsp/file_diagnostic.hpp"
#include "lsp/text_document.hpp"

namespace hal::tools::protocol {

using Json = nlohmann::json;

/// JSON-RPC 2.0, 5.1, and Language Server Protocol 3.17, ErrorCodes.
enum class ErrorCode {
    parse_error = -32700,
    invalid_request = -32600,
    method_not_found = -32601,
    invalid_params = -32602,
    server_not_initialized = -32002,
    request_failed = -32803,
};

/// The request fails with this code and text.
class RequestError : public std::runtime_error {
public:
    RequestError(ErrorCode which, const std::string& text)
        : std::runtime_error(text), code(which) {}
    ErrorCode code;
};

/// Returns the member at `path` ("textDocument/uri"), null when there is none. Accepts anything.
const Json& member(const Json& value, std::string_view path);
/// Returns a text; empty when the member is none.
std::string text_at(const Json& value, std::string_view path);
/// Returns an integer; `fallback` when the member is none.
std::int64_t integer_at(const Json& value, std::string_view path, std::int64_t fallback);
/// Throws RequestError when the member is not a position; a number out of range counts as the
/// nearest one.
TextPosition position_at(const Json& value, std::string_view path);
TextRange range_at(const Json& value, std::string_view path);

Json to_json(TextPosition at);
Json to_json(TextRange range);
/// Returns a Diagnostic; `uri_of` names the file of a related place.
Json to_json(const FileDiagnostic& finding,
             const std::function<std::string(const std::string&)>& uri_of);

}  // namespace hal::tools::protocol
