// SPDX-License-Identifier: MIT
// Requests to mailboxes from other threads: tools, the shell, the gateway. They are served by
// channels of their own between all other traffic; process data never waits for them.
//
//     RequestServer server(mailboxes, [&](std::uint16_t number) { return &slaves[number]; });      // [setup]
//     for (std::size_t i = 0; i < server.workers(); ++i) master.add(server.channel(i));
//     RequestPort& port = server.open();                                                           // one for each thread
//     ...
//     server.step(now_ns);                                    // in each cycle, between receive() and transmit()
//     ...
//     MailboxRequest request;                                 // in the other thread
//     request.slave = 3, request.index = 0x1008, request.data = buffer;
//     if (port.submit(request)) port.wait(request);
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "ethercat/master/aoe_client.hpp"
#include "ethercat/master/coe_client.hpp"
#include "ethercat/master/eoe_client.hpp"
#include "ethercat/master/foe_client.hpp"
#include "ethercat/master/object_information.hpp"
#include "ethercat/master/soe_client.hpp"
#include "ethercat/master/voe_client.hpp"
#include "hal/queue.hpp"

namespace hal::ethercat::master {

/// A request and its result. Belongs to the thread that submits it; until it is finished, only the
/// server may touch it and its buffers.
struct MailboxRequest {
    enum class Kind : std::uint8_t {
        sdo_upload,
        sdo_download,
        object_list,
        object,
        entry,
        foe_read,
        foe_write,
        soe_read,
        soe_write,
        aoe_read,
        aoe_write,
        voe_send,
        set_ip,
        get_ip,
        message,  ///< `data` holds a message with its header, and then its reply; `length` bytes
    } kind = Kind::sdo_upload;
    std::uint16_t slave = 0;  ///< BusSlave::number
    std::uint16_t index = 0;  ///< of an object; an IDN; coe::List
    std::uint8_t sub = 0;  ///< sub-index; drive of an IDN
    std::uint8_t elements = soe::element::value;
    bool complete = false;  ///< complete access
    std::span<std::uint8_t> data;  ///< is read or written; names of objects
    std::size_t length = 0;  ///< of a message
    std::string_view name;  ///< of a file
    FoeOptions foe;
    FoeProgress* progress = nullptr;  ///< nullptr: not wanted
    AoeAddress aoe;
    std::uint32_t group = 0;
    std::uint32_t offset = 0;
    VoeHeader voe;
    eoe::Ip ip;
    ObjectDescription object;
    EntryDescription entry;
    MailboxResult result;  ///< valid when finished

    enum class Stage : std::uint8_t { idle, queued, withdrawn, running, finished };
    /// queued and withdrawn by the submitter, otherwise written by the server until it is finished
    std::atomic<Stage> stage{Stage::idle};
    MailboxRequest* next = nullptr;  ///< of the server
};

/// The way of one thread to the server.
class RequestPort {
public:
    explicit RequestPort(std::size_t capacity) : queue_(capacity) {}
    /// Submits a request. Returns false when the queue is full or the server has stopped. [any] one
    /// thread
    bool submit(MailboxRequest& request) noexcept;
    /// Takes back a request that the server has not begun, because nobody waits for it any more: the
    /// server finishes it as lost. [any] the submitter
    void withdraw(MailboxRequest& request) noexcept {
        auto stage = MailboxRequest::Stage::queued;
        request.stage.compare_exchange_strong(stage, MailboxRequest::Stage::withdrawn);
    }
    /// Returns whether the result is valid; a request that a stopped server left is finished as
    /// lost. [any]
    bool finished(MailboxRequest& request) const noexcept;
    /// Blocks until the request is finished. Every operation has a timeout. [setup]
    void wait(MailboxRequest& request) const noexcept;

private:
    friend class RequestServer;
    Queue<MailboxRequest*> queue_;
    std::atomic<bool> closed_{false};
};

/// See the top of this file.
class RequestServer {
public:
    /// must not allocate; nullptr: not on the bus
    using Find = std::function<BusSlave*(std::uint16_t number)>;

    /// `workers`: requests served at the same time, to different slaves. [setup]
    RequestServer(Mailboxes& mailboxes, Find find, std::size_t workers = 4);
    ~RequestServer();
    /// Returns a port for one more thread. [setup]
    RequestPort& open(std::size_t capacity = 16);
    std::size_t workers() const noexcept { return workers_.size(); }
    /// Returns the channel of a worker, to be added to the engine. [setup]
    Channel& channel(std::size_t n) noexcept { return workers_[n]->channel; }
    /// Serves the frames of a switch too. [setup]
    void set_switch(EoeSwitch* frames) noexcept { switch_ = frames; }
    /// Sets how often a mailbox is read without a request where the process image does not report
    /// it full, in ns; 0: never. [setup]
    void set_poll_interval(std::int64_t ns) noexcept { poll_interval_ns_ = ns; }

    /// Starts what is waiting on idle workers. Call once per cycle. [realtime]
    void step(std::int64_t now_ns) noexcept;
    /// Ends all requests as lost and accepts no more. The cycle must not run any more. [setup]
    void stop() noexcept;

    /// Returns the client that the start-up uses too. [any]
    CoeClient& coe() noexcept { return coe_; }
    /// Returns the client with the received VoE messages. [any] one reader
    VoeClient& voe() noexcept { return voe_; }

private:
    struct Worker {
        Channel channel;
        std::uint16_t slave = 0;
        MailboxRequest* request = nullptr;
        FoeProgress progress;
    };
    struct Slot {  // of a slave
        MailboxRequest* first = nullptr;
        MailboxRequest* last = nullptr;
        std::int64_t polled_ns = 0;
        bool busy = false;
    };
    Task<> serve(Channel&, Worker&, BusSlave&) noexcept;
    Task<> serve_unrequested(Channel&, Worker&, BusSlave&, bool frames) noexcept;
    Task<MailboxResult> execute(Channel&, BusSlave&, MailboxRequest&, FoeProgress&) noexcept;
    Task<MailboxResult> pass(Channel&, BusSlave&, MailboxRequest&) noexcept;
    enum class Unrequested : std::uint8_t { nothing, poll, frames };
    Unrequested unrequested(const BusSlave&, const Slot&, std::int64_t now_ns) const noexcept;
    bool start(Worker&, std::uint16_t number, std::int64_t now_ns) noexcept;
    MailboxRequest* take_next(Slot&) noexcept;
    void drop_withdrawn(Slot&) noexcept;
    void refuse_all(Slot&, const MailboxResult&) noexcept;
    void collect() noexcept;
    void finish(Worker&) noexcept;
    static void finish(MailboxRequest& request, const MailboxResult& result) noexcept;

    Mailboxes& mailboxes_;
    Find find_;
    CoeClient coe_{mailboxes_};
    ObjectInformation objects_{mailboxes_};
    FoeClient foe_{mailboxes_};
    SoeClient soe_{mailboxes_};
    AoeClient aoe_{mailboxes_};
    EoeClient eoe_{mailboxes_};
    VoeClient voe_{mailboxes_};
    EoeSwitch* switch_ = nullptr;
    std::int64_t poll_interval_ns_ = 0;
    std::vector<std::unique_ptr<RequestPort>> ports_;
    std::vector<std::unique_ptr<Worker>> workers_;
    std::vector<Slot> slots_;
    // waiting_: requests in slots
    std::size_t next_slot_ = 0;
    std::size_t waiting_ = 0;
};

}  // namespace hal::ethercat::master
