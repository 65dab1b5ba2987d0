// SPDX-License-Identifier: MIT
#include "master.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "modbus/master/value_codec.hpp"

namespace hal::modbus {

namespace {

constexpr std::int64_t millisecond = 1'000'000;
// USB adapters deliver bytes in bursts, up to 16 ms apart
constexpr std::int64_t burst_ns = 20 * millisecond;
// an adapter that echoes makes every write look acknowledged: a read comes first, for this time
constexpr std::int64_t verify_ns = 3'000 * millisecond;
constexpr std::int64_t exception_pause_ns = 1'000 * millisecond;
constexpr std::int64_t poll_ns = millisecond;  // of set-points and stop requests
// a corrupt answer counts as many as 32 others: the threshold is a share of 1 of 33
constexpr std::uint32_t corrupt_weight = 32;
constexpr std::uint32_t disturbed_above = 2 * corrupt_weight - 1;
constexpr std::uint32_t max_disturbance = 4 * corrupt_weight;
constexpr std::uint32_t max_rereads = 3;  // at once, of a value that changes
// answers in a row of which none has the value of the one before, until it is reported
constexpr std::uint32_t max_unaccepted = 50;
constexpr std::int64_t probe_share = 20;       // 1/20 of the line: 5 %
constexpr std::int64_t urgent_share = 4;       // 1/4
// a line that is open and does not accept the broadcast stop: 1 s
constexpr std::int64_t broadcast_retry_ns = 10 * millisecond;
constexpr std::uint32_t max_broadcast_failures = 100;
// a slave that was just lost may not have received a command, as the stop of a drive
constexpr std::int64_t fresh_loss_ns = 5'000 * millisecond;

Function read_function(Table table) noexcept {
    switch (table) {
    case Table::coil: return Function::read_coils;
    case Table::discrete: return Function::read_discrete;
    case Table::input: return Function::read_input;
    default: return Function::read_holding;
    }
}

/// Exceptions of a gateway that did not reach the slave.
bool is_of_gateway(std::uint8_t code) noexcept { return code == 10 || code == 11; }

/// The registers of a value in the data of an answer; 16 bits are one register, the first bit the
/// least significant. None in an answer that is too short.
Registers registers_at(const PlannedValue& p, std::span<const std::uint8_t> data) noexcept {
    Registers r;
    const Value& v = *p.value;
    if (v.table == Table::huanyang) {
        // index, then the number (function 04 of the dialect)
        if (data.size() < 3) return r;
        r.words[0] = word_at(data, 1);
        r.count = 1;
        return r;
    }
    if (is_bits(v.table)) {
        unsigned number = 0;
        for (unsigned n = 0; n < v.size(); ++n) {
            const std::size_t bit = p.offset + n;
            number |= (data[bit / 8] >> bit % 8 & 1U) << n;
        }
        r.words[0] = static_cast<std::uint16_t>(number);
        r.count = 1;
        return r;
    }
    r.count = v.size();
    for (std::size_t n = 0; n < r.count; ++n) {
        r.words[n] = word_at(data, 2 * (p.offset + n));
    }
    return r;
}

}  // namespace

Master::Master(const Bus& bus, const Plan& plan, Image image)
    : bus_(bus), plan_(plan), image_(image) {
    slaves_.resize(bus.slaves.size());
    telegrams_.resize(plan.telegrams.size());
    unaccepted_.resize(plan.values.size());
    std::size_t max_cells = 2;
    for (std::uint32_t n = 0; n < telegrams_.size(); ++n) {
        telegrams_[n].sent.resize(cells_of(n));
        if (plan.telegrams[n].kind == Telegram::Kind::read) {
            telegrams_[n].answer.reserve(max_pdu);
        }
        max_cells = std::max(max_cells, cells_of(n));
    }
    job_.cells.reserve(max_cells);
    for (std::uint32_t n = 0; n < slaves_.size(); ++n) {
        make_sync(n);
        slaves_[n].confirms = bus.slaves[n].confirm == Confirm::always;
    }
    has_reads_ = std::any_of(plan.telegrams.begin(), plan.telegrams.end(),
                             [](const Telegram& t) { return t.kind == Telegram::Kind::read; });
}

/// Fewer registers than a telegram reads, if no other telegram reads as many; else more, which the
/// slave may reject.
void Master::make_sync(std::uint32_t slave) {
    const Telegram* longest = nullptr;
    const auto is_read = [&](const Telegram& t) {
        return t.slave == slave && t.kind == Telegram::Kind::read && t.table != Table::huanyang;
    };
    for (const Telegram& t : plan_.telegrams) {
        if (is_read(t) && (longest == nullptr || t.count > longest->count)) {
            longest = &t;
        }
    }
    if (longest == nullptr) return;
    // bits come in bytes: counts of the same number of bytes have the same answers
    const std::uint16_t unit = is_bits(longest->table) ? 8 : 1;
    const auto units = [&](const Telegram& t) { return (t.count + unit - 1) / unit; };
    std::uint16_t count = 1;
    while (std::any_of(plan_.telegrams.begin(), plan_.telegrams.end(), [&](const Telegram& t) {
        return is_read(t) && t.table == longest->table && units(t) == count;
    })) {
        ++count;
    }
    slaves_[slave].is_sync_valid = count <= units(*longest);
    slaves_[slave].needs_sync = count > units(*longest);  // to know whether it answers
    const auto bits_or_registers = static_cast<std::uint16_t>((count - 1) * unit + 1);
    slaves_[slave].sync =
        read_request(read_function(longest->table), longest->address, bits_or_registers);
}

void Master::attach(line::Line& line, std::int64_t now_ns) {
    line_ = &line;
    framing_ = bus_.framing_on(line.description());
    const bool serial = !line.description().is_stream;
    silence_ns_ = serial ? silence_ns(bus_.line) : 0;
    quiet_ns_ = std::max(burst_ns, 2 * silence_ns_);
    free_at_ns_ = now_ns + silence_ns_;
    is_echo_known_ = framing_ == Framing::tcp;
    is_verified_ = framing_ == Framing::tcp;
    write_from_ns_ = now_ns + verify_ns;
    for (TelegramState& state : telegrams_) {
        state.due_ns = now_ns;
    }
}

std::int64_t Master::work(std::int64_t now_ns) noexcept {
    follow_requests(now_ns);
    if (!follow_line(now_ns)) {
        finish_stop(now_ns);
        return now_ns + 10 * millisecond;
    }
    receive(now_ns);
    while (true) {
        if (waits_ && !finish_exchange(now_ns)) {
            return std::min(deadline_ns_, now_ns + 10 * millisecond);
        }
        if (now_ns < free_at_ns_) return free_at_ns_;
        if (!has_job_ && !choose(now_ns)) return next_due(now_ns);
        send(now_ns);
    }
}

void Master::stop(StopReason reason, std::int64_t now_ns) noexcept {
    if ((!held_ || !stopping_) && bus_.has_stops()) {
        image_.tell({Event::stopping, 0, 0, static_cast<std::int64_t>(reason)});
    }
    held_ = true;
    stopping_ = true;
    stop_at_ns_ = now_ns;
    stop_turn_ = 0;
    broadcast_ = bus_.broadcast_stop.empty() ? Broadcast::none : Broadcast::first;
    broadcast_next_ = 0;
    broadcast_failures_ = 0;
    is_broadcast_reported_ = false;
    image_.header().phase.store(static_cast<std::uint32_t>(Phase::stopping));
    for (std::uint32_t n = 0; n < slaves_.size(); ++n) {
        slaves_[n].is_stop_reported = false;
        set_stop(n, bus_.slaves[n].stop.empty() ? StopState::none : StopState::sending, now_ns);
    }
    if (has_job_ && job_.telegram != stop_job && !waits_) {
        end_of_job();
    }
    finish_stop(now_ns);
}

void Master::release() noexcept {
    if (!held_ || stopping_) return;
    held_ = false;
    broadcast_ = Broadcast::none;
    image_.header().phase.store(static_cast<std::uint32_t>(Phase::running));
    for (std::uint32_t n = 0; n < telegrams_.size(); ++n) {
        telegrams_[n].is_sent = false;
    }
    for (std::uint32_t n = 0; n < slaves_.size(); ++n) {
        if (slaves_[n].stop == StopState::acknowledged) {
            set_stop(n, StopState::none, 0);
        }
    }
}

void Master::follow_requests(std::int64_t now_ns) noexcept {
    const bus::StopRequests::Request request = image_.header().requests.newest();
    if (request.count == stop_seen_) return;
    stop_seen_ = request.count;
    stop(request.reason, now_ns);
    image_.header().stops_followed.store(request.count, std::memory_order_release);
}

/// Returns false while the line is lost.
bool Master::follow_line(std::int64_t now_ns) noexcept {
    const bool is_open = line_ != nullptr && line_->is_open(now_ns);
    if (is_open == line_was_open_ && line_reported_) return is_open;
    if (!line_reported_ && !is_open && now_ns < free_at_ns_ + 1'500 * millisecond) {
        return false;  // a connection is being made
    }
    if (!is_open || line_reported_) {
        image_.tell({is_open ? Event::line_open : Event::line_lost, 0, 0, 0});
    }
    line_reported_ = true;
    line_was_open_ = is_open;
    image_.header().line_open.store(is_open ? 1 : 0, std::memory_order_relaxed);
    buffer_.clear();
    if (!is_open) {
        if (has_job_) {
            waits_ = false;
            end_of_job();
        }
        for (std::size_t n = 0; n < slaves_.size(); ++n) {
            image_.slave(n).online.store(0, std::memory_order_relaxed);
            touch(n);
            slaves_[n].is_known = false;
        }
    }
    for (TelegramState& state : telegrams_) {
        state.is_sent = false;
    }
    has_echo_ = false;  // it may be another adapter
    is_echo_known_ = framing_ == Framing::tcp;
    for (std::uint32_t n = 0; n < slaves_.size() && is_open; ++n) {
        repeat_stop(n, now_ns);
    }
    if (is_open) {
        repeat_broadcast();
    }
    return is_open;
}

void Master::receive(std::int64_t now_ns) noexcept {
    while (true) {
        auto space = buffer_.free_space();
        if (space.empty()) {
            buffer_.clear();
            space = buffer_.free_space();
        }
        const std::size_t count = line_->receive(space, now_ns);
        if (count == 0) return;
        last_byte_ns_ = now_ns;
        buffer_.added(count);
        if (!waits_) {
            buffer_.clear();  // nothing was asked: a late answer, or noise
            free_at_ns_ = std::max(free_at_ns_, now_ns + silence_ns_);
        }
    }
}

/// Returns whether the exchange is over.
bool Master::finish_exchange(std::int64_t now_ns) noexcept {
    const bool huanyang = bus_.slaves[job_.slave].is_huanyang();
    if (framing_ == Framing::rtu && echo_is_due_ && buffer_.span().size() >= sent_.size &&
        std::equal(sent_.bytes.begin(),
                   sent_.bytes.begin() + static_cast<std::ptrdiff_t>(sent_.size),
                   buffer_.span().begin())) {
        const std::uint8_t function = sent_.bytes[1];
        if (has_echo_ || (!huanyang && function <= 4)) {
            has_echo_ = true;
            echo_is_due_ = false;
            buffer_.drop(sent_.size);
        }
    }
    while (!buffer_.empty()) {
        Found found;
        const Scan result = scan(framing_, Role::answers, huanyang, buffer_.span(), found);
        if (result == Scan::incomplete) break;
        if (result == Scan::corrupt) {
            if (now_ns - last_byte_ns_ < silence_ns_ && framing_ == Framing::rtu) return false;
            fail(Failure::corrupt, 0, now_ns);
            return true;
        }
        const bool accepted = accept(found, now_ns);
        buffer_.drop(found.length);
        if (accepted) return true;
    }
    if (!buffer_.empty() && now_ns - last_byte_ns_ >= quiet_ns_) {
        fail(Failure::corrupt, 0, now_ns);
        return true;
    }
    if (now_ns < deadline_ns_ || !buffer_.empty()) return false;
    fail(Failure::timeout, 0, now_ns);
    return true;
}

/// Returns whether the frame is the answer.
bool Master::accept(const Found& found, std::int64_t now_ns) noexcept {
    const Slave& slave = bus_.slaves[job_.slave];
    if (found.unit != slave.unit) return false;
    if (framing_ == Framing::tcp && found.transaction != transaction_) return false;
    const Answer answer = decode(job_.requests[job_.next], found.pdu, slave.is_huanyang());
    switch (answer.verdict) {
    case Verdict::foreign: return false;
    case Verdict::exception:
        if (is_sync() && !is_of_gateway(answer.code)) {
            succeed({}, now_ns);
        } else {
            fail(Failure::exception, answer.code, now_ns);
        }
        return true;
    case Verdict::good: succeed(answer.data, now_ns); return true;
    }
    return false;
}

void Master::succeed(std::span<const std::uint8_t> data, std::int64_t now_ns) noexcept {
    waits_ = false;
    free_at_ns_ = now_ns + silence_ns_;
    ImageHeader& header = image_.header();
    header.telegrams.fetch_add(1, std::memory_order_relaxed);
    header.busy_ns.fetch_add(now_ns - sent_at_ns_ + silence_ns_, std::memory_order_relaxed);
    answered(job_.slave, now_ns);
    if (job_.telegram == echo_job) return end_echo_job();
    if (is_sync()) {
        slaves_[job_.slave].needs_sync = false;
        slaves_[job_.slave].is_sync_valid = true;
    }
    if (++job_.next < job_.count) {
        if (held_ && writes_set_points()) {
            end_of_job();  // the rest of a command must not come behind the stop
        }
        return;
    }
    if (job_.telegram == stop_job) return acknowledge_stop_telegram(now_ns);
    const Telegram& t = plan_.telegrams[job_.telegram];
    TelegramState& own = telegrams_[job_.telegram];
    clear_rejections(job_.telegram);
    if (t.kind == Telegram::Kind::read) {
        is_echo_known_ = true;
        is_verified_ = true;
        store(data, now_ns);
    } else {
        own.sent = job_.cells;
        own.is_sent = true;
        image_.stamp(job_.telegram).store(now_ns, std::memory_order_relaxed);
    }
    image_.failures(job_.telegram).store(0, std::memory_order_relaxed);
    touch(job_.slave);
    end_of_job();
}

/// Keeps the share of corrupt answers of a slave: a rising one counts at once, a falling one
/// slowly.
void Master::rate(std::uint32_t slave, bool is_corrupt) noexcept {
    SlaveState& state = slaves_[slave];
    if (is_corrupt) {
        state.disturbance = std::min(state.disturbance + corrupt_weight, max_disturbance);
    } else if (state.disturbance > 0) {
        --state.disturbance;
    }
    if (bus_.slaves[slave].confirm != Confirm::on_errors) return;
    if (state.disturbance > disturbed_above) {
        state.confirms = true;
    } else if (state.disturbance == 0) {
        state.confirms = false;
    }
}

/// Stores the values of an answer that are accepted. The others are read again at once, a few
/// times.
void Master::store(std::span<const std::uint8_t> data, std::int64_t now_ns) noexcept {
    TelegramState& own = telegrams_[job_.telegram];
    bool has_all = true;
    std::int64_t oldest_ns = now_ns;
    for (const std::uint32_t n : plan_.telegrams[job_.telegram].values) {
        has_all = accept_value(n, data, now_ns) && has_all;
        oldest_ns = std::min(oldest_ns, image_.value_stamp(n).load(std::memory_order_relaxed));
    }
    own.answer.assign(data.begin(), data.end());
    image_.stamp(job_.telegram).store(oldest_ns, std::memory_order_relaxed);
    own.unconfirmed = has_all ? 0 : own.unconfirmed + 1;
    if (!has_all && own.unconfirmed <= max_rereads) {
        own.due_ns = now_ns;
    }
}

/// Stores a value, unless its slave confirms and the answer before had another one. One of 65536
/// random frames has a valid check sequence, and a slave answers a request that was changed into
/// another valid one. Two answers in a row that are wrong and equal are not expected in the life of
/// a machine. Returns whether it is accepted.
bool Master::accept_value(std::uint32_t n, std::span<const std::uint8_t> data,
                          std::int64_t now_ns) noexcept {
    const PlannedValue& planned = plan_.values[n];
    const Registers registers = registers_at(planned, data);
    if (registers.count == 0) return true;
    auto& cell = image_.value(n);
    const std::uint64_t last = cell.load(std::memory_order_relaxed);
    const std::uint64_t value = decode_value(*planned.value, registers, last);
    if (slaves_[job_.slave].confirms) {
        const std::span<const std::uint8_t> before = telegrams_[job_.telegram].answer;
        if (before.size() != data.size() ||
            decode_value(*planned.value, registers_at(planned, before), last) != value) {
            count_unaccepted(n);
            return false;
        }
    }
    clear_unaccepted(n);
    cell.store(value, std::memory_order_relaxed);
    image_.value_stamp(n).store(now_ns, std::memory_order_relaxed);
    return true;
}

void Master::count_unaccepted(std::uint32_t n) noexcept {
    if (unaccepted_[n] == max_unaccepted || ++unaccepted_[n] != max_unaccepted) return;
    if (slaves_[job_.slave].changing_values++ == 0) {
        image_.tell({Event::value_changes, job_.slave, job_.telegram, n});
    }
}

void Master::clear_unaccepted(std::uint32_t n) noexcept {
    const bool was_reported = std::exchange(unaccepted_[n], 0) == max_unaccepted;
    if (was_reported && --slaves_[job_.slave].changing_values == 0) {
        image_.tell({Event::values_accepted, job_.slave, 0, 0});
    }
}

void Master::answered(std::uint32_t slave, std::int64_t now_ns) noexcept {
    SlaveState& state = slaves_[slave];
    const bool returns = !state.is_known || state.is_offline;
    state.failures = 0;
    state.is_offline = false;
    rate(slave, false);
    if (!returns) return;
    state.is_known = true;
    state.is_corrupt = false;
    image_.slave(slave).online.store(1, std::memory_order_relaxed);
    touch(slave);
    image_.tell({Event::slave_online, slave, 0, 0});
    for (std::size_t n = 0; n < telegrams_.size(); ++n) {
        if (plan_.telegrams[n].slave == slave) {
            telegrams_[n].is_sent = false;
        }
    }
    repeat_stop(slave, now_ns);
}

/// Ends a request that failed: counts it for the slave, which is offline after enough of them in a
/// row, and chooses when its telegram is due again. An exception is an answer: the slave is online.
/// `code`: of an exception.
void Master::fail(Failure failure, std::uint8_t code, std::int64_t now_ns) noexcept {
    const Slave& slave = bus_.slaves[job_.slave];
    SlaveState& state = slaves_[job_.slave];
    SlaveImage& own = image_.slave(job_.slave);
    waits_ = false;
    buffer_.clear();
    image_.header().busy_ns.fetch_add(now_ns - sent_at_ns_, std::memory_order_relaxed);
    free_at_ns_ = now_ns + silence_ns_;
    const bool is_answer = failure == Failure::exception && !is_of_gateway(code);
    if (job_.telegram == echo_job) {
        if (is_answer) {
            answered(job_.slave, now_ns);
        } else if (framing_ == Framing::rtu) {
            free_at_ns_ = now_ns + slave.timeout_ns;
        }
        return end_echo_job();
    }
    if (is_answer) {
        own.exceptions.fetch_add(1, std::memory_order_relaxed);
        touch(job_.slave);
        answered(job_.slave, now_ns);
        reject(code, now_ns);
        return;
    }
    if (failure == Failure::corrupt) {
        own.errors.fetch_add(1, std::memory_order_relaxed);
        rate(job_.slave, true);
        if (!state.is_corrupt) {
            state.is_corrupt = true;
            image_.tell({Event::slave_corrupt, job_.slave, 0, 0});
        }
    } else {
        own.timeouts.fetch_add(1, std::memory_order_relaxed);
        if (framing_ == Framing::rtu) {
            // a late answer would be that of the next request: nothing in RTU distinguishes them
            free_at_ns_ = now_ns + slave.timeout_ns;
            note_timeout();
        }
    }
    ++state.failures;
    if (!state.is_offline && state.failures >= slave.lost) {
        state.is_offline = true;
        state.is_known = true;
        state.offline_since_ns = now_ns;
        probe_at_ns_ = std::min(probe_at_ns_, now_ns + probe_pause_ns(job_.slave, now_ns));
        own.online.store(0, std::memory_order_relaxed);
        image_.tell({Event::slave_offline, job_.slave, 0, 0});
    }
    touch(job_.slave);
    if (job_.telegram == stop_job) return fail_stop(failure, now_ns);
    image_.failures(job_.telegram).fetch_add(1, std::memory_order_relaxed);
    telegrams_[job_.telegram].due_ns =
        now_ns + (plan_.telegrams[job_.telegram].kind == Telegram::Kind::read
                      ? plan_.telegrams[job_.telegram].period_ns
                      : 0);
    end_of_job();
}

/// Returns whether a job must not go on while a stop lasts.
bool Master::writes_set_points() const noexcept {
    return job_.telegram < telegrams_.size() &&
           plan_.telegrams[job_.telegram].kind != Telegram::Kind::read;
}

/// The answer to the request on the line, an RTU line, may still come.
void Master::note_timeout() noexcept {
    if (job_.telegram >= telegrams_.size() || writes_set_points()) return;
    SlaveState& state = slaves_[job_.slave];
    if (state.sync.size == 0) return;
    is_echo_known_ = true;
    // one that the slave may not answer at all is sent once
    state.needs_sync = !is_sync() || state.is_sync_valid;
}

/// A read of what is written, whose answer does not matter, on a line without other reads or before
/// them: an adapter that echoes is known by it. Returns false on a line of Huanyang drives, whose
/// answers may equal their requests.
bool Master::begin_echo_job() noexcept {
    for (const Telegram& t : plan_.telegrams) {
        if (t.table == Table::huanyang || t.kind == Telegram::Kind::drive) continue;
        end_of_job();
        has_job_ = true;
        job_.telegram = echo_job;
        job_.slave = t.slave;
        job_.add(read_request(read_function(t.table), t.address, t.count));
        return true;
    }
    end_echo_job();
    return false;
}

/// Without an echo and without an answer there is no echo.
void Master::end_echo_job() noexcept {
    is_echo_known_ = true;
    is_verified_ = is_verified_ || !has_reads_;
    end_of_job();
}

/// An exception: the slave is there and does not do what was asked.
void Master::reject(std::uint8_t code, std::int64_t now_ns) noexcept {
    if (job_.telegram == stop_job) {
        image_.tell({Event::exception, job_.slave, stop_job, code});
        return fail_stop(Failure::exception, now_ns);
    }
    is_verified_ = true;  // an exception is not an echo
    is_echo_known_ = true;
    image_.tell({Event::exception, job_.slave, job_.telegram, code});
    image_.failures(job_.telegram).fetch_add(1, std::memory_order_relaxed);
    count_rejection(job_.telegram);
    const Telegram& t = plan_.telegrams[job_.telegram];
    TelegramState& own = telegrams_[job_.telegram];
    const bool is_read = t.kind == Telegram::Kind::read;
    const std::int64_t first_pause = is_read ? t.period_ns : bus_.slaves[t.slave].timeout_ns;
    const bool is_rejected = image_.rejected(job_.telegram).load(std::memory_order_relaxed) != 0;
    own.due_ns = now_ns + (is_rejected ? std::max(exception_pause_ns, t.period_ns) : first_pause);
    own.sent = job_.cells;  // is written again when it is due, not at once
    own.is_sent = !is_read;
    end_of_job();
}

/// As many exceptions in a row as requests without an answer make a slave offline.
void Master::count_rejection(std::uint32_t telegram) noexcept {
    const std::uint32_t slave = plan_.telegrams[telegram].slave;
    if (++telegrams_[telegram].rejections != bus_.slaves[slave].lost) return;
    image_.rejected(telegram).store(1, std::memory_order_relaxed);
    touch(slave);
    if (slaves_[slave].rejected_telegrams++ == 0) {
        image_.tell({Event::slave_rejects, slave, 0, 0});
    }
}

void Master::clear_rejections(std::uint32_t telegram) noexcept {
    telegrams_[telegram].rejections = 0;
    if (image_.rejected(telegram).exchange(0, std::memory_order_relaxed) == 0) return;
    const std::uint32_t slave = plan_.telegrams[telegram].slave;
    touch(slave);
    if (--slaves_[slave].rejected_telegrams == 0) {
        image_.tell({Event::slave_accepts, slave, 0, 0});
    }
}

// --- The stop telegrams of a slave

/// Begins with the first of them.
void Master::set_stop(std::uint32_t slave, StopState to, std::int64_t now_ns) noexcept {
    SlaveState& state = slaves_[slave];
    state.stop = to;
    state.stop_next = 0;
    state.stop_attempts = 0;
    state.is_stop_partial = false;
    state.stop_due_ns = now_ns;
    SlaveImage& image = image_.slave(slave);
    image.stopped.store(to == StopState::acknowledged ? 1 : 0, std::memory_order_relaxed);
    image.stop_pending.store(state.has_pending_stop() ? 1 : 0, std::memory_order_relaxed);
    touch(slave);
}

/// A slave that returns while the stop lasts may have been switched off and on: what it has
/// acknowledged before does not count.
void Master::repeat_stop(std::uint32_t slave, std::int64_t now_ns) noexcept {
    SlaveState& state = slaves_[slave];
    switch (state.stop) {
    case StopState::none: break;
    case StopState::sending:
        state.is_stop_partial = state.is_stop_partial || state.stop_next != 0;
        break;
    case StopState::repeating:
    case StopState::acknowledged: set_stop(slave, StopState::repeating, now_ns); break;
    }
}

void Master::acknowledge_stop_telegram(std::int64_t now_ns) noexcept {
    const std::uint32_t slave = job_.slave;
    SlaveState& state = slaves_[slave];
    const bool counts = state.has_pending_stop() && job_.stop_index == state.stop_next;
    end_of_job();
    if (!counts) return;  // of a stop before the last request
    state.stop_attempts = 0;
    if (++state.stop_next < bus_.slaves[slave].stop.size()) return;
    if (state.is_stop_partial) {
        report_unconfirmed(slave, now_ns);
        set_stop(slave, StopState::repeating, now_ns + exception_pause_ns);
    } else {
        state.is_stop_reported = false;
        set_stop(slave, held_ ? StopState::acknowledged : StopState::none, now_ns);
        image_.tell({Event::stop_acknowledged, slave, 0, now_ns - stop_at_ns_});
    }
    finish_stop(now_ns);
}

void Master::fail_stop(Failure failure, std::int64_t now_ns) noexcept {
    const std::uint32_t slave = job_.slave;
    SlaveState& state = slaves_[slave];
    end_of_job();
    if (state.stop == StopState::sending) return use_attempt(slave, now_ns);
    if (state.stop != StopState::repeating) return;
    // after an exception the further telegrams of the list may still have an effect
    const bool is_rejected = failure == Failure::exception;
    state.is_stop_partial = true;
    if (is_rejected && ++state.stop_next < bus_.slaves[slave].stop.size()) return;
    report_unconfirmed(slave, now_ns);
    set_stop(slave, StopState::repeating,
             now_ns + (is_rejected ? exception_pause_ns : probe_pause_ns(slave, now_ns)));
}

void Master::use_attempt(std::uint32_t slave, std::int64_t now_ns) noexcept {
    SlaveState& state = slaves_[slave];
    if (++state.stop_attempts < bus_.slaves[slave].stop_attempts) return;
    state.stop_attempts = 0;
    state.is_stop_partial = true;
    // the further telegrams of the list may still have an effect
    if (++state.stop_next < bus_.slaves[slave].stop.size()) return;
    report_unconfirmed(slave, now_ns);
    set_stop(slave, StopState::repeating, now_ns + probe_pause_ns(slave, now_ns));
    finish_stop(now_ns);
}

void Master::report_unconfirmed(std::uint32_t slave, std::int64_t now_ns) noexcept {
    if (slaves_[slave].is_stop_reported) return;
    slaves_[slave].is_stop_reported = true;
    image_.tell({Event::stop_unconfirmed, slave, 0, now_ns - stop_at_ns_});
}

void Master::end_of_job() noexcept {
    has_job_ = false;
    job_.begins_with_sync = false;
    job_.count = 0;
    job_.next = 0;
    job_.cells.clear();
}

/// Ends Phase::stopping when each slave has acknowledged or its attempts are used up, or the line
/// is lost for a second.
void Master::finish_stop(std::int64_t now_ns) noexcept {
    if (!stopping_) return;
    const bool is_lost = !line_was_open_ && now_ns - stop_at_ns_ > 1'000 * millisecond;
    for (std::uint32_t n = 0; n < slaves_.size(); ++n) {
        if (slaves_[n].stop != StopState::sending) continue;
        if (!is_lost) return;
        report_unconfirmed(n, now_ns);
        set_stop(n, StopState::repeating, now_ns);
    }
    if (!is_lost && request_last_broadcast()) return;
    broadcast_ = Broadcast::none;
    stopping_ = false;
    image_.header().phase.store(static_cast<std::uint32_t>(Phase::stopped));
}

/// A line that returns while the stop lasts may have lost the broadcast.
void Master::repeat_broadcast() noexcept {
    if (!held_ || bus_.broadcast_stop.empty()) return;
    broadcast_ = stopping_ ? Broadcast::first : Broadcast::last;
    broadcast_next_ = 0;
    broadcast_failures_ = 0;
}

/// Requests the broadcast behind the addressed stop telegrams, for which no slave waits any more.
/// Returns whether the stop waits for a broadcast.
bool Master::request_last_broadcast() noexcept {
    if (broadcast_ == Broadcast::waits) {
        broadcast_ = Broadcast::last;
    }
    return broadcast_ != Broadcast::none;
}

/// A telegram to all slaves is on the line: nothing is sent before they have executed it.
void Master::finish_broadcast(std::int64_t now_ns) noexcept {
    const std::int64_t sent_ns = std::max(now_ns, line_->sent_until_ns());
    free_at_ns_ = sent_ns + bus_.turnaround_ns;
    image_.header().busy_ns.fetch_add(free_at_ns_ - now_ns, std::memory_order_relaxed);
    end_of_job();
    broadcast_failures_ = 0;
    if (++broadcast_next_ < bus_.broadcast_stop.size()) return;
    image_.header().broadcasts.fetch_add(1, std::memory_order_relaxed);
    if (!is_broadcast_reported_) {
        is_broadcast_reported_ = true;
        image_.tell({Event::stop_broadcast, 0, 0, sent_ns - stop_at_ns_});
    }
    end_broadcast(now_ns);
}

/// The line did not accept a telegram to all slaves: it is sent again, but an open line that
/// accepts nothing must not keep the addressed stop telegrams waiting.
void Master::fail_broadcast(std::int64_t now_ns) noexcept {
    free_at_ns_ = now_ns + broadcast_retry_ns;
    end_of_job();
    if (++broadcast_failures_ < max_broadcast_failures) return;
    broadcast_failures_ = 0;
    end_broadcast(now_ns);
}

void Master::end_broadcast(std::int64_t now_ns) noexcept {
    broadcast_next_ = 0;
    broadcast_ = broadcast_ == Broadcast::first ? Broadcast::waits : Broadcast::none;
    finish_stop(now_ns);
}

// --- What is next

bool Master::may_write(std::int64_t now_ns) const noexcept {
    return !held_ && (is_verified_ || now_ns >= write_from_ns_) &&
           image_.header().outputs_valid.load(std::memory_order_acquire) != 0;
}

/// Returns whether a set-point may be sent to the slave of a telegram.
bool Master::is_writable(std::uint32_t telegram) const noexcept {
    const Telegram& t = plan_.telegrams[telegram];
    const SlaveState& slave = slaves_[t.slave];
    return t.kind != Telegram::Kind::read && !slave.is_offline && !slave.has_pending_stop();
}

bool Master::choose(std::int64_t now_ns) noexcept {
    if (choose_broadcast()) return true;
    const bool needs_echo_job = !is_echo_known_ && (held_ || !has_reads_);
    if (needs_echo_job && begin_echo_job()) return true;
    if (stopping_) return choose_stop();
    if (choose_repeated_stop(now_ns)) return true;
    if (choose_set_point(now_ns)) {
        last_was_set_point_ = true;
        return true;
    }
    last_was_set_point_ = false;
    return choose_probe(now_ns) || choose_due(now_ns);
}

bool Master::choose_broadcast() noexcept {
    if (broadcast_ != Broadcast::first && broadcast_ != Broadcast::last) return false;
    end_of_job();
    has_job_ = true;
    job_.telegram = broadcast_job;
    job_.slave = 0;
    add_write(bus_.broadcast_stop[broadcast_next_]);
    return true;
}

/// One stop telegram of each slave in turn, so that a slave that is offline does not delay others.
bool Master::choose_stop() noexcept {
    const auto count = static_cast<std::uint32_t>(slaves_.size());
    for (std::uint32_t n = 0; n < count; ++n) {
        const std::uint32_t slave = (stop_turn_ + n) % count;
        if (slaves_[slave].stop != StopState::sending) continue;
        stop_turn_ = slave + 1;
        begin_stop(slave);
        return true;
    }
    return false;
}

/// A list that has begun goes on at once.
bool Master::choose_repeated_stop(std::int64_t now_ns) noexcept {
    for (std::uint32_t n = 0; n < slaves_.size(); ++n) {
        const SlaveState& state = slaves_[n];
        if (state.stop != StopState::repeating || state.is_offline) continue;
        if (state.stop_next == 0 && now_ns < state.stop_due_ns) continue;
        begin_stop(n);
        return true;
    }
    return false;
}

void Master::begin_stop(std::uint32_t slave) noexcept {
    end_of_job();
    has_job_ = true;
    job_.telegram = stop_job;
    job_.slave = slave;
    job_.stop_index = slaves_[slave].stop_next;
    add_write(bus_.slaves[slave].stop[job_.stop_index]);
}

bool Master::choose_set_point(std::int64_t now_ns) noexcept {
    if (!may_write(now_ns)) return false;
    if (last_was_set_point_) {
        for (std::size_t n = 0; n < telegrams_.size(); ++n) {
            const Telegram& t = plan_.telegrams[n];
            if (t.kind == Telegram::Kind::read && !slaves_[t.slave].is_offline &&
                now_ns - telegrams_[n].due_ns > t.period_ns) {
                return false;
            }
        }
    }
    // the one that was due first is first: no set-point starves another
    std::uint32_t best = UINT32_MAX;
    for (std::uint32_t n = 0; n < telegrams_.size(); ++n) {
        if (!is_writable(n) || !has_changed(n)) continue;
        if (best == UINT32_MAX || telegrams_[n].due_ns < telegrams_[best].due_ns) {
            best = n;
        }
    }
    return best != UINT32_MAX && begin(best, now_ns);
}

bool Master::choose_probe(std::int64_t now_ns) noexcept {
    if (now_ns < probe_at_ns_) return false;
    const auto count = static_cast<std::uint32_t>(slaves_.size());
    for (std::uint32_t i = 0; i < count; ++i) {
        const std::uint32_t slave = (probe_next_ + i) % count;
        if (!slaves_[slave].is_offline || !begin_probe(slave, now_ns)) continue;
        probe_next_ = slave + 1;
        probe_at_ns_ = now_ns + probe_pause_ns(slave, now_ns);
        return true;
    }
    return false;
}

/// A request to an offline slave: its stop telegrams, else a read, else what is written to it.
bool Master::begin_probe(std::uint32_t slave, std::int64_t now_ns) noexcept {
    if (slaves_[slave].stop == StopState::repeating) {
        begin_stop(slave);
        return true;
    }
    std::uint32_t write = UINT32_MAX;
    for (std::uint32_t n = 0; n < telegrams_.size(); ++n) {
        const Telegram& t = plan_.telegrams[n];
        if (t.slave != slave) continue;
        if (t.kind != Telegram::Kind::read) {
            write = n;
        } else if (begin(n, now_ns)) {
            return true;
        }
    }
    if (write == UINT32_MAX || !may_write(now_ns)) return false;
    telegrams_[write].is_sent = false;
    return begin(write, now_ns);
}

/// The time after which the next request to an offline slave may follow one to this slave.
std::int64_t Master::probe_pause_ns(std::uint32_t slave, std::int64_t now_ns) const noexcept {
    const SlaveState& state = slaves_[slave];
    const bool stops = held_ && state.stop == StopState::repeating;
    const bool is_urgent = stops || now_ns < state.offline_since_ns + fresh_loss_ns;
    return (is_urgent ? urgent_share : probe_share) * 2 * bus_.slaves[slave].timeout_ns;
}

bool Master::choose_due(std::int64_t now_ns) noexcept {
    std::uint32_t best = UINT32_MAX;
    for (std::uint32_t n = 0; n < telegrams_.size(); ++n) {
        const Telegram& t = plan_.telegrams[n];
        if (telegrams_[n].due_ns > now_ns || slaves_[t.slave].is_offline) continue;
        const bool is_read = t.kind == Telegram::Kind::read;
        if (!is_read && !(is_writable(n) && may_write(now_ns))) continue;
        if (best == UINT32_MAX || telegrams_[n].due_ns < telegrams_[best].due_ns) {
            best = n;
        }
    }
    if (best == UINT32_MAX) return false;
    if (plan_.telegrams[best].kind != Telegram::Kind::read) {
        telegrams_[best].is_sent = false;  // writes everything again
    }
    return begin(best, now_ns);
}

std::int64_t Master::next_due(std::int64_t now_ns) const noexcept {
    std::int64_t next = now_ns + 100 * millisecond;
    for (std::size_t n = 0; n < telegrams_.size(); ++n) {
        const Telegram& t = plan_.telegrams[n];
        if (t.kind != Telegram::Kind::read) {
            next = std::min(next, now_ns + poll_ns);
        } else if (!slaves_[t.slave].is_offline) {
            next = std::min(next, telegrams_[n].due_ns);
        }
    }
    for (const SlaveState& state : slaves_) {
        if (state.stop == StopState::repeating && !state.is_offline) {
            next = std::min(next, state.stop_due_ns);
        }
    }
    return std::max(next, now_ns + 1);
}

/// Makes the requests of a telegram. Returns false when there is nothing to send.
bool Master::begin(std::uint32_t telegram, std::int64_t now_ns) noexcept {
    const Telegram& t = plan_.telegrams[telegram];
    TelegramState& own = telegrams_[telegram];
    end_of_job();
    job_.telegram = telegram;
    job_.slave = t.slave;
    for (std::size_t n = 0; n < cells_of(telegram); ++n) {
        job_.cells.push_back(cell_of(telegram, n));
    }
    bool has_requests = true;
    switch (t.kind) {
    case Telegram::Kind::read:
        if (framing_ == Framing::rtu && slaves_[t.slave].needs_sync) {
            job_.add(slaves_[t.slave].sync);
            job_.begins_with_sync = true;
        }
        make_read(t);
        break;
    case Telegram::Kind::write: has_requests = make_write(t); break;
    case Telegram::Kind::drive: make_drive(t); break;
    }
    // the grid stays, and what is late does not come twice
    own.due_ns = std::max(own.due_ns + t.period_ns, now_ns + t.period_ns / 2);
    if (!has_requests || job_.count == 0) {
        own.sent = job_.cells;
        own.is_sent = true;
        end_of_job();
        return false;
    }
    has_job_ = true;
    return true;
}

bool Master::has_changed(std::uint32_t telegram) const noexcept {
    const TelegramState& own = telegrams_[telegram];
    if (!own.is_sent) return true;
    for (std::size_t n = 0; n < own.sent.size(); ++n) {
        if (own.sent[n] != cell_of(telegram, n)) return true;
    }
    return false;
}

/// The cells that a telegram writes; of a drive: command and speed.
std::size_t Master::cells_of(std::uint32_t telegram) const noexcept {
    const Telegram& t = plan_.telegrams[telegram];
    if (t.kind == Telegram::Kind::read) return 0;
    return t.kind == Telegram::Kind::drive ? 2 : t.values.size();
}
std::uint64_t Master::cell_of(std::uint32_t telegram, std::size_t n) const noexcept {
    const Telegram& t = plan_.telegrams[telegram];
    if (t.kind != Telegram::Kind::drive) {
        return image_.value(t.values[n]).load(std::memory_order_relaxed);
    }
    const SlaveImage& slave = image_.slave(t.slave);
    return n == 0 ? slave.command.load(std::memory_order_relaxed)
                  : slave.speed.load(std::memory_order_relaxed);
}

// --- Requests

void Master::make_read(const Telegram& t) noexcept {
    if (t.table == Table::huanyang) {
        const std::uint8_t data[] = {static_cast<std::uint8_t>(t.address), 0, 0};
        job_.add(huanyang_request(4, data));
        return;
    }
    job_.add(read_request(read_function(t.table), t.address, t.count));
}

/// Returns false when a value is not finite: the slave keeps the last one.
bool Master::make_write(const Telegram& t) noexcept {
    std::array<std::uint16_t, max_write_registers> words{};
    std::array<std::uint8_t, (max_write_bits + 7) / 8> bits{};
    for (std::size_t n = 0; n < t.values.size(); ++n) {
        const PlannedValue& planned = plan_.values[t.values[n]];
        Registers r;
        if (!encode_value(*planned.value, job_.cells[n], r)) return false;
        if (is_bits(t.table)) {
            const unsigned on = r.words[0] & 1U;
            bits[planned.offset / 8] =
                static_cast<std::uint8_t>(bits[planned.offset / 8] | on << planned.offset % 8);
            continue;
        }
        std::copy_n(r.words.begin(), r.count, words.begin() + planned.offset);
    }
    if (is_bits(t.table)) {
        job_.add(t.count == 1 ? write_coil_request(t.address, bits[0] != 0)
                              : write_coils_request(t.address, t.count,
                                                    std::span(bits).first((t.count + 7U) / 8)));
        return true;
    }
    job_.add(t.count == 1 ? write_register_request(t.address, words[0])
                          : write_registers_request(t.address, std::span(words).first(t.count)));
    return true;
}

/// The writes of a direction. A drive that cannot reverse is stopped instead.
const std::vector<Write>& Master::writes_of(const Drive& drive, std::uint32_t direction) noexcept {
    if (direction == drive_forward) return drive.forward;
    if (direction == drive_reverse && !drive.reverse.empty()) return drive.reverse;
    return drive.stop;
}

/// Speed first, then run; the stop first, then speed 0. What has not changed is not sent.
void Master::make_drive(const Telegram& t) noexcept {
    const Drive& drive = *bus_.slaves[t.slave].drive;
    if (drive.one_telegram) return make_drive_of_coils(drive);
    const TelegramState& own = telegrams_[job_.telegram];
    const auto command = static_cast<std::uint32_t>(job_.cells[0]);
    const double rpm = std::bit_cast<double>(job_.cells[1]);
    const auto sent_command = own.is_sent ? static_cast<std::uint32_t>(own.sent[0]) : 0U;
    const bool stops = (command & 3U) == drive_stop;
    const bool command_changed = !own.is_sent || sent_command != command;
    const bool speed_changed = !own.is_sent || own.sent[1] != job_.cells[1];
    const bool changes_reset = ((sent_command ^ command) & drive_reset) != 0;
    const bool begins_reset = changes_reset && (command & drive_reset) != 0;
    if (begins_reset && stops && (sent_command & 3U) != drive_stop) {
        add_writes(drive.stop);  // first: a reset must not start what is still commanded
    }
    if (changes_reset) {
        add_reset(drive, begins_reset);
    }
    if (!stops && speed_changed) {
        add_speed(drive, rpm);
    }
    if (command_changed) {
        add_writes(writes_of(drive, command & 3U));
    }
    if (stops && (speed_changed || command_changed)) {
        add_speed(drive, 0.0);
    }
}

/// The control word and the reference of the FC profile, 32 coils in one request.
void Master::make_drive_of_coils(const Drive& drive) noexcept {
    const auto command = static_cast<std::uint32_t>(job_.cells[0]);
    const bool stops = (command & 3U) == drive_stop;
    const double rpm = stops ? 0.0 : std::bit_cast<double>(job_.cells[1]);
    const double share = std::clamp(rpm / drive.max_speed_rpm, 0.0, 1.0);
    const auto reference = static_cast<unsigned>(std::lround(share * drive.speed.value));
    const bool resets = (command & drive_reset) != 0 && !drive.reset.empty();
    const auto& writes = resets ? drive.reset : writes_of(drive, command & 3U);
    if (writes.empty()) return;
    const unsigned word = writes.front().value;
    const std::uint8_t bits[] = {
        static_cast<std::uint8_t>(word), static_cast<std::uint8_t>(word >> 8),
        static_cast<std::uint8_t>(reference), static_cast<std::uint8_t>(reference >> 8)};
    job_.add(write_coils_request(writes.front().address, 32, bits));
}

/// The end of a reset writes 0, unless the register is that of the command, which follows.
void Master::add_reset(const Drive& drive, bool begins) noexcept {
    for (Write write : drive.reset) {
        const bool is_command = !drive.stop.empty() && write.address == drive.stop[0].address;
        if (begins) {
            add_write(write);
        } else if (!is_command) {
            write.value = 0;
            add_write(write);
        }
    }
}

void Master::add_writes(const std::vector<Write>& writes) noexcept {
    for (const Write& write : writes) {
        add_write(write);
    }
}

void Master::add_write(const Write& write) noexcept {
    switch (write.table) {
    case Table::coil: {
        const Slave& slave = bus_.slaves[job_.slave];
        if (slave.drive && slave.drive->one_telegram && write.value > 1) {
            const std::uint8_t bits[] = {static_cast<std::uint8_t>(write.value),
                                         static_cast<std::uint8_t>(write.value >> 8), 0, 0};
            job_.add(write_coils_request(write.address, 32, bits));
        } else {
            job_.add(write_coil_request(write.address, write.value != 0));
        }
        break;
    }
    case Table::huanyang: {
        const std::uint8_t data[] = {static_cast<std::uint8_t>(write.value)};
        job_.add(huanyang_request(static_cast<std::uint8_t>(write.address), data));
        break;
    }
    default: job_.add(write_register_request(write.address, write.value)); break;
    }
}

void Master::add_speed(const Drive& drive, double rpm) noexcept {
    const double share = std::clamp(rpm / drive.max_speed_rpm, 0.0, 1.0);
    const auto counts = static_cast<std::uint16_t>(std::lround(share * drive.speed.value));
    if (drive.speed.table == Table::huanyang) {
        const std::uint8_t data[] = {static_cast<std::uint8_t>(counts >> 8),
                                     static_cast<std::uint8_t>(counts)};
        job_.add(huanyang_request(static_cast<std::uint8_t>(drive.speed.address), data));
        return;
    }
    job_.add(drive.speed_by_16 ? write_registers_request(drive.speed.address, std::span(&counts, 1))
                               : write_register_request(drive.speed.address, counts));
}

void Master::send(std::int64_t now_ns) noexcept {
    const Slave& slave = bus_.slaves[job_.slave];
    const bool is_broadcast = job_.telegram == broadcast_job;
    const std::int64_t gap_ns = is_broadcast ? bus_.max_gap_ns() : slave.gap_ns;
    const std::int64_t earliest =
        std::max(last_byte_ns_, line_->sent_until_ns()) + std::max(silence_ns_, gap_ns);
    if (framing_ == Framing::rtu && now_ns < earliest) {
        free_at_ns_ = earliest;
        return;
    }
    const Pdu& request = job_.requests[job_.next];
    const std::uint8_t unit = is_broadcast ? broadcast_unit : slave.unit;
    sent_ = encode(framing_, unit, ++transaction_, request);
    buffer_.clear();
    sent_at_ns_ = now_ns;
    waits_ = !is_broadcast;
    echo_is_due_ = true;
    // a failed send is a request that is not answered; is_open() reports a lost line
    const bool is_sent = line_->send(sent_.span(), now_ns);
    if (is_broadcast) return is_sent ? finish_broadcast(now_ns) : fail_broadcast(now_ns);
    deadline_ns_ = std::max(now_ns, line_->sent_until_ns()) + slave.timeout_ns;
}

}  // namespace hal::modbus
