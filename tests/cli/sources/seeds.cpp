// SPDX-License-Identifier: MIT
// A component whose output depends on what a cycle must not depend on; `kind` chooses it.
#include <atomic>
#include <cfenv>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <fcntl.h>
#include <functional>
#include <random>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/uio.h>
#include <thread>
#include <unistd.h>

#include "hal/component.hpp"

// What a compiler calls with _FORTIFY_SOURCE.
extern "C" {
ssize_t __read_chk(int, void*, std::size_t, std::size_t);
ssize_t __pread64_chk(int, void*, std::size_t, off64_t, std::size_t);
ssize_t __recv_chk(int, void*, std::size_t, std::size_t, int);
ssize_t __recvfrom_chk(int, void*, std::size_t, std::size_t, int, sockaddr*, socklen_t*);
std::size_t __fread_chk(void*, std::size_t, std::size_t, std::size_t, FILE*);
char* __fgets_chk(char*, std::size_t, int, FILE*);
}

namespace {

struct Seeds : hal::Component {
    using Component::Component;
    hal::In<double> in{*this, "in", "added to the output"};
    hal::Out<double> out{*this, "out", "what is read"};
    hal::Param<std::int32_t> kind{*this, "kind", "what is read"};
    hal::Function run{*this, "", hal::step<&Seeds::update>, "reads it"};

    void start() {
        bytes_ = static_cast<unsigned char*>(std::malloc(4096));
        socket_ = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
        file_ = ::open("/dev/null", O_RDONLY | O_CLOEXEC);
        stream_ = std::fopen("/dev/null", "re");
        thread_ = std::jthread([this](const std::stop_token& end) {
            while (!end.stop_requested()) {
                ++turns_;
            }
        });
        while (turns_.load() == 0) {  // on a busy computer it runs late
            std::this_thread::yield();
        }
    }
    void stop() noexcept {
        thread_ = {};
        std::free(bytes_);
        std::free(line_);
        ::close(socket_);
        ::close(file_);
        std::fclose(stream_);
    }

    void update(hal::Cycle) noexcept { out = in + read(); }

    double read() noexcept {
        ++count_;
        timespec clock{};
        timeval time{};
        switch (kind) {
        case 1: return static_cast<double>(reinterpret_cast<std::uintptr_t>(bytes_) >> 4 & 0xffff);
        case 2: clock_gettime(CLOCK_MONOTONIC, &clock); return static_cast<double>(clock.tv_nsec);
        case 3: gettimeofday(&time, nullptr); return static_cast<double>(time.tv_usec);
        case 4: return bytes_[2000];
        case 5: return static_cast<double>(turns_.load());
        case 6: return getpid();
        case 7: return static_cast<double>(std::hash<void*>()(this) / 16 % 1009);
        case 8: return std::random_device()() % 1000003;
        case 9: return std::rand() % 1009;
        case 10: return received();
        case 11: std::fesetround(FE_DOWNWARD); return static_cast<double>(count_);
        case 12: return old_value();
        case 13: return set_modes_once();
        default: return kind < 100 ? static_cast<double>(count_) : from_outside();
        }
    }

    double set_modes_once() const noexcept {
        if (count_ == 2000) {  // when no function is checked by itself
            std::fesetround(FE_DOWNWARD);
        }
        return static_cast<double>(count_);
    }

    /// Reads nothing, by each function that could.
    double from_outside() noexcept {
        char bytes[8] = {};
        iovec part{bytes, sizeof bytes};
        mmsghdr messages{};
        messages.msg_hdr.msg_iov = &part;
        messages.msg_hdr.msg_iovlen = 1;
        constexpr int flags = MSG_DONTWAIT;
        switch (kind) {
        case 100: return static_cast<double>(::read(file_, bytes, 8));
        case 101: return static_cast<double>(::readv(file_, &part, 1));
        case 102: return static_cast<double>(::pread(file_, bytes, 8, 0));
        case 103: return static_cast<double>(::preadv(file_, &part, 1, 0));
        case 104: return static_cast<double>(::recv(socket_, bytes, 8, flags));
        case 105:
            return static_cast<double>(::recvfrom(socket_, bytes, 8, flags, nullptr, nullptr));
        case 106: return static_cast<double>(::recvmsg(socket_, &messages.msg_hdr, flags));
        case 107: return ::recvmmsg(socket_, &messages, 1, flags, nullptr);
        case 108: return ::ioctl(socket_, FIONREAD, bytes);
        case 109: return static_cast<double>(std::fread(bytes, 1, 8, stream_));
        case 110: return std::fgets(bytes, 8, stream_) ? 1.0 : 0.0;
        case 111: return std::fgetc(stream_);
        case 112: return std::getc(stream_);
        case 113: return static_cast<double>(::getline(&line_, &line_bytes_, stream_));
        case 114: return static_cast<double>(::getdelim(&line_, &line_bytes_, '.', stream_));
        case 115: return std::fscanf(stream_, "%7s", bytes);
        case 116: return static_cast<double>(__read_chk(file_, bytes, 8, 8));
        case 117: return static_cast<double>(__pread64_chk(file_, bytes, 8, 0, 8));
        case 118: return static_cast<double>(__recv_chk(socket_, bytes, 8, 8, flags));
        case 119:
            return static_cast<double>(
                __recvfrom_chk(socket_, bytes, 8, 8, flags, nullptr, nullptr));
        case 120: return static_cast<double>(__fread_chk(bytes, 8, 1, 8, stream_));
        case 121: return __fgets_chk(bytes, 8, 8, stream_) ? 1.0 : 0.0;
        default: return 0.0;
        }
    }

    double received() const noexcept {
        unsigned char byte = 0;
        return ::recv(socket_, &byte, 1, MSG_DONTWAIT) == 1 ? byte : -1.0;
    }
    /// Keeps the address of a value, which is valid for one plan only.
    double old_value() noexcept {
        if (!address_) {
            hal_pin pin;
            static_assert(sizeof in == sizeof pin);
            std::memcpy(&pin, static_cast<const void*>(&in), sizeof pin);
            address_ = pin.slot;
        }
        return address_->real;
    }

    int socket_ = -1;
    int file_ = -1;
    std::FILE* stream_ = nullptr;
    char* line_ = nullptr;
    std::size_t line_bytes_ = 0;
    const hal_value* address_ = nullptr;
    std::uint64_t count_ = 0;
    unsigned char* bytes_ = nullptr;
    std::atomic<std::uint64_t> turns_ = 0;
    std::jthread thread_;
};

}  // namespace

HAL_COMPONENT(Seeds, "seeds", "Reads what a cycle must not depend on", "Only for a test.")
