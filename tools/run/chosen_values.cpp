// SPDX-License-Identifier: MIT
#include "run/chosen_values.hpp"

#include <algorithm>
#include <fmt/core.h>
#include <fnmatch.h>
#include <set>
#include <utility>

#include "text/suggest.hpp"

namespace hal::tools {

std::vector<std::string> chosen_values(const Model& model,
                                       const std::vector<std::string>& patterns) {
    std::set<std::string> all;
    const auto wanted = [&](const std::string& name, bool otherwise) {
        if (patterns.empty()) return otherwise;
        return std::any_of(patterns.begin(), patterns.end(), [&](const std::string& one) {
            return one == name || ::fnmatch(one.c_str(), name.c_str(), 0) == 0;
        });
    };
    for (const auto& signal : model.signals) {
        if (signal->type != HAL_TYPE_PORT && wanted(signal->name, true)) {
            all.insert(signal->name);
        }
    }
    for (const Pin* const pin : model.sorted_pins()) {
        if (pin->type != HAL_TYPE_PORT &&
            wanted(pin->name, !pin->signal && !pin->of_thread && !pin->function)) {
            all.insert(pin->name);
        }
    }
    return {all.begin(), all.end()};
}

std::vector<std::string> named_values(const Model& model,
                                      const std::vector<std::string>& patterns) {
    std::vector<std::string> names;
    for (const std::string& one : patterns) {
        if (model.find_pin(one) || model.find_signal(one)) {
            names.push_back(one);
            continue;
        }
        for (std::string& match : chosen_values(model, {one})) {
            names.push_back(std::move(match));
        }
    }
    return names;
}

std::string unknown_value(const Model& model, const std::vector<std::string>& patterns) {
    for (const std::string& one : patterns) {
        if (model.find_pin(one) || model.find_signal(one) || !chosen_values(model, {one}).empty()) {
            continue;
        }
        std::vector<std::string> names;
        for (const auto& [own, pin] : model.pin) {
            names.emplace_back(own);
        }
        for (const auto& [own, signal] : model.signal) {
            names.emplace_back(own);
        }
        std::sort(names.begin(), names.end());
        const std::string hint = did_you_mean(one, names);
        return fmt::format("no pin, parameter or signal matches '{}'{}", one,
                           hint.empty() ? "" : "; " + hint);
    }
    return "";
}

bool add_rows(Sink& sink, const ProbeRows& rows, ProbeLayout& layout, std::uint64_t& count) {
    if (rows.layout) {
        layout = *rows.layout;
        if (!sink.layout(layout.groups)) return false;
    }
    ProbeBatch batch;
    std::size_t offset = 0;
    for (const auto& part : rows.parts) {
        const std::size_t columns = layout.groups[part.group].columns.size();
        batch.parts.push_back({part.group, part.rows, columns, part.lost, offset});
        offset += part.rows * (columns + 2) * 8;
    }
    batch.bytes = rows.bytes;
    return add_batch(sink, batch, 0, INT64_MAX, count);
}

}  // namespace hal::tools
