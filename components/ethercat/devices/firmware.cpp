// SPDX-License-Identifier: MIT
#include "ethercat/devices/firmware.hpp"

#include <algorithm>
#include <cstring>

#include "ethercat/devices/coe_server.hpp"
#include "ethercat/wire/registers.hpp"

namespace hal::ethercat::devices {

namespace {

// for valid outputs and SYNC0 after OP was requested
constexpr std::int64_t op_timeout_ns = 200'000'000;
constexpr std::int64_t lost_pulses = 10;
// between two steps without process data; in SAFE-OP longer than any cycle of SYNC0
constexpr std::int64_t idle_step_ns = 1'000'000;
constexpr std::int64_t idle_in_safeop_ns = 50'000'000;
constexpr std::uint8_t mode_bits = 0x0f;
constexpr std::uint8_t buffered_outputs = 0x04;
constexpr std::uint8_t buffered_inputs = 0x00;

int rank(State s) noexcept {
    if (s == State::op) return 4;
    if (s == State::safeop) return 3;
    if (s == State::preop) return 2;
    if (s == State::boot) return 1;
    return 0;
}

bool known(State s) noexcept { return s == State::init || rank(s) != 0; }

/// Returns whether a transition is one of the state machine, or none.
bool may_change(State from, State to) noexcept {
    if (to == from || to == State::init) return true;
    if (from == State::boot) return false;
    if (to == State::boot) return from == State::init;
    return rank(to) < rank(from) || rank(to) == rank(from) + 1 ||
           (from == State::init && to == State::preop);
}

}  // namespace

Firmware::Firmware(Design design, std::unique_ptr<Behaviour> behaviour)
    : design_(std::move(design)), behaviour_(std::move(behaviour)) {
    auto& dictionary = *design_.dictionary;
    if (design_.coe) {
        mailbox_.add(std::make_unique<CoeServer>(dictionary));
    }
    for (auto& service : design_.services) {
        mailbox_.add(std::move(service));
    }
    design_.services.clear();
    dictionary.guard_with(this);
    outputs_ = areas(sii::SmType::outputs);
    inputs_ = areas(sii::SmType::inputs);
}

/// Returns the process data of all sync managers of a type.
std::vector<SyncArea> Firmware::areas(sii::SmType type) const {
    const bool output = type == sii::SmType::outputs;
    std::vector<SyncArea> out;
    for (unsigned n = 0; n < design_.sii.sync_managers.size(); ++n) {
        const sii::SyncManager& sm = design_.sii.sync_managers[n];
        if (sm.type != type) continue;
        SyncArea& area = out.emplace_back();
        area.sync_manager = n;
        area.start = sm.start;
        area.mode = static_cast<std::uint8_t>(sm.control & mode_bits);
        if (sm.control == 0) {
            area.mode = output ? buffered_outputs : buffered_inputs;
        }
        const std::size_t max_bytes = output ? design_.max_output_bytes : design_.max_input_bytes;
        area.data.attach(*design_.dictionary, static_cast<std::uint16_t>(coe::assignment + n),
                         output, max_bytes, design_.sampled);
        area.image.resize(std::max<std::size_t>(max_bytes, 1));
    }
    return out;
}

std::size_t Firmware::bytes(const std::vector<SyncArea>& areas) noexcept {
    std::size_t sum = 0;
    for (const SyncArea& area : areas) {
        sum += area.data.bytes();
    }
    return sum;
}

void Firmware::build(unsigned samples) noexcept {
    for (auto* areas : {&outputs_, &inputs_}) {
        for (SyncArea& area : *areas) {
            area.data.build(samples);
        }
    }
}

void Firmware::clear_outputs() noexcept {
    for (SyncArea& area : outputs_) {
        area.data.clear();
    }
}

coe::Abort Firmware::check(const DictionaryObject& o, const DictionaryEntry& e,
                           std::span<const std::uint8_t> value) noexcept {
    for (const auto* areas : {&outputs_, &inputs_}) {
        for (const SyncArea& area : *areas) {
            const auto code = area.data.check(o, e, value);
            if (code != coe::Abort::none) return code;
        }
    }
    return behaviour_->check(o.index, e.sub, value);
}

void Firmware::written(const DictionaryObject& o, const DictionaryEntry& e) noexcept {
    behaviour_->written(o.index, e.sub);
}

void Firmware::power_on(esc::Pdi& pdi) noexcept {
    design_.dictionary->power_on();
    behaviour_->power_on();
    state_ = target_ = State::init;
    error_ = false;
    received_ = false;
    mailbox_.stop();
    change_at_ns_ = -1;
    shown_.store(State::init, std::memory_order_relaxed);
    pdi.set_al_status(static_cast<std::uint16_t>(State::init), 0);
}

void Firmware::power_off() noexcept {
    clear_outputs();
    behaviour_->power_off();
}

void Firmware::rest(std::int64_t now_ns) noexcept {
    const std::int64_t passed_ns = now_ns - last_step_ns_;
    if (passed_ns < idle_step_ns) return;
    last_step_ns_ = now_ns;
    behaviour_->rest(passed_ns);
}

/// Lets time pass while no process data does: below SAFE-OP, and in SAFE-OP without SYNC0. A motor
/// that turned when the slave left OP comes to rest in this time.
void Firmware::step_idle() noexcept {
    if (state_ == State::op) return;
    const std::int64_t passed_ns = now_ns_ - last_step_ns_;
    const std::int64_t pause_ns = state_ == State::safeop ? idle_in_safeop_ns : idle_step_ns;
    if (passed_ns < pause_ns) return;
    if (behaviour_->moves()) {
        work({now_ns_, passed_ns, false});
    } else {
        last_step_ns_ = now_ns_;
    }
}

void Firmware::run(esc::Pdi& pdi, std::int64_t now_ns) noexcept {
    now_ns_ = now_ns;
    if (const auto control = pdi.take_al_control()) {
        accept_control(pdi, *control);
    }
    if (change_at_ns_ >= 0 && now_ns >= change_at_ns_) {
        change_at_ns_ = -1;
        change(pdi, target_);
    }
    mailbox_.run(pdi, state_, now_ns);
    runs_free_ = false;
    if (state_ == State::safeop || state_ == State::op) {
        runs_free_ = !pdi.sync().active;
        run_process_data(pdi);
        wait_for_op(pdi);
        if (state_ == State::op) {
            watch(pdi);
        }
    }
    step_idle();
}

/// In OP with SYNC0, a pulse or a frame brings it further.
bool Firmware::waits() const noexcept {
    return state_ != State::op || runs_free_ || change_at_ns_ >= 0 || mailbox_.waits();
}

/// Takes new outputs out of all sync managers. Returns whether there are any. Their first sample is
/// in the dictionary then.
bool Firmware::read_outputs(esc::Pdi& pdi) noexcept {
    bool is_new = false;
    for (SyncArea& area : outputs_) {
        if (area.data.bytes() == 0) continue;
        const std::size_t n = pdi.read_sync_manager(area.sync_manager, area.image);
        if (n < area.data.bytes()) continue;
        is_new = true;
        received_ = true;
        if (state_ != State::op) continue;
        area.data.unpack({area.image.data(), n}, 0);
        area.data.each_object([this](std::uint16_t index, std::uint8_t sub) noexcept {
            behaviour_->written(index, sub);
        });
    }
    return is_new;
}

void Firmware::run_process_data(esc::Pdi& pdi) noexcept {
    const auto& sync = pdi.sync();
    if (samples_ > 1) return run_samples(pdi, sync);
    if (!sync.active) {
        read_outputs(pdi);
        if (now_ns_ > last_step_ns_) {
            step(pdi, now_ns_ - last_step_ns_);
        }
        return;
    }
    if (sync.pulses == pulses_) return;
    const auto pulses = static_cast<std::int64_t>(sync.pulses - pulses_);
    pulses_ = sync.pulses;
    if (!read_outputs(pdi)) {
        count_missed();
    }
    work({now_ns_, pulses * sync.sync0_cycle_ns, state_ == State::op, sync.sync0_cycle_ns,
          sync.last_pulse_dc_ns});
    pack(0);
    write_inputs(pdi);
}

/// Takes a sample at each pulse of SYNC0. The inputs are complete at SYNC1, or without it when all
/// samples of a cycle were taken; then the outputs of the next cycle begin.
void Firmware::run_samples(esc::Pdi& pdi, const esc::Pdi::Sync& sync) noexcept {
    if (sync.pulses != pulses_) {
        const auto pulses = static_cast<std::int64_t>(sync.pulses - pulses_);
        pulses_ = sync.pulses;
        if (sample_ == 0 && !read_outputs(pdi)) {
            count_missed();
        }
        const unsigned sample = std::min(sample_, samples_ - 1);
        for (SyncArea& area : outputs_) {
            if (state_ == State::op && received_) {
                area.data.unpack(area.image, sample);
            }
        }
        work({now_ns_, pulses * sync.sync0_cycle_ns, state_ == State::op, sync.sync0_cycle_ns,
              sync.last_pulse_dc_ns, sample});
        pack(sample);
        ++sample_;
    }
    const bool complete =
        sync.sync1_active ? sync.sync1_pulses != sync1_pulses_ : sample_ >= samples_;
    sync1_pulses_ = sync.sync1_pulses;
    if (complete) {
        write_inputs(pdi);
        sample_ = 0;
    }
}

/// Counts a pulse of SYNC0 without new outputs.
void Firmware::count_missed() noexcept {
    if (state_ != State::op || bytes(outputs_) == 0) return;
    missed_.fetch_add(1, std::memory_order_relaxed);
    if (auto* count = design_.dictionary->at(0x1c32, 0x0b)) {
        put(count, static_cast<std::uint16_t>(get<std::uint16_t>(count) + 1));
    }
}

/// Works once without SYNC0: all samples of the inputs are the same.
void Firmware::step(esc::Pdi& pdi, std::int64_t dt_ns) noexcept {
    work({now_ns_, dt_ns, state_ == State::op});
    for (unsigned sample = 0; sample < samples_; ++sample) {
        pack(sample);
    }
    write_inputs(pdi);
}

void Firmware::work(Step s) noexcept {
    behaviour_->step(s);
    last_step_ns_ = now_ns_;
    if (design_.coe && state_ != State::init) {
        send(s.emergencies);
    }
}

/// Copies the inputs of a sample out of the dictionary.
void Firmware::pack(unsigned sample) noexcept {
    for (SyncArea& area : inputs_) {
        const std::span<std::uint8_t> image{area.image.data(), area.data.bytes()};
        if (sample == 0) {
            std::fill(image.begin(), image.end(), std::uint8_t{0});
        }
        area.data.pack(image, sample);
    }
}

void Firmware::write_inputs(esc::Pdi& pdi) noexcept {
    for (const SyncArea& area : inputs_) {
        if (area.data.bytes() == 0) continue;
        pdi.write_sync_manager(area.sync_manager, {area.image.data(), area.data.bytes()});
    }
}

void Firmware::send(const Emergencies& emergencies) noexcept {
    std::uint32_t dropped = emergencies.dropped();
    for (const coe::Emergency& emergency : emergencies.all()) {
        if (!mailbox_.send(emergency)) {
            ++dropped;
        }
    }
    if (dropped != 0) {
        dropped_emergencies_.fetch_add(dropped, std::memory_order_relaxed);
    }
}

// The state machine (ETG.1000.6, clause 6.4.1) and its checks.

void Firmware::accept_control(esc::Pdi& pdi, std::uint16_t control) noexcept {
    const auto to = static_cast<State>(control & 0x0f);
    const bool acknowledge = (control & al_error) != 0;
    // an error is acknowledged first
    if (error_ && !acknowledge && rank(to) > rank(state_)) return;
    if (acknowledge) {
        error_ = false;
    }
    if ((control & al_identify) != 0 && to == state_ && !error_) {
        pdi.set_al_status(static_cast<std::uint16_t>(static_cast<unsigned>(state_) | al_identify),
                          design_.device_id);
        return;
    }
    target_ = to;
    const auto delay = faults_.state_delay_ns.load(std::memory_order_relaxed);
    if (delay > 0 && to != state_) {
        change_at_ns_ = now_ns_ + delay;
        return;
    }
    change_at_ns_ = -1;
    change(pdi, to);
}

void Firmware::change(esc::Pdi& pdi, State to) noexcept {
    op_since_ns_ = -1;
    if (!known(to)) return fail(pdi, state_, 0x0012);
    if (!may_change(state_, to)) return fail(pdi, state_, 0x0011);
    if (to == state_) {
        if (!error_) {
            pdi.set_al_status(static_cast<std::uint16_t>(state_), 0);
        }
        return;
    }
    if (const auto code = faults_.reject[to].load(std::memory_order_relaxed)) {
        return fail(pdi, state_, code);
    }
    const bool up = rank(to) > rank(state_);
    if (const auto code = up ? code_against(pdi, to) : std::uint16_t{0}) {
        return fail(pdi, state_, code);
    }
    if (to == State::op) {
        op_since_ns_ = now_ns_;
        return wait_for_op(pdi);
    }
    enter(pdi, to);
}

std::uint16_t Firmware::code_against(esc::Pdi& pdi, State to) noexcept {
    switch (to) {
    case State::boot:
        if (design_.sii.boot.receive.size == 0) return 0x0013;
        return check_mailbox(pdi, design_.sii.boot, 0x0015);
    case State::preop:
        if (!design_.sii.has_mailbox()) return 0;
        return check_mailbox(pdi, design_.sii.mailboxes, 0x0016);
    case State::safeop:
        if (const auto code = check_process_data(pdi)) return code;
        return check_sync(pdi);
    default: return 0;
    }
}

std::uint16_t Firmware::check_mailbox(esc::Pdi& pdi, const sii::Mailboxes& m,
                                      std::uint16_t code) const noexcept {
    const auto out = pdi.sync_manager(0);
    const auto in = pdi.sync_manager(1);
    const auto fits = [](const esc::Pdi::SyncManager& sm, const sii::Area& area,
                         unsigned direction) {
        return sm.enabled && sm.start == area.start && sm.length >= smallest_mailbox &&
               sm.length <= area.size && (sm.control & 0x0fU) == (2U | direction);
    };
    return fits(out, m.receive, 4) && fits(in, m.send, 0) ? std::uint16_t{0} : code;
}

bool Firmware::fits(esc::Pdi& pdi, const SyncArea& area) const noexcept {
    if (area.start == 0) return true;
    const auto sm = pdi.sync_manager(area.sync_manager);
    const std::size_t length = area.data.bytes();
    if (length == 0) return !sm.enabled || sm.length == 0;
    return sm.enabled && sm.start == area.start && sm.length == length &&
           (sm.control & mode_bits) == area.mode;
}

/// Returns the samples in a cycle: the pulses of SYNC0 until SYNC1, or what the length of a sync
/// manager holds.
unsigned Firmware::find_samples(esc::Pdi& pdi) noexcept {
    const unsigned max = design_.sampled.max_samples;
    if (max < 2) return 1;
    const auto& sync = pdi.sync();
    if (sync.sync1_active && sync.sync0_cycle_ns != 0) {
        return std::min(sync.sync1_cycle_ns / sync.sync0_cycle_ns + 1, max);
    }
    for (auto* areas : {&outputs_, &inputs_}) {
        for (SyncArea& area : *areas) {
            area.data.build(1);
            const std::size_t one = area.data.bits();
            if (!area.data.has_samples()) continue;
            area.data.build(2);
            const std::size_t per_sample = area.data.bits() - one;
            const std::size_t rest = one - per_sample;
            const std::size_t bits = 8 * std::size_t{pdi.sync_manager(area.sync_manager).length};
            if (per_sample == 0 || bits <= rest) continue;
            return std::clamp(static_cast<unsigned>((bits - rest) / per_sample), 1U, max);
        }
    }
    return 1;
}

std::uint16_t Firmware::check_process_data(esc::Pdi& pdi) noexcept {
    samples_ = find_samples(pdi);
    build(samples_);
    const auto all_fit = [&](const std::vector<SyncArea>& areas) {
        return std::all_of(areas.begin(), areas.end(),
                           [&](const SyncArea& area) { return fits(pdi, area); });
    };
    if (!all_fit(outputs_)) return 0x001d;
    if (!all_fit(inputs_)) return 0x001e;
    return 0;
}

std::uint16_t Firmware::check_sync(esc::Pdi& pdi) const noexcept {
    const std::uint8_t activation = *pdi.memory(registers::dc_activation);
    const bool requested = (activation & 1) != 0;
    if (!requested) {
        if (design_.dc_required || samples_ > 1) return 0x0027;
        return 0;
    }
    if (!design_.dc) return 0x0028;
    if ((activation & 2) == 0) return 0x0030;
    const auto& sync = pdi.sync();
    if (sync.sync0_cycle_ns == 0) return 0x0035;
    if (sync.sync0_cycle_ns < design_.shortest_cycle_ns) return 0x002e;
    return 0;
}

/// Completes SAFE-OP to OP once outputs were received and SYNC0 runs.
void Firmware::wait_for_op(esc::Pdi& pdi) noexcept {
    if (op_since_ns_ < 0 || state_ != State::safeop) return;
    const bool outputs = bytes(outputs_) == 0 || received_;
    const auto& sync = pdi.sync();
    const bool synchronised = !sync.active || sync.pulses != 0;
    if (outputs && synchronised) {
        op_since_ns_ = -1;
        enter(pdi, State::op);
    } else if (now_ns_ - op_since_ns_ >= op_timeout_ns) {
        op_since_ns_ = -1;
        fail(pdi, State::safeop, synchronised ? 0x001b : 0x002d);
    }
}

/// Leaves OP when outputs or SYNC0 fail.
void Firmware::watch(esc::Pdi& pdi) noexcept {
    if (const auto code = faults_.fail.exchange(0, std::memory_order_relaxed)) {
        return fail(pdi, State::safeop, code);
    }
    for (const SyncArea& area : outputs_) {
        if (area.data.bytes() == 0) continue;
        const auto sm = pdi.sync_manager(area.sync_manager);
        const bool watched = (sm.control & 0x40) != 0;
        if (watched && pdi.watchdog_expired()) return fail(pdi, State::safeop, 0x001b);
        if (!sm.enabled) return fail(pdi, State::safeop, 0x001d);
    }
    const auto& sync = pdi.sync();
    if (sync.active && sync.last_pulse_ns != 0 &&
        now_ns_ - sync.last_pulse_ns > lost_pulses * sync.sync0_cycle_ns) {
        fail(pdi, State::safeop, 0x002c);
    }
}

void Firmware::enter(esc::Pdi& pdi, State to) noexcept {
    const State from = state_;
    const bool leaves_op = from == State::op && to != State::op;
    if (leaves_op) {
        clear_outputs();
    }
    switch_mailbox(from, to);
    state_ = to;
    if (from == State::preop && to == State::safeop) {
        start_application(pdi);
    }
    const bool keeps_outputs = to == State::op || to == State::safeop;
    if (!keeps_outputs) {
        received_ = false;
    }
    shown_.store(to, std::memory_order_relaxed);
    if (leaves_op) {
        step(pdi, 0);  // below SAFE-OP it is the last one: outputs are off
    }
    pdi.set_al_status(static_cast<std::uint16_t>(to), 0);
}

/// Starts or stops the mailbox that a state has: none in INIT, that of BOOT, or the standard one.
void Firmware::switch_mailbox(State from, State to) noexcept {
    if (to == State::init) {
        mailbox_.stop();
    } else if (to == State::boot) {
        mailbox_.start(design_.sii.boot);
    } else if (from == State::init && to == State::preop && design_.sii.has_mailbox()) {
        mailbox_.start(design_.sii.mailboxes);
    }
}

/// Begins the exchange of process data: inputs are valid in SAFE-OP.
void Firmware::start_application(esc::Pdi& pdi) noexcept {
    const auto& sync = pdi.sync();
    received_ = false;
    last_step_ns_ = now_ns_;
    pulses_ = sync.active ? sync.pulses : 0;
    sync1_pulses_ = sync.sync1_pulses;
    sample_ = 0;
    step(pdi, 0);
}

void Firmware::fail(esc::Pdi& pdi, State stay, std::uint16_t code) noexcept {
    if (stay != state_) {
        const bool leaves_op = state_ == State::op;
        if (leaves_op) {
            clear_outputs();
            received_ = false;
        }
        state_ = stay;
        shown_.store(stay, std::memory_order_relaxed);
        if (leaves_op) {
            step(pdi, 0);
        }
    }
    error_ = true;
    pdi.set_al_status(static_cast<std::uint16_t>(static_cast<unsigned>(stay) | al_error), code);
}

}  // namespace hal::ethercat::devices
