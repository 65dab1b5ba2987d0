// SPDX-License-Identifier: MIT
#include "bus/scocan/plan_picture.hpp"

#include <fmt/core.h>

namespace hal::tools {

namespace {

using namespace scocan;

/// In a picture of more slots the identifiers, and the numbers, would overlap.
constexpr std::uint32_t max_labelled_slots = 40;
constexpr std::uint32_t max_numbered_slots = 80;

Bar slot_bar(const Table& t, std::uint32_t slot, Colour colour) {
    const Bar::Shape shape = colour == Colour::leader ? Bar::Shape::pale : Bar::Shape::solid;
    return {t.slot() * slot, t.slot() * (slot + 1), colour, shape};
}

std::string label_of(const Use& use) {
    const std::string id = use.ids.empty() ? "any" : scocan::id_text(use.ids.front()).substr(2);
    return use.every > 1 ? fmt::format("{} {} of {}", id, use.offset, use.every) : id;
}

/// Adds a private slot to the lane of its node: pale, with a frame of 8 bytes to scale. Uses of one
/// slot in different cycles share the bars and the label.
void add_private(Lane& lane, const Table& t, std::uint32_t slot, const Use& use) {
    const Time begin = t.slot() * slot;
    const Time middle = begin + t.slot() / 2;
    const bool labelled = t.slots <= max_labelled_slots;
    const bool is_shared = !lane.bars.empty() && lane.bars.back().from_ns == begin;
    if (!is_shared) {
        lane.bars.push_back(slot_bar(t, slot, Colour::leader));
        lane.bars.push_back({begin, begin + t.frame(8), Colour::leader, Bar::Shape::solid});
    }
    if (labelled && is_shared) {
        lane.labels.back().text += ", " + label_of(use);
    } else if (labelled) {
        lane.labels.push_back({middle, label_of(use), true});
    }
}

/// The numbers of the slots.
Lane number_lane(const Table& t) {
    Lane lane;
    lane.name = "slot";
    for (std::uint32_t slot = 0; slot < t.slots; ++slot) {
        lane.labels.push_back({t.slot() * slot + t.slot() / 2, fmt::format("{}", slot), true});
    }
    return lane;
}

std::vector<Lane> lanes_of(const Table& t, const Mode& mode) {
    Lane shared;
    Lane sync;
    sync.name = "SYNC";
    shared.name = "shared slots";
    std::vector<Lane> nodes(t.nodes.size());
    for (std::uint32_t slot = 0; slot < t.slots; ++slot) {
        const auto& uses = mode.slots[slot];
        if (uses.empty() || uses.front().kind == Kind::shared) {
            shared.bars.push_back(slot_bar(t, slot, Colour::idle));
        }
        for (const Use& use : uses) {
            if (use.kind == Kind::sync) {
                sync.bars.push_back(slot_bar(t, slot, Colour::clock));
            } else if (use.kind == Kind::priv) {
                add_private(nodes[use.node], t, slot, use);
            }
        }
    }
    std::vector<Lane> lanes;
    if (t.slots <= max_numbered_slots) {
        lanes.push_back(number_lane(t));
    }
    lanes.push_back(std::move(sync));
    for (std::size_t i = 0; i < nodes.size(); ++i) {
        if (nodes[i].bars.empty()) continue;
        nodes[i].name = t.nodes[i].name;
        lanes.push_back(std::move(nodes[i]));
    }
    lanes.push_back(std::move(shared));
    return lanes;
}

}  // namespace

Timeline timeline_of(const Table& t, const plan::Plan& p) {
    using Sample = KeyEntry::Sample;
    const Mode& mode = *t.mode(p.mode);
    Timeline timeline;
    timeline.command = "hal scocan plan";
    timeline.title = fmt::format("A cycle of {:g} ms in {} slots of {:g} us at {} bit/s, mode {}",
                                 static_cast<double>(t.cycle) / 1e6, t.slots,
                                 static_cast<double>(t.slot()) / 1e3, t.bit_rate, mode.name);
    timeline.cycle_ns = t.cycle;
    timeline.shown_ns = t.cycle;
    timeline.lanes = lanes_of(t, mode);
    timeline.key = {{Sample::bar, Colour::clock, "SYNC"},
                    {Sample::pale, Colour::leader, "private slot"},
                    {Sample::bar, Colour::leader, "frame of 8 bytes in it"},
                    {Sample::bar, Colour::idle, "shared slot"}};
    timeline.response_title =
        "Worst-case latency of each message, ms: with slots (blue private, green shared), on plain "
        "CAN (red)";
    for (const plan::Latency& l : p.latencies) {
        const Message& m = t.messages[l.message];
        ResponseTime one;
        one.name = fmt::format("{} {}", scocan::id_text(m.id), m.name);
        one.worst_ns = l.worst;
        one.colour = l.priv ? Colour::leader : Colour::follower;
        one.compared_ns = l.plain;
        timeline.responses.push_back(std::move(one));
    }
    return timeline;
}

}  // namespace hal::tools
