// SPDX-License-Identifier: MIT
// What a LinuxCNC module does to the machine as a whole while it is loaded and unloaded: commands,
// values and locks by name.
#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>

#include "machine/load/construction.hpp"
#include "machine/load/elaborate.hpp"
#include "machine/report/journaled_calls.hpp"
#include "machine/run/running_model.hpp"

namespace hal {
namespace {

constexpr auto config = static_cast<unsigned>(Lock::tune) & ~static_cast<unsigned>(Lock::load);
constexpr auto params = static_cast<unsigned>(Lock::params);
constexpr auto run = static_cast<unsigned>(Lock::run);

/// A command that a module may give; those without an elaboration are carried out below.
struct Row {
    std::string_view name;
    unsigned lock;  // bits that forbid it
    void (*elaborate)(Elaboration& on, std::span<const Token> args);
};
constexpr Row module_commands[] = {{"newsig", config, edits::newsig},
                                   {"delsig", config, edits::delsig},
                                   {"linkps", config, edits::linkps},
                                   {"unlinkp", config, edits::unlinkp},
                                   {"addf", config, edits::addf},
                                   {"initf", config, edits::initf},
                                   {"delf", config, edits::delf},
                                   {"alias", config, edits::alias},
                                   {"unalias", config, edits::unalias},
                                   {"setp", params, edits::setp},
                                   {"start", run, nullptr},
                                   {"stop", run, nullptr},
                                   {"lock", 0, nullptr}};

void put_text(const std::string& text, char* to, std::size_t capacity) {
    const std::size_t length = std::min(text.size(), capacity - 1);
    std::memcpy(to, text.data(), length);
    to[length] = '\0';
}

unsigned locks_of(const Construction& c) {
    return c.lock.value_or(c.request.on->transaction->machine().locked);
}

/// start, stop and lock, which take effect with the transaction.
bool take_later(Construction& c, std::string_view name, const char* number) {
    Transaction& transaction = *c.request.on->transaction;
    RunningModel& running = transaction.machine();
    if (name == "lock") {
        unsigned bits = 0;
        std::from_chars(number, number + std::char_traits<char>::length(number), bits);
        c.lock = bits;
        transaction.when_committed([&running, bits] { running.locked = bits; });
        return true;
    }
    transaction.needs_threads();
    if (name == "start") {
        transaction.when_committed([&running] { running.threads().start(); });
    } else {
        transaction.when_committed([&running] { running.threads().stop(); });
    }
    return true;
}

/// Executes a command that a module calls while it is loaded, as a line of the netlist would. What
/// the module has declared by then is entered before. Returns 0 or a negative errno, with the
/// reason in `why`.
int carry_out(const hal_host* host, const char* const* words, std::size_t count, char* why,
              std::size_t capacity) {
    Construction& c = construction_of(host);
    return guarded(c, -ENOMEM, [&] {
        put_text("unknown command", why, capacity);
        const Row* const row =
            std::find_if(std::begin(module_commands), std::end(module_commands),
                         [&](const Row& one) { return count > 0 && one.name == words[0]; });
        if (!c.request.on || row == std::end(module_commands)) return -EINVAL;
        if (locks_of(c) & row->lock) {
            put_text("it is locked (lock, hal_set_lock)", why, capacity);
            return -EPERM;
        }
        if (!row->elaborate) {
            const char* const number = count > 1 ? words[1] : "0";
            return take_later(c, row->name, number) ? 0 : -EINVAL;
        }
        if (!enter_declared(c)) {
            c.said_why = true;
            put_text("what the module has declared is rejected", why, capacity);
            return -EINVAL;
        }
        std::vector<Token> arguments;
        for (std::size_t i = 1; i < count; ++i) {
            arguments.push_back({words[i], c.request.at});
        }
        const Elaboration& outer = *c.request.on;
        Diagnostics found;
        Elaboration on{outer.model,
                       outer.edit,
                       outer.plugins,
                       outer.sources,
                       found,
                       outer.auto_orders,
                       {row->name, ""},
                       outer.check_only,
                       outer.transaction,
                       outer.faults,
                       outer.hardware_allowed};
        {
            struct Restore {  // also when memory runs out on the way
                Edit& edit;
                Diagnostics* before;
                ~Restore() { edit.diagnostics = before; }
            } restore{outer.edit, c.diagnostics};
            outer.edit.diagnostics = &found;
            row->elaborate(on, arguments);
        }
        if (!found.failed()) {
            c.diagnostics->take(found);
            return 0;
        }
        const auto error =
            std::find_if(found.all().begin(), found.all().end(),
                         [](const Diagnostic& one) { return one.severity == Severity::error; });
        put_text(error->message, why, capacity);
        return -EINVAL;
    });
}

bool read_value(const hal_host* host, int kind, const char* name, hal_type* type, hal_value* value,
                bool* linked) {
    Construction& c = construction_of(host);
    return guarded(c, false, [&] {
        if (!c.request.on || !enter_declared(c)) return false;
        LiveValues& values = c.request.on->transaction->machine().values();
        if (kind == HAL_MODULE_SIGNAL) {
            const Signal* const signal = c.model.find_signal(name);
            if (!signal) return false;
            *type = signal->type;
            *linked = signal->writer || signal->ios != 0;
            *value = values.read_signals({signal})[0];
            return true;
        }
        const Pin* const pin = c.model.find_pin(name);
        if (!pin || (pin->dir == HAL_DIR_PARAM) != (kind == HAL_MODULE_PARAMETER)) return false;
        *type = pin->type;
        *linked = pin->signal != nullptr;
        *value = values.read_pins({pin})[0];
        return true;
    });
}

unsigned give_locks(const hal_host* host) {
    return construction_of(host).request.on ? locks_of(construction_of(host)) : 0;
}

std::int64_t give_base_period(const hal_host* host) {
    const Construction& c = construction_of(host);
    std::int64_t shortest =
        c.model.threads.empty() ? 0 : c.model.threads.front()->options.period_ns;
    for (const auto& thread : c.threads) {
        shortest = shortest == 0 ? thread.period_ns : std::min(shortest, thread.period_ns);
    }
    return shortest;
}

bool use_own_threads(const hal_host* host) {
    Construction& c = construction_of(host);
    if (!c.request.on || c.request.on->transaction->machine().options().virtual_clock) return false;
    return c.instance.own_threads = true;
}

void* give_machine(const hal_host* host) {
    return construction_of(host).request.on
               ? &construction_of(host).request.on->transaction->machine()
               : nullptr;
}

// The transaction that unloads the module is about to end, and its edits are in the model.
bool do_afterwards(void* machine, const char* command, const char* name,
                   void (*failed)(const char*)) {
    RunningModel& running = *static_cast<RunningModel*>(machine);
    try {
        const bool signal = std::string_view(command) == "delsig";
        if (signal ? !running.model().find_signal(name) : !running.model().find_pin(name)) {
            return false;
        }
        running.when_committed([&running, signal, failed, name = std::string(name)] {
            // the user may have removed it meanwhile: then it is as wanted
            if (signal ? !running.model().find_signal(name) : !running.model().find_pin(name)) {
                return;
            }
            Diagnostics problems;
            Transaction transaction = running.begin();
            const EditForm form = signal ? EditForm{{"delsig", "SIGNAL"}, edits::delsig}
                                         : EditForm{{"unlinkp", "PIN"}, edits::unlinkp};
            transaction.apply(form, {{signal ? "delsig" : "unlinkp", {}}, {{name, {}}}, {}},
                              problems);
            if (!transaction.commit(problems)) {
                failed(render(problems, running.sources).c_str());
            }
        });
        return true;
    } catch (const std::bad_alloc&) {
        return false;
    }
}

}  // namespace

const hal_module_calls module_calls_extension{sizeof module_calls_extension,
                                              carry_out,
                                              read_value,
                                              give_locks,
                                              give_base_period,
                                              use_own_threads,
                                              give_machine,
                                              do_afterwards,
                                              journaled_reading};

}  // namespace hal
