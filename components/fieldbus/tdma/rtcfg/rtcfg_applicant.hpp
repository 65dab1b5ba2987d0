// SPDX-License-Identifier: MIT
// A station without a schedule of its own: takes its block from the RTcfg server of the segment, and a file when it wants one.
//
//     cycle: arrived(stage 1) --offers--> helper: reads and judges it --answers--> cycle: reconfigures the station, announces it
//     cycle: all of stage 2 came, swaps buffers --files--> helper: writes the file
//
// One offer is on its way at a time. What was accepted stays until the end: faults in words point into it.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "fieldbus/tdma/config/fault_words.hpp"
#include "hal/message_log.hpp"
#include "hal/queue.hpp"
#include "rtcfg_client.hpp"

namespace hal::tdma::rtcfg {

/// A configuration that came and can be used.
struct Accepted {
    Address          server{};
    std::string      text;
    config::Schedule schedule;  ///< of one station
    StationSetup     setup;
    FaultWords       words;
};

class Applicant final : private ClientEvents {
public:
    /// `file`: where stage 2 is written; empty: it is not asked for. The station outlives it. [setup]
    Applicant(std::string instance, Station& station, Logical own, std::string file, Events& events);

    Client& client() noexcept { return client_; }
    void    begin() noexcept;              ///< forgets the server and its configuration. [setup]
    /// Before Station::receive(): takes what the helper accepted; true: the station has another configuration now. [realtime]
    bool            cycle() noexcept;
    const Accepted* accepted() const noexcept { return accepted_; }         ///< nullptr: none yet. [realtime]
    std::uint64_t   foreign() const noexcept { return client_.foreign() + foreign_; }
    std::uint32_t   file_bytes() const noexcept { return file_bytes_; }     ///< of the file that came last
    void            work(std::int64_t now_ns);   ///< the helper's turn; prints what came of it
    void            finish();                    ///< its last turn

private:
    struct Offer {
        Address                        server{};
        std::uint16_t                  length = 0;
        std::array<std::uint8_t, 1500> text{};
    };
    struct File {
        Address       server{};
        std::uint32_t length = 0;
    };
    void on_stage_1(std::span<const std::uint8_t>, const Address& server) noexcept override;
    void on_stage_2(std::vector<std::uint8_t>& file, std::uint32_t length, const Address& server) noexcept override;
    void on_dead_station(const Address&) noexcept override;
    void on_other_server(const Address&) noexcept override;
    void judge(const Offer&);
    void write(const File&);
    void say(const std::string& sentence);

    const std::string path_;
    Station&          station_;
    Events&           events_;
    Client            client_;
    // the cycle's
    const Accepted* accepted_ = nullptr;
    bool            offered_ = false, writing_ = false, told_server_ = false, told_other_ = false;
    std::uint64_t   foreign_ = 0;
    std::uint32_t   file_bytes_ = 0, dead_told_ = 0;
    // between both
    hal::Queue<Offer>           offers_{2};
    hal::Queue<const Accepted*> answers_{2};   // nullptr: refused
    hal::Queue<File>            files_{2};
    hal::Queue<std::uint32_t>   written_{2};
    std::vector<std::uint8_t>   spare_;        // whose turn it is says writing_
    // the helper's
    hal::MessageLog                        log_;
    std::int64_t                           now_ns_ = 0;  // of its turn
    std::vector<std::unique_ptr<Accepted>> all_;
    std::string                            refused_;  // the last, so that it is said once
    std::uint32_t                          refusals_ = 0;  // in a row
};

}  // namespace hal::tdma::rtcfg
