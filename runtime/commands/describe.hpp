// SPDX-License-Identifier: MIT
// What is there, as JSON: for `show` with --json and the protocol's list and describe.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "commands/json_text.hpp"
#include "commands/listing.hpp"

namespace hal {

class Session;

enum class Listed { components, pins, signals, parameters, functions, threads, aliases, all };

/// By the words of show and list ("pin", "sig", "signal" …).
std::optional<Listed> listed_kind(std::string_view word);

/// The names `list` prints, in its order.
std::vector<std::string> names_of(const Session& session, Listed kind, const Patterns& patterns);

/// Appends an array of objects, or for Listed::all an object with an array per kind. Values come
/// from one bulk read per kind; the session's lock must be held. The members of each object are
/// listed in docs/protocol.md.
void describe(std::string& to, Session& session, Listed kind, const Patterns& patterns,
              std::optional<hal_type> type);

}  // namespace hal
