// SPDX-License-Identifier: MIT
#include "journal/heap_blocks.hpp"

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <functional>
#include <link.h>
#include <map>
#include <memory>
#include <mutex>
#include <new>
#include <string_view>
#include <unwind.h>
#include <utility>

#include "execute/core.hpp"
#include "machine/load/setup_call.hpp"

namespace hal {
namespace {

/// For the table of the blocks itself, which must not be in it.
template <class Object>
struct MallocAllocator {
    using value_type = Object;
    MallocAllocator() = default;
    template <class Other>
    explicit MallocAllocator(const MallocAllocator<Other>&) noexcept {}
    Object* allocate(std::size_t count) {
        void* const memory = std::malloc(count * sizeof(Object));
        if (!memory) throw std::bad_alloc();
        return static_cast<Object*>(memory);
    }
    void deallocate(Object* memory, std::size_t) noexcept { std::free(memory); }
    bool operator==(const MallocAllocator&) const = default;
};

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

    /// `from`: where `operator new` returns to. Functions of the C++ library ask for their callers.
    bool is_of_program(void* from) const {
        const auto address = reinterpret_cast<std::uint64_t>(from);
        if (program_.has(address)) return true;
        if (!library_.has(address)) return false;
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
        if (!search.passed || search.callers.library_.has(address)) return _URC_NO_REASON;
        search.found = search.callers.program_.has(address);
        return _URC_END_OF_STACK;
    }
    static int note(dl_phdr_info* object, std::size_t /*size*/, void* to) {
        auto& callers = *static_cast<Callers*>(to);
        const std::string_view name = object->dlpi_name ? object->dlpi_name : "";
        const bool is_library = name.find("libstdc++") != std::string_view::npos;
        if (!name.empty() && !is_library) return 0;
        CodeRange& range = is_library ? callers.library_ : callers.program_;
        if (range.end != 0) return 0;  // the vDSO has no name either
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
    CodeRange library_;
};

class HeapTable {
public:
    void add(void* memory, std::size_t bytes, void* from) {
        HeapBlock block{.begin = static_cast<char*>(memory), .bytes = bytes};
        const bool is_in_cycle = Core::current() != nullptr;
        const bool is_in_call = !is_in_cycle && SetupCall::is_mine();
        const bool is_of_call = is_in_call && !callers_.is_of_program(from);
        const std::scoped_lock own(mutex_);
        if (is_in_cycle) {
            block.origin = HeapBlock::Origin::cycle;
        } else if (is_of_call) {
            note_call(block);
        } else if (!is_in_call && call_ > 0) {
            block.origin = HeapBlock::Origin::later;
        }
        blocks_.insert_or_assign(block.begin, block);
    }
    void remove(void* memory) {
        const std::scoped_lock own(mutex_);
        blocks_.erase(static_cast<const char*>(memory));
    }
    std::optional<HeapBlock> find(const char* byte) {
        const std::scoped_lock own(mutex_);
        auto after = blocks_.upper_bound(byte);
        if (after == blocks_.begin()) return std::nullopt;
        const HeapBlock& block = (--after)->second;
        const bool has_it =
            std::less<>()(byte, block.begin + std::max<std::size_t>(block.bytes, 1));
        return has_it ? std::optional(block) : std::nullopt;
    }
    template <class Use>
    void each(Use use) {
        const std::scoped_lock own(mutex_);
        for (const auto& [begin, block] : blocks_) {
            use(block);
        }
    }

private:
    void note_call(HeapBlock& block) {
        const std::int64_t since_ns = SetupCall::now.since_ns.load();
        if (std::exchange(call_since_ns_, since_ns) != since_ns) {
            ++call_;
            index_ = 0;
        }
        block.origin = HeapBlock::Origin::setup;
        block.call = call_;
        block.index = index_++;
    }

    using Entry = std::pair<const char* const, HeapBlock>;
    const Callers callers_;
    std::mutex mutex_;  // of all below
    std::map<const char*, HeapBlock, std::less<>, MallocAllocator<Entry>> blocks_;
    std::int64_t call_since_ns_ = 0;  // identifies the call
    std::uint32_t call_ = 0;
    std::uint32_t index_ = 0;
};

std::atomic<HeapTable*> table{nullptr};  // written once

}  // namespace

namespace heap_blocks {

std::optional<HeapBlock> find(const void* byte) {
    HeapTable* const all = table.load(std::memory_order_acquire);
    return all ? all->find(static_cast<const char*>(byte)) : std::nullopt;
}

std::vector<HeapBlock> of_setup_calls() {
    std::vector<HeapBlock> found;
    HeapTable* const all = table.load(std::memory_order_acquire);
    if (!all) return found;
    std::size_t count = 0;
    all->each([&](const HeapBlock& block) { count += block.call != 0 ? 1 : 0; });
    found.reserve(count);  // nothing is allocated while the table is locked
    all->each([&](const HeapBlock& block) {
        if (block.call != 0 && found.size() < count) {
            found.push_back(block);
        }
    });
    return found;
}

}  // namespace heap_blocks
}  // namespace hal

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)

bool hal::heap_blocks::track() { return false; }

#else

bool hal::heap_blocks::track() {
    if (table.load(std::memory_order_acquire)) return true;
    void* const memory = std::malloc(sizeof(HeapTable));
    if (!memory) return false;
    table.store(::new (memory) HeapTable, std::memory_order_release);  // for good
    // a program with an `operator new` of its own does not use the ones below
    const std::unique_ptr<char> probe(new char);
    if (find(probe.get())) return true;
    table.store(nullptr, std::memory_order_release);
    return false;
}

namespace {

template <class Allocate>
void* allocated(std::size_t bytes, void* from, Allocate allocate) {
    for (;;) {
        if (void* const memory = allocate()) {
            if (hal::HeapTable* const all = hal::table.load(std::memory_order_acquire)) {
                all->add(memory, bytes, from);
            }
            return memory;
        }
        const std::new_handler handler = std::get_new_handler();
        if (!handler) throw std::bad_alloc();
        handler();
    }
}

void release(void* memory) noexcept {
    hal::HeapTable* const all = hal::table.load(std::memory_order_acquire);
    if (all && memory) {
        all->remove(memory);
    }
    std::free(memory);
}

}  // namespace

// The other forms of the library call these. Weak: a program may have its own.

[[gnu::weak]] void* operator new(std::size_t bytes) {
    return allocated(bytes, __builtin_return_address(0),
                     [bytes] { return std::malloc(std::max<std::size_t>(bytes, 1)); });
}

[[gnu::weak]] void* operator new(std::size_t bytes, std::align_val_t alignment) {
    const auto boundary = static_cast<std::size_t>(alignment);
    const std::size_t whole =
        (std::max<std::size_t>(bytes, 1) + boundary - 1) / boundary * boundary;
    return allocated(bytes, __builtin_return_address(0),
                     [=] { return std::aligned_alloc(boundary, whole); });
}

[[gnu::weak]] void operator delete(void* memory) noexcept { release(memory); }
[[gnu::weak]] void operator delete(void* memory, std::size_t) noexcept { release(memory); }
[[gnu::weak]] void operator delete(void* memory, std::align_val_t) noexcept { release(memory); }
[[gnu::weak]] void operator delete(void* memory, std::size_t, std::align_val_t) noexcept {
    release(memory);
}

#endif
