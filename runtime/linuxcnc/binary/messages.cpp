// SPDX-License-Identifier: MIT
#include "linuxcnc/binary/messages.hpp"

#include <atomic>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <pthread.h>
#include <unistd.h>

#include "linuxcnc/binary/format.hpp"
#include "linuxcnc/binary/module.hpp"
#include "linuxcnc/binary/tasks.hpp"

namespace hal::modules {
namespace {

constexpr std::size_t line_length = 1024;
constexpr std::size_t lines_in_flight = 128;

// Any cycle fills a line, the printer empties it. `turn` is the owner: n for the writer of message
// n, n + 1 for the printer of message n; then it is n + lines_in_flight for the next writer. A full
// queue loses the new message and counts it.
//   1. writer A: next_line 7 -> 8       2. writer B: next_line 8 -> 9, writes line 8, turn 8 -> 9
//   3. printer: line 7 has turn 7: waits, although line 8 is complete        4. writer A: writes line 7, turn 7 -> 8; the printer goes on
struct Line {
    std::atomic<std::uint64_t> turn;
    int level;
    char text[line_length];
};
Line lines[lines_in_flight];
std::atomic<std::uint64_t> next_line{0};
std::atomic<std::uint64_t> lost_lines{0};
std::uint64_t printed_line = 0;  // the printer's
pthread_t printer;
std::atomic<bool> printing{false};
bool printer_made = false;
bool lines_ready = false;

std::atomic<int> message_level{RTAPI_MSG_ERR};
std::atomic<rtapi_msg_handler_t> message_handler{nullptr};

char capture[8192];
std::size_t capture_length = 0;
char first_error[line_length];  // of what is captured
bool capturing = false;
thread_local bool captures __attribute__((tls_model("initial-exec"))) = false;

void write_text(int level, const char* text, std::size_t length) noexcept {
    const int file = level == RTAPI_MSG_ALL ? STDOUT_FILENO : STDERR_FILENO;
    while (length > 0) {
        const ssize_t n = write(file, text, length);
        if (n <= 0) return;
        text += n;
        length -= static_cast<std::size_t>(n);
    }
}

struct Rate {
    std::time_t second = 0;
    unsigned printed = 0;
    std::uint64_t withheld = 0;
};
Rate rate;  // the printer's

void report_withheld() noexcept {
    rate.withheld += lost_lines.exchange(0, std::memory_order_relaxed);
    if (rate.withheld == 0) return;
    char text[128];
    const int length =
        std::snprintf(text, sizeof text,
                      "hal: %llu messages of LinuxCNC modules not printed (limit %u per second)\n",
                      static_cast<unsigned long long>(rate.withheld), max_per_second);
    write_text(RTAPI_MSG_ERR, text, static_cast<std::size_t>(length));
    rate.withheld = 0;
}

void print_lines() noexcept {
    timespec now{};
    clock_gettime(CLOCK_MONOTONIC, &now);
    if (now.tv_sec != rate.second) {
        report_withheld();
        rate = {now.tv_sec, 0, 0};
    }
    for (;; ++printed_line) {
        Line& line = lines[printed_line % lines_in_flight];
        if (line.turn.load(std::memory_order_acquire) != printed_line + 1) break;
        if (rate.printed < max_per_second) {
            ++rate.printed;
            write_text(line.level, line.text, std::strlen(line.text));
        } else {
            ++rate.withheld;
        }
        line.turn.store(printed_line + lines_in_flight, std::memory_order_release);
    }
}

void* print_until_stopped(void*) {
    const timespec pause{0, 10 * 1000 * 1000};
    while (printing.load(std::memory_order_acquire)) {
        print_lines();
        report_silent_tasks();
        nanosleep(&pause, nullptr);
    }
    return nullptr;
}

void queue_message(int level, const char* format, va_list arguments) noexcept {
    std::uint64_t mine = next_line.load(std::memory_order_relaxed);
    Line* line;
    do {
        line = &lines[mine % lines_in_flight];
        if (line->turn.load(std::memory_order_acquire) != mine) {
            lost_lines.fetch_add(1, std::memory_order_relaxed);
            return;
        }
    } while (!next_line.compare_exchange_weak(mine, mine + 1, std::memory_order_relaxed));
    line->level = level;
    format_text(line->text, sizeof line->text, format, arguments);
    line->turn.store(mine + 1, std::memory_order_release);
}

void print_by_default(msg_level_t level, const char* format, va_list arguments) {
    if (in_cycle) return queue_message(level, format, arguments);
    char text[line_length];
    const int wanted = std::vsnprintf(text, sizeof text, format, arguments);
    const std::size_t length =
        wanted < 0 ? 0 : std::min<std::size_t>(static_cast<std::size_t>(wanted), sizeof text - 1);
    if (!captures) return write_text(level, text, length);
    // as drivers do at this level, to be seen
    const bool announces = std::strstr(text, ": loading ") != nullptr;
    if (level == RTAPI_MSG_ERR && !*first_error && !announces) {
        std::memcpy(first_error, text, length + 1);
    }
    if (length > sizeof capture - 1 - capture_length) {  // then it prints earlier
        write_text(RTAPI_MSG_ERR, capture, capture_length);
        capture_length = 0;
    }
    std::memcpy(capture + capture_length, text, length);
    capture_length += length;
    capture[capture_length] = '\0';
}

void print_message(msg_level_t level, const char* format, va_list arguments) {
    const rtapi_msg_handler_t handler = message_handler.load(std::memory_order_acquire);
    (handler ? handler : print_by_default)(level, format, arguments);
}

}  // namespace

void begin_capture() noexcept {
    capture_length = 0;
    *capture = *first_error = '\0';
    capturing = captures = true;
}
std::string captured_cause() {
    return *first_error ? first_error : std::string(capture, capture_length);
}
void end_capture() noexcept {
    capture_length = 0;
    capturing = captures = false;
}
void print_captured() noexcept {
    if (capturing) {
        write_text(RTAPI_MSG_ERR, capture, capture_length);
    }
    end_capture();
}

void start_printer() noexcept {
    if (printer_made) return;
    if (!lines_ready) {
        for (std::size_t i = 0; i < lines_in_flight; ++i) {
            lines[i].turn = i;
        }
    }
    lines_ready = true;
    printing = true;
    // without it the last lines are printed at the end
    printer_made = pthread_create(&printer, nullptr, print_until_stopped, nullptr) == 0;
}

void stop_printer() noexcept {
    printing = false;
    if (printer_made) {
        pthread_join(printer, nullptr);
    }
    printer_made = false;
    print_lines();
    report_withheld();
}

}  // namespace hal::modules

using namespace hal::modules;

extern "C" {

void rtapi_print(const char* format, ...) {
    va_list arguments;
    va_start(arguments, format);
    print_message(RTAPI_MSG_ALL, format, arguments);
    va_end(arguments);
}

void rtapi_print_msg(msg_level_t level, const char* format, ...) {
    if (static_cast<int>(level) > message_level.load(std::memory_order_relaxed)) return;
    va_list arguments;
    va_start(arguments, format);
    print_message(level, format, arguments);
    va_end(arguments);
}

int rtapi_vsnprintf(char* to, unsigned long size, const char* format, va_list arguments) {
    return in_cycle ? format_text(to, size, format, arguments)
                    : std::vsnprintf(to, size, format, arguments);
}
int rtapi_snprintf(char* to, unsigned long size, const char* format, ...) {
    va_list arguments;
    va_start(arguments, format);
    const int length = rtapi_vsnprintf(to, size, format, arguments);
    va_end(arguments);
    return length;
}

int rtapi_set_msg_level(int level) {
    if (level < 0 || level > RTAPI_MSG_ALL) return -EINVAL;
    message_level = level;
    return 0;
}
int rtapi_get_msg_level() { return message_level; }
// A handler calls the one before it, so the default is one as well.
rtapi_msg_handler_t rtapi_get_msg_handler() {
    const rtapi_msg_handler_t handler = message_handler;
    return handler ? handler : print_by_default;
}
void rtapi_set_msg_handler(rtapi_msg_handler_t handler) { message_handler = handler; }
}
