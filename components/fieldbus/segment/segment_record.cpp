// SPDX-License-Identifier: MIT
#include <algorithm>
#include <atomic>
#include <chrono>
#include <memory>
#include <stdexcept>
#include <thread>
#include <time.h>

#include "hal/background.hpp"
#include "hal/component.hpp"
#include "hal/message_log.hpp"
#include "hal/naming.hpp"
#include "hal/queue.hpp"
#include "link/ethernet_capture.hpp"

namespace {

using namespace hal::ethernet;

struct SegmentRecord final : hal::Component {
    using Component::Component;

    hal::TextArgument link{*this, "link", "sim:net0/recorder",
                           "segment: in memory with a station of its own, or eth:enp3s0"};
    hal::TextArgument file{*this, "file", "", "capture file, for example seen.pcapng"};

    hal::Function run{*this, "update", &SegmentRecord::update,
                      "captures the frames since the last cycle"};

    hal::In<bool> pause{*this, "pause", "TRUE: frames are not captured"};
    hal::Out<std::uint64_t> frames{*this, "frames", "frames captured"};
    hal::Out<std::uint64_t> dropped{*this, "dropped",
                                    "frames lost because the file is written too slowly"};
    hal::Out<bool> failed{*this, "failed",
                          "the file could not be written, for example because the disk is full"};

    void start() {
        if (file.get().empty()) throw std::runtime_error("missing file=; write file=seen.pcapng");
        auto opened = open(link.get(), {.promiscuous = true, .receive_capacity = 1024});
        if (!opened) throw std::runtime_error(opened.problem);
        std::string problem;
        recorder_ = record(file.get(), opened.port->description().interface, problem);
        if (!recorder_) throw std::runtime_error(problem);
        port_ = std::move(opened.port);
        since_1970_ = port_->description().simulated
                          ? 0
                          : clock_ns(CLOCK_REALTIME) - clock_ns(CLOCK_MONOTONIC);
        broken_.store(false);
        writer_.start();
    }
    void stop() noexcept {
        writer_.stop();
        write();
        recorder_.reset();
        port_.reset();
    }

    void update(hal::Cycle cycle) noexcept {
        constexpr int max = 256;  // per cycle: a babbling station must not block the thread
        for (int n = 0; n < max; ++n) {
            const auto arrival = port_->receive(cycle.start_ns());
            if (!arrival) break;
            if (pause || arrival->bytes.size() > max_frame) continue;
            taken_.time_ns = arrival->time_ns;
            taken_.length = arrival->bytes.size();
            std::copy(arrival->bytes.begin(), arrival->bytes.end(), taken_.bytes.begin());
            if (waiting_.push(taken_)) {
                frames = frames + 1;
            } else {
                dropped = dropped + 1;
            }
        }
        failed = broken_.load(std::memory_order_relaxed);
    }

private:
    struct Taken {
        std::int64_t time_ns = 0;
        std::size_t length = 0;
        std::array<std::uint8_t, max_frame> bytes{};
    };
    static std::int64_t clock_ns(clockid_t clock) noexcept {
        timespec t;
        clock_gettime(clock, &t);
        return std::int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec;
    }
    void write() noexcept {
        bool good = true;
        bool any = false;
        for (; waiting_.pop(written_); any = true) {
            good = recorder_ &&
                   recorder_->write(written_.time_ns + since_1970_,
                                    std::span(written_.bytes).first(written_.length)) &&
                   good;
        }
        if (any) {
            good = recorder_ && recorder_->flush() && good;
        }
        if (good || broken_.exchange(true)) return;
        hal::MessageLog(name_).print("cannot write " + file.get() +
                                     "; check that the disk is not full");
    }

    const std::string name_ = hal::own_name("segment-record.0");
    std::unique_ptr<Port> port_;
    std::unique_ptr<Recorder> recorder_;
    std::int64_t since_1970_ = 0;
    hal::Queue<Taken> waiting_{512};
    Taken taken_, written_;      // of the cycle; of the writer
    std::atomic<bool> broken_{false};        // set by the writer
    hal::Background writer_{[this](std::int64_t, bool may_wait) {
        write();
        if (may_wait) {
            std::this_thread::sleep_for(std::chrono::milliseconds(10));
        }
    }};  // the last member: it uses the others
};

}  // namespace

HAL_COMPONENT(SegmentRecord, "segment_record", "Captures an Ethernet segment into a pcapng file",
              R"(
Captures every frame on a segment in memory, for any station, with its time, as pcapng: for
Wireshark and tshark, which decode TDMA and RTcfg, and for `link=replay:seen.pcapng`. Times are
those of the run: on the virtual clock they begin at 0, which Wireshark shows as 1970.

    loadrt segment_record link=sim:net0/recorder file=seen.pcapng
    addf segment-record.0.update servo

The position of `update` in the thread does not matter. On a real interface, `link=eth:enp3s0`, it
captures received frames only; capture sent frames with `tcpdump -i enp3s0 -w seen.pcap`.
)")
