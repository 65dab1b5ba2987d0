// SPDX-License-Identifier: MIT
#include "model/check/check.hpp"
#include "text/quoting.hpp"
#include "text/suggest.hpp"

namespace hal {

namespace {

std::string one_or_all(std::size_t count, const char* one, const char* all) {
    return count == 1 ? one : all;
}

}  // namespace

void check_lost_writers(const Model& model, Diagnostics& diagnostics) {
    std::vector<std::string> names;
    const Signal* first = nullptr;
    for (const auto& signal : model.signals) {
        const bool is_read = signal->readers != 0 && signal->ios == 0;
        if (!signal->had_writer || signal->writer || !is_read) continue;
        first = first ? first : signal.get();
        names.push_back(signal->name);
    }
    if (names.empty()) return;
    const std::size_t count = names.size();
    diagnostics.warning(
        "lost-writer", first->made,
        (count == 1 ? "signal " + quoted(first->name) : "signals " + listed(names)) + ' ' +
            one_or_all(count, "has no writer any more: its readers keep the value it has",
                       "have no writer any more: their readers keep the values they have"),
        "",
        "for another writer, type: net " + first->name + " PIN; for another value: sets " +
            first->name + " VALUE");
}

}  // namespace hal
