// SPDX-License-Identifier: MIT
#include "bus/ethercat/datagram_exchange.hpp"

#include <algorithm>

namespace hal::tools {

using ethercat::Command;

namespace {

constexpr std::int64_t answer_timeout_ns = 20'000'000;
constexpr unsigned max_attempts = 3;
constexpr std::size_t max_flights = 8;

bool has_all_answers(std::span<const WireDatagram> datagrams) {
    return std::all_of(datagrams.begin(), datagrams.end(),
                       [](const WireDatagram& d) { return d.working_counter.has_value(); });
}

/// Returns whether a datagram that arrived is the answer to one that was sent.
bool is_answer(const ethercat::DatagramView& answer, const WireDatagram& sent, bool last) {
    return answer.command == sent.command && answer.length == sent.data.size() &&
           answer.register_address() == sent.address >> 16 && answer.more != last;
}

/// Returns the answers in a frame to datagrams that were sent under `index`; empty: the frame has
/// others.
std::vector<ethercat::DatagramView> answers_in(std::span<std::uint8_t> bytes, std::uint8_t index,
                                               std::span<const WireDatagram> sent) {
    std::vector<ethercat::DatagramView> answers;
    ethercat::FrameReader reader(bytes);
    while (const auto answer = reader.next()) {
        const std::size_t n = answers.size();
        if (n >= sent.size() || answer->index != index) return {};
        if (!is_answer(*answer, sent[n], n + 1 == sent.size())) return {};
        answers.push_back(*answer);
    }
    if (answers.size() != sent.size()) return {};
    return answers;
}

}  // namespace

WireDatagram read_datagram(std::size_t position, std::uint16_t address, std::uint16_t length) {
    return {Command::aprd, ethercat::at_position(static_cast<unsigned>(position), address),
            std::vector<std::uint8_t>(length)};
}

WireDatagram write_datagram(std::size_t position, std::uint16_t address,
                            std::span<const std::uint8_t> bytes) {
    return {Command::apwr, ethercat::at_position(static_cast<unsigned>(position), address),
            std::vector<std::uint8_t>(bytes.begin(), bytes.end())};
}

DatagramExchange::Flight DatagramExchange::send(std::span<WireDatagram> datagrams,
                                                std::size_t first) {
    std::array<std::uint8_t, ethercat::max_frame_bytes> buffer;
    const std::size_t max_bytes = ethernet::header_bytes + access_.port().statistics().mtu;
    ethercat::FrameWriter frame(buffer, access_.port().address(), max_bytes);
    Flight flight{.first = first, .count = 0, .index = ++index_};
    for (const WireDatagram& d : datagrams.subspan(first)) {
        // an answer is kept: this frame ends at what has to be sent again
        if (d.working_counter) break;
        std::uint8_t* to = frame.add(d.command, flight.index, d.address,
                                     static_cast<std::uint16_t>(d.data.size()));
        if (to == nullptr) break;
        std::copy(d.data.begin(), d.data.end(), to);
        ++flight.count;
    }
    if (flight.count != 0) {
        access_.port().send(frame.finish(), {}, access_.now_ns());
    }
    return flight;
}

void DatagramExchange::receive(std::span<WireDatagram> datagrams, std::span<Flight> flights) {
    std::size_t missing = flights.size();
    const std::int64_t until_ns = access_.now_ns() + answer_timeout_ns;
    while (missing != 0) {
        auto bytes = access_.receive(until_ns);
        if (!bytes) return;
        for (Flight& flight : flights) {
            if (flight.arrived) continue;
            const auto sent = datagrams.subspan(flight.first, flight.count);
            const auto answers = answers_in(*bytes, flight.index, sent);
            if (answers.empty()) continue;
            for (std::size_t n = 0; n < answers.size(); ++n) {
                std::copy_n(answers[n].data, answers[n].length, sent[n].data.begin());
                sent[n].working_counter = answers[n].wkc();
            }
            flight.arrived = true;
            --missing;
            break;
        }
    }
}

void DatagramExchange::run(std::span<WireDatagram> datagrams) {
    std::vector<Flight> flights;
    for (unsigned attempt = 0; attempt < max_attempts && !has_all_answers(datagrams); ++attempt) {
        for (std::size_t next = 0; next < datagrams.size();) {
            if (datagrams[next].working_counter) {
                ++next;
                continue;
            }
            const Flight flight = send(datagrams, next);
            // one that fits into no frame has no answer
            next += std::max<std::size_t>(flight.count, 1);
            if (flight.count != 0) {
                flights.push_back(flight);
            }
            if (flights.size() == max_flights) {
                receive(datagrams, flights);
                flights.clear();
            }
        }
        receive(datagrams, flights);
        flights.clear();
    }
}

}  // namespace hal::tools
