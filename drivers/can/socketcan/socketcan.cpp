// SPDX-License-Identifier: MIT
#include "socketcan.hpp"

#include <fcntl.h>
#include <linux/can/raw.h>
#include <linux/sockios.h>
#include <net/if.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/uio.h>

#include <algorithm>
#include <mutex>
#include <utility>
#include <vector>

#include "controller_monitor.hpp"
#include "hal/queue.hpp"
#include "kernel_frames.hpp"
#include "link/counting.hpp"
#include "link/drop_counter.hpp"
#include "link/system.hpp"

namespace hal::can::socketcan {

namespace {

constexpr std::size_t batch = 32;  // frames per system call
constexpr std::size_t max_filters = CAN_RAW_FILTER_MAX;
// of a waiting receive; the kernel adds up to a tick of its timer, 1 to 10 ms
constexpr timeval receive_timeout{0, 20'000};
constexpr std::int64_t receive_timeout_ns = receive_timeout.tv_usec * 1000LL;

template <class T>
bool set(int fd, int level, int name, const T& value) {
    return setsockopt(fd, level, name, &value, sizeof value) == 0;
}

/// Opens a raw socket with all options and binds it. On failure returns none and sets `problem`.
link::Descriptor make_socket(int index, const Options& o, const std::vector<can_filter>& filters,
                             std::string& problem) {
    link::Descriptor fd(::socket(AF_CAN, SOCK_RAW | SOCK_CLOEXEC, CAN_RAW));
    if (!fd) {
        const int error = errno;
        if (error == EAFNOSUPPORT || error == EPROTONOSUPPORT) {
            problem =
                "this kernel has no SocketCAN; type: sudo modprobe can-raw, or use a bus without "
                "it: sim:NAME, "
                "udp:239.74.163.2:43113, slcan:DEVICE";
        } else if (error == EPERM || error == EACCES) {
            problem =
                "permission denied for a raw CAN socket; start the container with the host's "
                "network";
        } else {
            problem = "cannot open a raw CAN socket: " + link::reason(error);
        }
        return {};
    }
    const int yes = 1;
    if (o.fd && !set(fd.get(), SOL_CAN_RAW, CAN_RAW_FD_FRAMES, yes)) {
        problem = "this kernel does not support CAN FD; remove fd";
        return {};
    }
    const can_err_mask_t errors = CAN_ERR_MASK & ~static_cast<can_err_mask_t>(CAN_ERR_LOSTARB);
    // they report the state of the controller
    set(fd.get(), SOL_CAN_RAW, CAN_RAW_ERR_FILTER, errors);
    if (o.own_frames) {
        set(fd.get(), SOL_CAN_RAW, CAN_RAW_RECV_OWN_MSGS, yes);
    }
    set(fd.get(), SOL_CAN_RAW, CAN_RAW_FILTER, can_filter{});
    if (!filters.empty()) {
        setsockopt(fd.get(), SOL_CAN_RAW, CAN_RAW_FILTER, filters.data(),
                   static_cast<socklen_t>(filters.size() * sizeof(can_filter)));
    }
    if (o.stamps) {
        set(fd.get(), SOL_SOCKET, SO_TIMESTAMPNS, yes);
    }
    set(fd.get(), SOL_SOCKET, SO_RCVTIMEO, receive_timeout);
    // the kernel's cost of a frame
    const int buffer_bytes =
        static_cast<int>(std::min<std::size_t>(o.receive_capacity, 65536) * 1024);
    if (!set(fd.get(), SOL_SOCKET, SO_RCVBUFFORCE, buffer_bytes)) {
        set(fd.get(), SOL_SOCKET, SO_RCVBUF, buffer_bytes);
    }
    sockaddr_can address{};
    address.can_family = AF_CAN;
    address.can_ifindex = index;
    if (::bind(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
        problem = "cannot bind to the interface: " + link::reason();
        return {};
    }
    return fd;
}

class SocketLink final : public Link {
public:
    SocketLink(const std::string& name, const Options& options, const Interface& interface,
               link::Descriptor socket)
        : options_(options),
          socket_(std::move(socket)),
          outgoing_(options.send_capacity),
          monitor_(name, counting_, interface.index, options.restart_ms,
                   [this](int index) { return reopen(index); }) {
        if (interface.bit_rate != 0) {
            counting_.bit_rate = interface.bit_rate;
        } else if (options.bit_rate != unlimited) {
            counting_.bit_rate = options.bit_rate;
        } else {
            counting_.bit_rate = 0;
        }
        counting_.data_rate = interface.data_rate != 0 ? interface.data_rate : options.data_rate;
        if (interface.has_state) {
            counting_.state = interface.state;
        }
        description_ = describe(name);
        if (!interface.kind.empty()) {
            description_.transport += " (" + interface.kind + ")";
        }
        description_.bit_rate = counting_.bit_rate;
        description_.data_rate = counting_.data_rate;

        description_.fd = options.fd;
        // without IFF_ECHO the kernel returns a frame before the driver sends it (can_send()); what
        // vcan accepts is on its bus
        description_.has_echo = interface.has_echo || interface.kind == "vcan";
        description_.listen_only = options.listen_only || interface.listen_only;
        for (std::size_t i = 0; i < batch; ++i) {
            parts_[i] = {&raw_[i], sizeof raw_[i]};
            in_[i].msg_hdr.msg_iov = &parts_[i];
            in_[i].msg_hdr.msg_iovlen = 1;
            in_[i].msg_hdr.msg_control = options.stamps ? control_[i] : nullptr;
            in_[i].msg_hdr.msg_controllen = options.stamps ? sizeof control_[i] : 0;
            out_parts_[i] = {&out_raw_[i], 0};
            out_[i].msg_hdr = {};
            out_[i].msg_hdr.msg_iov = &out_parts_[i];
            out_[i].msg_hdr.msg_iovlen = 1;
        }
    }

    Sent send(const Frame& frame, std::int64_t now_ns) noexcept override {
        if (!may_send(frame, options_)) return counting_.drop(Sent::rejected);
        const State state = counting_.state.load(std::memory_order_relaxed);
        if (state == State::down) return counting_.drop(Sent::down);
        if (state == State::bus_off) return counting_.drop(Sent::bus_off);
        if (outgoing_.push(frame)) return Sent::queued;
        flush(now_ns);
        return outgoing_.push(frame) ? Sent::queued : counting_.drop(Sent::full);
    }

    void flush(std::int64_t) noexcept override {
        // Frames queued before the interface was lost must not be sent when it returns.
        if (state() == State::down) {
            discard_queued();
        }
        for (bool again = true;;) {
            std::size_t count = 0;
            for (; count < batch; ++count) {
                const Frame* f = outgoing_.at(count);
                if (f == nullptr) break;
                out_parts_[count].iov_len = to_kernel(*f, out_raw_[count]);
            }
            if (count == 0) return;
            const int sent = hand_over(count);
            const int error = errno;
            for (int i = 0; i < sent; ++i) {
                counting_.count_sent(*outgoing_.at(static_cast<std::size_t>(i)));
            }
            if (sent > 0) {
                outgoing_.drop(static_cast<std::size_t>(sent));
            }
            if (sent == static_cast<int>(count)) continue;
            if (sent > 0) {
                continue;  // the next attempt reports the error
            }
            if (error == EINTR) continue;
            // the queue of the interface is full: continue in the next cycle
            if (error == ENOBUFS || error == EAGAIN) return;
            if (error == ENETDOWN || error == ENXIO || error == ENODEV) {
                if (std::exchange(again, false)) {
                    continue;  // the first may be a stale error
                }
                return lose_interface();
            }
            outgoing_.drop();  // the kernel rejects this frame only
            Counting::add(counting_.dropped);
        }
    }

    void discard_queued() noexcept override {
        for (; outgoing_.front() != nullptr; outgoing_.drop()) {
            Counting::add(counting_.dropped);
        }
    }
    /// A CAN interface has the discipline pfifo_fast, whose first of three bands has a queue of its
    /// own (tc-pfifo_fast(8)). TC_PRIO_INTERACTIVE is the highest priority that needs no privilege.
    bool set_urgent(bool is_urgent) noexcept override {
        const int priority = is_urgent ? 6 : 0;
        return set(socket_.get(), SOL_SOCKET, SO_PRIORITY, priority);
    }

    std::size_t receive(std::span<Frame> frames, std::int64_t now_ns) noexcept override {
        if (std::exchange(waited_, false)) {
            refilled_at_ = now_ns;
        }
        // one system call per cycle unless the batch was full
        else if (now_ns != unclocked && now_ns == drained_at_) {
            return 0;
        }
        std::size_t count = 0;
        while (count < frames.size()) {
            if (next_ == filled_ && ((count != 0 && last_batch_short_) || !refill(now_ns))) break;
            frames[count++] = buffer_[next_++];
        }
        return count;
    }

    Statistics statistics() const noexcept override { return counting_.read(outgoing_.size()); }
    State state() const noexcept override {
        return counting_.state.load(std::memory_order_relaxed);
    }
    void restart() noexcept override {
        monitor_.wants_restart.store(true);
        monitor_.nudge();
    }
    bool set_filters(std::span<const Filter> filters) override {
        if (filters.size() > max_filters) return false;
        std::vector<can_filter> kernel;
        for (const auto& f : filters) {
            const auto whole = f.extended ? CAN_EFF_MASK : CAN_SFF_MASK;
            kernel.push_back({(f.id & whole) | (f.extended ? CAN_EFF_FLAG : 0U),
                              (f.mask & whole) | CAN_EFF_FLAG});
        }
        const std::lock_guard lock(mutex_);
        filters_ = kernel;
        if (kernel.empty()) {
            kernel.push_back({0, 0});
        }
        const auto size = static_cast<socklen_t>(kernel.size() * sizeof(can_filter));
        return setsockopt(socket_.get(), SOL_CAN_RAW, CAN_RAW_FILTER, kernel.data(), size) == 0;
    }
    const Description& description() const noexcept override { return description_; }
    /// Receives in the call that waits: poll and receive would be two calls, at the cost of the
    /// rest of a transfer. The timeout of that call is coarse, so the end of the wait is left to
    /// poll.
    bool wait(std::int64_t at_most_ns) override {
        if (next_ != filled_) return true;
        for (std::int64_t until = 0; at_most_ns >= receive_timeout_ns;) {
            // A second receive costs a tenth of the first even where frames arrive one by one: only
            // now and then, or after a burst.
            const bool many = several_ || ++waits_ % 32 == 0;
            const bool plain = !many && !options_.stamps && !options_.own_frames;
            const unsigned count = many ? batch : 1;
            const int got = plain ? receive_one() : receive_batch(MSG_WAITFORONE, count, unclocked);
            if (got > 0) {
                if (many) {
                    several_ = got > 1;
                } else {
                    last_batch_short_ = true;  // further frames are received by the next wait
                }
                return waited_ = true;
            }
            if (errno == EINTR) return false;
            if (errno != EAGAIN) return true;
            const auto now = link::monotonic_ns();
            if (until == 0) {
                until = now + at_most_ns - receive_timeout_ns;
            }
            at_most_ns = until - now;
        }
        return link::readable_within(socket_.get(), at_most_ns);
    }
    int descriptor() const noexcept override { return socket_.get(); }

private:
    /// Receives up to one batch from the kernel. Returns false when there is nothing for the
    /// caller.
    bool refill(std::int64_t now_ns) noexcept {
        if (last_batch_short_ && now_ns != unclocked && now_ns == refilled_at_) {
            drained_at_ = now_ns;
            last_batch_short_ = false;
            return false;
        }
        const int got = receive_batch(MSG_DONTWAIT, batch, now_ns);
        refilled_at_ = now_ns;
        if (filled_ == 0 && now_ns != unclocked && got < static_cast<int>(batch)) {
            drained_at_ = now_ns;
        }
        return filled_ != 0;
    }

    /// Does one system call. Returns the number of frames, or -1 with errno set.
    int receive_batch(int flags, std::size_t max, std::int64_t now_ns) noexcept {
        for (; used_ > 0; --used_) {
            in_[used_ - 1].msg_hdr.msg_controllen = options_.stamps ? sizeof control_[0] : 0;
        }
        next_ = filled_ = 0;
        const int got = ::recvmmsg(socket_.get(), in_, static_cast<unsigned>(max), flags, nullptr);
        const int error = errno;
        last_batch_short_ = got < static_cast<int>(max);
        Counting::add(counting_.lost,
                      drops_.update(socket_.get(), got > 0 ? static_cast<std::size_t>(got) : 0,
                                    last_batch_short_));
        if (got < 0 && (error == ENETDOWN || error == ENODEV || error == ENXIO)) {
            lose_interface();
        }
        if (got > 0 || now_ns == unclocked) {
            const auto monotonic =
                options_.stamps || now_ns == unclocked ? link::monotonic_ns() : now_ns;
            counting_.tick(now_ns != unclocked ? now_ns : monotonic);
            const auto offset = options_.stamps ? monotonic - link::clock_ns(CLOCK_REALTIME) : 0;
            for (int i = 0; i < got; ++i) {
                take(in_[i], raw_[i], offset, options_.stamps ? 0 : monotonic);
            }
            used_ = static_cast<std::size_t>(got > 0 ? got : 0);
        } else {
            counting_.tick(now_ns);
        }
        errno = error;
        return got;
    }

    /// Waits for one frame without the kernel's timestamp, half a microsecond cheaper than
    /// take_batch(). Returns 1, or -1 with errno set.
    int receive_one() noexcept {
        next_ = filled_ = 0;
        const auto got = ::recv(socket_.get(), &raw_[0], sizeof raw_[0], 0);
        if (got < 0) {
            const int error = errno;
            if (error == ENETDOWN || error == ENODEV || error == ENXIO) {
                lose_interface();
            }
            counting_.tick(link::monotonic_ns());
            errno = error;
            return -1;
        }
        const auto monotonic = link::monotonic_ns();
        counting_.tick(monotonic);
        take(static_cast<std::size_t>(got), false, raw_[0], monotonic);
        return 1;
    }

    /// Sends the frames in out_ with one system call. Returns how many were taken, or -1 with errno
    /// set.
    int hand_over(std::size_t count) noexcept {
        constexpr int flags = MSG_DONTWAIT | MSG_NOSIGNAL;
        if (count > 1) return ::sendmmsg(socket_.get(), out_, static_cast<unsigned>(count), flags);
        return ::send(socket_.get(), out_raw_, out_parts_[0].iov_len, flags) < 0 ? -1 : 1;
    }

    void take(const mmsghdr& message, const canfd_frame& raw, std::int64_t offset,
              std::int64_t time_ns) noexcept {
        if (options_.stamps) {
            time_ns = stamp_of(message, offset);
        }
        take(message.msg_len, (message.msg_hdr.msg_flags & MSG_CONFIRM) != 0, raw, time_ns);
    }

    void take(std::size_t length, bool own, const canfd_frame& raw, std::int64_t time_ns) noexcept {
        Frame& f = buffer_[filled_];
        if (!from_kernel(raw, length, f)) return Counting::add(counting_.errors);
        f.own = own;
        f.time_ns = time_ns;
        if (f.error) {
            controller_event(f);
            if (!options_.error_frames) return;
        } else {
            counting_.count_received(f);
        }
        ++filled_;
    }

    std::int64_t stamp_of(const mmsghdr& message, std::int64_t offset) noexcept {
        std::int64_t time_ns = 0;
        auto* header = const_cast<msghdr*>(&message.msg_hdr);
        for (cmsghdr* c = CMSG_FIRSTHDR(header); c != nullptr; c = CMSG_NXTHDR(header, c)) {
            if (c->cmsg_level != SOL_SOCKET) continue;
            if (c->cmsg_type == SCM_TIMESTAMPNS) {
                timespec t{};
                std::memcpy(&t, CMSG_DATA(c), sizeof t);
                time_ns = t.tv_sec * 1'000'000'000LL + t.tv_nsec + offset;
            }
        }
        return time_ns;
    }

    void controller_event(const Frame& f) noexcept {
        Counting::add(counting_.errors);
        const auto to = [this](State s) { counting_.state.store(s, std::memory_order_relaxed); };
        if ((f.id & CAN_ERR_CRTL) != 0) {
            const auto what = f.data[1];
            if ((what & (CAN_ERR_CRTL_RX_OVERFLOW)) != 0) {
                Counting::add(counting_.lost);
            }
            if ((what & (CAN_ERR_CRTL_RX_PASSIVE | CAN_ERR_CRTL_TX_PASSIVE)) != 0) {
                to(State::passive);
            } else if ((what & (CAN_ERR_CRTL_RX_WARNING | CAN_ERR_CRTL_TX_WARNING)) != 0) {
                to(State::warning);
            } else if ((what & CAN_ERR_CRTL_ACTIVE) != 0) {
                to(State::active);
            }
            counting_.send_errors.store(f.data[6], std::memory_order_relaxed);
            counting_.receive_errors.store(f.data[7], std::memory_order_relaxed);
        }
        if ((f.id & CAN_ERR_BUSOFF) != 0) {
            Counting::add(counting_.bus_offs);
            to(State::bus_off);
            monitor_.nudge();
        }
        if ((f.id & CAN_ERR_RESTARTED) != 0) {
            Counting::add(counting_.restarts);
            to(State::active);
        }
    }

    /// Handles ENETDOWN: the monitor decides whether the interface is down, because the error may
    /// be stale.
    void lose_interface() noexcept {
        if (counting_.state.load(std::memory_order_relaxed) != State::down) {
            monitor_.nudge();
        }
    }

    /// Replaces the socket by one for the returned interface under the same descriptor, in the
    /// monitor's thread; the cycle does not notice.
    bool reopen(int index) {
        const std::lock_guard lock(mutex_);
        std::string problem;
        const link::Descriptor fresh = make_socket(index, options_, filters_, problem);
        return fresh && ::dup3(fresh.get(), socket_.get(), O_CLOEXEC) >= 0;
    }

    const Options options_;
    const link::Descriptor socket_;
    Counting counting_;
    hal::Queue<Frame> outgoing_;  // written and read by the sending thread
    Description description_;
    std::mutex mutex_;  // setup and the monitor: filters_
    std::vector<can_filter> filters_;

    // Used by the sending thread.
    mmsghdr out_[batch]{};
    iovec out_parts_[batch]{};
    canfd_frame out_raw_[batch]{};
    // Used by the receiving thread.
    mmsghdr in_[batch]{};
    iovec parts_[batch]{};
    canfd_frame raw_[batch]{};
    alignas(cmsghdr) char control_[batch][CMSG_SPACE(sizeof(timespec))]{};
    Frame buffer_[batch];
    std::size_t next_ = 0;
    std::size_t filled_ = 0;
    std::int64_t drained_at_ = unclocked;
    std::int64_t refilled_at_ = unclocked;
    std::size_t used_ = 0;  // entries of in_ written by the last batch
    bool last_batch_short_ = false;
    bool waited_ = false;
    bool several_ = false;
    unsigned waits_ = 0;
    link::DropCounter drops_;

    ControllerMonitor monitor_;  // last: its thread uses all of the above, and ends first
};

std::string up_command(const std::string& name, const Interface& i, const Options& o) {
    const auto rate = o.bit_rate != 0 && o.bit_rate != unlimited ? o.bit_rate : 1'000'000U;
    return "sudo ip link set " + name + " up" +
           (i.kind == "can" ? " type can bitrate " + std::to_string(rate) : std::string{});
}

}  // namespace

Description describe(const std::string& interface) {
    return {.address = "can:" + interface,
            .transport = "SocketCAN",
            .has_stamps = true,
            .interface = interface};
}

Opened open(const std::string& name, const Options& options) {
    if (name.empty() || name.size() >= IFNAMSIZ) {
        return {nullptr, "invalid interface name; write can:can0"};
    }
    std::string problem;
    const Interface interface = ask(name);
    if (interface.index == 0) {
        const link::Descriptor probe = make_socket(0, {}, {}, problem);
        if (!probe) {
            return {nullptr, problem};
        }
        return {nullptr,
                "no interface " + name +
                    "; to list them: ip -br link; to create a virtual one: sudo ip link add " +
                    name + " type vcan && sudo ip link set " + name + " up"};
    }
    if (!interface.is_can) {
        return {nullptr, name + " is not a CAN interface; to list them: ip -br link show type can"};
    }
    link::Descriptor socket = make_socket(interface.index, options, {}, problem);
    if (!socket) {
        return {nullptr, problem};
    }
    if (!interface.up) {
        return {nullptr, "the interface is down; type: " + up_command(name, interface, options)};
    }
    if (options.fd && interface.mtu < CANFD_MTU) {
        const auto how = interface.kind == "can" ? "type can fd on dbitrate 2000000" : "mtu 72";
        return {nullptr, "the interface is not set up for CAN FD; type: sudo ip link set " + name +
                             " down && sudo ip link set " + name + " " + how + " && " +
                             up_command(name, interface, options)};
    }
    if (options.bit_rate != 0 && interface.bit_rate != 0 &&
        options.bit_rate != interface.bit_rate) {
        return {nullptr, "the interface runs at " + std::to_string(interface.bit_rate) +
                             " bit/s; type: sudo ip link set " + name + " down && " +
                             up_command(name, interface, options)};
    }
    return {std::make_unique<SocketLink>(name, options, interface, std::move(socket)), {}};
}

}  // namespace hal::can::socketcan
