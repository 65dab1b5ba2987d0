// SPDX-License-Identifier: MIT
// The driver of a Mesa card as a component, under the names of LinuxCNC's hm2_eth.
#pragma once

#include <atomic>
#include <bit>
#include <memory>
#include <optional>
#include <vector>

#include "bus/component/bus_component.hpp"
#include "dpll_pins.hpp"
#include "encoder_pins.hpp"
#include "event_texts.hpp"
#include "hal/reporter.hpp"
#include "hal/retained.hpp"
#include "input_pins.hpp"
#include "loaded_card.hpp"
#include "mesa/driver/card_monitor.hpp"
#include "mesa/driver/cycle_link.hpp"
#include "output_pins.hpp"
#include "port_pins.hpp"
#include "pwm_pins.hpp"
#include "serial_pins.hpp"
#include "stepgen_pins.hpp"
#include "three_phase_pins.hpp"

namespace hal::mesa {

/// `names` is the MesaNames of the component.
template <const MesaNames& names>
struct MesaComponent : LoadedCard, hal::bus::BusComponent {
    explicit MesaComponent(const hal_host* host)
        : LoadedCard(host, names), BusComponent(host, "hm2_card.0", "read", "write") {
        declare_modules();
        std::vector<std::string> remotes;
        for (const RemotePort& port : remote_ports_) {
            for (const Remote& remote : port.remotes) {
                remotes.push_back("the device " + remote.name());
                remote_faults_.emplace_back();
            }
        }
        std::vector<std::string> unused = unused_modules(image_);
        unused_modules_ = unused.size();
        texts_ =
            std::make_unique<EventTexts>(image_.address + " (" + image_.card + ")",
                                         std::move(remotes), std::move(unused), image_.pins.size());
        reporter_ = std::make_unique<hal::Reporter<EventRecord>>(
            name_, [this](const EventRecord& record) { return texts_->line(record); }, 256,
            &EventTexts::subject);
    }

    void start() {
        if (port_ == nullptr) {
            throw std::runtime_error(std::string("missing card; type: loadrt ") + names.example);
        }
        SetupLink setup(*port_);
        check_alone(setup);
        if (leads_) {
            if (dpll_ == nullptr) {
                throw std::runtime_error("clock=card: the firmware of the card has no DPLL");
            }
            clock_.claim();
        }
        build_stop();
        link_.emplace(*port_, layout_, session());
        monitor_.restart();
        rewrites_ = true;
        was_lost_ = false;
        begin_cycles();
        reporter_->start();
        for (std::uint32_t n = 0; n < unused_modules_; ++n) {
            reporter_->tell({Event::module_unused, n});
        }
    }
    void stop() noexcept {
        if (link_) {
            send_last_stop();
        }
        link_.reset();
        reporter_->stop();
    }

    /// Does nothing in another thread than that of read: a card belongs to one thread.
    void read_request(hal::Cycle cycle) noexcept {
        if (!link_ || reader_.load(std::memory_order_relaxed) != thread_of(cycle)) return;
        requested_by_function_ = true;
        link_->request(cycle.start_ns());
    }

    void read(hal::Cycle cycle) noexcept {
        if (!link_) return;
        const std::int64_t now = cycle.start_ns();
        reader_.store(thread_of(cycle), std::memory_order_relaxed);
        const hal::bus::Turn turn = receive_turn(cycle);
        if (begins_anew(turn)) {
            monitor_.restart();
            link_->restart();
            is_after_gap_ = true;
            pause_ns_ += std::max<std::int64_t>(now - last_read_ns_, 0);
            note_stop();
        }
        last_read_ns_ = now;
        stop_unwritten(now);
        if (is_offline(turn)) {
            show_offline(cycle.seconds());
            return;
        }
        link_->request(now);
        const Answer answer = link_->receive(now, wait_limit(cycle));
        const bool is_fresh = answer == Answer::fresh;
        is_fresh_ = is_fresh;
        check_hold(cycle.period_ns());
        const CardState before = monitor_.state();
        const CardEvent event = monitor_.step(report(is_fresh), hold_cycles_, cycle.period_ns());
        rewrites_ = rewrites_ || (monitor_.state() != before && !monitor_.drives_outputs());
        handle(event, now);
        if (is_fresh) {
            // one behind a gap is checked by the position; of others, those that may have had a rate
            if (monitor_.state() == CardState::configuring && shows_bite() && !is_after_gap_) {
                lose_positions();
            }
            receive(cycle, now);
        } else {
            ++missing_cycles_;
            may_have_reset_ = may_have_reset_ || std::exchange(hides_reset_, false);
            ports_->miss(cycle.seconds());
            rewrites_ = true;  // whether the writes of the same datagram have arrived is unknown
            for (const auto& module : modules_) {
                module->miss(cycle.seconds());
            }
        }
        tell_waiting();
        follow_remotes();
        follow_bite();
        tell_release();
        show(is_fresh);
        if (leads_ && is_fresh) {
            // a reading that is late in the period of the card has to be earlier
            follow_reference(static_cast<std::int64_t>(-1000.0 * dpll_->error_us()),
                             cycle.period_ns());
        }
    }

    void write(hal::Cycle cycle) noexcept {
        if (!link_) return;
        const std::int64_t now = cycle.start_ns();
        if (!functions_.transmit(cycle)) {
            stop_unread(cycle);
            return;
        }
        unwritten_cycles_ = 0;
        unread_cycles_ = 0;
        const bool requests = !std::exchange(requested_by_function_, false);
        const CardState state = monitor_.state();
        if (state == CardState::lost || state == CardState::contended) {
            if (requests) {
                link_->request(now);
            }
            return;
        }
        const Writing writing = writing_of(cycle);
        Outgoing out(link_->begin_write(), std::exchange(rewrites_, false));
        write_watchdog(out);
        for (const auto& module : modules_) {
            module->transmit(out, writing);
        }
        ports_->transmit(out, writing);
        link_->send_write(now, requests, serial_ ? serial_->write_size() : 0,
                          [&](Request& request) {
            if (serial_) {
                Outgoing late(request, false);
                serial_->transmit_late(late, writing);
            }
        });
    }

    void make_safe(hal::Cycle) noexcept {
        if (!link_) return;
        send_last_stop();
        interrupt();
    }

private:
    static constexpr std::int64_t max_run_on_ns = 20'000'000;
    static constexpr unsigned stop_copies = 3;  // of a datagram that nothing confirms
    static constexpr unsigned max_hold = hal::FunctionPair::tolerated_cycles;

    // --- Declaration

    template <class Pins, class... Arguments>
    Pins* add(Arguments&&... arguments) {
        auto pins = place<Pins>(std::forward<Arguments>(arguments)...);
        Pins* const added = pins.get();
        modules_.push_back(std::move(pins));
        return added;
    }
    /// In the order of the reads: the levels of the pins and the sync event of the DPLL first.
    void declare_modules() {
        const PinOwner owner{*this, read_, write_};
        const CardModule& ports = *image_.find(Tag::ioport);
        ports_ = place<PortPins>(owner, image_, ports);
        const CardModule* const dpll = image_.find(Tag::dpll);
        const bool has_dpll = dpll != nullptr && dpll->used > 0;
        if (has_dpll) {
            dpll_ = add<DpllPins>(owner, *dpll, leads_);
        }
        for (const CardModule& module : image_.modules) {
            declare_module(owner, module, has_dpll);
        }
        if (!remote_ports_.empty()) {
            serial_ = add<SerialPins>(owner, remote_ports_);
        }
        if (config_.enable_raw()) {
            add<RawPins>(owner);
        }
        const CardModule& watchdog = *image_.find(Tag::watchdog);
        ports_->plan(layout_);
        watchdog_status_ = layout_.add(watchdog.addresses.at(watchdog::status));
        watchdog_timeout_ = layout_.add(watchdog.addresses.at(watchdog::timeout));
        for (const auto& module : modules_) {
            module->plan(layout_);
        }
        watchdog_ = watchdog.addresses;
        watchdog_clock_hz_ = watchdog.clock_hz;
    }
    void declare_module(const PinOwner& owner, const CardModule& module, bool has_dpll) {
        if (module.used == 0) return;
        switch (module.tag()) {
        case Tag::stepgen: stepgens_ = add<StepgenPins>(owner, module, dpll_); break;
        case Tag::encoder:
        case Tag::muxed_encoder: encoders_ = add<EncoderPins>(owner, module, has_dpll); break;
        case Tag::pwm: add<PwmPins>(owner, module); break;
        case Tag::three_phase_pwm: add<ThreePhasePins>(owner, module); break;
        case Tag::ssr: add<SsrPins>(owner, image_, module); break;
        case Tag::outm: add<OutmPins>(owner, image_, module); break;
        case Tag::led: add<LedPins>(owner, module); break;
        case Tag::inm: add<InputPins>(owner, module, inm_widths_); break;
        case Tag::inmux: add<InputPins>(owner, module, inmux_widths_); break;
        default: break;
        }
    }
    /// Another master of the same card has another one.
    std::uint16_t session() const {
        std::uint64_t bits = std::hash<std::string>()(name_);
        if (!port_->description().in_memory) {
            bits ^= static_cast<std::uint64_t>(hal::monotonic_ns());
        }
        bits *= 0x9E3779B97F4A7C15;
        return static_cast<std::uint16_t>(bits >> 48 | 1U);
    }

    // --- Functions that do not run

    /// Returns whether one function has run so often without the other one that the card is stopped.
    /// The stop is repeated some times, because nothing confirms it.
    bool is_to_stop(unsigned& cycles) noexcept {
        const unsigned tolerated = std::min<std::uint32_t>(hold_cycles_, max_hold) + 1;
        cycles = std::min(cycles + 1, tolerated + stop_copies + 1);
        return cycles > tolerated && cycles <= tolerated + stop_copies &&
               monitor_.state() != CardState::contended;
    }
    /// read runs, and write may not: nothing is commanded any more.
    void stop_unwritten(std::int64_t now) noexcept {
        if (!is_to_stop(unwritten_cycles_)) return;
        send_stop(now);
        note_stop();
        lose_sight();
    }
    /// write runs, and read does not: nobody knows what the commands are about.
    void stop_unread(hal::Cycle cycle) noexcept {
        const bool is_alone = functions_.receive_is_late() &&
                              reader_.load(std::memory_order_relaxed) == thread_of(cycle);
        if (!is_alone || !is_to_stop(unread_cycles_)) return;
        send_stop(cycle.start_ns());
        interrupt();  // read notes it when it runs again
    }

    // --- Reading

    /// The host gives all functions of a thread the same hal_cycle, and each thread another one.
    static const void* thread_of(hal::Cycle cycle) noexcept {
        return std::bit_cast<const hal_cycle*>(cycle);
    }
    std::int64_t wait_limit(hal::Cycle cycle) const noexcept {
        // a lost card costs as little time as possible
        if (monitor_.state() == CardState::lost) return 0;
        const std::int64_t value = packet_read_timeout_;
        if (value <= 0) return cycle.period_ns() * 80 / 100;
        return value < 100 ? cycle.period_ns() * value / 100 : value;
    }
    /// Returns whether the newest answer shows that the watchdog has bitten.
    bool shows_bite() const noexcept {
        return (link_->reply().at(watchdog_status_) & watchdog::has_bitten) != 0;
    }
    CardReport report(bool is_fresh) noexcept {
        CardReport report;
        report.is_fresh = is_fresh;
        if (!is_fresh) return report;
        const Reply reply = link_->reply();
        report.writes_arrived =
            link_->writes_arrived() && reply.at(watchdog_timeout_) == sent_timeout_;
        report.is_reset =
            (reply.at(watchdog_timeout_) & watchdog::off) != 0 || link_->has_forgotten_count();
        report.has_bitten = shows_bite();
        const bool is_untouched = !report.is_reset && !report.has_bitten;
        report.has_foreign_writes =
            link_->has_foreign_writes() ||
            (is_untouched && ports_->were_changed(reply, link_->writes_arrived()));
        return report;
    }
    /// Pins become outputs only behind an answer that is younger than the timeout of the watchdog
    /// and shows no bite: a datagram that follows lost ones could end a bite that nobody has seen.
    Writing writing_of(hal::Cycle cycle) const noexcept {
        Writing writing;
        writing.period_s = cycle.seconds();
        writing.outputs_on = monitor_.drives_outputs();
        writing.may_set_outputs = writing.outputs_on && is_fresh_ && !shows_bite() &&
                                  link_->age_ns(cycle.start_ns()) < std::int64_t{timeout_ns_};
        writing.may_move = writing.outputs_on && ports_->modules_are_released();
        return writing;
    }
    /// Reports once that the outputs are off before the card counts as lost, or long behind it.
    void check_hold(std::int64_t period_ns) noexcept {
        const std::int64_t hold_ns = period_ns * std::int64_t{hold_cycles_};
        const std::int64_t timeout_ns = timeout_ns_;
        const bool is_too_slow = period_ns > timeout_ns;
        if (is_too_slow && !is_too_slow_) {
            tell({Event::period_too_long, 0, period_ns / 1000});
        }
        is_too_slow_ = is_too_slow;
        const bool is_too_long = hold_ns > timeout_ns && !is_too_slow;
        if (is_too_long && !holds_too_long_) {
            tell({Event::hold_too_long, 0, hold_ns / 1'000'000});
        }
        holds_too_long_ = is_too_long;
        const bool runs_on = timeout_ns - hold_ns > max_run_on_ns;
        if (runs_on && !runs_on_too_long_) {
            tell({Event::timeout_too_long, 0, timeout_ns / 1'000'000});
        }
        runs_on_too_long_ = runs_on;
    }
    void handle(CardEvent event, std::int64_t now) noexcept {
        switch (event) {
        case CardEvent::none: break;
        case CardEvent::online:
            tell({Event::online});
            end(bite_fault_);
            has_bit_ = false;
            break;
        case CardEvent::lost:
            tell({Event::lost, 0, monitor_.missing()});
            losses_ = losses_ + 1;
            was_lost_ = true;
            hold_positions();
            send_stop(now);
            note_stop();
            lose_sight();
            break;
        case CardEvent::returned:
            come_back({monitor_.awaits_acknowledgment() ? Event::returned_bitten : Event::returned},
                      monitor_.was_off(), false);
            break;
        case CardEvent::was_reset:
            resets_ = resets_ + 1;
            if (!was_lost_) {
                hold_positions();
            }
            come_back(
                {monitor_.awaits_acknowledgment() ? Event::was_reset_bitten : Event::was_reset},
                true, true);
            break;
        case CardEvent::bitten:
            tell({Event::bitten});
            has_told_bite_ = true;
            has_bit_ = true;
            lose_positions();
            break;
        case CardEvent::contended:
            tell({Event::contended});
            give_up_positions();
            ports_->has_stopped();
            break;
        }
    }
    void hold_positions() noexcept {
        if (stepgens_ != nullptr) {
            stepgens_->hold();
        }
    }
    /// For the time in which the watchdog of the card has not bitten, if nothing else has arrived.
    void lose_sight() noexcept {
        if (stepgens_ == nullptr) return;
        const double shown_ns =
            watchdog_ns(link_->reply().at(watchdog_timeout_) & ~watchdog::off, watchdog_clock_hz_);
        const auto wanted_ns = static_cast<double>(timeout_ns_.get());
        stepgens_->lose_sight(std::max(shown_ns, wanted_ns) * 1e-9);
    }
    void lose_positions() noexcept {
        if (stepgens_ == nullptr) return;
        stepgens_->was_off([this](std::size_t unit) {
            tell({Event::position_lost, static_cast<std::uint32_t>(unit)});
        });
    }
    void give_up_positions() noexcept {
        if (stepgens_ == nullptr) return;
        stepgens_->were_taken([this](std::size_t unit) {
            tell({Event::position_lost, static_cast<std::uint32_t>(unit)});
        });
    }
    void come_back(const EventRecord& record, bool was_off, bool has_lost_power) noexcept {
        tell(record);
        rewrites_ = true;
        was_lost_ = false;
        is_after_gap_ = true;
        has_lost_power_ = has_lost_power;
        is_after_reset_ = was_off;
        if (was_off) {
            lose_positions();
        }
    }
    void receive(hal::Cycle cycle, std::int64_t now) noexcept {
        Reading reading;
        reading.period_s = cycle.seconds();
        reading.age_s = static_cast<double>(link_->age_ns(now)) * 1e-9;
        reading.is_after_gap = std::exchange(is_after_gap_, false);
        reading.gap_s = cycle.seconds() * std::exchange(missing_cycles_, 0U);
        reading.pause_s = static_cast<double>(std::exchange(pause_ns_, 0)) * 1e-9;
        reading.has_bitten = shows_bite();
        reading.has_lost_power = std::exchange(has_lost_power_, false);
        // no step generator has a rate before the timeout is confirmed
        const bool may_have_reset = std::exchange(may_have_reset_, false);
        reading.has_lost_power = reading.has_lost_power || may_have_reset;
        reading.is_after_reset = std::exchange(is_after_reset_, false) || may_have_reset;
        reading.writes_arrived = link_->writes_arrived();
        const Reply reply = link_->reply();
        ports_->receive(reply, reading);
        for (const auto& module : modules_) {
            module->receive(reply, reading);
        }
        tell_losses();
        if (link_->counts().lost_writes != lost_writes_.get() || link_->has_other_requests()) {
            rewrites_ = true;
        }
    }
    void tell_losses() noexcept {
        if (encoders_ != nullptr) {
            encoders_->take_losses([this](std::size_t unit) {
                tell({Event::encoder_gap, static_cast<std::uint32_t>(unit)});
            });
        }
        if (stepgens_ != nullptr) {
            stepgens_->take_run_on([this](std::size_t unit) {
                tell({Event::position_lost, static_cast<std::uint32_t>(unit)});
            });
        }
    }
    void tell_waiting() noexcept {
        if (stepgens_ == nullptr) return;
        stepgens_->take_waiting([this](std::size_t unit) {
            tell({Event::setting_waits, static_cast<std::uint32_t>(unit)});
        });
    }
    /// Outputs stay off after a bite, also while the card is lost, until has_bit is FALSE.
    void follow_bite() noexcept {
        if (!monitor_.awaits_acknowledgment()) return;
        if (!std::exchange(has_told_bite_, true)) {
            tell({Event::still_bitten});  // a reload
            has_bit_ = true;
        } else if (!has_bit_) {
            monitor_.acknowledge();
            rewrites_ = true;
        }
    }
    void tell_release() noexcept {
        if (stepgens_ != nullptr && position_fault_.lasts() && stepgens_->are_released()) {
            tell({Event::positions_valid});
        }
    }
    void follow_remotes() noexcept {
        if (serial_ == nullptr) return;
        for (const auto& port : serial_->ports()) {
            if (monitor_.state() == CardState::lost) {
                port->show_offline();
            }
            for (const auto& remote : port->remotes()) {
                const bool is_lost =
                    port->is_running() && !remote->is_online() && monitor_.drives_outputs();
                const bool lasts = remote_faults_[remote->number()].lasts();
                if (is_lost && !lasts) {
                    tell({Event::remote_lost, remote->number()});
                } else if (lasts && remote->is_online()) {
                    tell({Event::remote_online, remote->number()});
                }
            }
        }
    }
    void show_offline(double period_s) noexcept {
        if (stepgens_ != nullptr) {
            stepgens_->miss(period_s);
            positions_valid_ = stepgens_->positions_are_valid();
        }
        online_ = false;
        packet_error_ = false;
        if (serial_ != nullptr) {
            for (const auto& port : serial_->ports()) {
                port->show_offline();
            }
        }
    }
    void show(bool is_fresh) noexcept {
        const LinkCounts& counts = link_->counts();
        const bool is_error = !is_fresh || counts.lost_writes != lost_writes_.get();
        const std::int32_t limit = std::max(packet_error_limit_.get(), 0);
        const std::int32_t change = is_error ? std::max(packet_error_increment_.get(), 1)
                                             : -std::max(packet_error_decrement_.get(), 0);
        packet_error_ = is_error;
        const std::int64_t level = std::int64_t{packet_error_level_} + change;
        packet_error_level_ = static_cast<std::int32_t>(std::clamp<std::int64_t>(level, 0, limit));
        packet_error_exceeded_ = packet_error_level_ == limit;
        if (is_error) {
            packet_error_total_ = packet_error_total_ + 1;
        }
        online_ = monitor_.state() == CardState::online;
        fault_ = link_fault_.lasts() || bite_fault_.lasts() || position_fault_.lasts() ||
                 has_remote_fault();
        requests_ = counts.requests;
        lost_requests_ = counts.lost;
        lost_writes_ = counts.lost_writes;
        unexpected_ = counts.unexpected;
        positions_valid_ = stepgens_ == nullptr || stepgens_->positions_are_valid();
    }
    bool has_remote_fault() const noexcept {
        return std::ranges::any_of(remote_faults_,
                                   [](const hal::LastingFault& f) { return f.lasts(); });
    }

    // --- Writing

    /// A card that was reset is recognised by its timeout, which is then off. So that is written only
    /// behind an answer that shows another value, and never on suspicion.
    void write_watchdog(Outgoing& out) noexcept {
        sent_timeout_ = watchdog_timeout(timeout_ns_, watchdog_clock_hz_);
        if (monitor_.state() == CardState::configuring && is_fresh_ && shows_bite()) {
            out.put(watchdog_.at(watchdog::status), 0);  // a bite that nobody has seen stays there
        }
        const bool writes_timeout =
            is_fresh_ && link_->reply().at(watchdog_timeout_) != sent_timeout_;
        hides_reset_ = false;
        if (writes_timeout) {
            out.put(watchdog_.at(watchdog::timeout), sent_timeout_);
            hides_reset_ = !link_->keep_count();
            rewrites_ = true;  // without a count, a loss of these writes is not seen
        }
        out.put(watchdog_.at(watchdog::reset), watchdog::reload);
    }
    /// Everything off: what the card has to do when nobody is there. Built in advance, because it is
    /// sent in a crash handler as well. It does not make the watchdog bite: that register shows a
    /// reset, also one whose answer was lost before.
    void build_stop() {
        stop_.clear();
        Outgoing out(stop_, true);
        for (const auto& module : modules_) {
            module->stop(out);
        }
        ports_->stop(out);
    }
    /// [any]
    void send_stop(std::int64_t now) noexcept { port_->send(stop_.bytes(), now); }
    /// The last that is sent: nobody is there to repeat it when it is lost. [any]
    void send_last_stop() noexcept {
        for (unsigned n = 0; n < stop_copies; ++n) {
            send_stop(datagram::unclocked);
        }
    }
    /// The card has stopped: in the thread of read.
    void note_stop() noexcept {
        for (const auto& module : modules_) {
            module->has_stopped();
        }
        ports_->has_stopped();
        rewrites_ = true;
    }

    // --- Events

    void tell(const EventRecord& record) noexcept {
        reporter_->tell(record);
        hal::LastingFault& condition = fault_of(record);
        const auto& row = event_rows[static_cast<std::size_t>(record.event)];
        if (row.effect == hal::bus::Effect::ends) {
            end(condition);
        } else if (const auto* text = texts_->fault(record)) {
            begin(condition, text->text, text->detail(record.value));
        }
    }
    hal::LastingFault& fault_of(const EventRecord& record) noexcept {
        switch (record.event) {
        case Event::position_lost:
        case Event::positions_valid: return position_fault_;
        case Event::remote_lost:
        case Event::remote_online: return remote_faults_[record.unit];
        case Event::bitten:
        case Event::still_bitten: return bite_fault_;
        default: return link_fault_;
        }
    }

    hal::Function read_{*this,
                        "read",
                        &MesaComponent::read,
                        "shows what the card has; first in the thread",
                        {.required = true}};
    hal::Function read_request_{*this, "read-request", &MesaComponent::read_request,
                                "sends the request of read earlier than read; without it, write "
                                "sends it"};
    hal::Function write_{*this,
                         "write",
                         &MesaComponent::write,
                         "sends commands to the card; last in the thread",
                         {.required = true}};
    hal::Emergency emergency_{*this, &MesaComponent::make_safe, "stops all outputs of the card"};

    hal::Out<bool> online_{
        *this, read_, "online", "the card answers and is configured", {.safe = false}};
    hal::Out<bool> fault_{*this, read_, "fault",
                          "the card or a remote device is lost, the watchdog has bitten, another "
                          "master writes, or a step generator that has lost its position stands"};
    hal::Out<bool> positions_valid_{*this,
                                    read_,
                                    "positions-valid",
                                    "no step generator has lost its position",
                                    {.initial = true, .safe = false}};
    hal::Out<std::uint64_t> requests_{*this, read_, "requests", "requests to the card"};
    hal::Out<std::uint64_t> lost_requests_{*this, read_, "lost-requests",
                                           "requests without an answer in time"};
    hal::Out<std::uint64_t> lost_writes_{*this, read_, "lost-writes",
                                         "answers that show that writes before them are lost"};
    hal::Out<std::uint64_t> unexpected_{*this, read_, "unexpected",
                                        "late and duplicate answers, which were not used"};
    hal::Out<std::uint32_t> losses_{*this, read_, "losses", "how often the card was lost"};
    hal::Out<std::uint32_t> resets_{*this, read_, "resets", "how often it was reset"};
    hal::Param<std::uint32_t> hold_cycles_{
        *this,
        "hold-cycles",
        "cycles without an answer in which step generators go on at their last rates; with one "
        "more the card is lost",
        {.initial = 4}};

    // hm2_eth
    hal::Param<bool> io_error_{*this, "io_error", "not used: the driver recovers without a reset"};
    hal::Out<bool> packet_error_{*this, read_, "packet-error", "this cycle has lost a datagram"};
    hal::Out<std::int32_t> packet_error_level_{*this, read_, "packet-error-level", "recent errors"};
    hal::Out<bool> packet_error_exceeded_{*this, read_, "packet-error-exceeded",
                                          "packet-error-level is at its limit"};
    hal::Io<std::uint32_t> packet_error_total_{*this, "packet-error-total",
                                               "cycles that have lost a datagram"};
    hal::Param<std::int32_t> packet_read_timeout_{
        *this,
        "packet-read-timeout",
        "longest wait for an answer: 1..99: percent of the period, from 100: ns; 0: 80 percent. At "
        "least 100 us",
        {.initial = 80}};
    hal::Param<std::int32_t> packet_error_limit_{
        *this, "packet-error-limit", "limit of packet-error-level", {.initial = 10}};
    hal::Param<std::int32_t> packet_error_increment_{
        *this, "packet-error-increment", "added by an error", {.initial = 2}};
    hal::Param<std::int32_t> packet_error_decrement_{
        *this, "packet-error-decrement", "subtracted in other cycles", {.initial = 1}};
    hal::Io<bool> has_bit_{*this, "watchdog.has_bit",
                           "TRUE: the watchdog has bitten; set it to FALSE to go on"};
    hal::Param<std::uint32_t> timeout_ns_{*this,
                                          "watchdog.timeout_ns",
                                          "time without a write until the watchdog bites",
                                          {.initial = 5'000'000, .unit = "ns"}};

    std::vector<Placed<ModulePins>> modules_;
    Placed<PortPins> ports_;
    StepgenPins* stepgens_ = nullptr;  // these four are in `modules_`
    EncoderPins* encoders_ = nullptr;
    DpllPins* dpll_ = nullptr;
    SerialPins* serial_ = nullptr;
    ReadLayout layout_;
    ModuleAddresses watchdog_;
    std::uint32_t watchdog_clock_hz_ = 0;
    std::size_t watchdog_status_ = 0;
    std::size_t watchdog_timeout_ = 0;
    std::uint32_t sent_timeout_ = 0;
    Request stop_;

    std::optional<CycleLink> link_;
    CardMonitor monitor_;
    hal::Retained retained_{*this, {{"card", monitor_}}};
    std::unique_ptr<EventTexts> texts_;
    std::size_t unused_modules_ = 0;
    std::unique_ptr<hal::Reporter<EventRecord>> reporter_;
    hal::LastingFault link_fault_, bite_fault_, position_fault_;
    std::vector<hal::LastingFault> remote_faults_;
    unsigned missing_cycles_ = 0;  // before the next answer
    std::int64_t last_read_ns_ = 0;
    std::int64_t pause_ns_ = 0;  // of read, before the next answer
    bool rewrites_ = true;  // all settings are written
    std::atomic<const void*> reader_{nullptr};  // the thread of read; written by it
    bool requested_by_function_ = false;
    bool is_fresh_ = false;  // the answer of this cycle
    bool hides_reset_ = false;  // the newest datagram has the timeout that shows a reset
    bool may_have_reset_ = false;  // such a datagram had no answer
    bool was_lost_ = false;
    bool has_told_bite_ = false;  // that awaits its acknowledgment
    bool is_too_slow_ = false;
    bool holds_too_long_ = false;
    bool runs_on_too_long_ = false;
    unsigned unwritten_cycles_ = 0;  // of read without write
    unsigned unread_cycles_ = 0;  // of write without read
    bool is_after_gap_ = false;  // these three are for the next answer
    bool has_lost_power_ = false;
    bool is_after_reset_ = false;
};

}  // namespace hal::mesa
