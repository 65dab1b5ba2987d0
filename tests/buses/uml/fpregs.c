/* SPDX-License-Identifier: MIT
 * Loaded before linux.uml, whose kernel (6.1) reserves too few bytes for the extended processor state of a CPU with AVX-512 or AMX: the host's
 * kernel rejects a state that is not whole, and the guest dies at its first process. What the guest reads into a buffer is therefore kept
 * whole here, by the address of the buffer, and completes what the guest writes back from there. */
#define _GNU_SOURCE
#include <elf.h>
#include <stdarg.h>
#include <string.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

enum {
    peek_text = 1,
    peek_user = 3,
    get_register_set = 0x4204,
    set_register_set = 0x4205,
    max = 16384,
    places = 1024
};

static struct {
    const void* of;
    unsigned char state[max];
} kept[places];

static unsigned char* kept_state(const void* of) {
    unsigned place = (unsigned)((unsigned long)of / 64) % places;
    for (unsigned tries = 0; tries < places; ++tries, place = (place + 1) % places) {
        if (!kept[place].of) {
            kept[place].of = of;
        }
        if (kept[place].of == of) return kept[place].state;
    }
    return 0;
}

static long raw(long request, long process, long address, void* data) {
    return syscall(SYS_ptrace, request, process, address, data);
}

static long get_state(long process, struct iovec* to) {
    unsigned char* const state = kept_state(to->iov_base);
    if (!state) return -1;
    struct iovec whole = {state, max};
    const long result = raw(get_register_set, process, NT_X86_XSTATE, &whole);
    if (result < 0) return result;
    if (to->iov_len > whole.iov_len) {
        to->iov_len = whole.iov_len;
    }
    memcpy(to->iov_base, state, to->iov_len);
    return result;
}

static long set_state(long process, const struct iovec* from) {
    static unsigned char now[max];
    struct iovec whole = {now, max};
    if (raw(get_register_set, process, NT_X86_XSTATE, &whole) < 0) return -1;
    unsigned char* const state = kept_state(from->iov_base);
    if (state) {
        memcpy(now, state, whole.iov_len);
    }
    memcpy(now, from->iov_base, from->iov_len < whole.iov_len ? from->iov_len : whole.iov_len);
    return raw(set_register_set, process, NT_X86_XSTATE, &whole);
}

long ptrace(int request, ...) {
    va_list arguments;
    va_start(arguments, request);
    const long process = va_arg(arguments, int);
    const long address = va_arg(arguments, long);
    void* const data = va_arg(arguments, void*);
    va_end(arguments);
    if (request == get_register_set && address == NT_X86_XSTATE) return get_state(process, data);
    if (request == set_register_set && address == NT_X86_XSTATE) return set_state(process, data);
    if (request < peek_text || request > peek_user) return raw(request, process, address, data);
    long word = 0; /* the system call writes what it peeks; the function returns it */
    return raw(request, process, address, &word) < 0 ? -1 : word;
}
