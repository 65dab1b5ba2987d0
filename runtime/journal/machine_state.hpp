// SPDX-License-Identifier: MIT
// The state of a machine between two cycles as bytes, so that a journal can begin there
// (docs/internals/journal.md).
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "execute/core.hpp"
#include "journal/component_heap.hpp"
#include "journal/mapped_memory.hpp"
#include "model/model.hpp"
#include "recording/mcap/bytes.hpp"

namespace hal {

class Session;

/// Copies regions of memory: of signals, of images, of what components see of the machine, and the
/// memory of components, which has the same addresses in both processes (component_heap.hpp). A
/// word that points into a region of other addresses is stored as its position there, one that
/// points into a library as an offset in it, and any other pointer keeps the value that it has in
/// the process that the state is restored in. Both have executed the same edits, with
/// component_heap::track(). [setup] with the session's lock held and no cycle begun
class MachineState {
public:
    /// `cores`: of all threads, in the same order in both processes.
    MachineState(Session& session, std::vector<Core*> cores);

    /// Returns the state; "" after setting problem().
    std::string capture();
    /// Returns false after setting problem(): then the machine has a part of the state.
    bool restore(std::string_view bytes);
    /// Returns why not, as a sentence without a full stop.
    const std::string& problem() const { return problem_; }

private:
    struct Region {
        char* begin;
        std::size_t bytes;
        const Instance* instance = nullptr;  ///< nullptr: of no instance, or of several
        bool is_copied = true;  ///< false: only pointers into it are kept
        bool is_grown = false;  ///< component_heap::grown_segment
    };
    enum Pointer : std::uint8_t {
        into_region,
        into_library,
        own,  ///< it keeps its value
        like,  ///< it is equal to the own pointer at an offset of a region
        none,  ///< what it pointed to does not exist
    };
    struct Fixup {
        std::uint32_t word = 0;
        Pointer kind = own;
        std::uint32_t target = 0;
        std::uint64_t offset = 0;
    };

    void add(const void* begin, std::size_t bytes, const Instance* instance = nullptr);
    void add_regions(Session& session);
    void add_instance(const Instance& instance);
    void add_pin(const Pin& pin);
    void add_segment(char* begin, const component_heap::Segment& segment);
    void note_own_pointers();
    void find_like(std::uint64_t word, Fixup& fixup) const;
    const Region* region_of(const char* byte) const;
    bool fixup_of(std::uint64_t word, Fixup& fixup) const;
    void put_region(std::string& to, const Region& region) const;
    static void put_core(std::string& to, Core& core);
    bool get_segments(mcap::Fields& from);
    bool get_region(mcap::Fields& from, const Region& region,
                    const std::vector<std::string>& libraries);
    bool set_pointers(mcap::Fields& from, const Region& region, std::string& content,
                      const std::vector<std::string>& libraries);
    bool has_word(std::uint32_t region, std::uint64_t offset) const;
    bool get_core(mcap::Fields& from, Core& core);
    bool fail(std::string problem);
    static std::string name_of(const Region& region);
    std::string function_named(std::uint32_t id) const;

    Session& session_;
    std::vector<Core*> cores_;
    MappedMemory memory_;
    std::vector<Region> regions_;
    std::size_t fixed_ = 0;  // the first ones; the segments follow
    std::map<const char*, std::size_t> by_begin_;  // index of regions that begin there
    /// Region and offset of pointers to what is not copied, by their value.
    std::map<std::uint64_t, std::pair<std::uint32_t, std::uint64_t>> own_pointers_;
    std::string problem_;
};

}  // namespace hal
