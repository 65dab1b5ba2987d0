/* SPDX-License-Identifier: MIT */
/* Gives a second instance in the place of the first the static variables as they were when the
 * library was loaded. */
#define _GNU_SOURCE
#include <link.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "inside.h"

struct memory {
    char* begin;
    size_t bytes;
};
static struct {
    struct memory memory[8];
    size_t count;
    char* copy;
} image;

static int note_segments(struct dl_phdr_info* info, size_t size, void* inside) {
    (void)size;
    bool mine = false;
    for (int i = 0; i < info->dlpi_phnum; ++i) {
        const char* const begin = (const char*)info->dlpi_addr + info->dlpi_phdr[i].p_vaddr;
        mine = mine || (info->dlpi_phdr[i].p_type == PT_LOAD && (const char*)inside >= begin &&
                        (const char*)inside < begin + info->dlpi_phdr[i].p_memsz);
    }
    if (!mine) return 0;
    /* end of what the loader protects after relocating: the begin of a writable segment */
    const char* read_only = NULL;
    for (int i = 0; i < info->dlpi_phnum; ++i) {
        if (info->dlpi_phdr[i].p_type == PT_GNU_RELRO) {
            read_only = (const char*)info->dlpi_addr + info->dlpi_phdr[i].p_vaddr +
                        info->dlpi_phdr[i].p_memsz;
        }
    }
    const uintptr_t page = (uintptr_t)sysconf(_SC_PAGESIZE);
    for (int i = 0; i < info->dlpi_phnum; ++i) {
        if (info->dlpi_phdr[i].p_type != PT_LOAD || !(info->dlpi_phdr[i].p_flags & PF_W) ||
            image.count == sizeof image.memory / sizeof *image.memory) {
            continue;
        }
        char* begin = (char*)info->dlpi_addr + info->dlpi_phdr[i].p_vaddr;
        char* const end = begin + info->dlpi_phdr[i].p_memsz;
        if (read_only > begin && read_only <= end) {
            begin = (char*)(((uintptr_t)read_only + page - 1) / page * page);
        }
        if (begin < end) {
            image.memory[image.count++] = (struct memory){begin, (size_t)(end - begin)};
        }
    }
    return 1;
}

__attribute__((destructor)) static void free_copy(void) { free((char*)image.copy); }

bool halcyon_restore_variables(void) {
    if (!image.copy) {
        dl_iterate_phdr(note_segments, &image);
        size_t bytes = 0;
        for (size_t i = 0; i < image.count; ++i) {
            bytes += image.memory[i].bytes;
        }
        char* const copy = malloc(bytes);
        if (!copy) return false;
        image.copy = copy;
        for (size_t i = 0, at = 0; i < image.count; at += image.memory[i++].bytes) {
            memcpy(copy + at, image.memory[i].begin, image.memory[i].bytes);
        }
        return true;
    }
    struct memory memory[8];
    const size_t count = image.count;
    const char* const copy = image.copy;
    memcpy(memory, image.memory, sizeof memory);
    for (size_t i = 0, at = 0; i < count; at += memory[i++].bytes) {
        memcpy(memory[i].begin, copy + at, memory[i].bytes);
    }
    return true;
}
