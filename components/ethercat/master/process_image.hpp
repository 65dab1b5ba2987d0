// SPDX-License-Identifier: MIT
// Layout of the process data: the logical address space, and the frames that carry it, prebuilt so
// that a cycle only copies data.
//
// Each domain is a list of blocks. A block holds the outputs of some slaves, then their inputs, and
// fits one datagram: LRW, or LWR and LRD where a slave does not support LRW. Inputs and outputs
// have different addresses, so the input bytes of a frame leave as zeros, and the answers of two
// frames that went round a ring from both ends can be ORed. Only a slave with more data than a
// frame holds is cut.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "ethercat/master/setup.hpp"
#include "ethercat/master/status.hpp"
#include "ethercat/wire/frames.hpp"

namespace hal::ethercat::master {

/// See the top of this file. [setup] unless marked; then in the thread of the master's cycle.
class ProcessImage {
public:
    /// Process data of one sync manager: one FMMU.
    struct Area {
        std::uint32_t at = 0;
        std::uint32_t bytes = 0;  ///< logical address, which is the offset in the image too
        bool output = false;
    };
    struct SlaveImage {
        /// in_bytes with the mailbox status
        std::uint32_t out_at = 0;
        std::uint32_t out_bytes = 0;
        std::uint32_t in_at = 0;
        std::uint32_t in_bytes = 0;
        std::int64_t mailbox_status_at = -1;  ///< address of the copy of 080Dh; -1: none
        std::vector<Area> areas;  ///< one for each of Slave::sync_managers
        /// its FMMUs are set, so it counts in the working counter
        bool writes = false;
        bool reads = false;
        /// its FMMUs are being set: it may count or not
        bool starting = false;
        bool no_lrw = false;
        /// a datagram with its data is stale
        bool stale = false;
        std::uint16_t domain = 0;
    };
    struct Datagram {
        std::uint32_t address = 0;
        std::uint16_t length = 0;
        std::uint16_t offset = 0;  ///< offset of its header in the frame
        std::uint16_t in_from = 0;
        std::uint16_t in_to = 0;  ///< input bytes in its data
        std::uint16_t out_to = 0;  ///< output bytes in its data: [0, out_to)
        std::uint16_t expected = 0;
        std::uint16_t tolerance = 0;
        std::uint16_t wkc = 0;
        std::uint16_t domain = 0;
        std::uint16_t first_slave = 0;
        std::uint16_t last_slave = 0;  ///< in order of the layout
        bool sent = false;
        bool answered = false;  ///< since settle()
        /// its data was not exchanged for 30 exchanges and 30 ms; ends after as many good ones
        bool stale = false;
        bool returned = false;  ///< it was answered in its newest exchange
        unsigned every = 1;  ///< cycles between two exchanges
        std::uint32_t contradictions = 0;  ///< exchanges in a row that contradict `stale`
    };
    struct Frame {
        std::array<std::uint8_t, max_frame_bytes> bytes{};
        std::uint16_t size = 0;
        unsigned every = 1;
        /// datagrams [first, last)
        unsigned first = 0;
        unsigned last = 0;
        /// offsets of the datagrams to 0910h; 0: none
        std::uint16_t clock_write = 0;
        std::uint16_t clock_read = 0;
    };

    explicit ProcessImage(const Setup& setup, const std::array<std::uint8_t, 6>& source);

    /// Returns the process data of sync manager `n` of `Setup::slaves[slave].sync_managers`.
    /// [realtime]
    std::span<std::uint8_t> data(std::size_t slave, std::size_t n) noexcept {
        const Area& area = slaves_[slave].areas[n];
        return {image_.data() + area.at, area.bytes};
    }
    /// Returns the layout of a slave. [realtime]
    const SlaveImage& slave(std::size_t n) const noexcept { return slaves_[n]; }
    /// Returns where 080Dh of a slave is copied to, or nullptr. [realtime]
    const std::uint8_t* mailbox_status(std::size_t n) const noexcept {
        return slaves_[n].mailbox_status_at < 0 ? nullptr
                                                : image_.data() + slaves_[n].mailbox_status_at;
    }

    /// Marks a slave that does not support LRW; follow with build(). [realtime]
    void set_no_lrw(std::size_t slave) noexcept { slaves_[slave].no_lrw = true; }
    /// Builds the frames. Not while one is under way. [realtime]
    void build() noexcept;
    /// Changes how a slave counts in the working counters. [realtime]
    void set_counting(std::size_t slave, bool writes, bool reads, bool starting) noexcept;
    /// Clears the inputs of a lost slave's mailbox status, so that no client waits for a missing
    /// mail. [realtime]
    void clear_mailbox_status(std::size_t slave) noexcept;
    /// Sets the slave with the reference clock, for frames that are filled from now on; 0: none.
    /// `write_time`: it gets the time of fill(). [realtime]
    void set_reference(std::uint16_t station, bool write_time) noexcept;

    std::span<Frame> frames() noexcept { return {frames_.data(), frames_used_}; }  ///< [realtime]
    /// Copies outputs into a frame that is about to leave, with its index and the time at which it
    /// leaves; nullopt: it distributes no time. [realtime]
    void fill(Frame& frame, std::uint8_t index, std::optional<std::uint64_t> dc_time_ns) noexcept;
    /// Returns whether `answer`, which is not shorter, has the datagrams of `frame` as it left with
    /// an index: in this cycle, or in one before. Others may follow them. [realtime]
    bool matches(const Frame& frame, std::uint8_t index,
                 std::span<const std::uint8_t> answer) const noexcept;
    /// Returns whether a frame left again since it had an index. [realtime]
    static bool left_again(const Frame& frame, std::uint8_t index) noexcept {
        return frame.bytes[frame.clock_read + 1U] != index;
    }
    /// Takes the inputs and counters of an answer that matches. [realtime]
    void take(const Frame& frame, const std::uint8_t* answer) noexcept;
    /// ORs the inputs of `second` into `first` and adds the working counters: both halves of a
    /// broken ring. [realtime]
    void merge(const Frame& frame, std::uint8_t* first, const std::uint8_t* second) const noexcept;

    /// [realtime]
    std::span<const Datagram> datagrams() const noexcept {
        return {datagrams_.data(), datagrams_used_};
    }
    /// slaves in order of the layout. [realtime]
    std::span<const std::uint16_t> order() const noexcept { return order_; }
    /// [realtime]
    DomainStatus& domain(std::size_t n) noexcept { return domains_[n]; }
    /// [realtime]
    std::size_t domain_count() const noexcept { return domains_.size(); }
    /// Sums the counters of the datagrams sent since the last call, per domain; a datagram without
    /// answer counts 0. [realtime]
    void settle() noexcept;
    /// Changes when SlaveImage::stale of a slave may have changed. [realtime]
    std::uint64_t staleness() const noexcept { return staleness_; }
    /// Returns whether a datagram with data of a slave was answered in its newest exchange: its
    /// working counter is wrong, then. [realtime]
    bool returns(std::size_t slave) const noexcept;

private:
    struct Block {
        std::uint32_t at = 0;
        std::uint32_t out_bytes = 0;
        std::uint32_t in_bytes = 0;
        std::uint16_t first = 0;
        std::uint16_t last = 0;  ///< in order_
        std::uint16_t domain = 0;
        unsigned every = 1;
    };
    /// Gives each slave its place in the image: in blocks of one domain and one way of exchange,
    /// each of which fits into a frame. [setup]
    void lay_out(const Setup&);
    /// Sets how many bytes a slave exchanges. [setup]
    void measure(const Slave&, SlaveImage&) const;
    /// Adds the blocks of the slaves of a domain that are exchanged with or without LRW. [setup]
    void fill_blocks(std::uint16_t domain, unsigned every, bool no_lrw, std::uint32_t& at);
    /// Resets the domains that have sent datagrams. Returns false when there are none. [realtime]
    bool begin_domains() noexcept;
    /// Counts the exchange of a domain by its working counter. [realtime]
    static void count_exchange(DomainStatus&) noexcept;
    void close(Block&, std::uint32_t& at);
    void recount() noexcept;
    void build_frames(unsigned every) noexcept;
    void add(FrameWriter&, Frame&, Command, std::uint32_t at, std::uint32_t length,
             const Block&) noexcept;
    void copy_present(const Datagram&, const std::uint8_t* data) noexcept;
    std::size_t capacity() const noexcept;
    bool carries(const Datagram&, const SlaveImage&) const noexcept;
    void observe(Datagram&, bool refreshed) noexcept;
    void mark_stale_slaves() noexcept;

    std::vector<SlaveImage> slaves_;
    std::vector<std::uint16_t> order_;
    std::vector<Block> blocks_;
    std::vector<std::uint8_t> image_;
    std::vector<Datagram> datagrams_;
    std::vector<Frame> frames_;
    std::vector<DomainStatus> domains_;
    std::uint64_t staleness_ = 0;
    std::size_t datagrams_used_ = 0;
    std::size_t frames_used_ = 0;
    std::array<std::uint8_t, 6> source_;
    std::size_t max_;  ///< bytes of the longest frame
    bool write_clock_ = false;
    std::uint16_t reference_ = 0;
    bool write_time_ = false;
    std::int64_t cycle_ns_;
};

}  // namespace hal::ethercat::master
