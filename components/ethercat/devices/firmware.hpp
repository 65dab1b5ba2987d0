// SPDX-License-Identifier: MIT
// The firmware of an emulated slave: its state machine with all checks, its mailbox, its process
// data. What the device does is a Behaviour.
//
//     auto firmware = Firmware(std::move(design), std::make_unique<Blinker>());   // [setup]
//     firmware.faults().reject[State::op] = 0x0029;                               // from any thread
#pragma once

#include <array>
#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "ethercat/devices/coe_server.hpp"
#include "ethercat/devices/dictionary.hpp"
#include "ethercat/devices/mailbox_service.hpp"
#include "ethercat/devices/process_data.hpp"
#include "ethercat/esc/pdi.hpp"
#include "ethercat/wire/sii.hpp"

namespace hal::ethercat::devices {

/// A step of a device.
struct Step {
    std::int64_t now_ns = 0;
    std::int64_t dt_ns = 0;
    /// OP: the outputs in the dictionary are the master's; else they are 0
    bool outputs_valid = false;
    bool synchronous = false;  ///< the step belongs to a SYNC0 pulse
    std::optional<coe::Emergency> emergency;  ///< set by the device to send one
};

/// What a device does with its dictionary.
class Behaviour {
public:
    virtual ~Behaviour() = default;
    /// Starts anew; the dictionary has its initial values. [realtime]
    virtual void power_on() noexcept {}
    /// Works once: reads outputs, sets inputs in the dictionary. [realtime]
    virtual void step(Step&) noexcept = 0;
};

/// Faults on command. Written from any thread, read by the firmware.
struct FirmwareFaults {
    struct Rejections {
        std::atomic<std::uint16_t>& operator[](State s) noexcept {
            return codes[static_cast<unsigned>(s) & 15];
        }
        std::array<std::atomic<std::uint16_t>, 16> codes{};
    };
    /// AL status code with which a state is rejected; 0: accepted
    Rejections reject;
    std::atomic<std::uint16_t> fail{0};  ///< drops to SAFE-OP with this code, once
    std::atomic<std::int64_t> mailbox_delay_ns{0};  ///< minimum time to an answer
    std::atomic<std::int64_t> state_delay_ns{0};  ///< time that a state change takes
    std::atomic<bool> mailbox_dead{false};  ///< reads requests, answers none
};

/// All that makes a slave, apart from its behaviour. Filled in setup.
struct Design {
    std::string name;
    sii::Contents sii;
    std::shared_ptr<Dictionary> dictionary = std::make_shared<Dictionary>();
    std::vector<std::unique_ptr<MailboxService>> services;  ///< apart from CoE
    bool coe = true;
    bool dc = false;  ///< has SYNC0
    bool dc_required = false;  ///< rejects free run
    std::uint32_t shortest_cycle_ns = 62'500;
    /// explicit device identification; 0: none set
    std::uint16_t device_id = 0;
    std::size_t most_output_bytes = 0;
    std::size_t most_input_bytes = 0;
};

class Firmware final : public esc::Application, private DictionaryGuard {
public:
    Firmware(Design, std::unique_ptr<Behaviour>);  ///< [setup]
    void power_on(esc::Pdi&) noexcept override;
    void run(esc::Pdi&, std::int64_t now_ns) noexcept override;

    FirmwareFaults& faults() noexcept { return faults_; }  ///< [any]
    /// [any]
    State state() const noexcept { return shown_.load(std::memory_order_relaxed); }
    const Design& design() const noexcept { return design_; }
    Behaviour& behaviour() noexcept { return *behaviour_; }
    /// SYNC0 pulses without new
    std::uint32_t missed_outputs() const noexcept {
        return missed_.load(std::memory_order_relaxed);
    }
    ///< outputs. [any]

private:
    std::uint32_t check(const DictionaryObject&, const DictionaryEntry&,
                        std::span<const std::uint8_t> value) noexcept override;

    // State machine (firmware_states.cpp).
    void take_control(esc::Pdi&, std::uint16_t control) noexcept;
    void change(esc::Pdi&, State to) noexcept;
    std::uint16_t code_against(esc::Pdi&, State to) noexcept;  ///< 0: the state can be entered
    std::uint16_t check_mailbox(esc::Pdi&, const sii::Mailboxes&,
                                std::uint16_t code) const noexcept;
    std::uint16_t check_process_data(esc::Pdi&) noexcept;
    std::uint16_t check_sync(esc::Pdi&) const noexcept;
    void wait_for_op(esc::Pdi&) noexcept;
    void watch(esc::Pdi&) noexcept;
    void enter(esc::Pdi&, State) noexcept;
    void fail(esc::Pdi&, State stay, std::uint16_t code) noexcept;

    // Mailbox (firmware_mailbox.cpp).
    void start_mailbox(const sii::Mailboxes&) noexcept;
    void run_mailbox(esc::Pdi&) noexcept;
    void receive_mail(esc::Pdi&) noexcept;
    void send_mail(esc::Pdi&) noexcept;
    void repeat_mail(esc::Pdi&) noexcept;

    void run_process_data(esc::Pdi&) noexcept;
    void step(esc::Pdi&, std::int64_t dt_ns, bool synchronous) noexcept;
    bool read_outputs(esc::Pdi&) noexcept;

    Design design_;
    std::unique_ptr<Behaviour> behaviour_;
    std::unique_ptr<CoeServer> coe_;
    FirmwareFaults faults_;
    ProcessData outputs_, inputs_;
    std::vector<std::uint8_t> image_;  ///< of outputs or inputs
    unsigned sm_out_ = 2;
    unsigned sm_in_ = 3;
    std::uint16_t out_start_ = 0;
    std::uint16_t in_start_ = 0;

    State state_ = State::init;
    State target_ = State::init;
    std::atomic<State> shown_{State::init};
    std::atomic<std::uint32_t> missed_{0};
    bool error_ = false;
    bool received_ = false;  ///< outputs since SAFE-OP
    std::int64_t now_ns_ = 0;
    std::int64_t last_step_ns_ = 0;
    std::int64_t op_since_ns_ = 0;
    std::int64_t change_at_ns_ = -1;
    std::uint64_t pulses_ = 0;

    Outbox outbox_;
    std::vector<std::uint8_t> mail_, newest_, previous_, taken_;  // taken_: the newest request
    std::size_t newest_bytes_ = 0;
    std::size_t previous_bytes_ = 0;
    std::size_t receive_bytes_ = 0;
    std::size_t taken_bytes_ = 0;
    std::int64_t answer_at_ns_ = 0;
    std::uint8_t counter_ = 0;
    bool mailbox_running_ = false;
    bool repeat_ = false;
    bool resend_newest_ = false;
};

}  // namespace hal::ethercat::devices
