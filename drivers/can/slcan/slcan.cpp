// SPDX-License-Identifier: MIT
#include "slcan.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <termios.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "hal/queue.hpp"
#include "link/filtering.hpp"
#include "link/system.hpp"
#include "slcan_line.hpp"

namespace hal::can::slcan {

namespace {

/// Returns the commands that open the channel.
std::string greeting(const Options& o) {
    std::string text = "C\r";
    if (o.bit_rate != 0 && o.bit_rate != unlimited) {
        text += std::string(rate_command(o.bit_rate)) + "\r";
    }
    if (o.data_rate != 0) {
        text += o.data_rate == 5'000'000 ? "Y5\r" : "Y2\r";
    }
    return text + (o.listen_only ? "L\r" : "O\r");
}

/// Opens the line in raw mode, and the channel. On failure returns none and sets `problem`.
link::Descriptor open_line(const std::string& device, const Options& o, std::string& problem) {
    link::Descriptor fd(::open(device.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
    if (!fd) {
        if (errno == ENOENT) {
            problem = "no such device; to list adapters: ls /dev/serial/by-id";
        } else if (errno == EACCES) {
            problem = "permission denied; type: sudo usermod -aG dialout $USER, and log in again";
        } else if (errno == EBUSY) {
            problem = "the line is in use by another program; to find it: fuser " + device;
        } else {
            problem = "cannot open: " + link::reason();
        }
        return {};
    }
    termios t{};
    if (tcgetattr(fd.get(), &t) != 0) {
        problem = "not a serial line; write slcan:/dev/ttyACM0";
        return {};
    }
    cfmakeraw(&t);
    t.c_cflag |= CLOCAL | CREAD;
    t.c_cc[VMIN] = 0;
    t.c_cc[VTIME] = 0;
    cfsetspeed(&t, B115200);  // ignored by USB adapters
    tcsetattr(fd.get(), TCSANOW, &t);
    tcflush(fd.get(), TCIOFLUSH);
    const auto text = greeting(o);
    if (::write(fd.get(), text.data(), text.size()) < 0 && errno != EAGAIN) {
        problem = "cannot write: " + link::reason();
        return {};
    }
    return fd;
}

class SerialLink final : public FilteringLink {
public:
    SerialLink(const std::string& device, const Options& options, link::Descriptor fd)
        : options_(options),
          device_(device),
          line_(std::move(fd)),
          outgoing_(options.send_capacity),
          watcher_([this] { watch(); }) {
        counting_.bit_rate = options.bit_rate != unlimited ? options.bit_rate : 0;
        counting_.data_rate = options.data_rate;
        description_ = describe(device);
        description_.bit_rate = counting_.bit_rate;
        description_.data_rate = counting_.data_rate;

        description_.fd = options.fd;
        description_.listen_only = options.listen_only;
    }
    ~SerialLink() override {
        {
            const std::lock_guard lock(mutex_);
            ending_ = true;
        }
        changed_.notify_all();
        watcher_.join();
        drain(link::monotonic_ns() + closing_ns());
        (void)!::write(line_.get(), "C\r", 2);
    }

    /// A bus at 10 kbit/s needs seconds for what is queued, the safe values at its end among it.
    std::int64_t closing_ns() const noexcept override {
        constexpr std::int64_t min_bits = 47;
        constexpr std::int64_t max_ns = 50'000'000'000;  // frame without data
        constexpr std::int64_t shortest_line = 6;  // "t1230\r"
        if (state() == State::down) return 0;
        const auto lines =
            static_cast<std::int64_t>(outgoing_.size()) +
            (static_cast<std::int64_t>(text_size_) + held_by_kernel()) / shortest_line;
        if (lines == 0) return 0;
        const std::int64_t rate =
            counting_.bit_rate != 0 ? static_cast<std::int64_t>(counting_.bit_rate) : min_rate;
        return std::min(max_ns, 1'000'000'000 + lines * 4 * min_bits * 1'000'000'000 / rate);
    }

    Sent send(const Frame& frame, std::int64_t now_ns) noexcept override {
        if (!may_send(frame, options_)) return counting_.drop(Sent::rejected);
        if (state() == State::down) return counting_.drop(Sent::down);
        if (outgoing_.push(frame)) return Sent::queued;
        flush(now_ns);
        return outgoing_.push(frame) ? Sent::queued : counting_.drop(Sent::full);
    }

    void flush(std::int64_t) noexcept override {
        if (state() == State::down) return forget();
        for (;;) {
            while (text_size_ + max_line_length <= sizeof text_) {
                const Frame* f = outgoing_.front();
                if (f == nullptr) break;
                Line line;
                const auto size = encode(*f, line);
                std::copy_n(line.data(), size, text_ + text_size_);
                text_size_ += size;
                counting_.count_sent(*f);
                outgoing_.drop();
            }
            if (text_size_ == 0) return;
            const auto written = ::write(line_.get(), text_, text_size_);
            if (written <= 0) {
                if (written < 0 && errno != EAGAIN && errno != EINTR) {
                    lose();
                }
                return;  // the line is slower than the sender: continue in the next cycle
            }
            const auto done = static_cast<std::size_t>(written);
            std::copy(text_ + done, text_ + text_size_, text_);
            text_size_ -= done;
        }
    }

    std::size_t receive(std::span<Frame> frames, std::int64_t now_ns) noexcept override {
        const auto now = now_ns != unclocked ? now_ns : link::monotonic_ns();
        std::size_t count = 0;
        for (int reads = 0; count < frames.size();) {
            if (next_ == filled_) {
                if (reads++ == 4) {
                    break;  // continue with an endless line in the next cycle
                }
                const auto got = ::read(line_.get(), in_, sizeof in_);
                next_ = filled_ = 0;
                if (got <= 0) {
                    // A pseudo-terminal without a peer reads as an error, an unplugged serial
                    // adapter as end of file.
                    if (got == 0 ? hung_up() : errno != EAGAIN && errno != EINTR) {
                        lose();
                    }
                    break;
                }
                filled_ = static_cast<std::size_t>(got);
                arrived_ns_ = link::monotonic_ns();
            }
            switch (decoder_.take(in_[next_++])) {
            case Decoder::Found::frame: {
                Frame f = decoder_.frame();
                if ((f.fd && !options_.fd) || !filters_.pass(f)) break;
                f.time_ns = arrived_ns_;
                counting_.count_received(f);
                frames[count++] = f;
                break;
            }
            case Decoder::Found::error: Counting::add(counting_.errors); break;
            case Decoder::Found::status: apply_status(decoder_.status()); break;
            case Decoder::Found::nothing: break;
            }
        }
        counting_.tick(now);
        return count;
    }

    Statistics statistics() const noexcept override { return counting_.read(outgoing_.size()); }
    bool wait(std::int64_t at_most_ns) override {
        if (next_ != filled_) return true;
        if (state() != State::down) return link::readable_within(line_.get(), at_most_ns);
        std::unique_lock lock(mutex_);  // a dead line is always readable
        return changed_.wait_for(lock, std::chrono::nanoseconds(at_most_ns),
                                 [this] { return state() != State::down; });
    }
    int descriptor() const noexcept override { return line_.get(); }

private:
    static constexpr std::int64_t min_rate = 10'000;

    /// Returns the number of bytes that the line has not sent yet.
    std::int64_t held_by_kernel() const noexcept {
        int bytes = 0;
        return ::ioctl(line_.get(), TIOCOUTQ, &bytes) == 0 ? bytes : 0;
    }
    std::int64_t unsent() const noexcept {
        return static_cast<std::int64_t>(outgoing_.size()) + static_cast<std::int64_t>(text_size_) +
               held_by_kernel();
    }
    /// Writes what is queued until then, as long as the adapter takes some. What remains is
    /// discarded: closing a line would wait for it.
    void drain(std::int64_t until_ns) noexcept {
        constexpr std::int64_t max_idle_ns = 2'000'000'000;
        flush(0);
        std::int64_t left = unsent();
        for (std::int64_t moved_ns = link::monotonic_ns(); state() != State::down && left != 0;) {
            const std::int64_t now_ns = link::monotonic_ns();
            if (now_ns >= until_ns || now_ns - moved_ns >= max_idle_ns) break;
            const bool full = outgoing_.size() != 0 || text_size_ != 0;
            pollfd p{line_.get(), static_cast<short>(full ? POLLOUT : 0), 0};
            ::poll(&p, 1, 10);
            flush(0);
            if (const std::int64_t before = std::exchange(left, unsent()); left != before) {
                moved_ns = now_ns;
            }
        }
        if (left != 0) {
            tcflush(line_.get(), TCOFLUSH);
        }
    }
    void apply_status(unsigned bits) noexcept {  // Lawicel: 2 warning, 3 overrun, 5 passive
        if ((bits & 8) != 0) {
            Counting::add(counting_.lost);
        }
        State state = (bits & 4) != 0 ? State::warning : State::active;
        if ((bits & 32) != 0) {
            state = State::passive;
        }
        counting_.state.store(state, std::memory_order_relaxed);
    }
    bool hung_up() const noexcept {
        pollfd p{line_.get(), 0, 0};
        return ::poll(&p, 1, 0) > 0 && (p.revents & (POLLHUP | POLLERR)) != 0;
    }
    /// Discards queued frames, stale when the line returns, and a partial line, which would corrupt
    /// the next one. Sending thread.
    void forget() noexcept {
        text_size_ = 0;
        for (; outgoing_.front() != nullptr; outgoing_.drop()) {
            Counting::add(counting_.dropped);
        }
    }
    void lose() noexcept { counting_.state.store(State::down, std::memory_order_relaxed); }

    /// Reopens a lost device, in the watcher's thread; the new line takes the descriptor of the old
    /// one.
    void watch() {
        std::unique_lock lock(mutex_);
        while (
            !changed_.wait_for(lock, std::chrono::milliseconds(500), [this] { return ending_; })) {
            if (state() != State::down) continue;
            std::string problem;
            const link::Descriptor fresh = open_line(device_, options_, problem);
            if (!fresh || ::dup3(fresh.get(), line_.get(), O_CLOEXEC) < 0) continue;
            Counting::add(counting_.restarts);
            counting_.state.store(State::active, std::memory_order_relaxed);
            changed_.notify_all();
        }
    }

    const Options options_;
    const std::string device_;
    const link::Descriptor line_;
    hal::Queue<Frame> outgoing_;  // written and read by the sending thread

    char text_[4096]{};  // sending thread: lines not written yet
    std::size_t text_size_ = 0;
    char in_[4096]{};  // from here on: used by the receiving thread
    std::size_t next_ = 0;
    std::size_t filled_ = 0;
    std::int64_t arrived_ns_ = 0;
    Decoder decoder_;

    std::mutex mutex_;  // the watcher and setup
    std::condition_variable changed_;
    bool ending_ = false;
    std::thread watcher_;
};

}  // namespace

Description describe(const std::string& device) {
    return {.address = "slcan:" + device, .transport = "serial-line CAN", .fd_on_request = true};
}

Opened open(const std::string& device, const Options& options) {
    if (device.empty()) {
        return {nullptr, "missing device; write slcan:/dev/ttyACM0"};
    }
    if (options.bit_rate != 0 && options.bit_rate != unlimited &&
        rate_command(options.bit_rate) == nullptr) {
        return {
            nullptr,
            "unsupported bit rate " + std::to_string(options.bit_rate) +
                " of a serial-line adapter; use 10k, 20k, 50k, 100k, 125k, 250k, 500k, 800k or 1M"};
    }
    if (options.data_rate != 0 && options.data_rate != 2'000'000 &&
        options.data_rate != 5'000'000) {
        return {nullptr, "unsupported data rate " + std::to_string(options.data_rate) +
                             " of a serial-line adapter; use 2M or 5M"};
    }
    std::string problem;
    link::Descriptor line = open_line(device, options, problem);
    if (!line) {
        return {nullptr, problem};
    }
    return {std::make_unique<SerialLink>(device, options, std::move(line)), {}};
}

}  // namespace hal::can::slcan
