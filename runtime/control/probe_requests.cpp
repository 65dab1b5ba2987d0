// SPDX-License-Identifier: MIT
// The verbs that look at a running machine cycle by cycle: probe, unprobe, journal.
#include <limits>
#include <utility>

#include "control/connection_state.hpp"

namespace hal {

void Connection::State::probe(const Json& body, std::string& reply) {
    const auto number = [&](const char* key, std::int64_t least, std::int64_t most,
                            std::int64_t otherwise) {
        const Json& given = member(body, key);
        return given.is_null() ? otherwise : whole(given, key, least, most);
    };
    ProbeRequest request{names_in(body["probe"], "probe")};
    request.every = static_cast<std::uint32_t>(number("every", 1, 1'000'000, 1));
    request.buffer_ns = number("buffer_ms", 10, 60'000, 2000) * 1'000'000;
    const std::int64_t batch_ns = number("batch_ms", 1, 1000, 20) * 1'000'000;
    if (std::string problem = probes.add(request, batch_ns, reply); !problem.empty()) {
        throw RequestError{std::move(problem)};
    }
}

void Connection::State::unprobe(const Json& body, std::string& reply) {
    const auto id = static_cast<std::uint64_t>(
        whole(body["unprobe"], "unprobe", 1, std::numeric_limits<std::int64_t>::max()));
    const auto lost = probes.remove(id);
    if (!lost) {
        throw RequestError{"unknown probe " + std::to_string(id)};
    }
    reply += ",\"lost\":" + std::to_string(*lost);
}

void Connection::State::journal(const Json& body, std::string&) {
    const Json& on = body["journal"];
    if (!on.is_boolean()) {
        throw RequestError{"journal must be true or false"};
    }
    probes.journal(on.get<bool>());
}

}  // namespace hal
