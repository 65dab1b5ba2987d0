// SPDX-License-Identifier: MIT
#include "control/probe_client.hpp"

#include <bit>

#include <nlohmann/json.hpp>

#include "base/types.hpp"

namespace hal {

using Json = nlohmann::json;

double ProbeBatch::real(const Part& part, std::size_t row, std::size_t column,
                        hal_type type) const {
    const std::uint64_t value = raw(part, row, column);
    if (type == HAL_TYPE_FLOAT) return std::bit_cast<double>(value);
    if (type == HAL_TYPE_S32 || type == HAL_TYPE_S64) {
        return static_cast<double>(static_cast<std::int64_t>(value));
    }
    return static_cast<double>(value);
}

std::unique_ptr<ProbeClient> ProbeClient::attach(Client& client,
                                                 const std::vector<std::string>& names,
                                                 const Options& options, std::string& problem) {
    std::unique_ptr<ProbeClient> probe(new ProbeClient(client));
    const Json reply = client.request({{"probe", names},
                                       {"every", options.every},
                                       {"batch_ms", options.batch_ms},
                                       {"buffer_ms", options.buffer_ms}});
    if (!reply.value("ok", false)) {
        problem = reply.value("error", "no answer");
        return nullptr;
    }
    probe->number_ = reply.value("probe", std::uint64_t{0});
    probe->layout_.number = reply.value("layout", std::uint64_t{0});
    probe->unix_offset_ns_ =
        reply.value("unix_ns", std::int64_t{0}) - reply.value("time_ns", std::int64_t{0});
    for (const Json& column : reply.value("columns", Json::array())) {
        probe->columns_.push_back({column.value("name", ""),
                                   type_named(column.value("type", "")).value_or(HAL_TYPE_BIT),
                                   column.value("unit", "")});
    }
    if (!probe->read_groups(reply)) {
        problem = "the instance describes the probe in a way that this version does not understand";
        return nullptr;
    }
    if (options.journal) {
        client.request({{"journal", true}});
    }
    return probe;
}

ProbeClient::~ProbeClient() {
    if (number_ != 0 && client_.connected()) {
        client_.request({{"unprobe", number_}});
    }
}

bool ProbeClient::read_groups(const Json& from) {
    std::vector<ProbeGroup> groups;
    for (const Json& group : from.value("groups", Json::array())) {
        if (!group.is_object()) return false;
        ProbeGroup& one = groups.emplace_back();
        one.thread = group.value("thread", "");
        one.period_ns = group.value("period_ns", std::int64_t{0});
        for (const Json& column : group.value("columns", Json::array())) {
            if (!column.is_number_unsigned() || column.get<std::size_t>() >= columns_.size()) {
                return false;
            }
            one.columns.push_back(column.get<std::size_t>());
        }
    }
    layout_.groups = std::move(groups);
    return true;
}

bool ProbeClient::read_batch(const Json& event, std::string&& payload, ProbeBatch& batch) {
    batch.layout = event.value("layout", std::uint64_t{0});
    batch.until_ns = event.value("until_ns", std::int64_t{0});
    batch.parts.clear();
    batch.bytes = std::move(payload);
    std::size_t offset = 0;
    for (const Json& part : event.value("parts", Json::array())) {
        ProbeBatch::Part& one = batch.parts.emplace_back();
        one.group = part.value("group", std::size_t{0});
        one.rows = part.value("rows", std::size_t{0});
        one.lost = part.value("lost", std::uint64_t{0});
        one.offset = offset;
        if (batch.layout != layout_.number || one.group >= layout_.groups.size() ||
            one.rows > batch.bytes.size()) {
            return false;
        }
        one.columns = layout_.groups[one.group].columns.size();
        offset += one.rows * (one.columns + 2) * 8;
        lost_ += one.lost;
    }
    return offset == batch.bytes.size();
}

ProbeClient::Got ProbeClient::next(ProbeBatch& batch, int timeout_ms) {
    Json event;
    std::string payload;
    while (client_.next_event(event, payload, timeout_ms)) {
        const std::string kind = event.value("event", "");
        if (kind == "journal") {
            entry_ = {event.value("time_ns", std::int64_t{0}), event.value("kind", ""),
                      event.value("text", "")};
            return Got::journal;
        }
        if (event.value("probe", std::uint64_t{0}) != number_) continue;
        if (kind == "samples") {
            return read_batch(event, std::move(payload), batch) ? Got::batch : Got::disconnected;
        }
        if (kind != "layout") continue;
        layout_.number = event.value("layout", std::uint64_t{0});
        return read_groups(event) ? Got::layout : Got::disconnected;
    }
    return client_.connected() ? Got::nothing : Got::disconnected;
}

}  // namespace hal
