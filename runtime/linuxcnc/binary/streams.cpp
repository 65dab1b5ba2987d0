// SPDX-License-Identifier: MIT
// Streams: FIFOs of records in shared memory by key, in the layout that LinuxCNC's halsampler and
// halstreamer use.
#include <atomic>
#include <cerrno>
#include <cstring>
#include <string_view>
#include <sys/shm.h>

#include "linuxcnc/binary/rtapi_interface.hpp"

namespace {

constexpr std::uint32_t magic = 0x4649464f;
constexpr std::size_t max_pins = 21;
constexpr int max_depth = 1 << 24;

struct Header {
    std::uint32_t magic;
    std::atomic<std::uint32_t> in, out;  // index of the next record to write and to read
    std::uint32_t number;                // of the newest record; the writer's
    std::int32_t depth, pins;
    std::atomic<std::uint32_t> overruns, underruns;
    char unused[8];
    std::int32_t types[max_pins];
};
constexpr std::size_t data_offset = 128;
static_assert(offsetof(Header, depth) == 16 && offsetof(Header, overruns) == 24 &&
              offsetof(Header, types) == 40 && sizeof(Header) <= data_offset);

Header& header(const halcyon_stream* stream) { return *static_cast<Header*>(stream->fifo); }

// One value more than pins: the number of the record.
halcyon_stream_value* record(const halcyon_stream* stream, std::uint32_t index) {
    auto* const data =
        reinterpret_cast<halcyon_stream_value*>(static_cast<char*>(stream->fifo) + data_offset);
    return data + std::size_t{index} * (static_cast<std::size_t>(header(stream).pins) + 1);
}

std::uint32_t next(const Header& of, std::uint32_t index) {
    return index + 1 == static_cast<std::uint32_t>(of.depth) ? 0 : index + 1;
}

int type_of(char letter) {
    constexpr std::string_view letters = "bBfFrRsSuUlLkK";
    constexpr int types[] = {1, 2, 2, 3, 4, 6, 7};
    const std::size_t index = letters.find(letter);
    return index == letters.npos ? 0 : types[index / 2];
}

}  // namespace

extern "C" {

int hal_stream_create(halcyon_stream* stream, int comp, int key, int depth, const char* types) {
    const std::size_t pins = types ? std::strlen(types) : 0;
    if (!stream || pins == 0 || pins > max_pins || depth < 1 || depth > max_depth) return -EINVAL;
    for (std::size_t i = 0; i < pins; ++i) {
        if (type_of(types[i]) == 0) return -EINVAL;
    }
    const int segment = rtapi_shmem_new(
        key, comp,
        data_offset + sizeof(halcyon_stream_value) * static_cast<std::size_t>(depth) * (pins + 1));
    if (segment < 0) return segment;
    *stream = {comp, segment, nullptr};
    rtapi_shmem_getptr(segment, &stream->fifo);
    Header& made = header(stream);
    std::memset(stream->fifo, 0, data_offset);
    made.depth = depth;
    made.pins = static_cast<std::int32_t>(pins);
    for (std::size_t i = 0; i < pins; ++i) {
        made.types[i] = type_of(types[i]);
    }
    std::atomic_thread_fence(std::memory_order_release);
    made.magic = magic;  // last: a program that finds it finds the rest
    return 0;
}

void hal_stream_destroy(halcyon_stream* stream) {
    header(stream).magic = 0;
    hal_stream_detach(stream);
}
int hal_stream_detach(halcyon_stream* stream) {
    stream->fifo = nullptr;
    return rtapi_shmem_delete(stream->segment, stream->comp);
}

int hal_stream_attach(halcyon_stream* stream, int comp, int key, const char* types) {
    if (!stream) return -EINVAL;
    if (shmget(key, 0, 0) < 0) {
        return -errno;  // the writer creates it
    }
    const int segment = rtapi_shmem_new(key, comp, data_offset);
    if (segment < 0) return segment;
    *stream = {comp, segment, nullptr};
    rtapi_shmem_getptr(segment, &stream->fifo);
    const Header& found = header(stream);
    bool good = found.magic == magic &&
                (!types || std::strlen(types) == static_cast<std::size_t>(found.pins));
    for (int i = 0; good && types && i < found.pins; ++i) {
        good = type_of(types[i]) == found.types[i];
    }
    if (!good) {
        hal_stream_detach(stream);
    }
    return good ? 0 : -EINVAL;
}

int hal_stream_element_count(halcyon_stream* stream) { return header(stream).pins; }
int hal_stream_element_type(halcyon_stream* stream, int index) {
    return index < 0 || index >= header(stream).pins ? -EINVAL : header(stream).types[index];
}
int hal_stream_maxdepth(halcyon_stream* stream) { return header(stream).depth; }
int hal_stream_depth(halcyon_stream* stream) {
    const Header& of = header(stream);
    const int difference = static_cast<int>(of.in.load(std::memory_order_acquire)) -
                           static_cast<int>(of.out.load(std::memory_order_acquire));
    return difference < 0 ? difference + of.depth : difference;
}
bool hal_stream_readable(halcyon_stream* stream) {
    return header(stream).in.load(std::memory_order_acquire) !=
           header(stream).out.load(std::memory_order_relaxed);
}
bool hal_stream_writable(halcyon_stream* stream) {
    const Header& of = header(stream);
    return next(of, of.in.load(std::memory_order_relaxed)) !=
           of.out.load(std::memory_order_acquire);
}
int hal_stream_num_overruns(halcyon_stream* stream) {
    return static_cast<int>(header(stream).overruns.load(std::memory_order_relaxed));
}
int hal_stream_num_underruns(halcyon_stream* stream) {
    return static_cast<int>(header(stream).underruns.load(std::memory_order_relaxed));
}

int hal_stream_read(halcyon_stream* stream, halcyon_stream_value* to, unsigned* number) {
    Header& of = header(stream);
    if (!hal_stream_readable(stream)) {
        of.underruns.fetch_add(1, std::memory_order_relaxed);
        return -ENOSPC;
    }
    const std::uint32_t index = of.out.load(std::memory_order_relaxed);
    const halcyon_stream_value* const from = record(stream, index);
    std::memcpy(to, from, static_cast<std::size_t>(of.pins) * sizeof *from);
    if (number) {
        *number = from[of.pins].u32;
    }
    of.out.store(next(of, index), std::memory_order_release);
    return 0;
}

int hal_stream_write(halcyon_stream* stream, halcyon_stream_value* from) {
    Header& of = header(stream);
    if (!hal_stream_writable(stream)) {
        of.overruns.fetch_add(1, std::memory_order_relaxed);
        return -ENOSPC;
    }
    const std::uint32_t index = of.in.load(std::memory_order_relaxed);
    halcyon_stream_value* const to = record(stream, index);
    std::memcpy(to, from, static_cast<std::size_t>(of.pins) * sizeof *to);
    // 1 for the first record, as halsampler expects; lost records have no number
    to[of.pins].raw = ++of.number;
    of.in.store(next(of, index), std::memory_order_release);
    return 0;
}
}
