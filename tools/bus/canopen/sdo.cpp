// SPDX-License-Identifier: MIT
#include "bus/canopen/sdo.hpp"

#include "cia301/values.hpp"

namespace hal::tools {

void ParallelReads::ask(std::uint8_t node, std::uint16_t index, std::uint8_t sub) {
    nodes_[node & 0x7f].questions.push_back({index, sub});
}

void ParallelReads::poll(can::Link& link, unsigned frames) {
    for (std::uint32_t node = 1; node < nodes_.size() && frames > 0; ++node) {
        Node& n = nodes_[node];
        if (n.waits || n.questions.empty()) continue;
        const Question q = n.questions.front();
        const can::Frame f(0x600 + node,
                           {0x40, static_cast<std::uint8_t>(q.index & 0xff),
                            static_cast<std::uint8_t>(q.index >> 8), q.sub, 0, 0, 0, 0});
        if (link.send(f, can::unclocked) != can::Sent::queued) break;
        n.waits = true;
        --frames;
    }
    link.flush(can::unclocked);
}

/// Decodes the answer to an expedited upload, or an abort. Returns false for any other frame.
bool ParallelReads::decode(const can::Frame& f, Answer& answer) {
    constexpr unsigned initiate_upload = 2;
    constexpr unsigned abort = 4;
    constexpr std::uint32_t too_long = 0x06070012;
    const bool is_answer =
        !f.own && f.is_standard_data() && f.length == 8 && f.id > 0x580 && f.id <= 0x5ff;
    if (!is_answer) return false;
    answer.node = static_cast<std::uint8_t>(f.id & 0x7f);
    answer.index = static_cast<std::uint16_t>(f.data[1] | f.data[2] << 8);
    answer.sub = f.data[3];
    const std::uint64_t value = cia301::natural_of(f.bytes().subspan(4));
    switch (f.data[0] >> 5) {
    case abort: answer.abort = static_cast<std::uint32_t>(value); return true;
    case initiate_upload: break;
    default: return false;  // of a transfer of another client
    }
    const bool is_expedited = (f.data[0] & 2) != 0;
    const bool has_size = (f.data[0] & 3) == 3;
    const unsigned unused_bits = has_size ? (f.data[0] >> 2 & 3U) * 8 : 0;
    answer.value = static_cast<std::uint32_t>(value) << unused_bits >> unused_bits;
    answer.abort = is_expedited ? 0 : too_long;
    return true;
}

void ParallelReads::handle(const can::Frame& f) {
    Answer answer;
    if (!decode(f, answer)) return;
    Node& n = nodes_[answer.node];
    answer.asked = n.waits && n.questions.front().index == answer.index &&
                   n.questions.front().sub == answer.sub;
    if (answer.asked) {
        n.questions.pop_front();
        n.waits = false;
    }
    if (on_answer) {
        on_answer(answer);
    }
}

}  // namespace hal::tools
