/* SPDX-License-Identifier: MIT */
/* The other side of the CAN figures: no stack, blocking calls on one raw socket. `can_neutral IFACE slave`: SDO server of node 5 (2000h
   UNSIGNED32, 2001h domain; expedited, segmented, block), answers SYNC with TPDO 1 and RPDO 1 with TPDO 2, until it is killed.
   `… master`: measures such a slave. `… generate COUNT NS`: sends that many TPDO 1 that far apart, `… receive COUNT` takes them. Results are
   lines "name value". */
#define _GNU_SOURCE
#include <errno.h>
#include <linux/can.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

enum { node = 5, max = 8 << 20, blocks = 127 };
static int fd;
static uint8_t domain[max + 8];
static uint32_t domain_size, value;

static int64_t now_ns(clockid_t clock) {
    struct timespec t;
    clock_gettime(clock, &t);
    return t.tv_sec * 1000000000LL + t.tv_nsec;
}
static void until(int64_t ns) {
    const struct timespec t = {ns / 1000000000, ns % 1000000000};
    while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, NULL) == EINTR) {
    }
}
static void put(uint32_t id, const uint8_t* data, uint8_t length) {
    struct can_frame f;
    memset(&f, 0, sizeof f);
    f.can_id = id;
    f.can_dlc = length;
    memcpy(f.data, data, length);
    while (write(fd, &f, sizeof f) < 0 && (errno == ENOBUFS || errno == EAGAIN || errno == EINTR)) {
        usleep(50);
    }
}
/* 0: nothing came in time. */
static int get(struct can_frame* f) { return read(fd, f, sizeof *f) == sizeof *f; }

static uint16_t crc_of(const uint8_t* data, uint32_t size) {
    static uint16_t table[256];
    if (!table[1]) {
        for (unsigned n = 0; n < 256; ++n) {
            uint16_t c = (uint16_t)(n << 8);
            for (int bit = 0; bit < 8; ++bit) {
                c = (uint16_t)(c & 0x8000 ? c << 1 ^ 0x1021 : c << 1);
            }
            table[n] = c;
        }
    }
    uint16_t crc = 0;
    while (size--) {
        crc = (uint16_t)(crc << 8 ^ table[(crc >> 8 ^ *data++) & 0xff]);
    }
    return crc;
}
static void put_block(uint32_t id, uint32_t from, uint32_t size, unsigned count, unsigned* sent) {
    uint8_t b[8];
    for (*sent = 0; *sent < count && from + *sent * 7 < size;) {
        const uint32_t at = from + *sent * 7;
        memcpy(b + 1, domain + at, 7);
        b[0] = (uint8_t)(++*sent | (at + 7 >= size ? 0x80 : 0));
        put(id, b, 8);
    }
}
static uint8_t unused(uint32_t size) { return (uint8_t)((7 - size % 7) % 7); }

/* The slave. */
static void slave(void) {
    enum { idle, down, up, block_down, block_up } mode = idle;
    uint32_t at = 0;
    unsigned sequence = 0;
    unsigned size = blocks;
    uint8_t tpdo[8] = {0};
    struct can_frame f;
    for (;;) {
        if (!get(&f)) continue;
        uint8_t a[8] = {0}, *d = f.data;
        if (f.can_id == 0x80) {
            put(0x180 + node, tpdo, 8);
            ++tpdo[0];
        } else if (f.can_id == 0x200 + node) {
            put(0x280 + node, d, f.can_dlc);
        } else if (f.can_id == 0x600 + node) {
            const int is_domain = d[1] == 1;
            memcpy(a + 1, d + 1, 3);
            if (mode == block_down && d[0] != 0x80 &&
                !(d[0] >> 5 == 6 && sequence == 0 && at >= domain_size)) {
                if ((d[0] & 0x7f) == sequence + 1) {
                    if (at + 7 <= max) {
                        memcpy(domain + at, d + 1, 7);
                    }
                    at += 7;
                    ++sequence;
                }
                if ((d[0] & 0x80) || (d[0] & 0x7f) == blocks) {
                    const uint8_t acknowledge[8] = {0xa2, (uint8_t)sequence, blocks};
                    put(0x580 + node, acknowledge, 8);
                    sequence = 0;
                }
                continue;
            }
            if (d[0] >> 5 == 1) {
                a[0] = 0x60;
                if (d[0] & 2) {
                    memcpy(&value, d + 4, 4);
                } else {
                    mode = down;
                    at = 0;
                }
            } else if (d[0] == 0x40 && !is_domain) {
                a[0] = 0x43;
                memcpy(a + 4, &value, 4);
            } else if (d[0] == 0x40) {
                a[0] = 0x41;
                mode = up;
                at = 0;
                memcpy(a + 4, &domain_size, 4);
            } else if (mode == down && d[0] >> 5 == 0) {
                const uint32_t n = 7 - (d[0] >> 1 & 7);
                if (at + 7 <= max) {
                    memcpy(domain + at, d + 1, n);
                }
                at += n;
                if (d[0] & 1) {
                    domain_size = at;
                    mode = idle;
                }
                memset(a, 0, 8);
                a[0] = (uint8_t)(0x20 | (d[0] & 0x10));
            } else if (mode == up && d[0] >> 5 == 3) {
                const uint32_t n = domain_size - at < 7 ? domain_size - at : 7;
                memcpy(a + 1, domain + at, n);
                at += n;
                a[0] = (uint8_t)((d[0] & 0x10) | (7 - n) << 1 | (at == domain_size));
            } else if ((d[0] & 0xe1) == 0xc0) {
                a[0] = 0xa4;
                a[4] = blocks;
                mode = block_down;
                at = sequence = 0;
                memcpy(&domain_size, d + 4, 4);
            } else if ((d[0] & 0xe1) == 0xc1) {
                memset(a, 0, 8);
                a[0] = 0xa1;
                mode = idle;
                if (crc_of(domain, domain_size) != (d[1] | d[2] << 8)) {
                    memset(a, 0xff, 8);
                    a[0] = 0x80;
                }
            } else if ((d[0] & 0xe3) == 0xa0) {
                a[0] = 0xc6;
                size = d[4];
                mode = block_up;
                at = 0;
                memcpy(a + 4, &domain_size, 4);
            } else if (mode == block_up && d[0] == 0xa3) {
                put_block(0x580 + node, 0, domain_size, size, &sequence);
                continue;
            } else if (mode == block_up && d[0] == 0xa2) {
                at += d[1] * 7u;
                size = d[2];
                if (at < domain_size) {
                    put_block(0x580 + node, at, domain_size, size, &sequence);
                    continue;
                }
                const uint16_t crc = crc_of(domain, domain_size);
                memset(a, 0, 8);
                a[0] = (uint8_t)(0xc1 | unused(domain_size) << 2);

                a[1] = (uint8_t)crc;
                a[2] = (uint8_t)(crc >> 8);
            } else {
                mode = idle;
                continue;
            }
            put(0x580 + node, a, 8);
        }
    }
}

/* The master. */
static void fail(const char* what) {
    fprintf(stderr, "can_neutral: %s\n", what);
    exit(1);
}
static void ask(const uint8_t* request, struct can_frame* answer) {
    put(0x600 + node, request, 8);
    do {
        if (!get(answer)) {
            fail("no answer to SDO");
        }
    } while (answer->can_id != 0x580 + node);
    if (answer->data[0] == 0x80) {
        fail("SDO aborted");
    }
}
static void expedited(int upload, unsigned count) {
    const uint8_t request[8] = {upload ? 0x40 : 0x23, 0x00, 0x20, 0, 1, 2, 3, 4};
    struct can_frame f;
    const int64_t began = now_ns(CLOCK_MONOTONIC);
    const int64_t cpu = now_ns(CLOCK_PROCESS_CPUTIME_ID);
    for (unsigned n = 0; n < count; ++n) {
        ask(request, &f);
    }
    printf("exp_%s %.0f\nexp_%s_cpu %.3f\n", upload ? "up" : "down",
           count * 1e9 / (double)(now_ns(CLOCK_MONOTONIC) - began), upload ? "up" : "down",
           (double)(now_ns(CLOCK_PROCESS_CPUTIME_ID) - cpu) / count / 1000);
}
static void download(uint32_t size, int block) {
    uint8_t b[8] = {block ? 0xc6 : 0x21, 0x01, 0x20, 0};
    struct can_frame f;
    memcpy(b + 4, &size, 4);
    ask(b, &f);
    if (!block) {
        for (uint32_t at = 0, toggle = 0; at < size; at += 7, toggle ^= 0x10) {
            const uint32_t n = size - at < 7 ? size - at : 7;
            b[0] = (uint8_t)(toggle | (7 - n) << 1 | (at + n == size));
            memcpy(b + 1, domain + at, 7);
            ask(b, &f);
        }
        return;
    }
    unsigned sent, blksize = f.data[4];
    for (uint32_t at = 0; at < size;) {
        put_block(0x600 + node, at, size, blksize, &sent);
        do {
            if (!get(&f)) {
                fail("no acknowledgement");
            }
        } while (f.can_id != 0x580 + node || f.data[0] != 0xa2);
        at += f.data[1] * 7u;
        blksize = f.data[2];
    }
    const uint16_t crc = crc_of(domain, size);
    memset(b, 0, 8);
    b[0] = (uint8_t)(0xc1 | unused(size) << 2);
    b[1] = (uint8_t)crc;

    b[2] = (uint8_t)(crc >> 8);
    ask(b, &f);
}
static void upload(uint32_t size, int block, uint8_t* to) {
    uint8_t b[8] = {block ? 0xa4 : 0x40, 0x01, 0x20, 0, block ? blocks : 0};
    struct can_frame f;
    ask(b, &f);
    memset(b, 0, 8);
    if (!block) {
        for (uint32_t at = 0, toggle = 0;; toggle ^= 0x10) {
            b[0] = (uint8_t)(0x60 | toggle);
            ask(b, &f);
            const uint32_t n = 7 - (f.data[0] >> 1 & 7);
            memcpy(to + at, f.data + 1, n);
            at += n;
            if (f.data[0] & 1) return;
        }
    }
    b[0] = 0xa3;
    put(0x600 + node, b, 8);
    unsigned sequence = 0;
    for (uint32_t at = 0;;) {
        if (!get(&f)) {
            fail("a segment is missing");
        }
        if (f.can_id != 0x580 + node || (f.data[0] & 0x7f) != sequence + 1) continue;
        memcpy(to + at, f.data + 1, 7);
        at += 7;
        ++sequence;
        const int last = f.data[0] & 0x80;
        if (sequence < blocks && !last) continue;
        const uint8_t acknowledge[8] = {0xa2, (uint8_t)sequence, blocks};
        sequence = 0;
        put(0x600 + node, acknowledge, 8);
        if (!last) continue;
        do {
            if (!get(&f)) {
                fail("the end of the upload is missing");
            }
        } while (f.can_id != 0x580 + node || (f.data[0] & 0xe3) != 0xc1);
        if (crc_of(to, size) != (f.data[1] | f.data[2] << 8)) {
            fail("CRC of the upload");
        }
        const uint8_t done[8] = {0xa1};
        put(0x600 + node, done, 8);
        return;
    }
}
static void transfers(const char* name, uint32_t size, int block) {
    static uint8_t back[max + 8];
    for (uint32_t n = 0; n < size; ++n) {
        domain[n] = (uint8_t)(n * 7 + n / 251);
    }
    int64_t began = now_ns(CLOCK_MONOTONIC);
    download(size, block);
    printf("%s_down %.1f\n", name, size * 1e6 / (double)(now_ns(CLOCK_MONOTONIC) - began));
    began = now_ns(CLOCK_MONOTONIC);
    upload(size, block, back);
    printf("%s_up %.1f\n", name, size * 1e6 / (double)(now_ns(CLOCK_MONOTONIC) - began));
    if (memcmp(domain, back, size) != 0) {
        fail("the bytes read differ from those written");
    }
}
static int by_size(const void* a, const void* b) {
    return *(const int64_t*)a < *(const int64_t*)b ? -1 : *(const int64_t*)a > *(const int64_t*)b;
}
static void synchronous(unsigned count) {
    int64_t* const took = calloc(count, sizeof *took);
    struct can_frame f;
    const int64_t cpu = now_ns(CLOCK_PROCESS_CPUTIME_ID);
    int64_t next = now_ns(CLOCK_MONOTONIC) + 1000000;
    for (unsigned n = 0; n < count; ++n, next += 1000000) {
        until(next);
        const int64_t began = now_ns(CLOCK_MONOTONIC);
        put(0x80, NULL, 0);
        do {
            if (!get(&f)) {
                fail("no TPDO after a SYNC");
            }
        } while (f.can_id != 0x180 + node);
        took[n] = now_ns(CLOCK_MONOTONIC) - began;
    }
    const double cpu_us = (double)(now_ns(CLOCK_PROCESS_CPUTIME_ID) - cpu) / count / 1000;
    qsort(took, count, sizeof *took, by_size);
    printf("sync_p50 %.1f\nsync_p99 %.1f\nsync_cpu %.2f\n", (double)took[count / 2] / 1000,
           (double)took[count - count / 100 - 1] / 1000, cpu_us);
}

int main(int argc, char** argv) {
    if (argc < 3) {
        fputs("can_neutral IFACE slave|master [FACTOR]|generate COUNT NS|receive COUNT\n", stderr);

        return 2;
    }
    struct sockaddr_can at = {.can_family = AF_CAN, .can_ifindex = (int)if_nametoindex(argv[1])};
    const struct timeval timeout = {2, 0};
    const int capacity = 4 << 20;
    const int master = strcmp(argv[2], "master") == 0;

    const int answered = master || strcmp(argv[2], "receive") == 0;
    const struct can_filter heard[] = {
        {0x080, CAN_SFF_MASK}, {0x200 + node, CAN_SFF_MASK}, {0x600 + node, CAN_SFF_MASK}};
    const struct can_filter answers[] = {{0x180 + node, CAN_SFF_MASK},
                                         {0x580 + node, CAN_SFF_MASK}};
    fd = socket(PF_CAN, SOCK_RAW, CAN_RAW);
    if (fd < 0) {
        perror("can_neutral");
        return 1;
    }
    setsockopt(fd, SOL_CAN_RAW, CAN_RAW_FILTER, answered ? answers : heard,
               answered ? sizeof answers : sizeof heard);
    setsockopt(fd, SOL_SOCKET, SO_RCVBUFFORCE, &capacity, sizeof capacity);
    setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &timeout, sizeof timeout);
    if (bind(fd, (struct sockaddr*)&at, sizeof at) < 0) {
        perror("can_neutral");
        return 1;
    }
    puts("ready");
    fflush(stdout);
    if (strcmp(argv[2], "slave") == 0) {
        slave();
    }
    if (strcmp(argv[2], "generate") == 0 && argc == 5) {
        uint8_t data[8] = {0};
        int64_t next = now_ns(CLOCK_MONOTONIC);
        for (long n = 0, count = atol(argv[3]); n < count; ++n, next += atol(argv[4])) {
            until(next);
            memcpy(data, &n, sizeof n);
            put(0x180 + node, data, 8);
        }
        return 0;
    }
    if (!master && strcmp(argv[2], "receive") != 0) return 2;
    if (!master) {
        struct can_frame f;
        long got = 0, count = argc > 3 ? atol(argv[3]) : 1;
        const int64_t cpu = now_ns(CLOCK_PROCESS_CPUTIME_ID);
        while (got < count && get(&f)) {
            ++got;
        }
        printf("received %ld\nreceive_cpu %.3f\n", got,
               (double)(now_ns(CLOCK_PROCESS_CPUTIME_ID) - cpu) / (double)(got ? got : 1) / 1000);
        return 0;
    }
    const unsigned part = argc > 3 ? (unsigned)atoi(argv[3]) : 1; /* 4: a quarter of everything */
    expedited(1, 5000 / part);
    expedited(0, 5000 / part);
    transfers("seg64k", 65536, 0);
    transfers("seg1m", (1 << 20) / part, 0);
    transfers("blk64k", 65536, 1);
    transfers("blk1m", 1 << 20, 1);
    synchronous(5000 / part);
    return 0;
}
