// SPDX-License-Identifier: MIT
#include "run/determinism_check.hpp"

#include <algorithm>
#include <cstdlib>
#include <fcntl.h>
#include <fmt/core.h>
#include <map>
#include <set>
#include <string>
#include <unistd.h>
#include <unordered_set>
#include <vector>

#include "cli/no_output.hpp"
#include "cli/other_program.hpp"
#include "cli/output.hpp"
#include "comp/toolchain.hpp"
#include "execute/violation.hpp"
#include "link/address.hpp"
#include "recording/mcap/recording.hpp"
#include "run/offline.hpp"
#include "text/numbers.hpp"
#include "text/quoting.hpp"

namespace hal::tools {
namespace {

/// While it lives, standard output is discarded: what the netlist prints.
class Silence {
public:
    Silence() : kept_(::dup(STDOUT_FILENO)) {
        const int null = ::open("/dev/null", O_WRONLY | O_CLOEXEC);
        ::dup2(null, STDOUT_FILENO);
        ::close(null);
    }
    ~Silence() {
        ::dup2(kept_, STDOUT_FILENO);
        ::close(kept_);
    }
    Silence(const Silence&) = delete;

private:
    const int kept_;
};

/// Finds the instances whose outputs differ although none of those that they read does.
class Comparison {
public:
    Comparison(const Model& model, const mcap::Recording& one, const mcap::Recording& other)
        : model_(model), one_(one), other_(other) {}

    /// Returns lines about what differs, and about functions that a re-execution cannot repeat.
    std::string compare() {
        name_violations();
        for (const Row& row : rows()) {
            compare(row);
        }
        return text_;
    }
    std::uint64_t values() const { return values_; }
    std::size_t sources() const { return sources_; }
    std::size_t followers() const { return tainted_.size() - (sources_ - violations_.size()); }
    bool equal() const { return equal_; }

private:
    struct Row {
        std::int64_t time_ns;
        std::size_t table;
        std::size_t index;
    };

    std::vector<Row> rows() {
        std::vector<Row> rows;
        for (std::size_t i = 0; i < std::min(one_.tables.size(), other_.tables.size()); ++i) {
            const mcap::Table& table = one_.tables[i];
            const mcap::Table& other = other_.tables[i];
            const bool same_shape =
                table.rows() == other.rows() && table.columns.size() == other.columns.size();
            if (!same_shape) {
                equal_ = false;
                text_ += fmt::format("thread '{}' has {} in one run and {} in the other\n",
                                     table.thread, counted(table.rows(), "cycle"), other.rows());
            }
            if (table.columns.size() != other.columns.size()) continue;
            for (std::size_t k = 0; k < std::min(table.rows(), other.rows()); ++k) {
                rows.push_back({table.times_ns[k] - table.times_ns[0], i, k});
            }
        }
        std::ranges::stable_sort(rows, {}, &Row::time_ns);
        return rows;
    }

    /// What a function reads from a socket, or leaves to the functions after it, differs only when
    /// another program or another order of threads takes part.
    void name_violations() {
        for (const mcap::Event& event : one_.events) {
            if (event.kind != "fault") continue;
            for (const char* const reason : {violation::read_outside, violation::float_modes}) {
                const std::size_t at = event.text.find(reason);
                if (at == std::string::npos) continue;
                // "servo: function 'f' (c) REASON at cycle 7; what to do", or "servo: a function …"
                const std::size_t who = event.text.find(": ") + 2;
                if (!violations_.insert(event.text.substr(who, at - who)).second) continue;
                ++sources_;
                equal_ = false;
                text_ += event.text.substr(who, event.text.find(';') - who) +
                         ": it is not deterministic\n";
            }
        }
    }

    void compare(const Row& row) {
        const mcap::Table& table = one_.tables[row.table];
        const mcap::Table& other = other_.tables[row.table];
        std::map<std::string, std::size_t> differing;
        for (std::size_t i = 0; i < table.columns.size(); ++i) {
            ++values_;
            if (table.word(row.index, i) != other.word(row.index, i)) {
                differing.emplace(table.columns[i].name, i);
            }
        }
        if (differing.empty()) return;
        equal_ = false;
        for (const auto& thread : model_.threads) {
            if (thread->name != table.thread) continue;
            for (const LoadedFunction* const function : thread->functions) {
                for (const Instance* const instance : function->instances) {
                    examine(row, *function, *instance, differing);
                }
            }
        }
    }

    /// Functions are examined in the order in which they run.
    void examine(const Row& row, const LoadedFunction& function, const Instance& instance,
                 const std::map<std::string, std::size_t>& differing) {
        if (tainted_.contains(&instance)) return;
        const auto first = std::ranges::find_if(instance.pins, [&](const auto& pin) {
            return pin->dir != HAL_DIR_IN && differing.contains(pin->name);
        });
        if (first == instance.pins.end()) return;
        const bool follows = std::ranges::any_of(instance.pins, [&](const auto& pin) {
            return pin->signal && pin->signal->writer &&
                   tainted_.contains(pin->signal->writer->instance);
        });
        tainted_.insert(&instance);
        if (follows) return;
        ++sources_;
        const std::size_t column = differing.at((*first)->name);
        const auto value = [&](const mcap::Recording& run) {
            return format_exact((*first)->type,
                                hal_value{.raw = run.tables[row.table].word(row.index, column)});
        };
        text_ += fmt::format(
            "'{}' ({}) is not deterministic: function '{}' sets '{}' to {} and to {} in cycle {} "
            "of thread '{}', from the same inputs\n",
            instance.name, instance.component->name, function.name, (*first)->name, value(one_),
            value(other_), row.index, one_.tables[row.table].thread);
    }

    const Model& model_;
    const mcap::Recording& one_;
    const mcap::Recording& other_;
    std::set<std::string> violations_;  // functions
    std::unordered_set<const Instance*> tainted_;  // their outputs have differed
    std::size_t sources_ = 0;
    std::uint64_t values_ = 0;
    bool equal_ = true;
    std::string text_;
};

/// Records all values of a simulation. `fill`: what fresh memory contains; also the seed of `rand`.
int simulate(const CheckOptions& options, const std::string& file, const char* fill) {
    std::vector<std::string> words = {"sim"};
    words.insert(words.end(), options.words.begin(), options.words.end());
    words.insert(words.end(), {"-q", "--record", file, "--values", "*", "--for",
                               fmt::format("{}ns", options.for_ns)});
    if (!options.ini.empty()) {
        words.insert(words.end(), {"-i", options.ini});
    }
    ::setenv("MALLOC_PERTURB_", fill, 1);
    ::setenv(link::links_inside, "1", 1);
    ::setenv(determinism_seed, fill, 1);
    const Silence silence;
    const int status = run_tool(std::move(words));
    ::unsetenv(determinism_seed);
    ::unsetenv(link::links_inside);
    ::unsetenv("MALLOC_PERTURB_");
    return status;
}

}  // namespace

int run_determinism_check(const CheckOptions& options) {
    if (const int status = run_check(options); status != 0) return status;
    const TemporaryFolder folder;
    if (!folder.problem().empty()) return fail(options, folder.problem());
    const char* const fills[] = {"90", "165"};
    mcap::Recording runs[2];
    for (std::size_t i = 0; i < 2; ++i) {
        const std::string file = folder.file(fmt::format("{}.mcap", i));
        std::string problem;
        if (simulate(options, file, fills[i]) != 0) {
            return fail(options, "the netlists cannot be simulated, see above");
        }
        if (!mcap::load(file, runs[i], problem)) {
            return fail(options, fmt::format("cannot compare the simulations: {}", problem));
        }
    }
    Session session(offline());
    Shell shell(session, {});
    NoOutput none;
    load_offline(shell, options, none);
    const auto lock = session.lock();
    Comparison comparison(session.model(), runs[0], runs[1]);
    std::string text = comparison.compare();
    if (comparison.equal()) {
        text +=
            fmt::format("two simulations are equal in {}\n", counted(comparison.values(), "value"));
    } else {
        text +=
            fmt::format("two simulations differ: {} not deterministic, {} because of them\n",
                        counted(comparison.sources(), "instance is", "instances are"),
                        counted(comparison.followers(), "instance differs", "instances differ"));
    }
    if (!print(text)) return 1;
    return exit_code(comparison.equal());
}

}  // namespace hal::tools
