/* SPDX-License-Identifier: MIT */
/* Reads numbered bytes from one port and writes such to another, in pieces of many sizes, and uses both wrongly. */
#include "declared.h"
#include <signal.h>

enum { max = 4000 };
static volatile int *from, *to;
static sig_atomic_t stop;

static void end(int signal) { stop = signal; }

static bool receive(unsigned* number, unsigned count, bool in_two_steps) {
    char bytes[64], seen[64];
    if (in_two_steps) {
        if (!hal_port_peek(*from, seen, count) || !hal_port_peek(*from, bytes, count) ||
            !hal_port_peek_commit(*from, count)) {
            return false;
        }
        if (memcmp(seen, bytes, count) != 0) {
            printf("peeking changed something\n");
            return false;
        }
    } else if (!hal_port_read(*from, bytes, count)) {
        return false;
    }
    for (unsigned i = 0; i < count; ++i) {
        if ((unsigned char)bytes[i] != (unsigned char)(*number)++) {
            printf("byte %u is %u\n", *number - 1, (unsigned char)bytes[i]);
            return false;
        }
    }
    return true;
}

static bool transmit(unsigned* number, unsigned count) {
    char bytes[64];
    for (unsigned i = 0; i < count; ++i) {
        bytes[i] = (char)(*number + i);
    }
    if (!hal_port_write(*to, bytes, count)) return false;
    *number += count;
    return true;
}

int main(void) {
    char bytes[400] = "";
    signal(SIGTERM, end);
    const int comp = hal_init("talker");
    if (hal_pin_port_new("talker.both", HAL_IO, &to, comp) != -22 ||
        hal_pin_port_newf(HAL_OUT, &to, comp, "talker.%s", "to") ||
        hal_pin_new("talker.from", HAL_PORT, HAL_IN, (void**)&from, comp)) {
        return 1;
    }
    printf("id %d, unlinked %u %u %u %d %d\n", comp, hal_port_buffer_size(*to),
           hal_port_writable(*to), hal_port_readable(*from), hal_port_write(*to, bytes, 1),
           hal_port_read(*from, bytes, 1));
    fflush(stdout);
    if (hal_ready(comp) != 0) return 1;
    hal_port_wait_readable((volatile int**)&from, 30, &stop);
    const bool reads = hal_port_read(*to, bytes, 1);

    const bool writes = hal_port_write(*from, bytes, 1); /* in this order */
    printf("wrong %d %d %d %d %d %d\n", reads, writes, hal_port_read(*from, bytes, 0),
           hal_port_write(*to, bytes, 400), hal_port_read(0, bytes, 1),
           hal_port_write(12345, bytes, 1));
    unsigned received = 0;
    unsigned transmitted = 0;
    for (unsigned turn = 0; !stop && (received < max || transmitted < max); ++turn) {
        const unsigned count = 1 + turn % 64;
        if (received < max) {
            hal_port_wait_readable((volatile int**)&from, count, &stop);
            if (!stop && !receive(&received, count, turn % 2)) {
                printf("not received\n");
                return 1;
            }
        }
        if (transmitted < max) {
            hal_port_wait_writable((volatile int**)&to, count, &stop);
            if (!stop && !transmit(&transmitted, count)) {
                printf("not transmitted\n");
                return 1;
            }
        }
    }
    printf("size %u, received %d, transmitted %u\n", hal_port_buffer_size(*to), received >= max,
           transmitted);
    hal_port_wait_readable((volatile int**)&from, 1000,
                           &stop); /* more than it holds: until the program is to end */
    const int before = hal_get_lock();
    const int other = hal_set_lock(8);
    const int allocated = hal_port_alloc(10);

    const int set = hal_set_lock(3);
    const int then = hal_get_lock();
    const int reset = hal_set_lock(0);
    printf("stopped by %d, lock %d, other %d, allocated %d, set %d %d, reset %d %d\n", (int)stop,
           before, other, allocated, set, then, reset, hal_get_lock());
    return hal_exit(comp);
}
