// SPDX-License-Identifier: MIT
// The firmware of an emulated slave: its state machine with all checks, its mailbox, its process
// data. What the device does is a Behaviour.
//
//     auto firmware = Firmware(std::move(design), std::make_unique<Blinker>());  // [setup]
//     firmware.faults().reject[State::op] = 0x0029;                              // from any thread
#pragma once

#include <array>
#include <atomic>
#include <memory>
#include <string>
#include <vector>

#include "ethercat/devices/dictionary.hpp"
#include "ethercat/devices/firmware_faults.hpp"
#include "ethercat/devices/firmware_mailbox.hpp"
#include "ethercat/devices/process_data.hpp"
#include "ethercat/esc/pdi.hpp"
#include "ethercat/wire/sii.hpp"

namespace hal::ethercat::devices {

/// Emergencies of one step, oldest first. Beyond the capacity, the newest ones are dropped and
/// counted. [realtime]
class Emergencies {
public:
    /// One that begins and one that ends a fault, of each of 8 axes.
    static constexpr std::size_t capacity = 16;

    void push(const coe::Emergency& emergency) noexcept {
        if (count_ == capacity) {
            ++dropped_;
            return;
        }
        items_[count_++] = emergency;
    }
    /// Appends the emergencies of a part of the device, and counts those it dropped.
    void append(const Emergencies& part) noexcept {
        for (const coe::Emergency& emergency : part.all()) {
            push(emergency);
        }
        dropped_ += part.dropped_;
    }
    std::span<const coe::Emergency> all() const noexcept { return {items_.data(), count_}; }
    std::uint32_t dropped() const noexcept { return dropped_; }

private:
    std::array<coe::Emergency, capacity> items_{};
    std::size_t count_ = 0;
    std::uint32_t dropped_ = 0;
};

/// A step of a device.
struct Step {
    std::int64_t now_ns = 0;
    std::int64_t dt_ns = 0;
    /// OP: the outputs in the dictionary are the master's; else they are 0
    bool outputs_valid = false;
    std::int64_t sync_cycle_ns = 0;  ///< of SYNC0, whose pulse the step belongs to; 0: free run
    std::uint64_t sync_time_ns = 0;  ///< system time of that pulse
    unsigned sample = 0;  ///< which sample of the cycle the step takes
    Emergencies emergencies{};  ///< put into the outbox of the mailbox after the step
};

/// What a device does with its dictionary.
class Behaviour {
public:
    virtual ~Behaviour() = default;
    /// Starts anew; the dictionary has its initial values. [realtime]
    virtual void power_on() noexcept {}
    /// Handles the loss of power: outputs are off. [realtime]
    virtual void power_off() noexcept {}
    /// Lets time pass without power. [realtime]
    virtual void rest(std::int64_t /*dt_ns*/) noexcept {}
    /// Returns true while time changes something without process data, such as the position of a
    /// motor. [realtime]
    virtual bool moves() const noexcept { return false; }
    /// Returns why a value that an SDO writes is rejected. [realtime]
    virtual coe::Abort check(std::uint16_t, std::uint8_t, std::span<const std::uint8_t>) noexcept {
        return coe::Abort::none;
    }
    /// Handles an object that the master wrote: by an SDO, or with outputs in OP. [realtime]
    virtual void written(std::uint16_t /*index*/, std::uint8_t /*sub*/) noexcept {}
    /// Works once: reads outputs, sets inputs in the dictionary. [realtime]
    virtual void step(Step&) noexcept = 0;
};

/// All that makes a slave, apart from its behaviour. Filled in setup.
struct Design {
    std::string name;
    sii::Contents sii;
    std::shared_ptr<Dictionary> dictionary = std::make_shared<Dictionary>();
    std::vector<std::unique_ptr<MailboxService>> services{};  ///< apart from CoE
    bool coe = true;
    bool dc = false;  ///< has SYNC0
    bool dc_required = false;  ///< rejects free run
    std::uint32_t shortest_cycle_ns = 62'500;
    SampledPdos sampled{};
    /// explicit device identification; 0: none set
    std::uint16_t device_id = 0;
    std::size_t max_output_bytes = 0;
    std::size_t max_input_bytes = 0;
};

/// The process data of one sync manager.
struct SyncArea {
    unsigned sync_manager = 0;
    std::uint16_t start = 0;
    std::uint8_t mode = 0;  ///< bits 0 to 3 of its control byte: buffers or mailbox, direction
    ProcessData data{};
    std::vector<std::uint8_t> image{};  ///< of all samples of a cycle
};

class Firmware final : public esc::Application, private DictionaryGuard {
public:
    Firmware(Design, std::unique_ptr<Behaviour>);  ///< [setup]
    void power_on(esc::Pdi&) noexcept override;
    void power_off() noexcept override;
    void rest(std::int64_t now_ns) noexcept override;
    void run(esc::Pdi&, std::int64_t now_ns) noexcept override;
    bool waits() const noexcept override;

    FirmwareFaults& faults() noexcept { return faults_; }  ///< [any]
    /// [any]
    State state() const noexcept { return shown_.load(std::memory_order_relaxed); }
    const Design& design() const noexcept { return design_; }
    Behaviour& behaviour() noexcept { return *behaviour_; }
    /// Returns the SYNC0 pulses without new outputs. [any]
    std::uint32_t missed_outputs() const noexcept {
        return missed_.load(std::memory_order_relaxed);
    }
    /// Returns how many emergencies the master never gets, because there were more in one step
    /// than Emergencies::capacity, or than the outbox had space for. [any]
    std::uint32_t dropped_emergencies() const noexcept {
        return dropped_emergencies_.load(std::memory_order_relaxed);
    }

private:
    coe::Abort check(const DictionaryObject&, const DictionaryEntry&,
                     std::span<const std::uint8_t> value) noexcept override;
    void written(const DictionaryObject&, const DictionaryEntry&) noexcept override;

    // State machine.
    void accept_control(esc::Pdi&, std::uint16_t control) noexcept;
    void change(esc::Pdi&, State to) noexcept;
    std::uint16_t code_against(esc::Pdi&, State to) noexcept;  ///< 0: the state can be entered
    std::uint16_t check_mailbox(esc::Pdi&, const sii::Mailboxes&,
                                std::uint16_t code) const noexcept;
    std::uint16_t check_process_data(esc::Pdi&) noexcept;
    std::uint16_t check_sync(esc::Pdi&) const noexcept;
    void wait_for_op(esc::Pdi&) noexcept;
    void watch(esc::Pdi&) noexcept;
    void enter(esc::Pdi&, State) noexcept;
    void switch_mailbox(State from, State to) noexcept;
    void start_application(esc::Pdi&) noexcept;
    void fail(esc::Pdi&, State stay, std::uint16_t code) noexcept;

    // Process data.
    std::vector<SyncArea> areas(sii::SmType) const;
    static std::size_t bytes(const std::vector<SyncArea>&) noexcept;
    void build(unsigned samples) noexcept;
    unsigned find_samples(esc::Pdi&) noexcept;
    bool fits(esc::Pdi&, const SyncArea&) const noexcept;
    void clear_outputs() noexcept;
    void run_process_data(esc::Pdi&) noexcept;
    void run_samples(esc::Pdi&, const esc::Pdi::Sync&) noexcept;
    void step(esc::Pdi&, std::int64_t dt_ns) noexcept;
    void work(Step) noexcept;
    void step_idle() noexcept;
    void pack(unsigned sample) noexcept;
    void write_inputs(esc::Pdi&) noexcept;
    void count_missed() noexcept;
    void send(const Emergencies&) noexcept;
    bool read_outputs(esc::Pdi&) noexcept;

    Design design_;
    std::unique_ptr<Behaviour> behaviour_;
    FirmwareFaults faults_;
    FirmwareMailbox mailbox_{faults_};
    std::vector<SyncArea> outputs_, inputs_;

    State state_ = State::init;
    State target_ = State::init;
    std::atomic<State> shown_{State::init};
    std::atomic<std::uint32_t> missed_{0};
    std::atomic<std::uint32_t> dropped_emergencies_{0};
    bool error_ = false;
    bool received_ = false;  ///< outputs since SAFE-OP
    bool runs_free_ = false;  ///< steps whenever it runs, without SYNC0
    std::int64_t now_ns_ = 0;
    std::int64_t last_step_ns_ = 0;
    std::int64_t op_since_ns_ = 0;
    std::int64_t change_at_ns_ = -1;
    std::uint64_t pulses_ = 0;
    std::uint64_t sync1_pulses_ = 0;
    unsigned samples_ = 1;  ///< in a cycle
    unsigned sample_ = 0;  ///< the next one
};

}  // namespace hal::ethercat::devices
