// SPDX-License-Identifier: MIT
// The HTTP side: the files of the page, which are in the program, and /metrics.
#pragma once

#include <string>
#include <string_view>

struct lws;

namespace hal::tools {

class PanelServer;

/// A file of the page.
struct Asset {
    std::string_view path;  ///< /app.js
    std::string_view type;  ///< text/javascript; charset=utf-8
    std::string_view bytes;
};

/// Returns the file, or nullptr.
const Asset* find_asset(std::string_view path);

/// The answer to one request that is being sent.
struct HttpAnswer {
    std::string_view rest;
    std::string own;  ///< the text, when it is not an asset
};

/// Answers a request. Returns the value for the library's callback.
int answer_http(PanelServer& server, lws* wsi, std::string_view path, HttpAnswer& answer);
/// Sends a text as the whole answer. Returns the value for the library's callback.
int answer_text(lws* wsi, unsigned status, std::string_view type, std::string text,
                HttpAnswer& answer);
/// Sends the next part of an answer. Returns the value for the library's callback.
int continue_http(lws* wsi, HttpAnswer& answer);
/// Returns a header of the request; empty when it is missing or too long.
std::string http_header(lws* wsi, int token);

}  // namespace hal::tools
