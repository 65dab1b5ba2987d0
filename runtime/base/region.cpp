// SPDX-License-Identifier: MIT
#include "base/region.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <mutex>
#include <sys/mman.h>

namespace hal::region {
namespace {

constexpr std::size_t chunk_bytes = std::size_t{256} << 10;
constexpr std::size_t max_chunks = 65536;
constexpr std::size_t opened_at_once = 8;  // 2 MiB: a huge page; divides max_chunks
constexpr std::size_t max_block = chunk_bytes / 16;  // larger ones leave too much of a chunk unused
constexpr std::size_t min_alignment = alignof(std::max_align_t);
constexpr std::size_t max_alignment = 4096;  // that of a chunk is at least a page
constexpr std::uint32_t open_count = 1U << 31;  // of an open chunk, beside what was freed of it

/// The chunks of the process. The first Scope reserves their addresses.
class Chunks {
public:
    /// Returns false when the addresses cannot be reserved.
    bool reserve() {
        if constexpr (sizeof(void*) < 8) return false;
        const std::lock_guard lock(mutex_);
        if (begin_.load(std::memory_order_relaxed)) return true;
        constexpr int flags = MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE;
        void* const memory = ::mmap(nullptr, max_chunks * chunk_bytes, PROT_NONE, flags, -1, 0);
        if (memory == MAP_FAILED) return false;
        // fewer page faults and TLB misses; where there are none, small pages do
        static_cast<void>(::madvise(memory, max_chunks * chunk_bytes, MADV_HUGEPAGE));
        begin_.store(static_cast<char*>(memory), std::memory_order_release);
        return true;
    }

    bool has(const void* memory) const {
        const char* const begin = begin_.load(std::memory_order_acquire);
        const auto offset = static_cast<std::size_t>(static_cast<const char*>(memory) - begin);
        return begin && offset < max_chunks * chunk_bytes;
    }

    /// Returns a chunk for the objects of one thread; nullptr when all are in use.
    char* open() {
        const std::lock_guard lock(mutex_);
        char* const begin = begin_.load(std::memory_order_relaxed);
        char* chunk = free_;
        if (chunk) {
            free_ = *reinterpret_cast<char**>(chunk);
        } else if (made_ < max_chunks) {
            chunk = begin + made_ * chunk_bytes;
            if (made_ % opened_at_once == 0 && !make_accessible(chunk)) return nullptr;
            ++made_;
        } else {
            return nullptr;
        }
        ++in_use_;
        live_of(chunk).store(open_count, std::memory_order_relaxed);
        return chunk;
    }

    /// `objects`: those that are live, beside what release() was called for meanwhile.
    void close(char* chunk, std::uint32_t objects) { count_down(chunk, open_count - objects); }

    void release(void* memory) {
        char* const begin = begin_.load(std::memory_order_relaxed);
        const auto offset = static_cast<std::size_t>(static_cast<char*>(memory) - begin);
        count_down(begin + offset / chunk_bytes * chunk_bytes, 1);
    }

    std::size_t in_use() {
        const std::lock_guard lock(mutex_);
        return in_use_;
    }

private:
    /// Not all at once: a program that locks its memory would get the whole range.
    static bool make_accessible(char* chunk) {
        return ::mprotect(chunk, opened_at_once * chunk_bytes, PROT_READ | PROT_WRITE) == 0;
    }

    std::atomic<std::uint32_t>& live_of(const char* chunk) {
        const char* const begin = begin_.load(std::memory_order_relaxed);
        return live_[static_cast<std::size_t>(chunk - begin) / chunk_bytes];
    }

    void count_down(char* chunk, std::uint32_t by) {
        if (live_of(chunk).fetch_sub(by, std::memory_order_acq_rel) != by) return;
        const std::lock_guard lock(mutex_);
        *reinterpret_cast<char**>(chunk) = free_;
        free_ = chunk;
        --in_use_;
    }

    std::atomic<char*> begin_{nullptr};  // written once
    std::array<std::atomic<std::uint32_t>, max_chunks> live_{};
    std::mutex mutex_;  // of all below
    char* free_ = nullptr;  // the first of a list of chunks that begin with the address of the next
    std::size_t made_ = 0;
    std::size_t in_use_ = 0;
};

constinit Chunks chunks;

/// Where the calling thread allocates.
struct OpenChunk {
    int scopes = 0;
    char* chunk = nullptr;  // nullptr: none is open
    std::size_t used = 0;  // bytes of it
    std::uint32_t objects = 0;  // in it, beside what other code than release_newest() has freed
};

constinit thread_local OpenChunk open_chunk;

/// `alignment` is a power of two.
std::size_t aligned(std::size_t offset, std::size_t alignment) {
    return (offset + alignment - 1) & ~(alignment - 1);
}

std::size_t rounded(std::size_t bytes) {
    return aligned(std::max<std::size_t>(bytes, 1), min_alignment);
}

void close_chunk() {
    if (!open_chunk.chunk) return;
    chunks.close(open_chunk.chunk, open_chunk.objects);
    open_chunk.chunk = nullptr;
}

/// Returns false unless the block is the newest one of the thread's chunk, as of a short-lived
/// text.
bool release_newest(char* memory, std::size_t bytes) {
    const bool is_newest = open_chunk.chunk && bytes > 0 && memory >= open_chunk.chunk &&
                           memory + rounded(bytes) == open_chunk.chunk + open_chunk.used;
    if (!is_newest) return false;
    open_chunk.used = static_cast<std::size_t>(memory - open_chunk.chunk);
    --open_chunk.objects;
    return true;
}

}  // namespace

Scope::Scope() noexcept {
    if (open_chunk.scopes > 0 || chunks.reserve()) {
        ++open_chunk.scopes;
    }
}

Scope::~Scope() {
    if (open_chunk.scopes == 0) return;
    --open_chunk.scopes;
    if (open_chunk.scopes == 0) {
        close_chunk();
    }
}

void* allocate(std::size_t bytes, std::size_t alignment) noexcept {
    if (open_chunk.scopes == 0 || bytes > max_block || alignment > max_alignment) return nullptr;
    std::size_t begin = aligned(open_chunk.used, alignment);
    if (!open_chunk.chunk || begin + rounded(bytes) > chunk_bytes) {
        close_chunk();
        open_chunk.chunk = chunks.open();
        open_chunk.used = 0;
        open_chunk.objects = 0;
        if (!open_chunk.chunk) return nullptr;
        begin = 0;
    }
    open_chunk.used = begin + rounded(bytes);
    ++open_chunk.objects;
    return open_chunk.chunk + begin;
}

bool has(const void* memory) noexcept { return chunks.has(memory); }

void release(void* memory, std::size_t bytes) noexcept {
    if (!release_newest(static_cast<char*>(memory), bytes)) {
        chunks.release(memory);
    }
}

std::size_t chunks_in_use() noexcept { return chunks.in_use(); }

}  // namespace hal::region
