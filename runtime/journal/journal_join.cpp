// SPDX-License-Identifier: MIT
#include "journal/journal_join.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <fmt/core.h>
#include <map>
#include <unistd.h>
#include <utility>

#include "journal/journal_format.hpp"
#include "recording/mcap/reader.hpp"
#include "recording/mcap/writer.hpp"

namespace hal {
namespace {

class JoinedJournal {
public:
    explicit JoinedJournal(const std::string& to)
        : writer_(to), is_open_(writer_.problem().empty() && writer_.error() == 0) {}

    /// Whether there is a file of this object: it is not another recorder's.
    bool is_open() const { return is_open_; }

    /// Returns why the file cannot be added, or "".
    std::string add(const std::string& path) {
        mcap::Reader reader;
        std::string problem;
        auto source = mcap::open_file(path, problem);
        if (source && !reader.open(std::move(source))) {
            problem = reader.problem();
        }
        if (!problem.empty()) return fmt::format("cannot read '{}': {}", path, problem);
        if (std::exchange(is_first_, false)) {
            writer_.metadata(journal_format::head, reader.metadata(journal_format::head));
        }
        std::map<std::uint16_t, std::uint16_t> channels;
        for (const auto& [id, channel] : reader.channels()) {
            channels[id] = channel_of(reader, channel);
        }
        reader.each([&](const mcap::Message& message) {
            const auto channel = channels.find(message.channel);
            if (channel == channels.end()) return true;
            return writer_.message(channel->second, message.sequence, message.log_time,
                                   message.payload);
        });
        return reason();
    }
    std::string close() {
        writer_.close();
        return reason();
    }

private:
    std::uint16_t channel_of(const mcap::Reader& reader, const mcap::Channel& channel) {
        const auto [found, is_new] = channels_.try_emplace(channel.topic, std::uint16_t{0});
        if (!is_new) return found->second;
        const auto schema = reader.schemas().find(channel.schema);
        const std::uint16_t number =
            schema == reader.schemas().end()
                ? std::uint16_t{0}
                : writer_.add_schema(schema->second.name, schema->second.encoding,
                                     schema->second.data);
        return found->second =
                   writer_.add_channel(number, channel.topic, channel.encoding, channel.metadata);
    }
    std::string reason() const {
        if (!writer_.problem().empty()) return writer_.problem();
        return writer_.error() == 0 ? "" : std::strerror(writer_.error());
    }

    mcap::Writer writer_;
    const bool is_open_;
    bool is_first_ = true;
    std::map<std::string, std::uint16_t> channels_;  // by topic
};

bool begins_with_state(const std::string& path) {
    mcap::Reader reader;
    std::string ignored;
    auto source = mcap::open_file(path, ignored);
    if (!source || !reader.open(std::move(source))) return false;
    return std::ranges::any_of(reader.channels(), [](const auto& one) {
        return one.second.topic == journal_format::state_topic;
    });
}

}  // namespace

std::string join_journals(const std::vector<std::string>& paths, const std::string& to) {
    std::size_t first = 0;
    for (std::size_t i = 0; i < paths.size(); ++i) {
        first = begins_with_state(paths[i]) ? i : first;
    }
    JoinedJournal joined(to);
    std::string problem;
    for (std::size_t i = first; i < paths.size() && problem.empty(); ++i) {
        problem = joined.add(paths[i]);
    }
    const std::string end_problem = joined.close();
    if (problem.empty()) {
        problem = end_problem;
    }
    if (!problem.empty() && joined.is_open()) {
        ::unlink(to.c_str());
    }
    return problem;
}

}  // namespace hal
