// SPDX-License-Identifier: MIT
// `hal check`: check netlists without running them.
#include "run/check.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include "cli/output.hpp"
#include "run/cell_netlists.hpp"
#include "run/netlist_part.hpp"
#include "run/offline.hpp"
#include "text/quoting.hpp"

namespace hal::tools {

namespace {

/// Keeps what is printed until it is known whether it helps.
class Collected final : public Output {
public:
    void out(std::string_view) override {}
    void err(std::string_view text) override { text_ += text; }
    const std::string& text() const { return text_; }
    std::size_t errors() const {
        std::size_t count = 0;
        for (auto at = text_.find(": error: "); at != text_.npos;
             at = text_.find(": error: ", at + 1)) {
            ++count;
        }
        return count;
    }

private:
    std::string text_;
};

/// Prints the errors of a netlist that others read. Many have one cause, which is printed in their
/// place: it is not complete.
void report_part(const CheckOptions& options, const Collected& output,
                 const std::vector<std::string>& readers) {
    constexpr std::size_t few = 3;
    if (output.errors() <= few) {
        write_all(STDERR_FILENO, output.text());
        return;
    }
    std::string names;
    for (const std::string& reader : readers) {
        append_item(names, fmt::format("'{}'", reader));
    }
    fail(options, fmt::format("'{}' is a part of {}, and has {} by itself; type: hal check {}",
                              options.words.front(), names, counted(output.errors(), "error"),
                              readers.front()));
}

/// Reports a file without errors, and how many of its lines were not checked.
class Verdicts {
public:
    explicit Verdicts(Session& session) : session_(session) {}
    void report(const std::string& path) {
        const std::size_t unchecked = session_.absences().unchecked_lines();
        const std::size_t lines = unchecked - before_;
        before_ = unchecked;
        std::string verdict = path + ": no errors";
        if (lines > 0) {
            verdict += fmt::format("; {} {} not checked", counted(lines, "line"),
                                   lines == 1 ? "was" : "were");
        }
        write_all(STDERR_FILENO, verdict + "\n");
    }

private:
    Session& session_;
    std::size_t before_ = 0;
};

}  // namespace

int run_check(const CheckOptions& options) {
    auto nodes = requested_nodes(options);
    if (!nodes) return 1;
    if (!nodes->empty()) return check_cell(options, std::move(*nodes));
    Session session(offline());
    for (const std::string& name : options.assume) {
        session.absences().assume(name);
    }
    ShellOptions how;
    how.check = how.keep_going = how.notes = true;
    how.linuxcnc = options.linuxcnc;
    how.color = colours(STDERR_FILENO);
    Shell shell(session, how);
    Verdicts verdicts(session);
    const auto good = [&](const std::string& path) { verdicts.report(path); };
    const bool may_be_part = options.words.size() == 1 && options.ini.empty();
    const auto readers =
        may_be_part ? files_that_read(options.words.front()) : std::vector<std::string>{};
    if (readers.empty()) {
        ErrorsOnly output;
        return exit_code(load_offline(shell, options, output, good) == 0);
    }
    Collected output;
    if (load_offline(shell, options, output) != 0) {
        report_part(options, output, readers);
        return 1;
    }
    write_all(STDERR_FILENO, output.text());
    good(options.words.front());
    return 0;
}

}  // namespace hal::tools
