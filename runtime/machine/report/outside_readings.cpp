// SPDX-License-Identifier: MIT
#include "machine/report/outside_readings.hpp"

// A sanitizer has these functions itself.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)

void hal::report_outside_readings() noexcept {}

#else

#include <atomic>
#include <cstdarg>
#include <cstdint>
#include <cstdio>

#include <sys/socket.h>
#include <sys/uio.h>
#include <time.h>
#include <unistd.h>

#include "execute/core.hpp"
#include "machine/report/next_function.hpp"

namespace {

std::atomic<bool> reports{false};

/// A function of the C library that reads a file, a socket or a device.
template <class Function>
class Reading;
template <class Result, class... Arguments>
class Reading<Result(Arguments...)> {
public:
    explicit constexpr Reading(const char* name) noexcept : next_(name) {}

    void find() noexcept { (void)*next_; }
    /// Calls it, after a note when a function of the machine does. [any]
    Result operator()(Arguments... arguments) {
        if (reports.load(std::memory_order_relaxed)) {
            note();
        }
        return (*next_)(arguments...);
    }

private:
    static void note() noexcept {
        hal::Core* const core = hal::Core::current();
        if (core && core->in_function()) {
            core->note_outside_reading();
        }
    }

    hal::NextFunction<Result(Arguments...)> next_;
};

using Size = std::size_t;

constinit Reading<ssize_t(int, void*, Size)> next_read{"read"};
constinit Reading<ssize_t(int, const iovec*, int)> next_readv{"readv"};
constinit Reading<ssize_t(int, void*, Size, long)> next_pread{"pread"};
constinit Reading<ssize_t(int, void*, Size, off64_t)> next_pread64{"pread64"};
constinit Reading<ssize_t(int, const iovec*, int, long)> next_preadv{"preadv"};
constinit Reading<ssize_t(int, const iovec*, int, off64_t)> next_preadv64{"preadv64"};
constinit Reading<ssize_t(int, void*, Size, int)> next_recv{"recv"};
constinit Reading<ssize_t(int, void*, Size, int, sockaddr*, socklen_t*)> next_recvfrom{"recvfrom"};
constinit Reading<ssize_t(int, msghdr*, int)> next_recvmsg{"recvmsg"};
constinit Reading<int(int, mmsghdr*, unsigned, int, timespec*)> next_recvmmsg{"recvmmsg"};
constinit Reading<int(int, unsigned long, void*)> next_ioctl{"ioctl"};

constinit Reading<Size(void*, Size, Size, FILE*)> next_fread{"fread"};
constinit Reading<char*(char*, int, FILE*)> next_fgets{"fgets"};
constinit Reading<int(FILE*)> next_fgetc{"fgetc"};
constinit Reading<ssize_t(char**, Size*, int, FILE*)> next_getdelim{"getdelim"};
// The conversions of three versions of C.
constinit Reading<int(FILE*, const char*, va_list)> next_vfscanf{"vfscanf"};
constinit Reading<int(FILE*, const char*, va_list)> next_c99_vfscanf{"__isoc99_vfscanf"};
constinit Reading<int(FILE*, const char*, va_list)> next_c23_vfscanf{"__isoc23_vfscanf"};

// With checks of the size, as in a component that was built with _FORTIFY_SOURCE.
constinit Reading<ssize_t(int, void*, Size, Size)> next_read_chk{"__read_chk"};
constinit Reading<ssize_t(int, void*, Size, long, Size)> next_pread_chk{"__pread_chk"};
constinit Reading<ssize_t(int, void*, Size, off64_t, Size)> next_pread64_chk{"__pread64_chk"};
constinit Reading<ssize_t(int, void*, Size, Size, int)> next_recv_chk{"__recv_chk"};
constinit Reading<ssize_t(int, void*, Size, Size, int, sockaddr*, socklen_t*)> next_recvfrom_chk{
    "__recvfrom_chk"};
constinit Reading<Size(void*, Size, Size, Size, FILE*)> next_fread_chk{"__fread_chk"};
constinit Reading<char*(char*, Size, int, FILE*)> next_fgets_chk{"__fgets_chk"};

}  // namespace

void hal::report_outside_readings() noexcept {
    const auto find = [](auto&... all) { (all.find(), ...); };
    find(next_read, next_readv, next_pread, next_pread64, next_preadv, next_preadv64, next_recv,
         next_recvfrom, next_recvmsg, next_recvmmsg, next_ioctl);
    find(next_fread, next_fgets, next_fgetc, next_getdelim, next_vfscanf, next_c99_vfscanf,
         next_c23_vfscanf);
    find(next_read_chk, next_pread_chk, next_pread64_chk, next_recv_chk, next_recvfrom_chk,
         next_fread_chk, next_fgets_chk);
    reports.store(true);
}

// Weak: test programs have some of their own. Under names of our own, because the headers of the
// library have other declarations of them, some with macros.
extern "C" {

[[gnu::weak, gnu::visibility("default")]] ssize_t outside_read(int file, void* to,
                                                               Size bytes) __asm__("read");
ssize_t outside_read(int file, void* to, Size bytes) { return next_read(file, to, bytes); }

[[gnu::weak, gnu::visibility("default")]] ssize_t outside_readv(int file, const iovec* to,
                                                                int count) __asm__("readv");
ssize_t outside_readv(int file, const iovec* to, int count) { return next_readv(file, to, count); }

[[gnu::weak, gnu::visibility("default")]] ssize_t outside_pread(int file, void* to, Size bytes,
                                                                long at) __asm__("pread");
ssize_t outside_pread(int file, void* to, Size bytes, long at) {
    return next_pread(file, to, bytes, at);
}

[[gnu::weak, gnu::visibility("default")]] ssize_t outside_pread64(int file, void* to, Size bytes,
                                                                  off64_t at) __asm__("pread64");
ssize_t outside_pread64(int file, void* to, Size bytes, off64_t at) {
    return next_pread64(file, to, bytes, at);
}

[[gnu::weak, gnu::visibility("default")]] ssize_t outside_preadv(int file, const iovec* to,
                                                                 int count,
                                                                 long at) __asm__("preadv");
ssize_t outside_preadv(int file, const iovec* to, int count, long at) {
    return next_preadv(file, to, count, at);
}

[[gnu::weak, gnu::visibility("default")]] ssize_t outside_preadv64(int file, const iovec* to,
                                                                   int count,
                                                                   off64_t at) __asm__("preadv64");
ssize_t outside_preadv64(int file, const iovec* to, int count, off64_t at) {
    return next_preadv64(file, to, count, at);
}

[[gnu::weak, gnu::visibility("default")]] ssize_t outside_recv(int socket, void* to, Size bytes,
                                                               int flags) __asm__("recv");
ssize_t outside_recv(int socket, void* to, Size bytes, int flags) {
    return next_recv(socket, to, bytes, flags);
}

[[gnu::weak, gnu::visibility("default")]] ssize_t outside_recvfrom(
    int socket, void* to, Size bytes, int flags, sockaddr* address,
    socklen_t* size) __asm__("recvfrom");
ssize_t outside_recvfrom(int socket, void* to, Size bytes, int flags, sockaddr* address,
                         socklen_t* size) {
    return next_recvfrom(socket, to, bytes, flags, address, size);
}

[[gnu::weak, gnu::visibility("default")]] ssize_t outside_recvmsg(int socket, msghdr* to,
                                                                  int flags) __asm__("recvmsg");
ssize_t outside_recvmsg(int socket, msghdr* to, int flags) {
    return next_recvmsg(socket, to, flags);
}

[[gnu::weak, gnu::visibility("default")]] int outside_recvmmsg(
    int socket, mmsghdr* to, unsigned count, int flags, timespec* timeout) __asm__("recvmmsg");
int outside_recvmmsg(int socket, mmsghdr* to, unsigned count, int flags, timespec* timeout) {
    return next_recvmmsg(socket, to, count, flags, timeout);
}

// The third argument is an address or a number, in a register either way.
[[gnu::weak, gnu::visibility("default")]] int outside_ioctl(int file, unsigned long request,
                                                            void* argument) __asm__("ioctl");
int outside_ioctl(int file, unsigned long request, void* argument) {
    return next_ioctl(file, request, argument);
}

[[gnu::weak, gnu::visibility("default")]] Size outside_fread(void* to, Size bytes, Size count,
                                                             FILE* file) __asm__("fread");
Size outside_fread(void* to, Size bytes, Size count, FILE* file) {
    return next_fread(to, bytes, count, file);
}

[[gnu::weak, gnu::visibility("default")]] Size outside_fread_unlocked(
    void* to, Size bytes, Size count, FILE* file) __asm__("fread_unlocked");
Size outside_fread_unlocked(void* to, Size bytes, Size count, FILE* file) {
    return next_fread(to, bytes, count, file);
}

[[gnu::weak, gnu::visibility("default")]] char* outside_fgets(char* to, int bytes,
                                                              FILE* file) __asm__("fgets");
char* outside_fgets(char* to, int bytes, FILE* file) { return next_fgets(to, bytes, file); }

[[gnu::weak, gnu::visibility("default")]] char* outside_fgets_unlocked(
    char* to, int bytes, FILE* file) __asm__("fgets_unlocked");
char* outside_fgets_unlocked(char* to, int bytes, FILE* file) {
    return next_fgets(to, bytes, file);
}

[[gnu::weak, gnu::visibility("default")]] int outside_fgetc(FILE* file) __asm__("fgetc");
int outside_fgetc(FILE* file) { return next_fgetc(file); }

[[gnu::weak, gnu::visibility("default")]] int outside_getc(FILE* file) __asm__("getc");
int outside_getc(FILE* file) { return next_fgetc(file); }

[[gnu::weak, gnu::visibility("default")]] int outside_IO_getc(FILE* file) __asm__("_IO_getc");
int outside_IO_getc(FILE* file) { return next_fgetc(file); }

[[gnu::weak, gnu::visibility("default")]] int outside_getc_unlocked(FILE* file) __asm__(
    "getc_unlocked");
int outside_getc_unlocked(FILE* file) { return next_fgetc(file); }

[[gnu::weak, gnu::visibility("default")]] int outside_fgetc_unlocked(FILE* file) __asm__(
    "fgetc_unlocked");
int outside_fgetc_unlocked(FILE* file) { return next_fgetc(file); }

[[gnu::weak, gnu::visibility("default")]] ssize_t outside_getdelim(char** to, Size* bytes,
                                                                   int delimiter,
                                                                   FILE* file) __asm__("getdelim");
ssize_t outside_getdelim(char** to, Size* bytes, int delimiter, FILE* file) {
    return next_getdelim(to, bytes, delimiter, file);
}

[[gnu::weak, gnu::visibility("default")]] ssize_t outside_own_getdelim(
    char** to, Size* bytes, int delimiter, FILE* file) __asm__("__getdelim");
ssize_t outside_own_getdelim(char** to, Size* bytes, int delimiter, FILE* file) {
    return next_getdelim(to, bytes, delimiter, file);
}

[[gnu::weak, gnu::visibility("default")]] ssize_t outside_getline(char** to, Size* bytes,
                                                                  FILE* file) __asm__("getline");
ssize_t outside_getline(char** to, Size* bytes, FILE* file) {
    return next_getdelim(to, bytes, '\n', file);
}

[[gnu::weak, gnu::visibility("default")]] int outside_vfscanf(FILE* file, const char* format,
                                                              va_list to) __asm__("vfscanf");
int outside_vfscanf(FILE* file, const char* format, va_list to) {
    return next_vfscanf(file, format, to);
}

[[gnu::weak, gnu::visibility("default")]] int outside_isoc99_vfscanf(
    FILE* file, const char* format, va_list to) __asm__("__isoc99_vfscanf");
int outside_isoc99_vfscanf(FILE* file, const char* format, va_list to) {
    return next_c99_vfscanf(file, format, to);
}

[[gnu::weak, gnu::visibility("default")]] int outside_isoc23_vfscanf(
    FILE* file, const char* format, va_list to) __asm__("__isoc23_vfscanf");
int outside_isoc23_vfscanf(FILE* file, const char* format, va_list to) {
    return next_c23_vfscanf(file, format, to);
}

[[gnu::weak, gnu::visibility("default")]] int outside_fscanf(FILE* file, const char* format,
                                                             ...) __asm__("fscanf");
int outside_fscanf(FILE* file, const char* format, ...) {
    va_list to;
    va_start(to, format);
    const int count = next_vfscanf(file, format, to);
    va_end(to);
    return count;
}

[[gnu::weak, gnu::visibility("default")]] int outside_isoc99_fscanf(FILE* file, const char* format,
                                                                    ...) __asm__("__isoc99_fscanf");
int outside_isoc99_fscanf(FILE* file, const char* format, ...) {
    va_list to;
    va_start(to, format);
    const int count = next_c99_vfscanf(file, format, to);
    va_end(to);
    return count;
}

[[gnu::weak, gnu::visibility("default")]] int outside_isoc23_fscanf(FILE* file, const char* format,
                                                                    ...) __asm__("__isoc23_fscanf");
int outside_isoc23_fscanf(FILE* file, const char* format, ...) {
    va_list to;
    va_start(to, format);
    const int count = next_c23_vfscanf(file, format, to);
    va_end(to);
    return count;
}

[[gnu::weak, gnu::visibility("default")]] ssize_t outside_read_chk(
    int file, void* to, Size bytes, Size limit) __asm__("__read_chk");
ssize_t outside_read_chk(int file, void* to, Size bytes, Size limit) {
    return next_read_chk(file, to, bytes, limit);
}

[[gnu::weak, gnu::visibility("default")]] ssize_t outside_pread_chk(
    int file, void* to, Size bytes, long at, Size limit) __asm__("__pread_chk");
ssize_t outside_pread_chk(int file, void* to, Size bytes, long at, Size limit) {
    return next_pread_chk(file, to, bytes, at, limit);
}

[[gnu::weak, gnu::visibility("default")]] ssize_t outside_pread64_chk(
    int file, void* to, Size bytes, off64_t at, Size limit) __asm__("__pread64_chk");
ssize_t outside_pread64_chk(int file, void* to, Size bytes, off64_t at, Size limit) {
    return next_pread64_chk(file, to, bytes, at, limit);
}

[[gnu::weak, gnu::visibility("default")]] ssize_t outside_recv_chk(int socket, void* to, Size bytes,
                                                                   Size limit,
                                                                   int flags) __asm__("__recv_chk");
ssize_t outside_recv_chk(int socket, void* to, Size bytes, Size limit, int flags) {
    return next_recv_chk(socket, to, bytes, limit, flags);
}

[[gnu::weak, gnu::visibility("default")]] ssize_t outside_recvfrom_chk(
    int socket, void* to, Size bytes, Size limit, int flags, sockaddr* address,
    socklen_t* size) __asm__("__recvfrom_chk");
ssize_t outside_recvfrom_chk(int socket, void* to, Size bytes, Size limit, int flags,
                             sockaddr* address, socklen_t* size) {
    return next_recvfrom_chk(socket, to, bytes, limit, flags, address, size);
}

[[gnu::weak, gnu::visibility("default")]] Size outside_fread_chk(void* to, Size limit, Size bytes,
                                                                 Size count,
                                                                 FILE* file) __asm__("__fread_chk");
Size outside_fread_chk(void* to, Size limit, Size bytes, Size count, FILE* file) {
    return next_fread_chk(to, limit, bytes, count, file);
}

[[gnu::weak, gnu::visibility("default")]] Size outside_fread_unlocked_chk(
    void* to, Size limit, Size bytes, Size count, FILE* file) __asm__("__fread_unlocked_chk");
Size outside_fread_unlocked_chk(void* to, Size limit, Size bytes, Size count, FILE* file) {
    return next_fread_chk(to, limit, bytes, count, file);
}

[[gnu::weak, gnu::visibility("default")]] char* outside_fgets_chk(
    char* to, Size limit, int bytes, FILE* file) __asm__("__fgets_chk");
char* outside_fgets_chk(char* to, Size limit, int bytes, FILE* file) {
    return next_fgets_chk(to, limit, bytes, file);
}

[[gnu::weak, gnu::visibility("default")]] char* outside_fgets_unlocked_chk(
    char* to, Size limit, int bytes, FILE* file) __asm__("__fgets_unlocked_chk");
char* outside_fgets_unlocked_chk(char* to, Size limit, int bytes, FILE* file) {
    return next_fgets_chk(to, limit, bytes, file);
}

}  // extern "C"

#endif
