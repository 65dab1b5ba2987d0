// SPDX-License-Identifier: MIT
// Netlists loaded without running anything: for `hal check` and `hal graph`.
#pragma once

#include <string>

#include "options.hpp"
#include "session/session.hpp"
#include "shell/shell.hpp"

namespace hal::tools {

/// Loads the files of `options.words` into a session that constructs components but starts none. Everything printed,
/// diagnostics included, goes to `output`. Returns the number of files that have errors.
int load_offline(Shell& shell, const Options& options, Output& output);

/// Options of such a session.
SessionOptions offline();

/// Output to standard error only; what commands would print has no place here.
class ErrorsOnly final : public Output {
public:
    void out(std::string_view) override {}
    void err(std::string_view text) override;
};

}  // namespace hal::tools
