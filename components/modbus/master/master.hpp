// SPDX-License-Identifier: MIT
// The engine of a bus: decides which telegram is next, sends it, decodes the answer, and stops the
// drives. It has no thread and no clock. The owner of the line calls work() when bytes have
// arrived, and when the time that the last call returned has come.
//
// Which telegram is next:
//   1. stop telegrams, when a stop was requested: nothing else until they are acknowledged or their
//      attempts are used up. The broadcast stop comes first, and again behind them;
//   2. the stop telegrams of a slave that did not acknowledge them, or returned while the stop
//      lasts: nothing is written to it before. An offline slave gets them in place of 4;
//   3. set-points that have changed, so that one waits for at most the telegram that is on the
//      line; a read that is overdue for a whole period comes between two of them;
//   4. a request to a slave that is offline, such that all of them use at most 5 % of the line,
//      25 % with stop telegrams while the stop lasts, and for 5 s after one was lost;
//   5. what is due, the earliest first.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "modbus/config/plan.hpp"
#include "modbus/master/image.hpp"

namespace hal::modbus {

class Master {
public:
    /// `bus`, `plan` and the memory of the image outlive it. [setup]
    Master(const Bus& bus, const Plan& plan, Image image);

    /// The line on which it works from now on; it outlives the master or the next attach().
    void attach(line::Line& line, std::int64_t now_ns);
    /// Does what is due. Returns when there will be something to do, if no byte arrives before.
    std::int64_t work(std::int64_t now_ns) noexcept;

    /// Sends the stop telegrams and holds all writes until release().
    void stop(StopReason reason, std::int64_t now_ns) noexcept;
    /// Writes are allowed again. Everything is written anew.
    void release() noexcept;
    /// Returns whether each stop telegram of the last stop is acknowledged or was sent as often as
    /// its slave declares.
    bool is_stopped() const noexcept { return held_ && !stopping_; }
    bool is_held() const noexcept { return held_; }

private:
    static constexpr std::size_t max_requests = 10;
    static constexpr std::uint32_t stop_job = UINT32_MAX;
    static constexpr std::uint32_t echo_job = UINT32_MAX - 1;  ///< a read that shows an echo
    static constexpr std::uint32_t broadcast_job = UINT32_MAX - 2;  ///< to all slaves

    enum class StopState : std::uint8_t {
        none,
        sending,  ///< as often as the slave declares
        repeating,  ///< those attempts are used up, or the slave returned: until acknowledged
        acknowledged,  ///< until release()
    };
    /// The broadcast stop: twice, because nothing acknowledges it.
    enum class Broadcast : std::uint8_t {
        none,
        first,  ///< is due, before the addressed stop telegrams
        waits,  ///< for the end of those
        last,  ///< is due
    };
    struct SlaveState {
        std::uint32_t failures = 0;  ///< in a row
        bool is_offline = false;
        std::int64_t offline_since_ns = 0;
        bool is_known = false;  ///< an answer has arrived, or it was reported offline
        bool is_corrupt = false;  ///< reported
        std::uint32_t disturbance = 0;  ///< rises with corrupt answers, falls with others
        bool confirms = false;  ///< accepts values that two answers in a row have
        std::uint32_t changing_values = 0;  ///< reported, until they are accepted
        std::uint32_t rejected_telegrams = 0;
        /// A read that no answer to another read of the slave can answer. It comes first after a
        /// timeout on RTU: a slave answers in order, so that its answer is behind all late ones.
        Pdu sync;
        bool is_sync_valid = false;  ///< the slave has the registers, or has answered it
        bool needs_sync = false;
        StopState stop = StopState::none;
        std::size_t stop_next = 0;  ///< the next stop telegram
        std::uint32_t stop_attempts = 0;
        bool is_stop_partial = false;  ///< one before `stop_next` was not acknowledged
        bool is_stop_reported = false;  ///< as not acknowledged
        std::int64_t stop_due_ns = 0;  ///< when it is repeated

        bool has_pending_stop() const noexcept {
            return stop == StopState::sending || stop == StopState::repeating;
        }
    };
    struct TelegramState {
        std::int64_t due_ns = 0;
        std::vector<std::uint64_t> sent;  ///< cells that the slave has acknowledged
        bool is_sent = false;  ///< `sent` is valid
        std::uint32_t rejections = 0;  ///< in a row
        std::vector<std::uint8_t> answer;  ///< data of the last one, of a read
        std::uint32_t unconfirmed = 0;  ///< answers in a row with a value that is not accepted
    };
    /// The requests of a telegram, or a stop telegram, one after the other.
    struct Job {
        std::uint32_t telegram = 0;
        std::uint32_t slave = 0;
        std::size_t stop_index = 0;  ///< of a stop telegram
        bool begins_with_sync = false;
        std::array<Pdu, max_requests> requests{};
        std::size_t count = 0;
        std::size_t next = 0;
        std::vector<std::uint64_t> cells;  ///< what it writes

        void add(const Pdu& pdu) noexcept {
            if (count < max_requests) {
                requests[count++] = pdu;
            }
        }
    };
    enum class Failure : std::uint8_t { none, timeout, corrupt, exception };

    void follow_requests(std::int64_t now_ns) noexcept;
    bool follow_line(std::int64_t now_ns) noexcept;
    void receive(std::int64_t now_ns) noexcept;
    bool finish_exchange(std::int64_t now_ns) noexcept;
    bool accept(const Found& found, std::int64_t now_ns) noexcept;
    void succeed(std::span<const std::uint8_t> data, std::int64_t now_ns) noexcept;
    void rate(std::uint32_t slave, bool is_corrupt) noexcept;
    void store(std::span<const std::uint8_t> data, std::int64_t now_ns) noexcept;
    bool accept_value(std::uint32_t n, std::span<const std::uint8_t> data,
                      std::int64_t now_ns) noexcept;
    void count_unaccepted(std::uint32_t n) noexcept;
    void clear_unaccepted(std::uint32_t n) noexcept;
    void fail(Failure failure, std::uint8_t code, std::int64_t now_ns) noexcept;
    void fail_stop(Failure failure, std::int64_t now_ns) noexcept;
    void use_attempt(std::uint32_t slave, std::int64_t now_ns) noexcept;
    void acknowledge_stop_telegram(std::int64_t now_ns) noexcept;
    void set_stop(std::uint32_t slave, StopState to, std::int64_t now_ns) noexcept;
    void repeat_stop(std::uint32_t slave, std::int64_t now_ns) noexcept;
    void report_unconfirmed(std::uint32_t slave, std::int64_t now_ns) noexcept;
    void reject(std::uint8_t code, std::int64_t now_ns) noexcept;
    void count_rejection(std::uint32_t telegram) noexcept;
    void clear_rejections(std::uint32_t telegram) noexcept;
    void answered(std::uint32_t slave, std::int64_t now_ns) noexcept;
    void end_of_job() noexcept;
    void touch(std::size_t slave) const noexcept { image_.touch(slave); }

    void make_sync(std::uint32_t slave);
    bool is_sync() const noexcept { return job_.begins_with_sync && job_.next == 0; }
    bool writes_set_points() const noexcept;
    void note_timeout() noexcept;
    bool begin_echo_job() noexcept;
    void end_echo_job() noexcept;

    bool choose(std::int64_t now_ns) noexcept;
    bool choose_broadcast() noexcept;
    bool choose_stop() noexcept;
    bool choose_repeated_stop(std::int64_t now_ns) noexcept;
    void begin_stop(std::uint32_t slave) noexcept;
    bool choose_set_point(std::int64_t now_ns) noexcept;
    bool choose_probe(std::int64_t now_ns) noexcept;
    bool begin_probe(std::uint32_t slave, std::int64_t now_ns) noexcept;
    std::int64_t probe_pause_ns(std::uint32_t slave, std::int64_t now_ns) const noexcept;
    bool choose_due(std::int64_t now_ns) noexcept;
    bool begin(std::uint32_t telegram, std::int64_t now_ns) noexcept;
    bool has_changed(std::uint32_t telegram) const noexcept;
    bool may_write(std::int64_t now_ns) const noexcept;
    bool is_writable(std::uint32_t telegram) const noexcept;
    std::int64_t next_due(std::int64_t now_ns) const noexcept;
    void send(std::int64_t now_ns) noexcept;
    void finish_broadcast(std::int64_t now_ns) noexcept;
    void fail_broadcast(std::int64_t now_ns) noexcept;
    void end_broadcast(std::int64_t now_ns) noexcept;
    bool request_last_broadcast() noexcept;
    void repeat_broadcast() noexcept;
    void finish_stop(std::int64_t now_ns) noexcept;

    void make_read(const Telegram& t) noexcept;
    bool make_write(const Telegram& t) noexcept;
    static const std::vector<Write>& writes_of(const Drive& drive,
                                               std::uint32_t direction) noexcept;
    void make_drive(const Telegram& t) noexcept;
    void make_drive_of_coils(const Drive& drive) noexcept;
    void add_reset(const Drive& drive, bool begins) noexcept;
    void add_writes(const std::vector<Write>& writes) noexcept;
    void add_write(const Write& write) noexcept;
    void add_speed(const Drive& drive, double rpm) noexcept;

    std::uint64_t cell_of(std::uint32_t telegram, std::size_t n) const noexcept;
    std::size_t cells_of(std::uint32_t telegram) const noexcept;

    const Bus& bus_;
    const Plan& plan_;
    Image image_;
    line::Line* line_ = nullptr;
    Framing framing_ = Framing::rtu;
    std::int64_t silence_ns_ = 0;
    std::int64_t quiet_ns_ = 0;  // after bytes: the frame is over

    std::vector<SlaveState> slaves_;
    std::vector<TelegramState> telegrams_;
    std::vector<std::uint32_t> unaccepted_;  // of each value: answers in a row
    Job job_;
    bool has_job_ = false;
    bool waits_ = false;  // for an answer
    bool line_was_open_ = false;
    bool line_reported_ = false;
    bool has_reads_ = false;  // by which an echo is known
    bool is_echo_known_ = false;  // a read was answered, echoed or timed out
    bool has_echo_ = false;
    bool echo_is_due_ = false;  // the answer to a write has the same bytes
    bool is_verified_ = false;  // a read was answered: an echo is known
    std::int64_t write_from_ns_ = 0;  // in any case
    bool last_was_set_point_ = false;
    Frame sent_;
    std::uint16_t transaction_ = 0;
    std::int64_t sent_at_ns_ = 0;
    std::int64_t deadline_ns_ = 0;
    std::int64_t free_at_ns_ = 0;
    std::int64_t last_byte_ns_ = 0;
    std::int64_t probe_at_ns_ = 0;
    std::uint32_t probe_next_ = 0;
    ReceiveBuffer buffer_;

    bool stopping_ = false;
    bool held_ = false;
    std::int64_t stop_at_ns_ = 0;
    std::uint32_t stop_seen_ = 0;  // StopRequests::Request::count
    std::uint32_t stop_turn_ = 0;
    Broadcast broadcast_ = Broadcast::none;
    std::size_t broadcast_next_ = 0;  // telegram
    std::uint32_t broadcast_failures_ = 0;  // to send it, in a row
    bool is_broadcast_reported_ = false;  // as sent, since the stop
};

}  // namespace hal::modbus
