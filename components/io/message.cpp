// SPDX-License-Identifier: MIT
#include <atomic>
#include <chrono>
#include <optional>
#include <string>
#include <thread>

#include "hal/component.hpp"
#include "hal/message_log.hpp"
#include "hal/retained.hpp"

namespace {

struct Message : hal::Component {
    using Component::Component;
    hal::TextArgument text{*this,
                           "messages",
                           "message",
                           "quoted texts separated by commas, one per instance",
                           {.per_instance = true}};
    hal::In<bool> trigger{*this, "trigger", "an edge prints the message"};
    hal::In<bool> force{
        *this, "force",
        "a rising edge prints the message again while trigger is in the triggered state"};
    hal::Param<bool> edge{
        *this, "edge", "edge of trigger: TRUE is rising, FALSE is falling", {.initial = true}};
    hal::Function run{*this, "", &Message::update, "detects edges of trigger and force"};

    void start() {
        ended_.store(false);
        printer_.emplace([this] { print(); });
    }
    void stop() noexcept {
        ended_.store(true);
        if (printer_ && printer_->joinable()) {
            printer_->join();
        }
        printer_.reset();
        log_.close();
    }

    void update(hal::Cycle) noexcept {
        const bool is_active = trigger == edge;
        const bool triggered = is_active && trigger != was_trigger_;

        const bool forced = is_active && force && !was_forced_;
        was_trigger_ = trigger;
        was_forced_ = force;
        if (triggered || forced) {
            wanted_.fetch_add(1, std::memory_order_relaxed);
        }
    }

private:
    void print() noexcept {
        for (bool last = false; !last;) {
            // read before the count, so that all messages before the end are printed
            last = ended_.load();
            for (; printed_ != wanted_.load(std::memory_order_relaxed); ++printed_) {
                log_.print("", text.get());
            }
            log_.flush();
            if (!last) {
                std::this_thread::sleep_for(std::chrono::milliseconds(20));
            }
        }
    }
    hal::MessageLog log_{""};
    std::atomic<std::uint32_t> wanted_{0};  // the cycle counts up, the printer follows
    std::uint32_t printed_ = 0;             // the printer only
    std::atomic<bool> ended_{false};
    std::optional<std::thread> printer_;
    bool was_trigger_ = false;
    bool was_forced_ = false;
    hal::Retained retained_{*this, {{"was-trigger", was_trigger_}, {"was-forced", was_forced_}}};
};

}  // namespace

HAL_COMPONENT(Message, "message", "Prints a message when a bit changes", R"(
An edge of `trigger` prints the instance's text to the standard error of the process that runs the
netlist. The cycle only counts; a separate thread prints, a few hundredths of a second later, and at
most one line per second: further messages of an instance in that time are counted, and the next
line ends with their number, as in `(12 times in 1.0 s)`. Before the first cycle `trigger` counts as
FALSE. The default text is `message`.

    loadrt message names=oillow,inverterfail messages="Slideway oil low,Spindle inverter fault"
    addf oillow servo
    addf inverterfail servo
    setp oillow.edge FALSE
    net oil-level => oillow.trigger
    net fault     => inverterfail.trigger
)")
