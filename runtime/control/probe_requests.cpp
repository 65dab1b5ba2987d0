// SPDX-License-Identifier: MIT
#include "control/probe_requests.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "control/request.hpp"

namespace hal {
namespace {

using Json = nlohmann::json;

}  // namespace

void ProbeRequests::probe(const Json& body, std::string& reply) {
    const auto number = [&](const char* key, std::int64_t min, std::int64_t max,
                            std::int64_t otherwise) {
        const Json& given = member(body, key);
        return given.is_null() ? otherwise : whole(given, key, min, max);
    };
    ProbeRequest request{names_in(body["probe"], "probe")};
    request.every = static_cast<std::uint32_t>(number("every", 1, 1'000'000, 1));
    request.buffer_ns = number("buffer_ms", 10, 60'000, 2000) * 1'000'000;
    request.advice = "sample fewer values, a shorter buffer_ms, or a larger every";
    const std::int64_t batch_ns = number("batch_ms", 1, 1000, 20) * 1'000'000;
    if (std::string problem = probes_.add(request, batch_ns, reply); !problem.empty()) {
        throw RequestError{std::move(problem)};
    }
}

void ProbeRequests::unprobe(const Json& body, std::string& reply) {
    const auto id = static_cast<std::uint64_t>(
        whole(body["unprobe"], "unprobe", 1, std::numeric_limits<std::int64_t>::max()));
    const auto lost = probes_.remove(id);
    if (!lost) {
        throw RequestError{"unknown probe " + std::to_string(id)};
    }
    reply += ",\"lost\":" + std::to_string(*lost);
}

void ProbeRequests::journal(const Json& body) {
    const Json& on = body["journal"];
    if (!on.is_boolean()) {
        throw RequestError{"journal must be true or false"};
    }
    probes_.journal(on.get<bool>());
}

void ProbeRequests::trace(const Json& body, std::string& reply) {
    const Json& on = body["trace"];
    if (!on.is_boolean()) {
        throw RequestError{"trace must be true or false"};
    }
    if (std::string problem = traces_.set(on.get<bool>(), reply); !problem.empty()) {
        throw RequestError{std::move(problem)};
    }
}

std::int64_t ProbeRequests::next_due_ns() const {
    return std::min(probes_.next_due_ns(), traces_.next_due_ns());
}

void ProbeRequests::publish(std::int64_t now_ns, bool congested, std::string& events) {
    probes_.publish(now_ns, congested, events);
    traces_.publish(now_ns, congested, events);
}

}  // namespace hal
