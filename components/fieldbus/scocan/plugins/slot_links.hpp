// SPDX-License-Identifier: MIT
// The links `scocan:NODE` of a node, as the component that runs the node uses them. Under a journal
// another thread may have their queues (SlotExchange::order): what could not be done then is done in
// the next cycle.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "discipline/slot_exchange.hpp"
#include "fieldbus/scocan/station/station.hpp"

namespace hal::scocan {

class SlotLinks {
public:
    SlotLinks() { arrived_.reserve(Station::receive_capacity); }

    /// Offers the slots of a node. Returns false when it is in this process already. [setup]
    bool offer(const std::string& node, const can::Description& description) {
        exchange_ = can::offer_slots(node, description);
        state_ = can::State::down;
        has_stale_frames_ = false;
        clear_arrived();
        return exchange_ != nullptr;
    }
    /// Withdraws them, and drops what the links have queued. [setup]
    void withdraw() noexcept {
        if (!exchange_) return;
        {
            const link::OrderedCall call(*exchange_->order, link::OrderedCall::Wait::made);
            can::withdraw_slots(*exchange_);
            drop_outgoing();  // behind that, no link sends
        }
        exchange_.reset();
    }

    /// Sets what the links show from the next publish() on. [realtime]
    void set_state(can::State state) noexcept { state_ = state; }
    /// Drops what the links have queued, which they count, at the next publish(). [realtime]
    void drop_queued() noexcept { has_stale_frames_ = true; }
    /// Takes a frame of the bus for the links. [realtime]
    void accept(const can::Frame& frame) noexcept {
        if (arrived_.size() < arrived_.capacity()) {
            arrived_.push_back(frame);
        } else {
            ++overflowed_;
        }
    }
    /// Gives the links the state of the node and what has arrived. [realtime]
    void publish() noexcept {
        if (is_up_to_date()) return;
        const link::OrderedCall call(*exchange_->order, link::OrderedCall::Wait::bounded);
        if (!call.is_made()) return;
        if (has_stale_frames_) {
            drop_outgoing();
            has_stale_frames_ = false;
        }
        exchange_->state.store(state_, std::memory_order_relaxed);
        exchange_->each([this](can::SlotUser& user) { deliver(user); });
        clear_arrived();
    }
    /// Moves what the links have queued into the queue of the station, as much as it takes.
    /// [realtime]
    void forward(Station& station) noexcept {
        const link::OrderedCall call(*exchange_->order, link::OrderedCall::Wait::bounded);
        if (!call.is_made() || has_stale_frames_) return;
        exchange_->each([&station](can::SlotUser& user) { forward(user, station); });
    }

private:
    /// Only the thread of the node changes the state, so this is the same in a re-execution.
    bool is_up_to_date() const noexcept {
        return !has_stale_frames_ && arrived_.empty() &&
               exchange_->state.load(std::memory_order_relaxed) == state_;
    }
    void deliver(can::SlotUser& user) const noexcept {
        std::uint64_t lost = overflowed_;
        for (const can::Frame& frame : arrived_) {
            if (!user.incoming.push(frame)) {
                ++lost;
            }
        }
        if (lost != 0) {
            user.lost.fetch_add(lost, std::memory_order_relaxed);
        }
    }
    void clear_arrived() noexcept {
        arrived_.clear();
        overflowed_ = 0;
    }
    static void forward(can::SlotUser& user, Station& station) noexcept {
        while (const can::SlotFrame* const next = user.outgoing.front()) {
            if (station.is_full()) return;  // it waits for the next cycle
            const can::Sent result = station.send(next->frame, false, next->slot);
            if (result != can::Sent::queued) {
                user.rejected.fetch_add(1, std::memory_order_relaxed);
            }
            user.outgoing.drop();
        }
    }
    void drop_outgoing() noexcept {
        exchange_->each([](can::SlotUser& user) {
            while (user.outgoing.front() != nullptr) {
                user.outgoing.drop();
                user.rejected.fetch_add(1, std::memory_order_relaxed);
            }
        });
    }

    std::shared_ptr<can::SlotExchange> exchange_;
    can::State state_ = can::State::down;
    bool has_stale_frames_ = false;  // the links have queued them before the node started anew
    std::vector<can::Frame> arrived_;  // since the last publish(); its capacity is fixed
    std::uint64_t overflowed_ = 0;  // frames that arrived_ had no space for
};

}  // namespace hal::scocan
