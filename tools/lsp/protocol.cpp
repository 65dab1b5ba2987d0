// SPDX-License-Identifier: MIT
#include "lsp/protocol.hpp"

#include <algorithm>
#include <limits>

namespace hal::tools::protocol {

namespace {

const Json no_member;

std::uint32_t number_at(const Json& value, std::string_view path) {
    const Json& number = member(value, path);
    if (!number.is_number()) {
        throw RequestError(ErrorCode::invalid_params,
                           "missing or invalid position member '" + std::string(path) + "'");
    }
    constexpr double max = std::numeric_limits<std::int32_t>::max();
    return static_cast<std::uint32_t>(std::clamp(number.get<double>(), 0.0, max));
}

int severity_number(Severity severity) {
    switch (severity) {
    case Severity::error: return 1;
    case Severity::warning: return 2;
    case Severity::note: return 3;
    }
    return 3;
}

std::string whole_message(const FileDiagnostic& finding) {
    std::string text = finding.message;
    if (!finding.label.empty()) {
        text += "\n" + finding.label;
    }
    for (const std::string& help : finding.help) {
        text += "\nhelp: " + help;
    }
    return text;
}

}  // namespace

const Json& member(const Json& value, std::string_view path) {
    const Json* at = &value;
    while (!path.empty()) {
        const auto slash = std::min(path.find('/'), path.size());
        if (!at->is_object()) return no_member;
        const auto found = at->find(path.substr(0, slash));
        if (found == at->end()) return no_member;
        at = &*found;
        path.remove_prefix(std::min(slash + 1, path.size()));
    }
    return *at;
}

std::string text_at(const Json& value, std::string_view path) {
    const Json& text = member(value, path);
    return text.is_string() ? text.get<std::string>() : "";
}

std::int64_t integer_at(const Json& value, std::string_view path, std::int64_t fallback) {
    const Json& number = member(value, path);
    return number.is_number_integer() ? number.get<std::int64_t>() : fallback;
}

TextPosition position_at(const Json& value, std::string_view path) {
    const Json& position = member(value, path);
    return {number_at(position, "line"), number_at(position, "character")};
}

TextRange range_at(const Json& value, std::string_view path) {
    const Json& range = member(value, path);
    return {position_at(range, "start"), position_at(range, "end")};
}

Json to_json(TextPosition at) { return {{"line", at.line}, {"character", at.character}}; }

Json to_json(TextRange range) {
    return {{"start", to_json(range.begin)}, {"end", to_json(range.end)}};
}

Json to_json(const FileDiagnostic& finding,
             const std::function<std::string(const std::string&)>& uri_of) {
    Json diagnostic{{"range", to_json(finding.range)},
                    {"severity", severity_number(finding.severity)},
                    {"code", finding.code},
                    {"source", "halcyon"},
                    {"message", whole_message(finding)}};
    for (const DiagnosticPlace& place : finding.related) {
        const std::string text = place.text.empty() ? "here" : place.text;
        diagnostic["relatedInformation"].push_back(
            {{"location", {{"uri", uri_of(place.path)}, {"range", to_json(place.range)}}},
             {"message", text}});
    }
    return diagnostic;
}

}  // namespace hal::tools::protocol
