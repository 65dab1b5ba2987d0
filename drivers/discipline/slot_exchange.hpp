// SPDX-License-Identifier: MIT
// The seam between the node of a CAN bus with time slots (SCoCAN) and the links that send through
// it, `scocan:NODE`. The component that runs a node offers its name; a link of that name adds
// itself, and the node moves frames between its queues and the slots:
//
//     std::shared_ptr<SlotExchange> x = offer_slots("motor", description);  // [setup] the component scocan
//     std::shared_ptr<SlotExchange> x = slots_of("motor");                  // [setup] a scocan: link
#pragma once

#include <array>
#include <atomic>
#include <memory>
#include <string>
#include <vector>

#include "hal/queue.hpp"
#include "link/call_order.hpp"
#include "link/can.hpp"

namespace hal::can {

#pragma GCC visibility push(default)

/// A frame for a slot; any_slot leaves the choice to the table.
struct SlotFrame {
    static constexpr std::uint32_t any_slot = UINT32_MAX;
    Frame frame;
    std::uint32_t slot = any_slot;
};

/// One link. The thread of the link writes `outgoing` and reads `incoming`, the thread of the node
/// does the opposite.
struct SlotUser {
    SlotUser(std::size_t sends, std::size_t receives) : outgoing(sends), incoming(receives) {}
    Queue<SlotFrame> outgoing;
    Queue<Frame> incoming;
    std::atomic<std::uint64_t> lost{0};
    /// Frames of `outgoing` that did not come into a queue of the node; written by its thread.
    std::atomic<std::uint64_t> rejected{0};
};

/// Under a journal, all threads take turns with `order` at the users and at `state`: those of the links
/// by their calls (drivers/can/journal), that of the node by an OrderedCall.
class SlotExchange {
public:
    static constexpr std::size_t max_users = 16;

    explicit SlotExchange(const std::string& node)
        : order(link::CallOrder::of("can", "scocan:" + node)) {}

    /// Returns false when there are too many. [setup]
    bool add(SlotUser&);
    /// Removes a user; waits until the node does not use it. [setup]
    void remove(SlotUser&);
    /// Calls `use` for each user. [realtime] the thread of the node
    template <class Use>
    void each(Use use) noexcept {
        busy_.fetch_add(1);
        for (auto& one : users_) {
            if (SlotUser* user = one.load()) {
                use(*user);
            }
        }
        busy_.fetch_sub(1);
    }

    std::atomic<bool> offered{false};  ///< written in setup
    /// written by the thread of the node: active while it may send
    std::atomic<State> state{State::down};
    Description description;  ///< of the link of the node; written by offer_slots()
    const std::shared_ptr<link::CallOrder> order;

private:
    std::array<std::atomic<SlotUser*>, max_users> users_{};
    std::atomic<unsigned> busy_{0};
};

/// Offers the slots of a node to links of this process; nullptr when the name is taken. [setup]
std::shared_ptr<SlotExchange> offer_slots(const std::string& node, const Description&);
/// Withdraws them; links stay, and are down. [setup]
void withdraw_slots(SlotExchange&);
/// Returns the slots of a node, or nullptr. [setup]
std::shared_ptr<SlotExchange> slots_of(const std::string& node);
/// Returns the names that are offered. [setup]
std::vector<std::string> offered_slots();

#pragma GCC visibility pop

}  // namespace hal::can
