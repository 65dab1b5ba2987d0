// SPDX-License-Identifier: MIT
#include "scope/input.hpp"

#include <algorithm>
#include <fmt/core.h>
#include <nlohmann/json.hpp>

namespace hal::tools {

bool Input::connect(const std::string& instance, std::string& problem) {
    client_ = Client::connect(instance_wanted(instance), problem);
    return client_ != nullptr;
}

std::vector<std::string> Input::expand(const std::vector<std::string>& words,
                                       std::string& problem) {
    std::vector<std::string> names;
    for (const std::string& word : words) {
        std::vector<std::string> found;
        const bool pattern = word.find_first_of("*?[") != word.npos;
        if (pattern) {
            for (const char* kind : {"pin", "param", "sig"}) {
                for (const nlohmann::json& name :
                     client_->request({{"list", kind}, {"patterns", {word}}})
                         .value("names", nlohmann::json::array())) {
                    if (name.is_string()) {
                        found.push_back(name.get<std::string>());
                    }
                }
            }
        }
        if (found.empty() && pattern) {
            problem = fmt::format(
                "no pin, parameter or signal matches '{}'; to list them: hal shell show pin", word);
        }
        if (found.empty()) {
            found.push_back(word);
        }
        names.insert(names.end(), found.begin(), found.end());
    }
    return names;
}

bool Input::attach(const std::vector<std::string>& names, int every, std::string& problem) {
    std::vector<std::string> once;
    for (const std::string& name : names) {
        if (std::find(once.begin(), once.end(), name) == once.end()) {
            once.push_back(name);
        }
    }
    ProbeClient::Options how;
    how.every = static_cast<std::uint32_t>(every);
    probe_ = ProbeClient::attach(*client_, once, how, problem);
    if (!probe_) return false;
    for (const ProbeColumn& column : probe_->columns()) {
        Channel::Wide wide = column.type == HAL_TYPE_U64 ? Channel::Wide::u64 : Channel::Wide::no;
        if (column.type == HAL_TYPE_S64) {
            wide = Channel::Wide::s64;
        }
        channels_.push_back({column.name, column.unit, column.type != HAL_TYPE_FLOAT,
                             column.type == HAL_TYPE_BIT, wide});
    }
    return true;
}

bool Input::take(int timeout_ms, const Take& take, const std::function<void(const Batch&)>& begin,
                 const std::function<void(const Batch&)>& done) {
    while (true) {
        const ProbeClient::Got got = probe_->next(batch_, timeout_ms);
        timeout_ms = 0;
        if (got == ProbeClient::Got::disconnected) return false;
        if (got == ProbeClient::Got::nothing) return true;
        if (got != ProbeClient::Got::batch) continue;
        const Batch about{batch_.until_ns,
                          std::any_of(batch_.parts.begin(), batch_.parts.end(),
                                      [](const ProbeBatch::Part& part) { return part.lost > 0; })};
        if (begin) {
            begin(about);
        }
        batch_.in_time_order([&](const ProbeBatch::Part& part, std::size_t row) {
            // A batch that was filled before an edit may have groups that are gone.
            const auto& groups = probe_->groups();
            if (part.group >= groups.size() || groups[part.group].columns.size() != part.columns) {
                return;
            }
            for (std::size_t i = 0; i < part.columns; ++i) {
                const std::size_t channel = groups[part.group].columns[i];
                take(channel, {batch_.time_ns(part, row),
                               batch_.real(part, row, i, probe_->columns()[channel].type),
                               batch_.raw(part, row, i)});
            }
            ++rows_;
        });
        if (done) {
            done(about);
        }
    }
}

std::string Input::end_reason() const {
    const std::string& why = client_->closed_because();
    return why.empty()
               ? fmt::format("instance '{}' has ended", client_->instance())
               : fmt::format("instance '{}' closed the connection: {}", client_->instance(), why);
}

}  // namespace hal::tools
