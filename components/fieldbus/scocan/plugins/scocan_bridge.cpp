// SPDX-License-Identifier: MIT
#include "link/send_counter.hpp"
#include "link/stale.hpp"
#include "station_component.hpp"

namespace {

using namespace hal::scocan;

struct ScocanBridge : StationComponent {
    explicit ScocanBridge(const hal_host* host)
        : StationComponent(host, "scocan-bridge.0", {Role::bridge}) {}

    hal::TextArgument pc{
        *this,
        "pc",
        "",
        "bus of the ordinary CAN participant: udp:239.74.163.2:43113, sim:NAME or can:can1",
        {.per_instance = true}};

    hal::Out<std::uint64_t> to_pc{*this, receive_, "to-pc",
                                  "frames forwarded from the bus, or waiting; decreases when the "
                                  "link discards frames that wait"};
    hal::Out<std::uint64_t> to_pc_dropped{*this, receive_, "to-pc-dropped",
                                          "frames of the bus not forwarded: queue full, or the "
                                          "participant's bus down or off"};
    hal::Out<std::uint64_t> from_pc{*this, transmit_, "from-pc",
                                    "frames of the participant that were queued for a slot"};
    hal::Out<std::uint64_t> rejected{
        *this, transmit_, "rejected",
        "frames of the participant dropped: the node does not run, they have waited for more than "
        "0.1 s, identifier of another node or reserved, queue full, or not a classic base frame"};

    void start() {
        if (pc.get().empty()) {
            throw hal::ArgumentError("pc",
                                     "missing pc=; write the bus of the ordinary participant: "
                                     "pc=udp:239.74.163.2:43113");
        }
        if (pc.get() == arguments_.link.get()) {
            throw hal::ArgumentError("pc",
                                     "pc= and link= are the same bus; name two different ones");
        }
        auto opened = hal::can::open(pc.get(), {.stamps = hal::can::describe(pc.get()).has_stamps});
        if (!opened) throw std::runtime_error(opened.problem);
        StationComponent::start();
        pc_ = std::move(opened.link);
        to_pc_ = {};
        from_pc_ = rejected_ = 0;
    }
    void stop() noexcept {
        StationComponent::stop();
        pc_.reset();
    }

private:
    void passed(const hal::can::Frame& frame) noexcept override {
        if (pc_) {
            to_pc_.count(pc_->send(frame, now_));
        }
    }
    void received() noexcept override {
        pc_->flush(now_);
        to_pc_.update(pc_->statistics());
        to_pc = to_pc_.sent();
        to_pc_dropped = to_pc_.dropped();
    }
    /// Takes at most one buffer of frames, so that a babbling participant costs a bounded time; the
    /// rest waits.
    void before_slots(std::int64_t period_ns) noexcept override {
        const auto count = pc_->receive(buffer_, now_);
        for (std::size_t i = 0; i < count; ++i) {
            const bool is_state =
                station_->table().owner(station_->mode(), buffer_[i].id) != nullptr;
            if (!hal::can::is_stale(buffer_[i], now_, period_ns) &&
                station_->send(buffer_[i], is_state) == hal::can::Sent::queued) {
                ++from_pc_;
            } else {
                ++rejected_;
            }
        }
        from_pc = from_pc_;
        rejected = rejected_;
    }

    std::unique_ptr<hal::can::Link> pc_;
    std::array<hal::can::Frame, 32> buffer_;
    hal::can::SendCounter to_pc_;
    std::uint64_t from_pc_ = 0;
    std::uint64_t rejected_ = 0;
};

}  // namespace

HAL_COMPONENT(ScocanBridge, "scocan_bridge",
              "Bridge between a CAN bus with time slots (SCoCAN) and an ordinary one", R"(
A node with two controllers: an ordinary participant on `pc=`, which knows nothing of slots, takes
part in the bus. Its frames are held and sent in the private slot that the table gives their
identifier, only the newest of each, or else in shared slots; frames from the bus are forwarded at
once.

`robot.scocan`:

    node clock A sync
    node pc A bridge
    mode 0 run
    0 sync
    2 private pc 0x10B

The netlist:

    loadrt scocan_bridge link=sim:robot pc=udp:239.74.163.2:43113 config=robot.scocan node=pc
    addf scocan-bridge.0.receive bus
    addf scocan-bridge.0.transmit bus

The messages of the bridge in the table are those of the participant and have no pins. Frames with a
reserved identifier (0x000..0x00F, 0x780..0x7FF) or one that the table gives to another node, in a
private slot or as a message, are dropped and counted in `rejected`; the first of each identifier is
reported. So are frames that come while the node does not run, or that have waited for more than
0.1 s, as while the thread is stopped: receivers would take them for fresh ones. Otherwise the node
is one like any other, see `hal doc scocan`.
)")
