// SPDX-License-Identifier: MIT
#include "commands/script.hpp"

#include <algorithm>
#include <filesystem>
#include <utility>

#include "commands/files.hpp"
#include "commands/foreign_file.hpp"
#include "commands/two_pass.hpp"
#include "text/find_row.hpp"
#include "text/quoting.hpp"

namespace hal {
namespace {

/// Commands that only look at the machine. `save` with a file acts.
bool only_looks(const CommandRow& row, const Command& command) {
    const bool writes_file = row.function.act == command_save && command.args.size() > 1;
    return row.is_query() && !writes_file;
}

/// `hal check` starts no programs: notes which names are theirs.
void note_program(Absences& absences, const Command& command) {
    std::vector<std::string> names;
    std::vector<std::string> arguments;
    std::string program;
    for (std::size_t i = 0; i < command.args.size(); ++i) {
        const std::string& word = command.args[i].text;
        const bool named = word == "-Wn" && i + 1 < command.args.size();
        if (named) {
            names.push_back(command.args[++i].text);
        }
        if (named || word.starts_with('-')) continue;
        // Many programs take the name of their component as an argument: pyvcp -c panel panel.xml
        names.push_back(std::filesystem::path(word).stem().string());
        if (program.empty()) {
            program = word;
        } else {
            arguments.push_back(word);
        }
    }
    absences.note_program(program, names, arguments);
}

}  // namespace

Script::Script(Shell& shell, Shell::State& state, Output& output)
    : shell_(shell),
      state_(state),
      session_(state.session),
      output_(output),
      lock_(state.session.lock()),
      texts_(shell, state),
      effects_(shell, state, output, lock_),
      logged_edits_(session_.event_log()),
      collected_before_(state.collected.size()) {}

Script::~Script() { transaction_.reset(); }

int Script::run(std::uint32_t source) {
    const bool collecting_before = state_.collecting;
    const std::size_t collected_before = state_.collected.size();
    texts_.enter(source);
    run_commands(source);
    texts_.leave();
    if (shell_.options.linuxcnc) {
        state_.linuxcnc_check.model(session_.model(), pending_);
    }
    finish();
    end_text(source, collecting_before, collected_before);
    return failed_ ? 1 : 0;
}

void Script::end_text(std::uint32_t source, bool collecting_before, std::size_t collected_before) {
    if (state_.collecting && collecting_before && failed_) {
        forget_collected(collected_before);
    }
    if (!texts_.is_file(source)) return;
    if (state_.collecting && !collecting_before) {
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
    const std::size_t errors = effects_.errors();
    if (separately() && errors > 0 && shell_.options.level != Level::nothing) {
        output_.err(counted(errors, "error") + "; " + kept_going_text(source) + "\n");
    }
}

/// After errors under -k: what took effect.
std::string Script::kept_going_text(std::uint32_t source) const {
    if (ignored_.contains(source)) return "nothing was changed";
    if (!ignored_.empty()) {
        return "lines with an error and ignored files changed nothing, all others took effect";
    }
    return "lines with an error changed nothing, all others took effect";
}

int Script::run(const std::vector<Command>& commands) {
    texts_.enter("");
    run_row(commands, 0, commands.size());
    texts_.leave();
    finish();
    return failed_ ? 1 : 0;
}

int Script::run_two_pass(const std::vector<std::uint32_t>& texts, Pass pass) {
    TwoPass sorted(texts_, shell_, pending_);
    for (const std::uint32_t text : texts) {
        sorted.add(text);
    }
    texts_.keep();
    texts_.enter("");
    if (pass != Pass::rest) {
        run_row(sorted.programs(), 0, sorted.programs().size());
        run_row(sorted.loads(), 0, sorted.loads().size());
    }
    if (pass != Pass::loads) {
        std::size_t at = 0;
        for (const TwoPass::Whole& whole : sorted.whole()) {
            run_row(sorted.rest(), at, whole.before);
            at = whole.before;
            finish();
            if (stop()) break;
            const bool keep_going = std::exchange(shell_.options.keep_going, true);
            run_commands(whole.text);
            shell_.options.keep_going = keep_going;
        }
        run_row(sorted.rest(), at, sorted.rest().size());
    }
    texts_.leave();
    finish();
    return failed_ ? 1 : 0;
}

void Script::run_commands(std::uint32_t source) {
    ParsedText parsed = texts_.parse(source);
    if (parsed.is_ignored()) {
        ignored_.insert(source);
    }
    auto problem = parsed.problems.all().begin();
    const auto report_problems_before = [&](std::uint32_t offset) {
        for (; problem != parsed.problems.all().end() &&
               (problem->labels.empty() || problem->labels[0].span.begin < offset);
             ++problem) {
            pending_.add(*problem);
            if (separately()) {
                finish();
            }
        }
    };
    rows_.push_back({&parsed.commands, 0, parsed.commands.size()});
    for (const Command& command : parsed.commands) {
        report_problems_before(command.span.begin);
        if (stop() || ended(command)) break;
        ++rows_.back().next;
        run_line(command);
        if (separately()) {
            finish();
        }
        if (stop()) break;
    }
    if (!stop()) {
        report_problems_before(UINT32_MAX);
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
    if (!row) return report_unknown(command);
    if (session_.event_log().wanted() && !row->edits() && !only_looks(*row, command)) {
        session_.event_log().add("command", std::string(session_.sources.text(command.span)));
    }
    if (!row->edits() && !check_arity(row->usage(), command.name, command.args, pending_)) {
        return effects_.add_line(command.span);
    }
    if (row->behaviour.timing == Timing::group) {
        // else it was reported, and the whole file is to be looked at
        if (!shell_.options.linuxcnc) {
            group(command);
        }
        return;
    }
    if ((state_.collecting || checked_begin_) && collect(command, *row)) return;
    if (row->edits()) return edit(command, *row);
    if (row->behaviour.timing == Timing::at_commit) return defer(command, *row);
    act(command, *row);
}

void Script::report_unknown(const Command& command) {
    const bool argument = command.name.text.find('=') != std::string::npos;
    effects_.add_line(command.span);
    pending_.error("unknown-command", command.name.span,
                   "unknown command '" + command.name.text + "'",
                   did_you_mean(command.name.text, command_names()),
                   argument ? "write spaces around the = of an assignment: NAME = VALUE"
                            : "`help` lists all commands");
}

Transaction& Script::transaction() {
    if (!transaction_) {
        transaction_.emplace(session_.begin());
    }
    return *transaction_;
}

void Script::edit(const Command& command, const CommandRow& row) {
    effects_.add_line(command.span);
    logged_edits_.add(session_.sources.text(command.span));
    if (!check_lock(row, command, locks(), session_.model(), pending_)) return;
    if (merge_module_load(command)) return;
    ++edits_;
    if (row.behaviour.effect == Effect::end_of_program && !shell_.options.check) {
        Context context{*this,   shell_,   session_, session_.programs(), output_, row,
                        command, pending_, lock_,    &transaction()};
        if (unload_processes(context)) return;
    }
    if (row.behaviour.effect == Effect::addition) {
        texts_.keep();
    }
    transaction().apply(row.form(), command, pending_);
}

/// The first pass of TWOPASS: true when the command was merged into the shell's module_loads.
bool Script::merge_module_load(const Command& command) {
    if (!state_.module_loads || command.name.text != "loadrt") return false;
    if (!merge_load(command, *state_.module_loads)) return false;
    texts_.keep();
    state_.module_load_texts.push_back(command.span.source);
    session_.sources.hold(command.span.source);
    return true;
}

void Script::defer(const Command& command, const CommandRow& row) {
    effects_.add_line(command.span);
    logged_edits_.add(session_.sources.text(command.span));
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
    if (checking && !begin_check(command, row)) return;
    // a check is one transaction: nothing acts
    const bool looks = only_looks(row, command);
    const bool apart = checking || row.is_apart() || looks;
    if (!apart) {
        finish_before_acting();
        if (stop()) return;
    } else if (!checking && looks && pending_.failed()) {
        return;  // it would show edits that are rolled back
    }
    const std::size_t errors_before = pending_.errors();
    if (!check_lock(row, command, locks(), session_.model(), pending_)) {
        log_failure(command, errors_before);
        effects_.add_line(command.span);
        return finish();
    }
    act_on_each(command, row);
    if (!looks) {
        log_failure(command, errors_before);
    }
    if (looks && !pending_.failed() && session_.ending()) {
        report_end(command);  // what it has printed may be incomplete
    }
    keep_remembered(command, row);
    note_effect(command, row, apart, pending_.errors() > errors_before);
}

/// Adds to the event log that a command which acts has failed, when it has.
void Script::log_failure(const Command& command, std::size_t errors_before) {
    if (!session_.event_log().wanted() || pending_.errors() <= errors_before) return;
    session_.event_log().add(
        "failed", failure_text(session_.sources.text(command.span), pending_, errors_before));
}

/// Notes what `hal check` does not carry out. Returns whether the command is checked.
bool Script::begin_check(const Command& command, const CommandRow& row) {
    if (row.function.act == command_loadusr) {
        note_program(session_.absences(), command);
    }
    if (!row.is_checked()) return false;
    session_.absences().begin(command.span);
    return true;
}

/// Keeps the texts of commands that are remembered: a component knows its loadusr, and the warning
/// that nothing ran names an advance.
void Script::keep_remembered(const Command& command, const CommandRow& row) {
    const bool advances = row.function.act == command_advance;
    if (row.function.act == command_loadusr ||
        (advances && session_.threads().note_advance(command.span))) {
        texts_.keep();
    }
}

/// Notes what a command has done; one that acts by itself ends its transaction.
void Script::note_effect(const Command& command, const CommandRow& row, bool apart, bool failed) {
    if (apart) {
        if (failed && row.function.act != command_source) {
            effects_.add_line(command.span);
        }
        return;
    }
    if (failed) {
        effects_.note_half_done();
    } else {
        effects_.add_effective(command.span);
    }
    finish();
}

/// The edits before a command that acts take effect first; the command counts as not carried out
/// yet.
void Script::finish_before_acting() {
    if (rows_.empty()) return finish();
    --rows_.back().next;
    finish();
    ++rows_.back().next;
}

/// Commands about one thing take a range of them: getp pid.[0..2].output
void Script::act_on_each(const Command& command, const CommandRow& row) {
    if (row.behaviour.operands != Operands::ranges) return act_on(command, row);
    for (const Command& one : expand(command, pending_)) {
        if (one.args.size() <= 1) {
            act_on(one, row);
            continue;
        }
        // a range among the arguments is a list of names
        for (const Token& name : one.args) {
            act_on({one.name, {name}, one.span}, row);
        }
    }
}

void Script::act_on(const Command& command, const CommandRow& row) {
    Context context{*this,   shell_,   session_, session_.programs(), output_, row,
                    command, pending_, lock_};
    row.function.act(context);
}

/// Returns a collected command that cannot be in a transaction with this one, or nullptr.
const Command* Script::find_conflict(const Command& command) const {
    return find_row_if(state_.collected, [&](const Command& one) {
        return one.name.text != command.name.text &&
               row_of(one)->behaviour.timing == Timing::at_request;
    });
}

bool Script::collect(const Command& command, const CommandRow& row) {
    if (!row.can_be_collected()) return reject_in_transaction(command, row);
    const bool acts = row.behaviour.timing == Timing::at_request;
    if (const Command* const other = acts ? find_conflict(command) : nullptr) {
        report_conflict(command, *other);
        return true;
    }
    if (checked_begin_) return false;
    state_.collected.push_back(command);
    session_.sources.hold(command.span.source);
    texts_.keep();
    return true;
}

void Script::report_conflict(const Command& command, const Command& other) {
    pending_.add({Severity::error,
                  "open-transaction",
                  "'" + command.name.text + "' and '" + other.name.text +
                      "' cannot be in the same transaction",
                  {{command.name.span, "second"}, {other.name.span, "first"}},
                  {"all commands of a transaction take effect together; commit first, then type " +
                   command.name.text}});
    effects_.add_line(command.span);
}

/// Reports a command that cannot be part of a transaction. Returns false for one that does not
/// disturb it.
bool Script::reject_in_transaction(const Command& command, const CommandRow& row) {
    if (row.is_apart() || row.is_query() || row.function.act == command_advance) return false;
    const bool typed = !texts_.is_file(command.span.source);
    pending_.error("open-transaction", command.name.span,
                   "'" + command.name.text + "' cannot be part of a transaction", "",
                   std::string(typed ? "the transaction is still open; type this" : "write it") +
                       " before `begin` or after `commit`");
    effects_.add_line(command.span);
    return true;
}

void Script::forget_collected(std::size_t from) {
    for (; state_.collected.size() > from; state_.collected.pop_back()) {
        const Span span = state_.collected.back().span;
        session_.sources.release(span.source);
        effects_.add_idle(span);
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
        begin_collecting(command);
    } else if (!state_.collecting) {
        pending_.error("no-transaction", command.name.span,
                       "no open transaction to " + name + ": 'begin' is missing", "",
                       "`begin` opens a transaction");
    } else if (name == "abort") {
        state_.collecting = false;
        forget_collected(0);
    } else {
        commit_collected();
    }
    finish();
}

void Script::begin_collecting(const Command& command) {
    if (state_.collecting) {
        pending_.error("open-transaction", command.name.span, "a transaction is already open", "",
                       "`commit` applies the collected edits, `abort` discards them");
    } else {
        collected_before_ = 0;
    }
    state_.collecting = true;
}

void Script::commit_collected() {
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

/// Reads the file of a `source` command. False after reporting.
bool Script::read_source(Context& context, std::string& path, std::string& text) {
    const std::string& given = context.argument(0);
    std::string problem;
    path = context.path(given);
    if (read_netlist(given, context.options().directory, path, text, problem)) return true;
    // Relative to the file it stands in, too: so that a folder of netlists can be run from
    // anywhere.
    const std::string beside = resolve_path(given, folder_of(texts_.open_files().back().path));
    std::string ignored;
    if (!given.starts_with('/') && read_text_file(beside, text, ignored)) {
        path = beside;
        return true;
    }
    if (shell_.options.check) {
        session_.absences().note_missing_text(given);
    }
    context.diagnostics.error("unreadable-file", context.span(0),
                              "'" + given + "' cannot be read: " + problem);
    return false;
}

/// Reports a file that is being read already. Returns false when it is not.
bool Script::reports_recursion(Context& context, const std::string& canonical) {
    const std::vector<OpenFile>& files = texts_.open_files();
    const auto open = std::ranges::find(files, canonical, &OpenFile::path);
    if (open == files.end()) return false;
    Diagnostic found{Severity::error,
                     "recursive-source",
                     "'" + context.argument(0) + "' includes itself",
                     {{context.span(0), "included again"}},
                     {}};
    for (auto inner = open + 1; inner != files.end(); ++inner) {
        found.labels.push_back({inner->at, "included from here"});
    }
    context.diagnostics.add(std::move(found));
    return true;
}

void Script::source(Context& context) {
    std::string path, text;
    if (!read_source(context, path, text)) return;
    if (auto foreign = foreign_file(path, text)) {
        context.diagnostics.error("unsupported-file", context.span(0), std::move(foreign->sentence),
                                  "", std::move(foreign->help));
        return;
    }
    const std::string canonical = canonical_path(path);
    if (reports_recursion(context, canonical)) return;
    const std::uint32_t source = add_text(path, std::move(text));
    const bool collecting = state_.collecting;
    const std::size_t collected = state_.collected.size();
    texts_.enter(canonical, context.command.span);
    run_commands(source);
    texts_.leave();
    // all of the file or nothing
    if (collecting && state_.collecting && (pending_.failed() || stopped_)) {
        forget_collected(collected);
    }
    ended_ = false;  // a `quit` in there ended that file
}

void Script::echo_line(std::string_view line, std::uint32_t number) {
    output_.err("(" + std::to_string(number) + ")<echo>: " + std::string(line) + "\n");
}

void Script::finish() {
    if (!transaction_ && edits_ == 0 && pending_.all().empty()) return;
    const std::size_t edits = std::exchange(edits_, 0);
    const bool open = transaction_.has_value();
    if (locks_ && transaction_) {
        transaction_->when_committed(
            [&session = session_, locks = *locks_] { session.locked = locks; });
    }
    const bool took_effect = open && transaction_->commit(pending_);
    transaction_.reset();
    locks_.reset();
    clears_faults_ = false;
    Diagnostics found;
    found.take(pending_);
    const bool failed = found.failed() || (open && !took_effect);
    logged_edits_.finish(found, failed);
    effects_.report(found, outcome_of(edits, took_effect, failed));
    if (!failed) return;
    failed_ = true;
    if (!separately()) {
        stopped_ = true;
    }
}

ScriptOutcome Script::outcome_of(std::size_t edits, bool took_effect, bool failed) const {
    ScriptOutcome outcome{edits, took_effect, failed, separately()};
    if (!failed) return outcome;
    for (std::size_t i = collected_before_; i < state_.collected.size(); ++i) {
        outcome.collected.push_back(state_.collected[i].span);
    }
    for (auto row = rows_.rbegin(); row != rows_.rend(); ++row) {
        for (std::size_t i = row->next; i < row->end; ++i) {
            outcome.not_reached.push_back((*row->commands)[i].span);
        }
    }
    return outcome;
}

bool Script::ended(const Command& command) {
    if (!session_.ending()) return false;
    if (!pending_.failed()) {
        report_end(command);
    }
    finish();
    stopped_ = true;
    return true;
}

void Script::report_end(const Command& command) {
    pending_.error("interrupted", command.span,
                   "'" + command.name.text + "' was interrupted: the machine ends");
}

bool Script::interrupted(Context& context) {
    const bool ends = session_.ending();
    if (!state_.cancelled.load(std::memory_order_relaxed) && !ends) return false;
    if (!context.diagnostics.failed()) {
        const std::string text = "'" + context.command.name.text + "' was interrupted";
        context.diagnostics.error("interrupted", context.command.span,
                                  ends ? text + ": the machine ends" : text);
    }
    return true;
}

}  // namespace hal
