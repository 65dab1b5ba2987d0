// SPDX-License-Identifier: MIT
#include "ethernet_replay.hpp"

#include <algorithm>
#include <atomic>
#include <cstring>

#include "capture/packets.hpp"
#include "link/ethernet_capture.hpp"
#include "link/system.hpp"
#include "link/trace_frame.hpp"

namespace hal::ethernet {

namespace {

class PcapngRecorder final : public Recorder {
public:
    PcapngRecorder(const std::string& file, std::string_view interface)
        : writer_(file, hal::replay::link_ethernet, interface) {}
    bool write(std::int64_t time_ns, std::span<const std::uint8_t> frame) override {
        return writer_.write(time_ns, {reinterpret_cast<const char*>(frame.data()), frame.size()});
    }
    bool flush() override { return writer_.flush(); }
    int error() const { return writer_.error(); }

private:
    hal::replay::PacketWriter writer_;
};

class ReplayPort final : public Port {
public:
    ReplayPort(const std::string& file, const Options& options, std::vector<Captured> frames)
        : options_(options), frames_(std::move(frames)) {
        // Not one of a segment in memory: a station of a recording must not have the address of
        // this port.
        address_ =
            options.address != Address{} ? options.address : Address{2, 'R', 'E', 'P', 'L', 'Y'};
        description_ = replay::describe(file);
    }
    const Address& address() const noexcept override { return address_; }
    Sent send(std::span<const std::uint8_t> frame, const Launch& launch,
              std::int64_t now_ns) noexcept override {
        if (!launch.fits(frame.size()) || frame.size() > max_frame) {
            add(dropped_);
            add(errors_);
            return Sent::rejected;
        }
        if (launch.is_late(time(now_ns))) {
            add(late_);
            return Sent::late;
        }
        link::trace_frame(link::ethernet_sent, frame);
        add(sent_);
        sent_bytes_.fetch_add(std::max(frame.size(), smallest_frame), std::memory_order_relaxed);
        return Sent::queued;
    }
    std::optional<Arrival> receive(std::int64_t now_ns) noexcept override {
        const auto now = time(now_ns);
        if (!begun_) {
            begun_ = true;
            shift_ = now - (frames_.empty() ? 0 : frames_.front().time_ns);
        }
        for (; next_ < frames_.size() && frames_[next_].time_ns + shift_ <= now;) {
            const Captured& f = frames_[next_++];
            if (next_ == frames_.size()) {
                up_.store(false, std::memory_order_relaxed);
            }
            if (!is_wanted(f.bytes)) continue;
            add(received_);
            received_bytes_.fetch_add(f.bytes.size(), std::memory_order_relaxed);
            link::trace_frame(link::ethernet_received, f.bytes);
            return Arrival{f.bytes, f.time_ns + shift_};
        }
        return std::nullopt;
    }
    bool wait(std::int64_t until_ns) noexcept override {
        if (next_ == frames_.size()) return false;
        const auto due = begun_ ? frames_[next_].time_ns + shift_ : link::monotonic_ns();
        const auto end = std::min(due, until_ns);
        const timespec t = link::to_timespec(end);
        if (end > link::monotonic_ns()) {
            clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr);
        }
        return due <= until_ns;
    }
    Statistics statistics() const noexcept override {
        const auto read = [](const auto& counter) {
            return counter.load(std::memory_order_relaxed);
        };
        Statistics s;
        s.up = read(up_);
        s.sent = read(sent_);
        s.sent_bytes = read(sent_bytes_);
        s.received = read(received_);
        s.received_bytes = read(received_bytes_);
        s.dropped = read(dropped_);
        s.late = read(late_);
        s.errors = read(errors_);
        return s;
    }
    const Description& description() const noexcept override { return description_; }

private:
    using Count = std::atomic<std::uint64_t>;
    static void add(Count& counter) noexcept { counter.fetch_add(1, std::memory_order_relaxed); }
    static std::int64_t time(std::int64_t now_ns) noexcept {
        return now_ns != unclocked ? now_ns : link::monotonic_ns();
    }
    /// Passes frames to any station: the capture was taken with another address.
    bool is_wanted(const std::vector<std::uint8_t>& frame) const noexcept {
        const auto type = static_cast<std::uint16_t>(frame[12] << 8U | frame[13]);
        return options_.types.empty() || std::find(options_.types.begin(), options_.types.end(),
                                                   type) != options_.types.end();
    }

    const Options options_;
    const std::vector<Captured> frames_;
    Address address_{};
    Description description_;
    Count sent_{0};
    Count sent_bytes_{0};
    Count received_{0};
    Count received_bytes_{0};
    Count dropped_{0};
    Count late_{0};

    Count errors_{0};
    std::atomic<bool> up_{true};
    std::size_t next_ = 0;  // from here on: used by the receiving thread
    bool begun_ = false;
    std::int64_t shift_ = 0;
};

}  // namespace

Capture parse_capture(std::string_view bytes) {
    Capture capture;
    capture.problem = hal::replay::each_packet(bytes, [&](const hal::replay::Packet& packet) {
        if (packet.link != hal::replay::link_ethernet) return;
        if (packet.bytes.size() < packet.length || packet.bytes.size() < header_bytes ||
            packet.bytes.size() > max_frame) {
            ++capture.left_out;
            return;
        }
        const auto* data = reinterpret_cast<const std::uint8_t*>(packet.bytes.data());
        capture.frames.push_back({packet.time_ns, {data, data + packet.bytes.size()}});
    });
    const auto earlier = [](const Captured& a, const Captured& b) { return a.time_ns < b.time_ns; };
    std::stable_sort(capture.frames.begin(), capture.frames.end(), earlier);
    return capture;
}

Capture read_capture(const std::string& file) {
    Capture none;
    const auto text = hal::replay::read_file(file, none.problem);
    return text ? parse_capture(*text) : none;
}

std::unique_ptr<Recorder> record(const std::string& file, std::string_view interface,
                                 std::string& problem) {
    auto recorder = std::make_unique<PcapngRecorder>(file, interface);
    if (recorder->error() == 0) return recorder;
    problem = "cannot write " + file + ": " + std::strerror(recorder->error());
    return nullptr;
}

namespace replay {

Description describe(const std::string& file) {
    return {.address = "replay:" + file,
            .transport = "capture",
            .interface = file,
            .simulated = true,
            .recorded = true};
}

Opened open(const std::string& file, const Options& options) {
    if (file.empty()) {
        return {nullptr, "missing file; write replay:capture.pcapng"};
    }
    auto capture = read_capture(file);
    if (!capture.problem.empty()) {
        return {nullptr, capture.problem};
    }
    if (capture.frames.empty()) {
        return {
            nullptr,
            "no Ethernet frames in this file; to record some: tcpdump -i enp3s0 -w capture.pcap"};
    }
    return {std::make_unique<ReplayPort>(file, options, std::move(capture.frames)), {}};
}

}  // namespace replay

}  // namespace hal::ethernet
