// SPDX-License-Identifier: MIT
#include <deque>

#include "hal/component.hpp"
#include "hal/interruption.hpp"
#include "hal/retained.hpp"
#include "hal/texts.hpp"
#include "mobile/texts/step_text.hpp"

namespace {

constexpr const char* example = R"(input start
output run
step wait
  when start -> go
step go
  set run
  after 1s -> wait
)";

class StepProgram : public hal::Component {
public:
    explicit StepProgram(const hal_host* host)
        : Component(host),
          texts_(*this),
          file_(*this, "file", "",
                "file beside the netlist with the program; default: an example of two steps"),
          program_(read()) {
        for (const auto& name : program_.inputs) {
            inputs_.emplace_back(*this, name.c_str(), "input of the program");
        }
        for (const auto& name : program_.outputs) {
            outputs_.emplace_back(*this, name.c_str(), "output of the program",
                                  hal::PinOptions<bool>{.safe = false});
        }
        for (const auto& s : program_.steps) {
            active_.emplace_back(*this, ("in-" + s.name).c_str(),
                                 ("TRUE in step " + s.name).c_str());
        }
    }

    void update(hal::Cycle cycle) noexcept {
        if (interruption_.accept() && started_) {
            waits_for_reset_ = true;
        }
        if (reset || !enable) {
            waits_for_reset_ = false;
        }
        if (reset || !enable || waits_for_reset_) {
            enter(0, cycle);
            started_ = false;
            fired_ = 0;
        } else if (!begun_ || at_ >= program_.steps.size()) {  // a reload read another program
            enter(0, cycle);
        } else {
            advance(cycle);
        }
        begun_ = true;
        step_time = seconds(cycle.start_ns() - entered_ns_);
        time = started_ ? seconds(cycle.start_ns() - left_ns_) : 0.0;
        step = at_;
        for (std::size_t i = 0; i < outputs_.size(); ++i) {
            outputs_[i] =
                enable && !waits_for_reset_ && (program_.steps[at_].outputs >> i & 1) != 0;
        }
        for (std::size_t i = 0; i < active_.size(); ++i) {
            active_[i] = i == at_;
        }
    }

private:
    static double seconds(std::int64_t ns) noexcept { return 1e-9 * static_cast<double>(ns); }

    /// At most one transition per cycle, so that each step sets its outputs for at least one.
    void advance(hal::Cycle cycle) noexcept {
        std::uint64_t bits = 0;
        for (std::size_t i = 0; i < inputs_.size(); ++i) {
            bits |= std::uint64_t{inputs_[i].get()} << i;
        }
        if (started_ && fired_ < program_.alarms.size() &&
            cycle.start_ns() - left_ns_ >= program_.alarms[fired_].after_ns) {
            return enter(program_.alarms[fired_++].to, cycle);
        }
        for (const auto& t : program_.steps[at_].transitions) {
            const bool taken = t.after_ns >= 0
                                   ? cycle.start_ns() - entered_ns_ >= t.after_ns
                                   : (bits & t.must) == t.must && (bits & t.must_not) == 0;
            if (taken) return enter(t.to, cycle);
        }
    }
    void enter(std::uint32_t to, hal::Cycle cycle) noexcept {
        if (!started_ && begun_ && to != 0) {
            started_ = true;
            left_ns_ = cycle.start_ns();
        }
        at_ = to;
        entered_ns_ = cycle.start_ns();
    }
    hal::mobile::StepText read() const {
        const std::string text = file_.get().empty() ? example : texts_.read("file", file_.get());
        hal::mobile::StepText program;
        program.read(text);
        texts_.reject(file_.get(), text, "mobile-text", program.problems);
        return program;
    }

    hal::Texts texts_;
    hal::TextArgument file_;
    hal::mobile::StepText program_;
    std::deque<hal::In<bool>> inputs_;
    std::deque<hal::Out<bool>> outputs_, active_;
    std::int64_t entered_ns_ = 0;
    std::int64_t left_ns_ = 0;
    std::size_t fired_ = 0;
    std::uint32_t at_ = 0;
    bool begun_ = false;
    bool started_ = false;
    bool waits_for_reset_ = false;

public:
    hal::In<bool> enable{*this,
                         "enable",
                         "FALSE: the program is in its first step and all outputs are FALSE",
                         {.initial = true}};
    hal::In<bool> reset{*this, "reset", "TRUE returns to the first step"};
    hal::Out<std::uint32_t> step{*this, "step",
                                 "number of the step, from 0, in the order of the file"};
    hal::Out<double> time{
        *this, "time", "time since the program left its first step", {.unit = "s"}};
    hal::Out<double> step_time{*this, "step-time", "time since the step began", {.unit = "s"}};
    hal::Function run{*this, "update", &StepProgram::update,
                      "takes at most one transition and sets the outputs"};
    hal::Interruption interruption_{*this};
    hal::Retained retained_{*this,
                            {{"entered-ns", entered_ns_},
                             {"left-ns", left_ns_},
                             {"fired", fired_},
                             {"at", at_},
                             {"begun", begun_},
                             {"started", started_},
                             {"waits-for-reset", waits_for_reset_},
                             {"interruption", interruption_}}};
};

}  // namespace

HAL_COMPONENT(StepProgram, "step_program", "Runs a program of steps with conditions and times", R"(
A sequence in a text file, in the manner of a sequential function chart (IEC 61131-3).

`match.program`:

    input  cord reached full          # bit pins that conditions read
    output drive collect              # bit pins that steps set
    step wait                         # the program begins in its first step
      when cord -> drive
    step drive
      set drive                       # TRUE in this step only
      when full and not reached -> wait
      when reached -> collect         # the first condition that is TRUE is taken
    step collect
      set collect
      after 2s -> drive               # time since the step began
    at 88s -> wait                    # time since the program left its first step; once, before any condition

At most one transition is taken per cycle. A pin `in-STEP` for each step is TRUE in that step. At
most 64 inputs, 64 outputs, 128 steps and 32 transitions per step. Names have a to z, 0 to 9 and
`-`.

After a stop of the thread a program that has left its first step is there again, with all outputs
FALSE, until `reset` is TRUE or `enable` is FALSE for a cycle.

    loadrt step_program file=match.program names=match
    addf match.update servo
    net cord => match.cord
    net drive <= match.drive
)")
