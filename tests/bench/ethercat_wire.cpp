// SPDX-License-Identifier: MIT
#include "ethercat_wire.hpp"

#include <algorithm>
#include <arpa/inet.h>
#include <cstring>
#include <linux/if_packet.h>
#include <net/if.h>
#include <pthread.h>
#include <stdexcept>
#include <sys/socket.h>

#include "ethercat/wire/frames.hpp"

namespace hal::bench {

using namespace hal::ethercat;

RawSocket::RawSocket(const std::string& interface)
    : socket_(::socket(AF_PACKET, SOCK_RAW, htons(ethertype))) {
    sockaddr_ll place{};
    place.sll_family = AF_PACKET;
    place.sll_protocol = htons(ethertype);
    place.sll_ifindex = static_cast<int>(if_nametoindex(interface.c_str()));
    packet_mreq everything{};
    everything.mr_ifindex = place.sll_ifindex;
    everything.mr_type = PACKET_MR_PROMISC;
    const int one = 1;
    const timeval wait{0, 20'000};
    setsockopt(socket_.get(), SOL_PACKET, PACKET_QDISC_BYPASS, &one, sizeof one);
    setsockopt(socket_.get(), SOL_PACKET, PACKET_IGNORE_OUTGOING, &one, sizeof one);
    setsockopt(socket_.get(), SOL_PACKET, PACKET_ADD_MEMBERSHIP, &everything, sizeof everything);
    setsockopt(socket_.get(), SOL_SOCKET, SO_RCVTIMEO, &wait, sizeof wait);
    if (::bind(socket_.get(), reinterpret_cast<const sockaddr*>(&place), sizeof place) != 0) {
        throw std::runtime_error("no raw socket");
    }
}

std::size_t RawSocket::receive(std::span<std::uint8_t> frame) noexcept {
    const ssize_t n = ::recv(socket_.get(), frame.data(), frame.size(), 0);
    return n > 0 ? static_cast<std::size_t>(n) : 0;
}

void RawSocket::send(std::span<const std::uint8_t> frame) noexcept {
    (void)!::send(socket_.get(), frame.data(), frame.size(), 0);
}

Slaves::Slaves(const std::string& interface, const std::string& line)
    : interface_(interface), devices_(devices::make_line(devices::read_line(line))) {
    for (devices::Device& d : devices_) {
        line_.add({.controller = {.dc = d.dc}, .sii = d.sii, .application = d.firmware.get()});
    }
    line_.power_on(link::monotonic_ns());
}

void Slaves::start(Mode mode, int cpu) {
    stop();
    stop_ = false;
    if (mode == Mode::null) {
        socket_ = std::make_unique<RawSocket>(interface_);
    } else {
        auto opened = ethernet::open(
            "eth:" + interface_,
            {.types = {ethertype}, .policy = ethernet::Policy::block, .promiscuous = true});
        if (!opened) throw std::runtime_error(opened.problem);
        port_ = std::move(opened.port);
    }
    thread_ = std::thread([this, mode, cpu] {
        cpu_set_t set;
        CPU_ZERO(&set);
        CPU_SET(static_cast<std::size_t>(cpu), &set);
        pthread_setaffinity_np(pthread_self(), sizeof set, &set);
        sched_param parameters{};
        // a null responder answers before the master looks
        parameters.sched_priority = mode == Mode::null ? 99 : 70;
        pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters);
        mode == Mode::null ? return_frames() : emulate();
    });
}

void Slaves::stop() {
    stop_ = true;
    if (thread_.joinable()) {
        thread_.join();
    }
    port_.reset();
    socket_.reset();
}

void Slaves::emulate() noexcept {
    std::array<std::uint8_t, max_frame_bytes> buffer, asked;
    std::int64_t tick = 0;
    while (!stop_.load(std::memory_order_relaxed)) {
        port_->wait(tick);
        while (const auto arrival = port_->receive(link::monotonic_ns())) {
            const std::span frame(buffer.data(), std::min(arrival->bytes.size(), buffer.size()));
            std::memcpy(frame.data(), arrival->bytes.data(), frame.size());
            std::memcpy(asked.data(), frame.data(), frame.size());
            const std::int64_t now = link::monotonic_ns();
            // the stamp of the kernel
            line_.process(frame, esc::End::primary,
                          std::clamp(arrival->time_ns, now - 1'000'000, now));
            remember({asked.data(), frame.size()}, frame);
            port_->send(frame, {}, now);
        }
        if (const std::int64_t now = link::monotonic_ns(); now >= tick) {
            line_.advance(now);
            tick = now + 1'000'000;
        }
    }
}

void Slaves::return_frames() noexcept {
    std::array<std::uint8_t, max_frame_bytes> buffer;
    while (!stop_.load(std::memory_order_relaxed)) {
        if (const std::size_t length = socket_->receive(buffer); length != 0) {
            const std::span frame(buffer.data(), length);
            answer(frame);
            socket_->send(frame);
        }
    }
}

void Slaves::remember(std::span<std::uint8_t> asked, std::span<std::uint8_t> answered) noexcept {
    FrameReader questions(asked);
    FrameReader reader(answered);
    while (const auto d = reader.next()) {
        const auto question = questions.next();  // each slave has counted up its position
        const bool is_shorter = cyclic_.empty() || answered.size() < cyclic_.size();
        if (d->command == Command::lrw && is_shorter) {
            cyclic_.assign(answered.begin(), answered.end());
        }
        Answer& a = answers_[{static_cast<std::uint8_t>(d->command), question->address, d->length}];
        a.wkc = d->wkc();
        std::memcpy(a.data.data(), d->data, std::min<std::size_t>(d->length, a.data.size()));
    }
}

void Slaves::answer(std::span<std::uint8_t> frame) noexcept {
    frame[6] |= 2;  // as the first slave marks a frame
    FrameReader reader(frame);
    while (const auto d = reader.next()) {
        const auto found =
            answers_.find({static_cast<std::uint8_t>(d->command), d->address, d->length});
        if (found == answers_.end() || found->second.wkc == 0) continue;
        d->set_wkc(found->second.wkc);
        const bool is_read = d->command != Command::apwr && d->command != Command::fpwr &&
                             d->command != Command::bwr && d->command != Command::lwr;
        if (is_read && d->length <= found->second.data.size()) {
            std::memcpy(d->data, found->second.data.data(), d->length);
        }
    }
}

}  // namespace hal::bench
