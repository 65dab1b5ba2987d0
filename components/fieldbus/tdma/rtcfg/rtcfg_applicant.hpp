// SPDX-License-Identifier: MIT
// A station without a schedule of its own: gets its block from the RTcfg server of the segment, and
// optionally a file.
//
//     cycle: arrived(stage 1) --offers--> helper: parses and checks it --answers--> cycle: reconfigures the station, announces it
//     cycle: stage 2 is complete, swaps buffers --files--> helper: writes the file
//
// One offer is pending at a time. Accepted configurations are kept until the end: fault messages
// point into them.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "fieldbus/tdma/config/event_texts.hpp"
#include "hal/message_log.hpp"
#include "hal/queue.hpp"
#include "rtcfg_client.hpp"

namespace hal::tdma::rtcfg {

/// A received, valid configuration.
struct Accepted {
    Address server{};
    std::string text;
    config::Schedule schedule;  ///< of one station
    StationSetup setup;
    SegmentFaults faults;
};

class Applicant final : private ClientEvents {
public:
    /// `file`: where stage 2 is written; empty: not requested. The station must outlive it. [setup]
    Applicant(hal::LinePrefix prefix, Station& station, Logical own, std::string file,
              Events& events);

    /// Returns the protocol client, for Station::accompany(). [setup]
    Client& client() noexcept { return client_; }
    void begin() noexcept;  ///< forgets the server and its configuration. [setup]
    /// Applies what the helper accepted; called before Station::receive(). Returns true when the
    /// configuration changed. [realtime]
    bool cycle() noexcept;
    /// nullptr: none yet. [realtime]
    const Accepted* accepted() const noexcept { return accepted_; }
    /// frames ignored
    std::uint64_t foreign() const noexcept { return client_.foreign() + foreign_; }
    /// size of the last file
    std::uint32_t file_bytes() const noexcept { return file_bytes_; }
    /// does the helper's work and prints its result. [helper]
    void work(std::int64_t now_ns);
    void finish();  ///< does the remaining work. [helper]

private:
    struct Offer {
        Address server{};
        std::uint16_t length = 0;
        std::array<std::uint8_t, 1500> text{};
    };
    struct File {
        Address server{};
        std::uint32_t length = 0;
    };
    void on_stage_1(std::span<const std::uint8_t>, const Address& server) noexcept override;
    void on_stage_2(std::vector<std::uint8_t>& file, std::uint32_t length,
                    const Address& server) noexcept override;
    void on_dead_station(const Address&) noexcept override;
    void on_other_server(const Address&) noexcept override;
    void check(const Offer&);
    void write(const File&);
    void log(const std::string& sentence);

    const std::string path_;
    Station& station_;
    Events& events_;
    Client client_;
    // the cycle's
    const Accepted* accepted_ = nullptr;
    bool offered_ = false;
    bool writing_ = false;
    bool server_reported_ = false;
    bool other_reported_ = false;
    std::uint64_t foreign_ = 0;
    std::uint32_t file_bytes_ = 0;
    std::uint32_t dead_reported_ = 0;
    // between both
    hal::Queue<Offer> offers_{2};
    hal::Queue<const Accepted*> answers_{2};  // nullptr: rejected
    hal::Queue<File> files_{2};
    hal::Queue<std::uint32_t> written_{2};
    std::vector<std::uint8_t> spare_;  // its owner is given by writing_
    // the helper's
    hal::MessageLog log_;
    std::int64_t now_ns_ = 0;  // of its call
    std::vector<std::unique_ptr<Accepted>> all_;
    std::string rejected_;  // the last, reported once
    std::uint32_t rejections_ = 0;  // consecutive
};

}  // namespace hal::tdma::rtcfg
