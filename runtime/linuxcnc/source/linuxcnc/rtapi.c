/* SPDX-License-Identifier: MIT */
/* rtapi.h: messages, time, splitting of arguments. */
#define _GNU_SOURCE
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "inside.h"
#include "rtapi_string.h"

char halcyon_messages[2048];
static int message_level = RTAPI_MSG_ERR;
static rtapi_msg_handler_t message_handler;
static bool in_cycles;

enum { line_length = 240, lines_in_flight = 128 };

/* --- messages --- */

/* Any thread fills a line, the printer empties it. `turn` is the owner: n for the writer of message
 * n, n + 1 for the printer of message n; then it is n + lines_in_flight for the next writer. A full
 * queue loses the new message and counts it. */
static struct line {
    uint64_t turn;
    int level;
    char text[line_length];
} lines[lines_in_flight];
static uint64_t printed_line, lost_lines;
static pthread_t printer;
static bool printing, printer_made;

static void print_text(int level, const char* text) {
    const int file = level == RTAPI_MSG_ALL ? STDOUT_FILENO : STDERR_FILENO;
    for (size_t left = strlen(text); left > 0;) {
        const ssize_t n = write(file, text, left);
        if (n <= 0) return;
        text += n;
        left -= (size_t)n;
    }
}

static void print_lines(void) {
    for (;; ++printed_line) {
        struct line* line = &lines[printed_line % lines_in_flight];
        if (__atomic_load_n(&line->turn, __ATOMIC_ACQUIRE) != printed_line + 1) break;
        print_text(line->level, line->text);
        __atomic_store_n(&line->turn, printed_line + lines_in_flight, __ATOMIC_RELEASE);
    }
    const uint64_t lost = __atomic_exchange_n(&lost_lines, 0, __ATOMIC_RELAXED);
    if (lost > 0) {
        char text[96];
        snprintf(text, sizeof text, HALCYON_COMPONENT ": %llu messages lost\n",
                 (unsigned long long)lost);
        print_text(RTAPI_MSG_ERR, text);
    }
}

static void* print_until_stopped(void* unused) {
    const struct timespec pause = {0, 20 * 1000 * 1000};
    while (__atomic_load_n(&printing, __ATOMIC_ACQUIRE)) {
        print_lines();
        nanosleep(&pause, NULL);
    }
    return unused;
}

#ifndef HALCYON_PROGRAM
static uint64_t next_line;

static void queue_message(int level, const char* format, va_list arguments) {
    uint64_t mine = __atomic_load_n(&next_line, __ATOMIC_RELAXED);
    struct line* line;
    do {
        line = &lines[mine % lines_in_flight];
        if (__atomic_load_n(&line->turn, __ATOMIC_ACQUIRE) != mine) {
            __atomic_fetch_add(&lost_lines, 1, __ATOMIC_RELAXED);
            return;
        }
    } while (!__atomic_compare_exchange_n(&next_line, &mine, mine + 1, true, __ATOMIC_RELAXED,
                                          __ATOMIC_RELAXED));
    line->level = level;
    vsnprintf(line->text, sizeof line->text, format, arguments);
    __atomic_store_n(&line->turn, mine + 1, __ATOMIC_RELEASE);
}
#endif

static void print_message(int level, const char* format, va_list arguments) {
    if (message_handler) {
        message_handler((msg_level_t)level, format, arguments);
    }
#ifdef HALCYON_PROGRAM
    else {
        vfprintf(level == RTAPI_MSG_ALL ? stdout : stderr, format, arguments);
    }
#else
    else if (in_cycles) {
        queue_message(level, format, arguments);
    } else if (strlen(halcyon_messages) + 1 < sizeof halcyon_messages) {
        vsnprintf(halcyon_messages + strlen(halcyon_messages),
                  sizeof halcyon_messages - strlen(halcyon_messages), format, arguments);
    }
#endif
}

void rtapi_print(const char* format, ...) {
    va_list arguments;
    va_start(arguments, format);
    print_message(RTAPI_MSG_ALL, format, arguments);
    va_end(arguments);
}

void rtapi_print_msg(msg_level_t level, const char* format, ...) {
    if ((int)level > message_level) return;
    va_list arguments;
    va_start(arguments, format);
    print_message(level, format, arguments);
    va_end(arguments);
}

int rtapi_set_msg_level(int level) {
    if (level < RTAPI_MSG_NONE || level > RTAPI_MSG_ALL) return -EINVAL;
    message_level = level;
    return 0;
}
int rtapi_get_msg_level(void) { return message_level; }
void rtapi_set_msg_handler(rtapi_msg_handler_t handler) { message_handler = handler; }
rtapi_msg_handler_t rtapi_get_msg_handler(void) { return message_handler; }

void halcyon_prepare_messages(void) {
    for (size_t i = 0; i < lines_in_flight; ++i) {
        lines[i].turn = i;
    }
}
void halcyon_print_messages(void) {
    print_text(RTAPI_MSG_ERR, halcyon_messages);
    *halcyon_messages = '\0';
}
void halcyon_start_printing(void) {
    printing = true;
    /* without it the last lines are printed at the end */
    printer_made = pthread_create(&printer, NULL, print_until_stopped, NULL) == 0;
    in_cycles = true;
}
void halcyon_stop_printing(void) {
    in_cycles = false;
    __atomic_store_n(&printing, false, __ATOMIC_RELEASE);
    if (printer_made) {
        pthread_join(printer, NULL);
    }
    printer_made = false;
    print_lines();
}

/* --- rtapi --- */

int rtapi_vsnprintf(char* to, unsigned long size, const char* format, va_list arguments) {
    return vsnprintf(to, size, format, arguments);
}
int rtapi_snprintf(char* to, unsigned long size, const char* format, ...) {
    va_list arguments;
    va_start(arguments, format);
    const int length = vsnprintf(to, size, format, arguments);
    va_end(arguments);
    return length;
}

long long rtapi_get_time(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec * 1000000000ll + now.tv_nsec;
}
long long rtapi_get_clocks(void) { return rtapi_get_time(); }
long rtapi_delay_max(void) { return 10000; }
void rtapi_delay(long ns) {
    const long long end = rtapi_get_time() + (ns < rtapi_delay_max() ? ns : rtapi_delay_max());
    while (rtapi_get_time() < end) {
    }
}

#ifdef HALCYON_PROGRAM
int rtapi_init(const char* name) { return name ? 1 : -EINVAL; } /* hal_init() comes next */
int rtapi_exit(int module) { return module == 1 ? 0 : -EINVAL; }
#else
int rtapi_init(const char* name) { return hal_init(name); }
int rtapi_exit(int module) { return hal_exit(module); }
#endif
int rtapi_is_kernelspace(void) { return 0; }
#ifdef HALCYON_PROGRAM
int rtapi_is_realtime(void) { return 0; }
#else
int rtapi_is_realtime(void) { return 1; }
#endif
int rtapi_prio_highest(void) { return 98; }
int rtapi_prio_lowest(void) { return 1; }
int rtapi_prio_next_higher(int priority) { return priority < 98 ? priority + 1 : 98; }
int rtapi_prio_next_lower(int priority) { return priority > 1 ? priority - 1 : 1; }
long rtapi_clock_set_period(long ns) { return ns == 0 ? 1000000 : -ENOSYS; }

char** rtapi_argv_split(rtapi_gfp_t how, const char* text, int* count) {
    (void)how;
    const size_t length = strlen(text);
    char** const words = malloc((length / 2 + 2) * sizeof *words + length + 1);
    if (!words) return NULL;
    char* copy = (char*)(words + length / 2 + 2);
    memcpy(copy, text, length + 1);
    int found = 0;
    char* rest = NULL;
    for (char* word = strtok_r(copy, " \t\n", &rest); word; word = strtok_r(NULL, " \t\n", &rest)) {
        words[found++] = word;
    }
    words[found] = NULL;
    if (count) {
        *count = found;
    }
    return words;
}
void rtapi_argv_free(char** words) { free(words); }
