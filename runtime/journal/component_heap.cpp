// SPDX-License-Identifier: MIT
#include "journal/component_heap.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fmt/core.h>
#include <link.h>
#include <memory>
#include <mutex>
#include <new>
#include <string_view>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unwind.h>
#include <utility>

#include "base/region.hpp"
#include "execute/core.hpp"
#include "machine/load/component_memory.hpp"
#include "machine/load/setup_call.hpp"

namespace hal {
namespace {

struct CodeRange {
    std::uint64_t begin = 0;
    std::uint64_t end = 0;
    bool has(std::uint64_t address) const { return address >= begin && address < end; }
};

/// Which code of this process asks for memory. A component that asks the program for something, as
/// a pin, does not own what the program allocates for that.
class Callers {
public:
    Callers() {
        dl_iterate_phdr(&Callers::note, this);
        is_of_program(__builtin_return_address(0));  // loads the unwinder
    }

    /// Returns false when the program uses more libraries than this can note.
    bool are_all() const { return are_all_; }

    /// `from`: where `operator new` returns to. Functions of libraries that the program was linked
    /// with ask for their callers.
    bool is_of_program(void* from) const {
        const auto address = reinterpret_cast<std::uint64_t>(from);
        if (program_.has(address)) return true;
        if (!is_in_library(address)) return false;
        Search search{*this, address};
        _Unwind_Backtrace(&Callers::look, &search);
        return search.found;
    }

private:
    struct Search {
        const Callers& callers;
        std::uint64_t from;
        bool passed = false;  // the frames of `operator new` itself
        bool found = false;
    };
    static _Unwind_Reason_Code look(_Unwind_Context* frame, void* to) {
        auto& search = *static_cast<Search*>(to);
        const auto address = static_cast<std::uint64_t>(_Unwind_GetIP(frame));
        search.passed = search.passed || address == search.from;
        if (!search.passed || search.callers.is_in_library(address)) return _URC_NO_REASON;
        search.found = search.callers.program_.has(address);
        return _URC_END_OF_STACK;
    }
    bool is_in_library(std::uint64_t address) const {
        for (std::size_t i = 0; i < count_; ++i) {
            if (libraries_[i].has(address)) return true;
        }
        return false;
    }
    static int note(dl_phdr_info* object, std::size_t /*size*/, void* to) {
        auto& callers = *static_cast<Callers*>(to);
        const std::string_view name = object->dlpi_name ? object->dlpi_name : "";
        // links are opened and used by components
        if (name.find("libhalcyon") != std::string_view::npos) return 0;
        const bool is_program = name.empty();
        if (is_program && callers.program_.end != 0) return 0;  // the vDSO has no name either
        if (!is_program && callers.count_ == callers.libraries_.size()) {
            callers.are_all_ = false;
            return 0;
        }
        CodeRange& range = is_program ? callers.program_ : callers.libraries_[callers.count_++];
        range.begin = UINT64_MAX;
        for (ElfW(Half) i = 0; i < object->dlpi_phnum; ++i) {
            const ElfW(Phdr)& part = object->dlpi_phdr[i];
            if (part.p_type != PT_LOAD) continue;
            const std::uint64_t begin = object->dlpi_addr + part.p_vaddr;
            range.begin = std::min<std::uint64_t>(range.begin, begin);
            range.end = std::max<std::uint64_t>(range.end, begin + part.p_memsz);
        }
        return 0;
    }

    CodeRange program_;
    std::array<CodeRange, 256> libraries_;
    std::size_t count_ = 0;
    bool are_all_ = true;
};

using component_heap::heap_begin;
constexpr std::size_t segment_bytes = std::size_t{1} << 28;
constexpr std::uint32_t max_segments = 65536;
constexpr std::size_t heap_bytes = segment_bytes * max_segments;
constexpr std::uint32_t instance_segment = 0;
constexpr std::uint32_t first_call_segment = 2;
constexpr std::size_t min_alignment = 16;
constexpr std::size_t large_bytes = std::size_t{1} << 16;

/// Lies directly before each block.
struct alignas(min_alignment) BlockHead {
    std::size_t bytes = 0;
    std::size_t size_class = 0;  ///< of the segment for cycles
};
static_assert(sizeof(BlockHead) == min_alignment);

/// At the begin of the segment for cycles, so that its content restores it.
struct FreeBlocks {
    static constexpr std::size_t min_class = 5;  ///< 32 bytes
    std::array<char*, 28> first{};  ///< by class; the first word of a block has the next one
};

void clear(char* begin, std::size_t bytes) {
    if (bytes >= large_bytes) {
        constexpr std::uint64_t page = 4096;
        const auto first = reinterpret_cast<std::uint64_t>(begin);
        const std::uint64_t from = (first + page - 1) / page * page;
        const std::uint64_t to = (first + bytes) / page * page;
        if (::madvise(reinterpret_cast<void*>(from), to - from, MADV_DONTNEED) == 0) {
            std::memset(begin, 0, from - first);
            std::memset(reinterpret_cast<void*>(to), 0, first + bytes - to);
            return;
        }
    }
    std::memset(begin, 0, bytes);
}

/// The first allocation that is in no segment.
struct Overflow {
    enum Kind : std::uint8_t { none, instances, cycles, call, calls, system };
    Kind kind = none;
    std::uint32_t function = 0;  ///< that allocated in a cycle; 0: unknown
    int error = 0;  ///< errno of `system`
    std::array<char, 128> instance{};
    std::array<char, 128> component{};
};

std::string cannot_reserve(const char* reason) {
    rlimit limit{};
    const bool is_limited = ::getrlimit(RLIMIT_AS, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY;
    return fmt::format("the addresses for the memory of components cannot be reserved: {}{}",
                       reason, is_limited ? "; see: ulimit -v" : "");
}

template <std::size_t size>
void copy(const char* from, std::array<char, size>& to) {
    std::strncpy(to.data(), from, size - 1);
}

class ComponentHeap {
public:
    static bool has(std::uint64_t address) {
        return address >= heap_begin && address - heap_begin < heap_bytes;
    }

    /// Returns why the addresses cannot be had; "" when nothing else is mapped there from now on.
    std::string reserve() {
        if (sizeof(void*) < sizeof heap_begin) {
            return "a program of 32 bits has no addresses for the memory of components";
        }
        if (!callers_.are_all()) return "the program uses more libraries than can be distinguished";
        constexpr int how = MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE | MAP_FIXED_NOREPLACE;
        void* const begin = begin_of(0);
        void* const at = ::mmap(begin, heap_bytes, PROT_NONE, how, -1, 0);
        if (at == begin) return "";
        if (at != MAP_FAILED) {
            ::munmap(at, heap_bytes);  // an old kernel takes the address as a hint
        } else if (errno != EEXIST) {
            return cannot_reserve(std::strerror(errno));
        }
        return "other memory has the addresses that components need";
    }

    void give_back() { ::munmap(begin_of(0), heap_bytes); }

    /// Returns nullptr when the memory is not a component's, or a segment is full.
    void* allocate(std::size_t bytes, std::size_t alignment, void* from) {
        const bool is_in_cycle = Core::current() != nullptr;
        const bool is_in_call = !is_in_cycle && SetupCall::is_mine();
        const bool is_for_one = ComponentMemory::component() != nullptr;
        if (!is_in_cycle && !is_in_call && !is_for_one) return nullptr;
        if (!is_for_one && callers_.is_of_program(from)) return nullptr;
        const std::scoped_lock own(mutex_);
        if (is_for_one) return bump(instance_segment, bytes, alignment);
        if (is_in_cycle) return grow(bytes, alignment);
        return bump(segment_of_call(), bytes, alignment);
    }
    void release(void* memory) {
        const std::scoped_lock own(mutex_);
        auto* const begin = static_cast<char*>(memory);
        BlockHead& head = head_of(begin);
        clear(begin, head.bytes);
        const std::size_t size_class = head.size_class;
        if (size_class == 0) return;  // a setup call allocates no address twice
        std::memcpy(begin, &free_blocks().first[size_class], sizeof begin);
        free_blocks().first[size_class] = begin;
    }
    std::vector<component_heap::Segment> segments() {
        std::vector<std::size_t> used(max_segments);
        {
            const std::scoped_lock own(mutex_);
            std::ranges::copy(used_, used.begin());
        }
        std::vector<component_heap::Segment> all;
        for (std::uint32_t i = 0; i < max_segments; ++i) {
            if (used[i] > 0) {
                all.push_back({i, begin_of(i), used[i]});
            }
        }
        return all;
    }
    char* resized(const component_heap::Segment& segment) {
        if (segment.number >= max_segments || segment.used > segment_bytes) return nullptr;
        const std::scoped_lock own(mutex_);
        if (!map(segment.number)) return nullptr;
        std::size_t& used = used_[segment.number];
        if (used > segment.used) {
            clear(begin_of(segment.number) + segment.used, used - segment.used);
        }
        used = segment.used;
        return begin_of(segment.number);
    }
    Overflow overflow() {
        const std::scoped_lock own(mutex_);
        return overflow_;
    }

private:
    static char* begin_of(std::uint32_t segment) {
        return reinterpret_cast<char*>(heap_begin + segment * segment_bytes);
    }
    static BlockHead& head_of(char* block) {
        return *reinterpret_cast<BlockHead*>(block - sizeof(BlockHead));
    }
    FreeBlocks& free_blocks() {
        return *reinterpret_cast<FreeBlocks*>(begin_of(component_heap::grown_segment));
    }
    bool map(std::uint32_t segment) {
        if (!is_mapped_[segment]) {
            const int done = ::mprotect(begin_of(segment), segment_bytes, PROT_READ | PROT_WRITE);
            is_mapped_[segment] = done == 0;
        }
        return is_mapped_[segment];
    }
    /// Notes the first time. Returns nullptr.
    void* fail(Overflow::Kind kind) {
        if (overflow_.kind != Overflow::none) return nullptr;
        overflow_.kind = kind;
        overflow_.error = errno;
        if (const char* const component = ComponentMemory::component()) {
            copy(component, overflow_.component);
        } else if (const Core* const core = Core::current()) {
            overflow_.function = core->current_function();
        } else {
            copy(SetupCall::now.instance, overflow_.instance);
            copy(SetupCall::now.component, overflow_.component);
        }
        return nullptr;
    }
    static Overflow::Kind kind_of(std::uint32_t segment) {
        if (segment == instance_segment) return Overflow::instances;
        return segment == component_heap::grown_segment ? Overflow::cycles : Overflow::call;
    }
    void* bump(std::uint32_t segment, std::size_t bytes, std::size_t alignment) {
        if (segment >= max_segments) return fail(Overflow::calls);
        if (!map(segment)) return fail(Overflow::system);
        const std::size_t at =
            (used_[segment] + sizeof(BlockHead) + alignment - 1) / alignment * alignment;
        if (bytes > segment_bytes || at > segment_bytes - bytes) return fail(kind_of(segment));
        used_[segment] = at + bytes;
        char* const begin = begin_of(segment) + at;
        head_of(begin).bytes = bytes;
        return begin;
    }
    /// Blocks of a class are used again.
    void* grow(std::size_t bytes, std::size_t alignment) {
        constexpr std::uint32_t segment = component_heap::grown_segment;
        if (used_[segment] == 0) {
            if (!map(segment)) return fail(Overflow::system);
            used_[segment] = sizeof(FreeBlocks);
        }
        const std::size_t size = std::max(bytes, alignment);
        const std::size_t size_class =
            std::max<std::size_t>(std::bit_width(size - 1), FreeBlocks::min_class);
        if (size_class >= free_blocks().first.size()) {
            return fail(Overflow::cycles);
        }
        char*& first = free_blocks().first[size_class];
        char* block = first;
        if (block) {
            std::memcpy(&first, block, sizeof first);
            std::fill_n(block, sizeof(char*), char{0});
        } else {
            // blocks of a class have its alignment
            const std::size_t whole = std::size_t{1} << size_class;
            block = static_cast<char*>(bump(segment, whole, whole));
        }
        if (block) {
            head_of(block) = {bytes, size_class};
        }
        return block;
    }
    std::uint32_t segment_of_call() {
        const std::uint64_t call = SetupCall::now.number.load();
        if (std::exchange(call_, call) != call) {
            ++calls_;
        }
        return first_call_segment + calls_ - 1;
    }

    const Callers callers_;
    std::mutex mutex_;  // of all below
    std::array<std::size_t, max_segments> used_{};  // bytes, by segment
    std::array<bool, max_segments> is_mapped_{};
    std::uint64_t call_ = 0;  // the newest one that has allocated something
    std::uint32_t calls_ = 0;  // that have allocated something
    Overflow overflow_;
};

std::string text_of(const Overflow& overflow, const std::string& function) {
    constexpr std::size_t mib = segment_bytes >> 20;
    const std::string instance =
        fmt::format("'{}' ({})", overflow.instance.data(), overflow.component.data());
    const auto outside = [](const std::string& by) {
        return by.empty() ? "" : fmt::format("; what {} allocates is not in the state", by);
    };
    switch (overflow.kind) {
    case Overflow::none: break;
    case Overflow::instances:
        return fmt::format("instances need more than {} MiB; those of '{}' are not in the state",
                           mib, overflow.component.data());
    case Overflow::cycles:
        return fmt::format("what functions allocate in cycles does not fit {} MiB", mib) +
               outside(function);
    case Overflow::call:
        return fmt::format("{} allocates more than {} MiB in one setup call", instance, mib);
    case Overflow::calls:
        return fmt::format("more than {} setup calls allocate memory",
                           max_segments - first_call_segment) +
               outside(instance);
    case Overflow::system:
        return fmt::format("no memory for components: {}", std::strerror(overflow.error));
    }
    return "";
}

std::atomic<ComponentHeap*> heap{nullptr};  // written once

}  // namespace

namespace component_heap {

bool has(std::uint64_t address) {
    return heap.load(std::memory_order_acquire) && ComponentHeap::has(address);
}

std::vector<Segment> segments() {
    ComponentHeap* const all = heap.load(std::memory_order_acquire);
    return all ? all->segments() : std::vector<Segment>();
}

char* resized(const Segment& segment) {
    ComponentHeap* const all = heap.load(std::memory_order_acquire);
    return all ? all->resized(segment) : nullptr;
}

std::string problem(const std::function<std::string(std::uint32_t)>& function_named) {
    ComponentHeap* const all = heap.load(std::memory_order_acquire);
    if (!all) return "";
    const Overflow overflow = all->overflow();
    return text_of(overflow, overflow.function == 0 ? "" : function_named(overflow.function));
}

}  // namespace component_heap
}  // namespace hal

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)

std::string hal::component_heap::track() {
    return "a build with a sanitizer has an operator new of its own";
}

#else

std::string hal::component_heap::track() {
    if (heap.load(std::memory_order_acquire)) return "";
    auto made = std::make_unique<ComponentHeap>();
    if (std::string problem = made->reserve(); !problem.empty()) return problem;
    heap.store(made.get(), std::memory_order_release);
    bool is_used = false;
    {
        const ComponentMemory mine("");
        const std::unique_ptr<char> probe(new char);
        is_used = has(reinterpret_cast<std::uint64_t>(probe.get()));
    }
    if (!is_used) {
        heap.store(nullptr, std::memory_order_release);
        made->give_back();
        return "the program has an operator new of its own";
    }
    made.release();  // for good
    return "";
}

namespace {

template <class Allocate>
void* allocated(std::size_t bytes, std::size_t alignment, void* from, Allocate allocate) {
    if (hal::ComponentHeap* const all = hal::heap.load(std::memory_order_acquire)) {
        const std::size_t size = std::max<std::size_t>(bytes, 1);
        if (void* const memory = all->allocate(size, alignment, from)) return memory;
    }
    if (void* const memory = hal::region::allocate(bytes, alignment)) return memory;
    for (;;) {
        if (void* const memory = allocate()) return memory;
        const std::new_handler handler = std::get_new_handler();
        if (!handler) throw std::bad_alloc();
        handler();
    }
}

/// `bytes`: 0 where they are unknown.
void release(void* memory, std::size_t bytes) noexcept {
    if (hal::region::has(memory)) {
        hal::region::release(memory, bytes);
    } else if (hal::component_heap::has(reinterpret_cast<std::uint64_t>(memory))) {
        hal::heap.load(std::memory_order_acquire)->release(memory);
    } else {
        std::free(memory);
    }
}

}  // namespace

// The other forms of the library call these. Weak: a program may have its own.

[[gnu::weak]] void* operator new(std::size_t bytes) {
    return allocated(bytes, hal::min_alignment, __builtin_return_address(0),
                     [bytes] { return std::malloc(std::max<std::size_t>(bytes, 1)); });
}

[[gnu::weak]] void* operator new(std::size_t bytes, std::align_val_t alignment) {
    const auto boundary = static_cast<std::size_t>(alignment);
    const std::size_t whole =
        (std::max<std::size_t>(bytes, 1) + boundary - 1) / boundary * boundary;
    return allocated(whole, std::max(boundary, hal::min_alignment), __builtin_return_address(0),
                     [=] { return std::aligned_alloc(boundary, whole); });
}

[[gnu::weak]] void operator delete(void* memory) noexcept { release(memory, 0); }
[[gnu::weak]] void operator delete(void* memory, std::size_t bytes) noexcept {
    release(memory, bytes);
}
[[gnu::weak]] void operator delete(void* memory, std::align_val_t) noexcept { release(memory, 0); }
[[gnu::weak]] void operator delete(void* memory, std::size_t, std::align_val_t) noexcept {
    release(memory, 0);
}

#endif
