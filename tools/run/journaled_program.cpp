// SPDX-License-Identifier: MIT
#include "run/journaled_program.hpp"

#include <fmt/core.h>
#include <unistd.h>

#include "cli/output.hpp"
#include "journal/file_hash.hpp"
#include "paths.hpp"
#include "run/replay_note.hpp"
#include "run/sim_summary.hpp"
#include "text/quoting.hpp"

namespace hal::tools {

int JournaledProgram::check() const {
    std::string problems;
    const std::string own = fmt::format("{} {}", paths::version, paths::commit);
    if (const std::string hash = file_hash("/proc/self/exe"); hash != file_.program()) {
        problems += fmt::format(
            "  it was written by another program: {} (hash {}), this is "
            "{} (hash {})\n",
            file_.version(), file_.program(), own, hash);
    }
    for (const ExecutionEntry& entry : file_.entries()) {
        for (const JournaledFile& plugin : entry.files) {
            problems += changed(plugin);
        }
        if (entry.kind == ExecutionEntry::Kind::opened) {
            problems += outside(entry);
        }
    }
    return reject(problems);
}

int JournaledProgram::check_devices() const {
    std::string problems;
    for (const ExecutionEntry& entry : file_.entries()) {
        if (entry.kind == ExecutionEntry::Kind::opened) {
            problems += outside(entry);
        }
    }
    return reject(problems);
}

int JournaledProgram::reject(const std::string& problems) const {
    if (problems.empty()) return 0;
    const std::string text =
        fmt::format("'{}' may not be executed exactly:\n{}", options_.words[0], problems);
    if (options_.anyway) {
        note(options_, text.substr(0, text.size() - 1));
        return 0;
    }
    return fail(options_, text +
                              "  to execute it all the same, type: hal replay --exact "
                              "--anyway");
}

void JournaledProgram::name_readers() const {
    for (const ExecutionEntry& entry : file_.entries()) {
        if (entry.kind != ExecutionEntry::Kind::opened || resources(entry).empty()) continue;
        note(options_, fmt::format("'{}' ({}) has {}, whose data are not in the journal: "
                                   "values that depend on them may differ",
                                   entry.instance, entry.component, resources(entry)));
    }
}

std::string JournaledProgram::changed(const JournaledFile& plugin) {
    const std::string now = file_hash(plugin.path);
    if (now == plugin.hash) return "";
    if (now.empty()) {
        return fmt::format("  the plugin of '{}' is missing: {}\n", plugin.component, plugin.path);
    }
    return fmt::format("  the plugin of '{}' was changed: {} has hash {}, it had {}\n",
                       plugin.component, plugin.path, now, plugin.hash);
}

/// Devices and sockets would be opened again, and a machine would move.
std::string JournaledProgram::outside(const ExecutionEntry& entry) {
    if (entry.resources.empty()) return "";
    return fmt::format("  '{}' ({}) opens again: {}\n", entry.instance, entry.component,
                       resources(entry));
}

std::string JournaledProgram::resources(const ExecutionEntry& entry) {
    std::string text;
    for (const std::string& resource : entry.resources) {
        text += (text.empty() ? "" : ", ") + resource;
    }
    if (entry.threads > 0) {
        text += (text.empty() ? "" : ", ") + counted(entry.threads, "thread");
    }
    if (entry.helpers > 0) {
        text += (text.empty() ? "" : ", ") + counted(entry.helpers, "helper thread");
    }
    if (entry.streams > 0) {
        text += (text.empty() ? "" : ", ") + counted(entry.streams, "stream");
    }
    return text;
}

void JournaledProgram::name_uncopied() const {
    for (const ExecutionEntry& entry : file_.entries()) {
        if (entry.kind != ExecutionEntry::Kind::opened) continue;
        if (entry.resources.empty() && entry.threads == 0) continue;
        note(options_, fmt::format("'{}' ({}) has {}, which cannot be copied: no keyframes once it "
                                   "is loaded, so that each step back executes the journal from "
                                   "its begin",
                                   entry.instance, entry.component, resources(entry)));
    }
}

}  // namespace hal::tools
