// SPDX-License-Identifier: MIT
#include "commands/script.hpp"

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "commands/files.hpp"
#include "netlist/nodes.hpp"
#include "text/quoting.hpp"

namespace hal {
namespace {

/// Commands that only look at the machine. `save` with a file acts.
bool only_looks(const CommandRow& row, const Command& command) {
    return (row.flags & command_query) &&
           !(row.function.act == command_save && command.args.size() > 1);
}

}  // namespace

std::string Context::path(const std::string& text) const {
    return resolve_path(text, options().directory);
}

Script::Script(Shell& shell, Shell::State& state, Output& output)
    : shell_(shell),
      state_(state),
      session_(state.session),
      output_(output),
      lock_(state.session.lock()),
      collected_before_(state.collected.size()) {}

Script::~Script() {
    transaction_.reset();
    Sources& sources = session_.sources;
    for (const std::uint32_t text : texts_) {
        sources.release(text);
        if (!text_is_kept_ && !shell_.options.check) {
            sources.drop(text);
        }
    }
    session_.sweep_texts();
}

std::uint32_t Script::add_text(std::string name, std::string text, std::uint32_t first_line) {
    texts_.reserve(texts_.size() + 1);
    const std::uint32_t source = session_.sources.add(std::move(name), std::move(text), first_line);
    session_.sources.hold(source);
    texts_.push_back(source);
    return source;
}

std::string Script::own_path(std::uint32_t source) const {
    const std::string& name = session_.sources.get(source).name;
    return name.starts_with('<') ? ""
                                 : canonical_path(resolve_path(name, shell_.options.directory));
}

Script::Parsed Script::parse_text(std::uint32_t source) {
    Parsed parsed;
    auto variable = state_.variable;
    if (!shell_.options.node.empty()) {
        variable = [this](const std::string& name) -> std::optional<std::string> {
            if (name == "NODE") return shell_.options.node;
            if (state_.variable) return state_.variable(name);
            const char* const value = std::getenv(name.c_str());
            return value ? std::optional<std::string>(value) : std::nullopt;
        };
    }
    parsed.commands =
        parse(session_.sources, source,
              {state_.ini ? &*state_.ini : &session_.ini, std::move(variable)}, parsed.problems);
    // quotes remain in the words of a netlist, but do not belong to the name of a file
    for (Command& command : parsed.commands) {
        const CommandRow* const row = find_command(command.name.text);
        if (row && (row->flags & command_path)) {
            for (Token& word : command.args) {
                word.text = without_quotes(word.text);
            }
        }
    }
    const auto files = std::count_if(files_.begin(), files_.end(),
                                     [](const Open& open) { return !open.path.empty(); });
    if (files <= 1 && !session_.sources.get(source).name.starts_with('<')) {
        take_part(source, parsed);
    }
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
        for (const NodeLine& node : nodes) {
            names.push_back(node.name);
        }
        parsed.problems.clear();  // of a text that is nobody's; $(NODE) has no value here
        parsed.problems.error(
            "several-nodes", line->span,
            "this netlist is for " + counted(nodes.size(), "machine") + ": " + listed(names, 100),
            "",
            "hal run " + session_.sources.get(source).name + " --node " + names.front() +
                " loads the part of one");
    }
    parsed.commands.clear();
}

int Script::run(std::uint32_t source) {
    const bool collecting_before = state_.collecting;
    const std::size_t collected_before = state_.collected.size();
    files_.push_back({own_path(source), {}});
    run_commands(source);
    files_.pop_back();
    if (shell_.options.linuxcnc) {
        state_.linuxcnc_check.model(session_.model(), pending_);
    }
    finish();
    const bool file = !session_.sources.get(source).name.starts_with('<');
    if (state_.collecting && collecting_before && failed_) {
        forget_collected(collected_before);
    }
    if (file && state_.collecting && !collecting_before) {
        const std::size_t lost = state_.collected.size();
        state_.collecting = false;
        forget_collected(0);
        if (!failed_) {
            pending_.error("open-transaction", {},
                           "'begin' without 'commit': " + counted(lost, "collected edit") +
                               " did not take effect",
                           "", "end the transaction with commit");
            finish();
        }
    }
    if (separately() && errors_ > 0 && file && shell_.options.level != Level::nothing) {
        output_.err(counted(errors_, "error") +
                    "; lines with an error changed nothing, all others took effect\n");
    }
    return failed_ ? 1 : 0;
}

int Script::run(const std::vector<Command>& commands) {
    files_.push_back({"", {}});
    run_row(commands, 0, commands.size());
    files_.pop_back();
    finish();
    return failed_ ? 1 : 0;
}

void Script::run_commands(std::uint32_t source) {
    Parsed parsed = parse_text(source);
    auto problem = parsed.problems.all().begin();
    const auto take_problems_before = [&](std::uint32_t place) {
        for (; problem != parsed.problems.all().end() &&
               (problem->labels.empty() || problem->labels[0].span.begin < place);
             ++problem) {
            pending_.add(*problem);
            if (separately()) {
                finish();
            }
        }
    };
    rows_.push_back({&parsed.commands, 0, parsed.commands.size()});
    for (const Command& command : parsed.commands) {
        take_problems_before(command.span.begin);
        if (stop() || ended(command)) break;
        ++rows_.back().next;
        run_line(command);
        if (separately()) {
            finish();
        }
        if (stop()) break;
    }
    if (!stop()) {
        take_problems_before(UINT32_MAX);
    }
    rows_.pop_back();
}

void Script::run_row(const std::vector<Command>& commands, std::size_t from, std::size_t to) {
    rows_.push_back({&commands, from, to});
    while (rows_.back().next < to && !stop()) {
        if (ended(commands[rows_.back().next])) break;
        run_line(commands[rows_.back().next++]);
        if (separately()) {
            finish();
        }
    }
    rows_.pop_back();
}

void Script::run_line(const Command& command) {
    if (shell_.options.linuxcnc) {
        state_.linuxcnc_check.command(command, session_.model(), pending_);
    }
    if (shell_.options.echo) {
        echo_line(session_.sources.text(command.span), session_.sources.place(command.span).line);
    }
    const CommandRow* const row = row_of(command);
    if (!row) {
        const bool argument = command.name.text.find('=') != std::string::npos;
        lines_.push_back(command.span);
        pending_.error("unknown-command", command.name.span,
                       "unknown command '" + command.name.text + "'",
                       did_you_mean(command.name.text, command_names()),
                       argument ? "write spaces around the = of an assignment: NAME = VALUE"
                                : "`help` lists all commands");
        return;
    }
    if (session_.journal().wanted() && !only_looks(*row, command)) {
        session_.journal().add(row->edits() ? "edit" : "command",
                               std::string(session_.sources.text(command.span)));
    }
    if (!row->edits() && !check_arity(row->usage(), command.name, command.args, pending_)) {
        return lines_.push_back(command.span);
    }
    if (row->flags & command_transaction) {
        // else it was reported, and the whole file is to be looked at
        if (!shell_.options.linuxcnc) {
            group(command);
        }
        return;
    }
    if ((state_.collecting || checked_begin_) && collect(command, *row)) return;
    if (row->edits()) return edit(command, *row);
    if (row->flags & command_deferred) return defer(command, *row);
    act(command, *row);
}

Transaction& Script::transaction() {
    if (!transaction_) {
        transaction_.emplace(session_.begin());
    }
    return *transaction_;
}

void Script::edit(const Command& command, const CommandRow& row) {
    lines_.push_back(command.span);
    if (!check_lock(row, command, locks(), session_.model(), pending_)) return;
    if (state_.module_loads && command.name.text == "loadrt" && merge_load(command)) return;
    ++edits_;
    if ((row.flags & command_programs) && !shell_.options.check) {
        Context context{*this,   shell_,   session_, session_.programs(), output_, row,
                        command, pending_, lock_,    &transaction()};
        if (unload_processes(context)) return;
    }
    if (!(row.flags & command_traceless)) {
        text_is_kept_ = true;
    }
    transaction().apply(row.form(), command, pending_);
}

void Script::defer(const Command& command, const CommandRow& row) {
    if (shell_.options.check && !(row.flags & command_checked)) return;
    lines_.push_back(command.span);
    if (!check_lock(row, command, locks(), session_.model(), pending_)) return;
    ++edits_;
    if (!locks_) {
        locks_ = session_.locked.load();
    }
    Context context{*this,   shell_,   session_, session_.programs(), output_, row,
                    command, pending_, lock_,    &transaction(),      &*locks_};
    row.function.act(context);
}

void Script::act(const Command& command, const CommandRow& row) {
    const bool checking = shell_.options.check;
    if (checking && row.function.act == command_loadusr) {
        note_program(command);
    }
    if (checking && !(row.flags & command_checked)) return;
    if (checking) {
        session_.absences().begin(command.span);
    }
    // a check is one transaction: nothing acts
    const bool apart = checking || (row.flags & command_apart) || only_looks(row, command);
    if (!apart) {
        if (!rows_.empty()) {
            --rows_.back().next;  // not carried out yet
        }
        finish();
        if (!rows_.empty()) {
            ++rows_.back().next;
        }
        if (stop()) return;
    } else if (!checking && only_looks(row, command) && pending_.failed()) {
        return;  // it would show edits that are rolled back
    }
    const std::size_t errors_before = pending_.errors();
    if (!check_lock(row, command, locks(), session_.model(), pending_)) {
        lines_.push_back(command.span);
        return finish();
    }
    // Commands about one thing take a range of them: getp pid.[0..2].output
    const bool about_one = (row.flags & command_each) != 0;
    const auto plain = about_one ? expand(command, pending_) : std::vector<Command>{command};
    for (const Command& one : plain) {
        if (one.args.size() > 1 && about_one) {  // a range among the arguments is a list of names
            for (const Token& name : one.args) {
                const Command single{one.name, {name}, one.span};
                Context context{*this,  shell_,   session_, session_.programs(), output_, row,
                                single, pending_, lock_};
                row.function.act(context);
            }
            continue;
        }
        Context context{*this, shell_,   session_, session_.programs(), output_, row,
                        one,   pending_, lock_};
        row.function.act(context);
    }
    if (only_looks(row, command) && !pending_.failed() && session_.ending()) {
        report_end(command);  // what it has printed may be incomplete
    }
    // its component remembers the place
    if (row.function.act == command_loadusr) {
        text_is_kept_ = true;
    }
    // for the warning that nothing ran
    if (row.function.act == command_advance && session_.threads().note_advance(command.span)) {
        text_is_kept_ = true;
    }
    const bool failed = pending_.errors() > errors_before;
    if (apart) {
        if (failed && row.function.act != command_source) {
            lines_.push_back(command.span);
        }
        return;
    }
    if (failed) {
        half_done_ = true;
    } else {
        effective_.push_back(command.span);
    }
    finish();
}

bool Script::collect(const Command& command, const CommandRow& row) {
    const bool acts = (row.flags & command_collected) != 0;
    if (row.edits() || (row.flags & command_deferred) || acts) {
        const auto other =
            std::find_if(state_.collected.begin(), state_.collected.end(), [&](const Command& one) {
            return acts && one.name.text != command.name.text &&
                   (row_of(one)->flags & command_collected);
        });
        if (other != state_.collected.end()) {
            Diagnostic found{
                Severity::error,
                "open-transaction",
                "'" + command.name.text + "' and '" + other->name.text +
                    "' cannot be in the same transaction",
                {{command.name.span, "second"}, {other->name.span, "first"}},
                {"all commands of a transaction take effect together; commit first, then type " +
                 command.name.text}};
            pending_.add(std::move(found));
            lines_.push_back(command.span);
            return true;
        }
        if (checked_begin_) return false;
        state_.collected.push_back(command);
        session_.sources.hold(command.span.source);
        text_is_kept_ = true;
        return true;
    }
    if ((row.flags & command_apart) || (row.flags & command_query) ||
        row.function.act == command_advance) {
        return false;
    }
    const bool typed = session_.sources.get(command.span.source).name.starts_with('<');
    pending_.error("open-transaction", command.name.span,
                   "'" + command.name.text + "' cannot be part of a transaction", "",
                   std::string(typed ? "the transaction is still open; type this" : "write it") +
                       " before `begin` or after `commit`");
    lines_.push_back(command.span);
    return true;
}

void Script::forget_collected(std::size_t from) {
    for (; state_.collected.size() > from; state_.collected.pop_back()) {
        const Span span = state_.collected.back().span;
        session_.sources.release(span.source);
        idle_.push_back(span);
    }
}

void Script::group(const Command& command) {
    finish();
    const std::string& name = command.name.text;
    if (shell_.options.check) {
        checked_begin_ = name == "begin";
    }
    if (stop() || shell_.options.check) return;
    if (name == "begin") {
        if (state_.collecting) {
            pending_.error("open-transaction", command.name.span, "a transaction is already open",
                           "", "`commit` applies the collected edits, `abort` discards them");
        } else {
            collected_before_ = 0;
        }
        state_.collecting = true;
    } else if (!state_.collecting) {
        pending_.error("no-transaction", command.name.span,
                       "no open transaction to " + name + ": 'begin' is missing", "",
                       "`begin` opens a transaction");
    } else if (name == "abort") {
        state_.collecting = false;
        forget_collected(0);
    } else {
        state_.collecting = false;
        std::vector<Command> collected = std::exchange(state_.collected, {});
        // no text is freed before this one is done
        for (const Command& one : collected) {
            session_.sources.release(one.span.source);
        }
        for (Command& one : collected) {
            if (!one.name.span.known()) {
                resolve_set(session_.model(), one);
            }
            const CommandRow& row = *row_of(one);
            if (row.edits()) {
                edit(one, row);
            } else {
                defer(one, row);
            }
        }
    }
    finish();
}

void Script::source(Context& context) {
    const std::string& given = context.argument(0);
    std::string path = context.path(given), text, problem;
    if (!read_netlist(given, context.options().directory, path, text, problem)) {
        // Relative to the file it stands in, too: so that a folder of netlists can be run from
        // anywhere.
        const std::string beside = resolve_path(given, folder_of(files_.back().path));
        std::string ignored;
        if (given.starts_with('/') || !read_text_file(beside, text, ignored)) {
            if (shell_.options.check) {
                session_.absences().note_missing_text(given);
            }
            context.diagnostics.error("unreadable-file", context.span(0),
                                      "'" + given + "' cannot be read: " + problem);
            return;
        }
        path = beside;
    }
    const std::string canonical = canonical_path(path);
    for (auto open = files_.begin(); open != files_.end(); ++open) {
        if (open->path != canonical) continue;
        Diagnostic found{Severity::error,
                         "recursive-source",
                         "'" + given + "' includes itself",
                         {{context.span(0), "included again"}},
                         {}};
        const std::string included = "included from here";
        for (auto inner = open + 1; inner != files_.end(); ++inner) {
            found.labels.push_back({inner->at, included});
        }
        context.diagnostics.add(std::move(found));
        return;
    }
    const std::uint32_t source = add_text(path, std::move(text));
    const bool collecting = state_.collecting;
    const std::size_t collected = state_.collected.size();
    files_.push_back({canonical, context.command.span});
    run_commands(source);
    files_.pop_back();
    // all of the file or nothing
    if (collecting && state_.collecting && (pending_.failed() || stopped_)) {
        forget_collected(collected);
    }
    ended_ = false;  // a `quit` in there ended that file
}

void Script::echo_line(std::string_view line, std::uint32_t number) {
    output_.err("(" + std::to_string(number) + ")<echo>: " + std::string(line) + "\n");
}

}  // namespace hal
