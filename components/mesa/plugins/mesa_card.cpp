// SPDX-License-Identifier: MIT
#include <deque>
#include <memory>
#include <optional>
#include <stdexcept>

#include "bus/component/message_report.hpp"
#include "hal/component.hpp"
#include "hal/edge.hpp"
#include "hal/texts.hpp"
#include "mesa/card/card_server.hpp"

namespace {

using namespace hal::mesa;

/// The pins of the machine behind a card.
class MachinePins {
public:
    MachinePins(hal::Component& c, const CardConfig& card) {
        for (const MotorConfig& motor : card.motors) {
            positions_.emplace_back(c, (motor.name + ".position").c_str(),
                                    "where the motor is, in its unit of length");
            lost_.emplace_back(c, (motor.name + ".lost-steps").c_str(),
                               "steps against a mechanical stop");
        }
        for (const SwitchConfig& one : card.switches) {
            switches_.emplace_back(c, one.name.c_str(), "the switch is closed");
        }
        for (const SpindleConfig& spindle : card.spindles) {
            speeds_.emplace_back(c, (spindle.name + ".speed").c_str(), "how fast it turns",
                                 hal::PinOptions<double>{.unit = "rpm"});
        }
        for (const WireConfig& wire : card.inputs) {
            inputs_.emplace_back(c, wire.name.c_str(), "level at the input",
                                 hal::PinOptions<bool>{.initial = wire.initial});
        }
        for (const WireConfig& wire : card.outputs) {
            outputs_.emplace_back(c, wire.name.c_str(), "level of the output");
        }
    }

    /// [realtime]
    void set_inputs(EmulatedCard& card) const noexcept {
        for (std::size_t n = 0; n < inputs_.size(); ++n) {
            card.set_input(n, inputs_[n]);
        }
    }
    /// [realtime]
    void show(const EmulatedCard& card) noexcept {
        const Plant& plant = card.plant();
        for (std::size_t n = 0; n < positions_.size(); ++n) {
            positions_[n] = plant.position(n);
            lost_[n] = plant.lost_steps(n);
        }
        for (std::size_t n = 0; n < switches_.size(); ++n) {
            switches_[n] = plant.is_closed(n);
        }
        for (std::size_t n = 0; n < speeds_.size(); ++n) {
            speeds_[n] = plant.rpm(n);
        }
        for (std::size_t n = 0; n < outputs_.size(); ++n) {
            outputs_[n] = card.output(n);
        }
    }

private:
    std::deque<hal::Out<double>> positions_, speeds_;
    std::deque<hal::Out<std::uint64_t>> lost_;
    std::deque<hal::Out<bool>> switches_, outputs_;
    std::deque<hal::In<bool>> inputs_;
};

struct MesaCard : hal::Component {
    explicit MesaCard(const hal_host* host) : Component(host) {
        load();
        if (loaded_) {
            machine_.emplace(*this, config_);
            make_card();
        }
    }

    hal::TextArgument file_{*this,
                            "config",
                            "",
                            "configuration of the card, NAME.mesa; a list makes an instance of "
                            "each",
                            {.per_instance = true}};
    hal::TextArgument link_{*this,
                            "link",
                            "",
                            "the name in memory, overrides the address of the configuration: "
                            "sim:NAME",
                            {.per_instance = true}};
    hal::Function run_{*this, "", &MesaCard::update,
                       "lets the time of the card pass, and copies the pins"};
    hal::In<bool> drop_request_{*this, "drop-request", "requests are lost"};
    hal::In<bool> drop_reply_{*this, "drop-reply", "requests are executed, replies are lost"};
    hal::In<double> delay_{*this, "delay", "replies are late", {.unit = "s"}};
    hal::In<bool> duplicate_{*this, "duplicate", "replies come twice"};
    hal::In<bool> swap_{*this, "swap", "each second reply comes after the next one"};
    hal::In<bool> wrong_length_{*this, "wrong-length", "replies have a byte less"};
    hal::In<bool> wrong_cookie_{*this, "wrong-cookie", "the cookie of the firmware is wrong"};
    hal::In<bool> stuck_counter_{*this, "stuck-counter", "the counter of received packets stands"};
    hal::In<bool> remote_lost_{*this, "remote-lost", "smart-serial devices do not answer"};
    hal::In<bool> bite_{*this, "bite", "rising edge: the watchdog bites"};
    hal::In<bool> reset_{*this, "reset", "rising edge: the card loses its power and gets it back"};
    hal::In<bool> quadrature_error_{*this, "quadrature-error",
                                    "rising edge: encoders see A and B change at the same time"};
    hal::In<bool> other_master_{*this, "other-master",
                                "rising edge: another master makes all pins inputs"};
    hal::In<double> loss_{*this, "loss", "share of the datagrams that are lost at random, 0..1"};
    hal::Out<std::uint64_t> requests_{*this, "requests", "requests that the card has executed"};
    hal::Out<std::uint64_t> lost_{*this, "lost", "requests and replies that were lost"};
    hal::Out<std::uint64_t> bites_{*this, "bites", "bites of the watchdog"};
    hal::Out<bool> bitten_{*this, "bitten", "the watchdog has bitten, and is not cleared"};

    void start() {
        if (!loaded_) throw std::runtime_error("missing configuration: write config=FILE.mesa");
        if (attachment_) return;
        auto attached = hal::datagram::attach(config_.address, *server_);
        if (!attached) throw std::runtime_error(attached.problem);
        attachment_ = std::move(attached.attachment);
    }
    void stop() noexcept { attachment_.reset(); }

    void update(hal::Cycle cycle) noexcept {
        now_ns_ = cycle.start_ns();
        const bool bites = bite_edge_.rises(bite_);
        const bool resets = reset_edge_.rises(reset_);
        const bool fails = quadrature_edge_.rises(quadrature_error_);
        must_bite_ = must_bite_ || bites;
        must_reset_ = must_reset_ || resets;
        must_fail_ = must_fail_ || fails;
        must_make_inputs_ = other_master_edge_.rises(other_master_) || must_make_inputs_;
        attachment_->exclusively([](void* self) { static_cast<MesaCard*>(self)->work(); }, this);
    }

private:
    static constexpr std::array<std::uint8_t, 6> mac{0x02, 0, 0, 0, 0, 1};

    /// Drivers ask the card what it has while they are loaded, so it answers from here on. During a
    /// reload the instance before it still does: then it answers from start() on. [setup]
    void make_card() {
        card_ = std::make_unique<EmulatedCard>(config_, mac);
        server_ = std::make_unique<CardServer>(*card_);
        for (std::size_t n = 0; n < hal::mesa::card_fault_kinds; ++n) {
            CardFault fault;
            fault.kind = static_cast<CardFaultKind>(n);
            fault.is_active = false;
            fault.every = fault.kind == CardFaultKind::swap ? 2 : 1;
            server_->faults().push_back(fault);
        }
        attachment_ = hal::datagram::attach(config_.address, *server_).attachment;
    }

    /// Reads the configuration and reports what is wrong in it. [setup]
    void load() {
        const hal::Texts texts(*this);
        if (file_.get().empty()) {
            if (!texts.offered()) return;
            throw std::invalid_argument(
                "missing configuration; type: loadrt mesa_card config=FILE.mesa");
        }
        const std::string path = texts.find(file_.get());
        const std::string text = texts.read("config", file_.get());
        CardReadResult result = read_card(text, file_.get());
        hal::bus::report(texts, result.messages, path, text);
        config_ = std::move(result.card);
        if (!link_.get().empty()) {
            config_.address = link_.get();
        }
        if (config_.address.empty()) {
            throw std::invalid_argument("missing address; write address = sim:NAME in [card] of " +
                                        file_.get() + ", or link=sim:NAME behind it");
        }
        loaded_ = true;
    }

    void set_fault(CardFaultKind kind, bool is_active) noexcept {
        server_->faults()[static_cast<std::size_t>(kind)].is_active = is_active;
    }

    /// While no request is served. [realtime]
    void work() noexcept {
        set_fault(CardFaultKind::drop_request, drop_request_);
        set_fault(CardFaultKind::drop_reply, drop_reply_);
        set_fault(CardFaultKind::duplicate, duplicate_);
        set_fault(CardFaultKind::swap, swap_);
        set_fault(CardFaultKind::wrong_length, wrong_length_);
        set_fault(CardFaultKind::wrong_cookie, wrong_cookie_);
        set_fault(CardFaultKind::stuck_counter, stuck_counter_);
        set_fault(CardFaultKind::remote_lost, remote_lost_);
        const double delay = delay_ > 0.0 && delay_ < 1000.0 ? delay_.get() : 0.0;
        set_fault(CardFaultKind::delay, delay > 0.0);
        server_->faults()[static_cast<std::size_t>(CardFaultKind::delay)].delay_ns =
            static_cast<std::int64_t>(delay * 1e9);
        server_->set_loss(loss_);
        machine_->set_inputs(*card_);
        server_->advance(now_ns_);
        if (std::exchange(must_bite_, false)) {
            server_->strike(CardFaultKind::bite);
        }
        if (std::exchange(must_reset_, false)) {
            server_->strike(CardFaultKind::reset);
        }
        if (std::exchange(must_fail_, false)) {
            server_->strike(CardFaultKind::quadrature_error);
        }
        if (std::exchange(must_make_inputs_, false)) {
            server_->strike(CardFaultKind::other_master);
        }
        machine_->show(*card_);
        requests_ = card_->requests();
        lost_ = server_->lost();
        bites_ = card_->bites();
        bitten_ = card_->has_bitten();
    }

    CardConfig config_;
    bool loaded_ = false;
    std::optional<MachinePins> machine_;
    std::unique_ptr<EmulatedCard> card_;
    std::unique_ptr<CardServer> server_;
    std::unique_ptr<hal::datagram::Attachment> attachment_;
    hal::RisingEdge bite_edge_, reset_edge_, quadrature_edge_, other_master_edge_;
    bool must_bite_ = false, must_reset_ = false, must_fail_ = false, must_make_inputs_ = false;
    std::int64_t now_ns_ = 0;
};

}  // namespace

HAL_COMPONENT(MesaCard, "mesa_card", "Emulated Mesa card with a machine, for simulations", R"(
A Mesa Ethernet card made of software: step generators, encoders, PWM, inputs and outputs, watchdog, DPLL, smart serial with a 7I76, and behind its pins
motors with switches and encoders, and spindles. With a driver on the same name in memory a machine runs in `hal sim`:

`mill.mesa`:

    [card]
    type = 7i76e
    address = sim:mill

    [motor x]
    stepgen = 0
    scale = 200
    start = 20
    min = -5
    max = 305

    [switch x-home]
    motor = x
    below = 0
    terminal = remote 0 0

    [spindle spindle]
    drive = remote 0
    max-speed = 24000
    encoder = 0

    [input e-stop]
    terminal = remote 0 31
    initial = yes

The netlist:

    loadrt mesa_card config=mill.mesa
    addf mesa-card.0 servo-thread
    setp mesa-card.0.e-stop FALSE

Pins of the machine have the names of its parts: `x.position`, `x-home`, `spindle.speed`, `e-stop`. Steps move a motor only while the pins of its step generator
are outputs of the module, so that a bite of the watchdog stops it, as a real one.

The faults of a card and of the network are pins: `loss`, `drop-request`, `drop-reply`, `delay`, `duplicate`, `swap`, `wrong-length`, `wrong-cookie`,
`stuck-counter`, `remote-lost`, `bite`, `reset`, `quadrature-error`, `other-master`.

As a process with an IP address, it is `hal node mesa FILE`.
)")
