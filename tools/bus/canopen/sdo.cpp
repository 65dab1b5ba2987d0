// SPDX-License-Identifier: MIT
#include "bus/canopen/sdo.hpp"

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

void ParallelReads::handle(const can::Frame& f) {
    if (f.own || f.error || f.extended || f.remote || f.fd || f.length != 8 || f.id <= 0x580 ||
        f.id > 0x5ff) {
        return;
    }
    const unsigned command = f.data[0] >> 5;
    if (command != 2 && command != 4) {
        return;  // of a transfer of another client
    }
    Answer answer;
    answer.node = static_cast<std::uint8_t>(f.id & 0x7f);
    answer.index = static_cast<std::uint16_t>(f.data[1] | f.data[2] << 8);
    answer.sub = f.data[3];
    const unsigned bytes = command == 2 && (f.data[0] & 3) == 3 ? 4U - (f.data[0] >> 2 & 3U) : 4U;
    for (unsigned i = 0; i < bytes; ++i) {
        (command == 4 ? answer.abort : answer.value) |= std::uint32_t{f.data[4 + i]} << 8 * i;
    }
    // longer than four bytes: not expected here
    if (command == 2 && (f.data[0] & 2) == 0) {
        answer.abort = 0x06070012;
    }
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
