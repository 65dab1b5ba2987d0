// SPDX-License-Identifier: MIT
#include "panel/http.hpp"

#include <algorithm>
#include <array>
#include <libwebsockets.h>
#include <vector>

#include "panel/assets.hpp"
#include "panel/metrics.hpp"
#include "panel/server.hpp"
#include "text/find_row.hpp"

namespace hal::tools {

namespace {

constexpr std::pair<const char*, std::string_view> security[] = {
    {"content-security-policy:",
     "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src 'self' "
     "data:; "
     "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"},
    {"x-content-type-options:", "nosniff"},
    {"referrer-policy:", "no-referrer"},
    {"cross-origin-resource-policy:", "same-origin"},
    {"cross-origin-opener-policy:", "same-origin"},
    {"cross-origin-embedder-policy:", "require-corp"},
    {"cache-control:", "no-store"},
};

bool begin(lws* wsi, unsigned status, std::string_view type, std::size_t size) {
    std::array<unsigned char, LWS_PRE + 4096> buffer;
    unsigned char* const start = buffer.data() + LWS_PRE;
    unsigned char* at = start;
    unsigned char* const end = buffer.data() + buffer.size() - 1;
    const std::string content(type);
    if (lws_add_http_common_headers(wsi, status, content.c_str(), size, &at, end) != 0) {
        return false;
    }
    for (const auto& [name, value] : security) {
        if (lws_add_http_header_by_name(wsi, reinterpret_cast<const unsigned char*>(name),
                                        reinterpret_cast<const unsigned char*>(value.data()),
                                        static_cast<int>(value.size()), &at, end) != 0) {
            return false;
        }
    }
    return lws_finalize_write_http_header(wsi, start, &at, end) == 0;
}

int send_answer(lws* wsi, unsigned status, std::string_view type, HttpAnswer& answer) {
    if (!begin(wsi, status, type, answer.rest.size())) return -1;
    lws_callback_on_writable(wsi);
    return 0;
}

}  // namespace

std::string http_header(lws* wsi, int token) {
    std::array<char, 300> buffer;
    const int length = lws_hdr_copy(wsi, buffer.data(), static_cast<int>(buffer.size()),
                                    static_cast<lws_token_indexes>(token));
    return length > 0 ? std::string(buffer.data(), static_cast<std::size_t>(length)) : "";
}

const Asset* find_asset(std::string_view path) {
    if (path == "/") {
        path = "/index.html";
    }
    return find_row(assets, path, &Asset::path);
}

int answer_text(lws* wsi, unsigned status, std::string_view type, std::string text,
                HttpAnswer& answer) {
    answer.own = std::move(text);
    answer.rest = answer.own;
    return send_answer(wsi, status, type, answer);
}

int answer_http(PanelServer& server, lws* wsi, std::string_view path, HttpAnswer& answer) {
    constexpr std::string_view plain = "text/plain; charset=utf-8";
    if (!host_allowed(server.access(), http_header(wsi, WSI_TOKEN_HOST))) {
        return answer_text(wsi, 421, plain,
                           "This server does not answer for this host name. Open the address that "
                           "hal panel printed, or add the name: --host NAME\n",
                           answer);
    }
    if (lws_hdr_total_length(wsi, WSI_TOKEN_GET_URI) == 0) {
        return answer_text(wsi, 405, plain, "Only GET is supported.\n", answer);
    }
    if (path == "/metrics") {
        const std::string given = http_header(wsi, WSI_TOKEN_HTTP_AUTHORIZATION);
        const bool token = given.starts_with("Bearer ") &&
                           is_token(server.access(), std::string_view(given).substr(7));
        if (!server.access().open && !token) {
            return answer_text(wsi, 401, plain,
                               "/metrics needs the header: Authorization: Bearer TOKEN\n", answer);
        }
        return server.metrics().ask(wsi, answer);
    }
    const Asset* const asset = find_asset(path);
    if (!asset) return answer_text(wsi, 404, plain, "Not found.\n", answer);
    answer.rest = asset->bytes;
    return send_answer(wsi, 200, asset->type, answer);
}

int continue_http(lws* wsi, HttpAnswer& answer) {
    if (answer.rest.empty()) {
        return 0;  // waits for the machine
    }
    const std::size_t size = std::min<std::size_t>(answer.rest.size(), 16384);
    std::vector<unsigned char> buffer(LWS_PRE + size);
    std::copy_n(answer.rest.begin(), size, buffer.begin() + LWS_PRE);
    const bool last = size == answer.rest.size();
    if (lws_write(wsi, buffer.data() + LWS_PRE, size,
                  last ? LWS_WRITE_HTTP_FINAL : LWS_WRITE_HTTP) < static_cast<int>(size)) {
        return -1;
    }
    answer.rest.remove_prefix(size);
    if (last) return lws_http_transaction_completed(wsi) != 0 ? -1 : 0;
    lws_callback_on_writable(wsi);
    return 0;
}

}  // namespace hal::tools
