// SPDX-License-Identifier: MIT
#include "machine/run/transaction.hpp"

#include <algorithm>
#include <iterator>
#include <stdexcept>
#include <utility>

#include "machine/run/running_model.hpp"
#include "machine/run/state.hpp"

namespace hal {
namespace {

void elaborate(Elaboration& on, const EditForm& form, const Command& plain) {
    on.edit.diagnostics = &on.diagnostics;
    on.edit.absences().begin(plain.span);
    std::vector<Token> args, counted;
    if (!plain.args.empty() && plain.args[0].text == "=") {  // NAME = VALUE
        args.push_back(plain.name);
        args.insert(args.end(), plain.args.begin() + 1, plain.args.end());
    } else {
        args = plain.args;
    }
    std::copy_if(args.begin(), args.end(), std::back_inserter(counted),
                 [&](const Token& t) { return !form.arrows || !is_arrow(t.text); });
    if (check_arity(form.usage, plain.name, counted, on.diagnostics)) {
        return form.elaborate(on, args);
    }
    // what it names may be missing because of this
    if (!args.empty()) {
        on.edit.absences().note(args[0].text);
    }
}

std::vector<std::string> words_of(const Command& command) {
    std::vector<std::string> words{command.name.text};
    for (const Token& token : command.args) {
        words.push_back(token.text);
    }
    return words;
}

}  // namespace

void Transaction::apply(const EditForm& form, const Command& command, Diagnostics& diagnostics) {
    SessionState& s = *machine_->state_;
    try {
        Edit& edit = s.transaction.editing(diagnostics);
        if (s.options.sink) {
            s.transaction.note(words_of(command));
        }
        for (const auto& thread : s.model.threads) {
            if (const Core* const core = s.threads.core(thread.get())) {
                thread->init_done = core->passed();
            }
        }
        Elaboration on{s.model,
                       edit,
                       s.plugins,
                       machine_->sources,
                       diagnostics,
                       s.transaction.auto_orders(),
                       form.usage,
                       s.options.check_only,
                       this,
                       s.executor ? &s.executor->board().shared.faults : nullptr,
                       s.options.hardware_allowed};
        for (const Command& plain : expand(command, diagnostics)) {
            s.transaction.count_command();
            elaborate(on, form, plain);
        }
    } catch (const std::bad_alloc&) {
        s.transaction.out_of_memory(diagnostics);
    }
}

void Transaction::when_committed(std::function<void()> action) {
    machine_->state_->transaction.when_committed(std::move(action));
}

void Transaction::needs_threads() { machine_->state_->transaction.need_threads(); }

void Transaction::roll_back() {
    if (!machine_) return;
    std::exchange(machine_, nullptr)->state_->transaction.roll_back();
}

bool Transaction::commit(Diagnostics& diagnostics) {
    if (!machine_) throw std::logic_error("the transaction has ended already");
    return std::exchange(machine_, nullptr)->state_->transaction.commit(diagnostics);
}

void Transaction::start_and_reject(Diagnostics& diagnostics) {
    if (!machine_) throw std::logic_error("the transaction has ended already");
    std::exchange(machine_, nullptr)->state_->transaction.start_and_reject(diagnostics);
}

}  // namespace hal
