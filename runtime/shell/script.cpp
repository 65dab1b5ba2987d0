// SPDX-License-Identifier: MIT
#include "shell/script.hpp"

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "base/words.hpp"
#include "netlist/nodes.hpp"
#include "shell/files.hpp"

namespace hal {
namespace {

std::string summary(std::size_t errors, std::size_t warnings, std::size_t notes) {
    std::string text;
    const auto add = [&](std::size_t number, const char* noun) {
        if (number > 0) text += (text.empty() ? "" : ", ") + counted(number, noun);
    };
    add(errors, "error");
    add(warnings, "warning");
    add(notes, "note");
    return text;
}

/// Edits that leave nothing in the model that points into their text.
bool makes_nothing(const Command& command) {
    static constexpr std::string_view names[] = {"setp",    "sets",   "delf",     "delsig", "unlinkp",
                                                 "unalias", "unload", "unloadrt", "reload", "delthread"};
    if (!command.args.empty() && command.args[0].text == "=") return true;
    return std::find(std::begin(names), std::end(names), command.name.text) != std::end(names);
}

bool is_include(const Command& command) { return command.name.text == "source" && command.args.size() == 1; }

/// `#NOTWOPASS` anywhere in a text, case and blanks ignored.
bool opts_out(std::string_view text) {
    static constexpr std::string_view magic = "#notwopass";
    for (std::size_t at = 0; at < text.size();) {
        const auto end = std::min(text.find('\n', at), text.size());
        std::string line;
        for (const char c : text.substr(at, end - at))
            if (c != ' ' && c != '\t' && c != '\r') line += static_cast<char>(c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c);
        if (line.starts_with(magic)) return true;
        at = end + 1;
    }
    return false;
}

}  // namespace

std::string Context::path(const std::string& text) const { return resolve_path(text, options().directory); }

Script::Script(Shell& shell, Shell::State& state, Output& output)
    : shell_(shell), state_(state), session_(state.session), output_(output), lock_(state.session.mutex) {}

Script::~Script() = default;

std::string Script::own_path(std::uint32_t source) const {
    const std::string& name = session_.sources.get(source).name;
    return name.starts_with('<') ? "" : canonical_path(resolve_path(name, shell_.options.directory));
}

Script::Parsed Script::parse_text(std::uint32_t source) {
    Parsed parsed;
    auto variable = state_.variable;
    if (!shell_.options.node.empty())
        variable = [this](const std::string& name) -> std::optional<std::string> {
            if (name == "NODE") return shell_.options.node;
            if (state_.variable) return state_.variable(name);
            const char* const value = std::getenv(name.c_str());
            return value ? std::optional<std::string>(value) : std::nullopt;
        };
    parsed.commands = parse(session_.sources, source, {&session_.ini, std::move(variable)}, parsed.problems);
    const auto files = std::count_if(files_.begin(), files_.end(), [](const Open& open) { return !open.path.empty(); });
    if (files <= 1 && !session_.sources.get(source).name.starts_with('<')) take_part(source, parsed);
    return parsed;
}

// Of a netlist for several machines: the part of this one.
void Script::take_part(std::uint32_t source, Parsed& parsed) {
    const auto line = std::find_if(parsed.commands.begin(), parsed.commands.end(), is_node_line);
    if (line == parsed.commands.end()) return;
    std::vector<NodeLine> nodes;
    collect_nodes(parsed.commands, nodes, parsed.problems);
    if (!shell_.options.node.empty()) return keep_part(shell_.options.node, parsed.commands);
    if (!nodes.empty()) {
        std::vector<std::string> names;
        for (const NodeLine& node : nodes) names.push_back(node.name);
        parsed.problems.clear();  // of a text that is nobody's; $(NODE) has no value here
        parsed.problems.error("several-nodes", line->span,
                              "this netlist is for " + counted(nodes.size(), "machine") + ": " + listed(names, 100), "",
                              "hal run " + session_.sources.get(source).name + " --node " + names.front() + " loads the part of one");
    }
    parsed.commands.clear();
}

int Script::run(std::uint32_t source) {
    const bool collecting_before = state_.collecting;
    files_.push_back({own_path(source), {}});
    run_commands(source);
    files_.pop_back();
    finish();
    const bool file = !session_.sources.get(source).name.starts_with('<');
    if (file && state_.collecting && !collecting_before) {
        const std::size_t lost = state_.collected.size();
        state_.collecting = false;
        state_.collected.clear();
        pending_.error("open-transaction", {}, "'begin' without 'commit': " + counted(lost, "collected edit") + " did not take effect", "",
                       "end the row of edits with commit");
        finish();
    }
    if (separately() && errors_ > 0 && file && shell_.options.level != Level::nothing)
        output_.err(counted(errors_, "error") + "; lines with an error changed nothing, all others took effect\n");
    return failed_ ? 1 : 0;
}

void Script::run_commands(std::uint32_t source) {
    Parsed parsed = parse_text(source);
    auto problem = parsed.problems.all().begin();
    const auto take_problems_before = [&](std::uint32_t place) {
        for (; problem != parsed.problems.all().end() && (problem->labels.empty() || problem->labels[0].span.begin < place); ++problem) {
            pending_.add(*problem);
            if (separately()) finish();
        }
    };
    for (const Command& command : parsed.commands) {
        take_problems_before(command.span.begin);
        if (stop()) return;
        run_line(command);
        if (separately()) finish();
        if (stop()) return;
    }
    take_problems_before(UINT32_MAX);
}

void Script::run_line(const Command& command) {
    if (shell_.options.echo) echo_line(session_.sources.text(command.span), session_.sources.place(command.span).line);
    const CommandRow* const row = row_of(command);
    if (!row) {
        const bool argument = command.name.text.find('=') != std::string::npos;
        pending_.error("unknown-command", command.name.span, "there is no command '" + command.name.text + "'",
                       did_you_mean(command.name.text, command_names()),
                       argument ? "an assignment has blanks around the =: NAME = VALUE" : "`help` lists all commands");
        return;
    }
    if (!row->handler) return edit(command, *row);
    if (!check_arity(*row, command, pending_)) return;
    if (row->flags & command_transaction) return transaction(command);
    act(command, *row);
}

void Script::edit(const Command& command, const CommandRow& row) {
    if (state_.collecting) {
        state_.collected.push_back(command);
        text_is_kept_ = true;
        return;
    }
    if (!check_lock(row, command, session_.lock, pending_)) return;
    if (command.name.text == "unload" && !shell_.options.check) {
        Context context{*this, shell_, session_, *state_.processes, output_, command, pending_, lock_};
        if (unload_processes(context)) return;
    }
    ++edits_;
    if (!makes_nothing(command)) text_is_kept_ = true;
    session_.apply(command, pending_);
}

void Script::act(const Command& command, const CommandRow& row) {
    if (shell_.options.check && !(row.flags & command_checked) && command.name.text != "quit" && command.name.text != "exit") return;
    const bool apart = row.flags & command_apart;
    if (!apart) {
        finish();
        if (stop()) return;
    }
    if (!check_lock(row, command, session_.lock, pending_)) return finish();
    // Commands about one thing take a range of them: getp pid.[0..2].output
    const bool about_one =
        row.handler == command_getp || row.handler == command_gets || row.handler == command_ptype || row.handler == command_stype;
    const auto plain = about_one ? expand(command, pending_) : std::vector<Command>{command};
    for (const Command& one : plain) {
        if (one.args.size() > 1 && about_one) {  // a range among the arguments is a list of names
            for (const Token& name : one.args) {
                const Command single{one.name, {name}, one.span};
                Context context{*this, shell_, session_, *state_.processes, output_, single, pending_, lock_};
                row.handler(context);
            }
            continue;
        }
        Context context{*this, shell_, session_, *state_.processes, output_, one, pending_, lock_};
        row.handler(context);
    }
    if (row.handler == command_loadusr) text_is_kept_ = true;  // its component remembers the place
    if (!apart) finish();
}

void Script::transaction(const Command& command) {
    finish();
    if (stop() || shell_.options.check) return;
    const std::string& name = command.name.text;
    if (name == "begin") {
        if (state_.collecting)
            pending_.error("open-transaction", command.name.span, "edits are being collected already", "",
                           "`commit` makes them take effect, `abort` forgets them");
        state_.collecting = true;
    } else if (!state_.collecting) {
        pending_.error("no-transaction", command.name.span, "there is nothing to " + name + ": no 'begin' came before", "",
                       "`begin` starts to collect edits");
    } else {
        state_.collecting = false;
        const auto collected = std::exchange(state_.collected, {});
        if (name == "commit")
            for (const Command& one : collected) edit(one, *row_of(one));
    }
    finish();
}

void Script::source(Context& context) {
    const std::string& given = context.argument(0);
    std::string path = context.path(given), text, problem;
    if (!read_text_file(path, text, problem)) {
        // Relative to the file it stands in, too: so that a folder of netlists can be run from anywhere.
        const std::string beside = resolve_path(given, folder_of(files_.back().path));
        std::string ignored;
        if (given.starts_with('/') || !read_text_file(beside, text, ignored)) {
            context.diagnostics.error("unreadable-file", context.span(0), "'" + given + "' cannot be read: " + problem);
            return;
        }
        path = beside;
    }
    const std::string canonical = canonical_path(path);
    for (auto open = files_.begin(); open != files_.end(); ++open) {
        if (open->path != canonical) continue;
        Diagnostic found{
            Severity::error, "recursive-source", "'" + given + "' is being read already", {{context.span(0), "reads it again"}}, {}};
        for (auto inner = open + 1; inner != files_.end(); ++inner) found.labels.push_back({inner->at, "reached from here"});
        context.diagnostics.add(std::move(found));
        return;
    }
    text_is_kept_ = true;
    const std::uint32_t source = session_.sources.add(path, std::move(text));
    files_.push_back({canonical, context.command.span});
    run_commands(source);
    files_.pop_back();
    ended_ = false;  // a `quit` in there ended that file
}

int Script::run_two_pass(const std::vector<std::uint32_t>& texts) {
    // Loading is additive here, so that the loads of all files need not be merged into one line per component: doing
    // them first, in order, gives the same instances. loadusr comes before that, as in LinuxCNC's first pass.
    std::vector<Command> programs, loads, rest;
    std::vector<std::size_t> whole;  // places in `rest` where a text that opted out runs as it is
    std::vector<std::uint32_t> opted_out;
    const auto sort_in = [&](const auto& self, std::uint32_t text) -> void {
        Parsed parsed = parse_text(text);
        pending_.take(parsed.problems);
        for (Command& command : parsed.commands) {
            if (command.name.text == "loadusr") programs.push_back(std::move(command));
            else if (command.name.text == "loadrt") loads.push_back(std::move(command));
            else if (is_include(command)) {
                const std::string path = resolve_path(command.args[0].text, shell_.options.directory);
                std::string content, problem;
                const bool again =
                    std::any_of(files_.begin(), files_.end(), [&](const Open& open) { return open.path == canonical_path(path); });
                if (again || !read_text_file(path, content, problem)) {
                    rest.push_back(std::move(command));  // run in its turn, it says what is wrong
                    continue;
                }
                files_.push_back({canonical_path(path), command.span});
                self(self, session_.sources.add(path, std::move(content)));
                files_.pop_back();
            } else rest.push_back(std::move(command));
        }
    };
    for (const std::uint32_t text : texts) {
        if (opts_out(session_.sources.get(text).text)) {
            whole.push_back(rest.size());
            opted_out.push_back(text);
            continue;
        }
        files_.push_back({own_path(text), {}});
        sort_in(sort_in, text);
        files_.pop_back();
    }
    text_is_kept_ = true;
    files_.push_back({"", {}});
    const auto run_all = [&](const std::vector<Command>& commands, std::size_t from, std::size_t to) {
        for (std::size_t i = from; i < to && !stop(); ++i) {
            run_line(commands[i]);
            if (separately()) finish();
        }
    };
    run_all(programs, 0, programs.size());
    run_all(loads, 0, loads.size());
    std::size_t at = 0;
    for (std::size_t i = 0; i < whole.size(); ++i) {
        run_all(rest, at, whole[i]);
        at = whole[i];
        finish();
        if (stop()) break;
        const bool kept = std::exchange(shell_.options.keep_going, true);
        run_commands(opted_out[i]);
        shell_.options.keep_going = kept;
    }
    run_all(rest, at, rest.size());
    files_.pop_back();
    finish();
    return failed_ ? 1 : 0;
}

void Script::echo_line(std::string_view line, std::uint32_t number) {
    output_.err("(" + std::to_string(number) + ")<echo>: " + std::string(line) + "\n");
}

void Script::finish() {
    if (edits_ == 0 && pending_.all().empty()) return;
    const std::size_t edits = std::exchange(edits_, 0);
    const bool open = session_.in_transaction();
    const bool took_effect = open && session_.commit(pending_);
    Diagnostics found;
    found.take(pending_);
    report(found, edits, took_effect);
    if (!found.failed() && (!open || took_effect)) return;
    errors_ += found.errors();
    failed_ = true;
    if (!separately()) stopped_ = true;
}

void Script::report(Diagnostics& found, std::size_t edits, bool took_effect) {
    const ShellOptions& options = shell_.options;
    if (options.level == Level::nothing) return;
    Diagnostics shown;
    for (const Diagnostic& one : found.all())
        if (one.severity != Severity::note || options.notes || options.level >= Level::results) shown.add(one);
    if (!shown.all().empty()) {
        std::string text = render(shown, session_.sources, options.color);
        if (edits > 0 && !separately()) {
            text += "\n" + summary(shown.errors(), shown.warnings(), shown.notes());
            text += options.check ? "\n" : shown.failed() ? "; nothing was changed\n" : "; the edit took effect\n";
        }
        output_.err(text);
    } else if (options.level >= Level::results && edits > 0 && took_effect) {
        output_.err(counted(edits, "edit") + " took effect\n");
    }
}

bool Script::interrupted(Context& context) {
    if (!state_.cancelled.load(std::memory_order_relaxed)) return false;
    if (!context.diagnostics.failed())
        context.diagnostics.error("interrupted", context.command.span, "'" + context.command.name.text + "' was interrupted");
    return true;
}

bool Context::interrupted() { return script.interrupted(*this); }

}  // namespace hal
