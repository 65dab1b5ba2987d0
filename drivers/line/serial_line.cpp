// SPDX-License-Identifier: MIT
// A serial line of this machine, or the master end of a pseudo terminal.
#include "serial_line.hpp"

#include <fcntl.h>
#include <linux/serial.h>
#include <stdlib.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <termios.h>

#include <algorithm>

#include "link/system.hpp"

namespace hal::line::serial {

namespace {

struct Speed {
    std::uint32_t baud;
    speed_t code;
};
constexpr Speed speeds[] = {
    {300, B300},         {600, B600},         {1200, B1200},       {2400, B2400},
    {4800, B4800},       {9600, B9600},       {19200, B19200},     {38400, B38400},
    {57600, B57600},     {115200, B115200},   {230400, B230400},   {460800, B460800},
    {500000, B500000},   {921600, B921600},   {1000000, B1000000}, {1500000, B1500000},
    {2000000, B2000000}, {3000000, B3000000}, {4000000, B4000000}};

constexpr std::int64_t reopen_ns = 500'000'000;

/// Sets a terminal to raw bytes. HUPCL stays off: closing the line must not drop DTR and RTS of
/// adapters that are fed or switched by them. Returns the problem, or "".
std::string make_raw(int fd, const Options& o) {
    termios t{};
    if (tcgetattr(fd, &t) != 0) return "not a serial line: " + link::reason();
    cfmakeraw(&t);
    t.c_cflag |= CLOCAL | CREAD;
    t.c_cflag &= ~static_cast<tcflag_t>(HUPCL | CRTSCTS | CSTOPB | PARENB | PARODD);
    t.c_iflag &= ~static_cast<tcflag_t>(INPCK | IGNPAR | PARMRK);
    if (o.stop_bits == 2) {
        t.c_cflag |= CSTOPB;
    }
    if (o.parity != Parity::none) {
        t.c_cflag |= PARENB;
        t.c_iflag |= INPCK;
    }
    if (o.parity == Parity::odd) {
        t.c_cflag |= PARODD;
    }
    t.c_cc[VMIN] = 1;
    t.c_cc[VTIME] = 0;
    const auto* speed = std::find_if(std::begin(speeds), std::end(speeds),
                                     [&](const Speed& s) { return s.baud == o.baud; });
    if (speed == std::end(speeds)) {
        return "unsupported baud " + std::to_string(o.baud) + "; write 9600, 19200 or 115200";
    }
    cfsetspeed(&t, speed->code);
    if (tcsetattr(fd, TCSANOW, &t) != 0)
        return "cannot set " + format_text(o) + ": " + link::reason();
    return {};
}

std::string enable_rs485(int fd) {
    serial_rs485 settings{};
    settings.flags = SER_RS485_ENABLED | SER_RS485_RTS_ON_SEND;
    if (ioctl(fd, TIOCSRS485, &settings) == 0) return {};
    return "the driver does not switch the direction of RS-485 (" + link::reason() +
           "); delete rs485 for an adapter that switches by itself";
}

/// What both kinds of terminal have in common: bytes out and in, and when they have left.
class TerminalLine : public Line {
public:
    TerminalLine(Description description, const Options& options)
        : description_(std::move(description)), options_(options) {}
    const Description& description() const noexcept override { return description_; }
    bool send(std::span<const std::uint8_t> bytes, std::int64_t now_ns) noexcept override {
        if (!fd_) return false;
        const ssize_t sent = ::write(fd_.get(), bytes.data(), bytes.size());
        if (sent < 0 && errno != EAGAIN && errno != EINTR) {
            lose(now_ns);
        }
        if (sent > 0) {
            sent_until_ = std::max(sent_until_, now_ns) +
                          characters_ns(options_, static_cast<std::size_t>(sent));
        }
        return sent == static_cast<ssize_t>(bytes.size());
    }
    std::size_t receive(std::span<std::uint8_t> bytes, std::int64_t now_ns) noexcept override {
        if (!fd_ || bytes.empty()) return 0;
        const ssize_t count = ::read(fd_.get(), bytes.data(), bytes.size());
        // 0: the device is gone; without bytes it would be EAGAIN
        if (count == 0 || (count < 0 && errno != EAGAIN && errno != EINTR)) {
            lose(now_ns);
        }
        return count > 0 ? static_cast<std::size_t>(count) : 0;
    }
    std::int64_t sent_until_ns() const noexcept override { return sent_until_; }
    int descriptor() const noexcept override { return fd_.get(); }

protected:
    virtual void lose(std::int64_t now_ns) noexcept = 0;

    Description description_;
    Options options_;
    link::Descriptor fd_;
    std::int64_t sent_until_ = INT64_MIN / 2;
};

/// Whether a descriptor is of a pseudo-terminal. Its exclusive mode would last as long as the program
/// on the other side: no later program could open it.
bool is_pseudo_terminal(int fd) noexcept {
    constexpr unsigned first_major = 136;  // Linux, Documentation/admin-guide/devices.txt
    constexpr unsigned last_major = 143;
    struct stat status{};
    if (fstat(fd, &status) != 0) return false;
    const unsigned device = major(status.st_rdev);
    return S_ISCHR(status.st_mode) && device >= first_major && device <= last_major;
}

class SerialLine final : public TerminalLine {
public:
    SerialLine(std::string device, Description description, const Options& options)
        : TerminalLine(std::move(description), options), device_(std::move(device)) {}

    /// Opens the device. Returns the problem, or "".
    std::string open() {
        link::Descriptor fd(::open(device_.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
        is_in_use_ = !fd && errno == EBUSY;
        // TIOCEXCL alone does not keep root out; the lock ends with the last copy of the descriptor
        if (fd && flock(fd.get(), LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
            is_in_use_ = true;
        }
        if (is_in_use_) {
            return "another program uses '" + device_ +
                   "'; a line has one owner: stop the other machine or command";
        }
        if (!fd) {
            return "cannot open '" + device_ + "': " + link::reason();
        }
        std::string problem = make_raw(fd.get(), options_);
        if (problem.empty() && options_.rs485) {
            problem = enable_rs485(fd.get());
        }
        if (!problem.empty()) return problem;
        if (!is_pseudo_terminal(fd.get())) {
            ioctl(fd.get(), TIOCEXCL);
        }
        tcflush(fd.get(), TCIOFLUSH);
        fd_ = std::move(fd);
        return {};
    }
    bool is_in_use() const noexcept { return is_in_use_; }
    bool is_open(std::int64_t now_ns) noexcept override {
        if (!fd_ && now_ns >= retry_at_) {
            retry_at_ = now_ns + reopen_ns;
            try {
                open();
            } catch (...) {  // out of memory for a text: the next attempt follows
            }
        }
        return static_cast<bool>(fd_);
    }

private:
    void lose(std::int64_t now_ns) noexcept override {
        fd_ = link::Descriptor();
        retry_at_ = now_ns + reopen_ns;
    }

    const std::string device_;
    bool is_in_use_ = false;
    std::int64_t retry_at_ = 0;
};

/// The master end. The other end is held open, because the master reads EIO while nobody has it.
class PtyLine final : public TerminalLine {
public:
    PtyLine(Description description, const Options& options)
        : TerminalLine(std::move(description), options) {}
    ~PtyLine() override {
        if (!link_.empty()) {
            ::unlink(link_.c_str());
        }
    }

    std::string open(const std::string& path) {
        link::Descriptor fd(posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC | O_NONBLOCK));
        char name[64];
        if (!fd || grantpt(fd.get()) != 0 || unlockpt(fd.get()) != 0 ||
            ptsname_r(fd.get(), name, sizeof name) != 0) {
            return "cannot create a pseudo terminal: " + link::reason();
        }
        other_end_ = link::Descriptor(::open(name, O_RDWR | O_NOCTTY | O_CLOEXEC));
        if (!other_end_) return "cannot open '" + std::string(name) + "': " + link::reason();
        if (std::string problem = make_raw(other_end_.get(), options_); !problem.empty()) {
            return problem;
        }
        struct stat old{};
        if (lstat(path.c_str(), &old) == 0) {
            if (!S_ISLNK(old.st_mode)) return "'" + path + "' exists; choose another path";
            ::unlink(path.c_str());
        }
        if (symlink(name, path.c_str()) != 0) {
            return "cannot create '" + path + "': " + link::reason();
        }
        link_ = path;
        fd_ = std::move(fd);
        return {};
    }
    bool is_open(std::int64_t) noexcept override { return static_cast<bool>(fd_); }

private:
    void lose(std::int64_t) noexcept override {}

    link::Descriptor other_end_;
    std::string link_;
};

Description terminal(const char* driver, const std::string& target, const char* transport) {
    return {.address = driver + target, .transport = transport};
}

}  // namespace

Opened open(const std::string& target, const Options& options) {
    auto line = std::make_unique<SerialLine>(target, describe(target), options);
    std::string problem = line->open();
    if (problem.empty()) return {std::move(line), {}};
    return {nullptr, std::move(problem), line->is_in_use()};
}
Description describe(const std::string& target) {
    return terminal("serial:", target, "serial line");
}

Opened open_pty(const std::string& path, const Options& options) {
    if (path.empty()) return {nullptr, "missing path; write pty:/tmp/modbus"};
    auto line = std::make_unique<PtyLine>(describe_pty(path), options);
    if (std::string problem = line->open(path); !problem.empty()) return {nullptr, problem};
    return {std::move(line), {}};
}
Description describe_pty(const std::string& path) {
    return terminal("pty:", path, "pseudo terminal");
}

}  // namespace hal::line::serial
