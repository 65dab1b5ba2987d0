// SPDX-License-Identifier: MIT
#include "run/what_if.hpp"

#include <fmt/core.h>
#include <set>
#include <sstream>

#include "base/types.hpp"

namespace hal::tools {
namespace {

/// Returns where the value is, in all threads that read it; nowhere sets `problem`.
std::vector<hal_value*> slots_of(Session& session, bool of_signal, const std::string& name,
                                 hal_type& type, std::string& problem) {
    const Model& model = session.model();
    if (of_signal) {
        const Signal* const signal = model.find_signal(name);
        if (!signal) {
            problem = fmt::format("the machine has no signal '{}' in this cycle", name);
        } else if (signal->type == HAL_TYPE_PORT) {
            problem = fmt::format("'{}' is a port", name);
        } else if (signal->writer) {
            problem = fmt::format("signal '{}' is written by '{}'", name, signal->writer->name);
        } else {
            type = signal->type;
            std::vector<hal_value*> slots = {signal->slot};
            for (const auto& [thread, slot] : signal->copies) {
                slots.push_back(slot);
            }
            return slots;
        }
        return {};
    }
    const Pin* const pin = model.find_pin(name);
    if (!pin) {
        problem = fmt::format("the machine has no pin or parameter '{}' in this cycle", name);
    } else if (pin->signal) {
        problem = fmt::format("'{}' is linked to signal '{}'", name, pin->signal->name);
    } else if (pin->dir == HAL_DIR_OUT || pin->read_only()) {
        problem = fmt::format("'{}' is written by its component", name);
    } else {
        type = pin->type;
        return {pin->memory->slot};
    }
    return {};
}

}  // namespace

std::string WhatIf::parse(const ReplayOptions& options) {
    const bool has_change = !options.edits.empty() || !options.netlist.empty();
    if (!has_change && options.at.empty()) return "";
    if (!has_change) return "--at needs --edit 'setp NAME VALUE' or --netlist FILE";
    if (options.at.empty()) {
        return fmt::format("{} needs --at CYCLE|TIME",
                           options.edits.empty() ? "--netlist" : "--edit");
    }
    if (!options.netlist.empty()) {
        const std::string problem = netlist_.read(options.netlist, options.ini);
        if (!problem.empty()) return "--netlist: " + problem;
    }
    if (!at_.parse(options.at)) {
        return fmt::format("--at: invalid cycle or time '{}'; write 12000, 3.5s or 250ms",
                           options.at);
    }
    for (const std::string& text : options.edits) {
        std::istringstream in(text);
        std::string command;
        std::string rest;
        Assignment edit;
        in >> command >> edit.name >> edit.value;
        const bool is_complete = !edit.value.empty() && !(in >> rest);
        if (!is_complete || (command != "setp" && command != "sets")) {
            return fmt::format(
                "--edit: invalid edit '{}'; write 'setp NAME VALUE' or 'sets SIGNAL "
                "VALUE'",
                text);
        }
        edit.of_signal = command == "sets";
        edits_.push_back(edit);
    }
    return "";
}

std::string WhatIf::apply(Session& session, ReExecution& execution, const JournalFile& file) {
    done_ = execution.newest();
    if (!netlist_.empty()) {
        const std::size_t entries = execution.progress().entries;
        const std::string problem =
            execution.edit_at_rest([&] { return netlist_.apply(session, file, entries); });
        if (!problem.empty()) return problem;
    }
    return set_values(session);
}

std::string WhatIf::set_values(Session& session) const {
    for (const Assignment& edit : edits_) {
        hal_type type = HAL_TYPE_BIT;
        std::string problem;
        const auto slots = slots_of(session, edit.of_signal, edit.name, type, problem);
        if (slots.empty()) return problem;
        const Parsed value = parse_value(type, edit.value);
        if (!value.problem.empty()) return fmt::format("'{}': {}", edit.name, value.problem);
        for (hal_value* const slot : slots) {
            slot->raw = value.value.raw;
        }
    }
    return "";
}

std::string outside_inputs(const JournalFile& file) {
    std::set<std::string> names;
    for (const ExecutionEntry& entry : file.entries()) {
        const bool reads_outside =
            entry.links + entry.threads + entry.streams > 0 || !entry.resources.empty();
        if (entry.kind == ExecutionEntry::Kind::opened && reads_outside) {
            names.insert(fmt::format("those of '{}' ({})", entry.instance, entry.component));
        } else if (entry.kind == ExecutionEntry::Kind::written) {
            names.insert("values that programs wrote");
        }
    }
    std::string text;
    for (const std::string& name : names) {
        text += (text.empty() ? "" : ", ") + name;
    }
    return text;
}

}  // namespace hal::tools
