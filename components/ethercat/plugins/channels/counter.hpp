// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <memory>
#include <optional>

#include "cia301/values.hpp"
#include "ethercat/plugins/channels/channel.hpp"

namespace hal::ethercat {

/// The counter of an encoder terminal, with as many bits as its object `count`:
///
///     count += difference of the counter since the last cycle       pos = count / pos-scale
///
/// `reset` and a latch event make the position of that moment 0. The objects decide which pins
/// there are: `enable-c`, `enable-pos`, `enable-neg` with `valid-c`, `valid-ext` and `latch` are
/// the latches; `set`, `set-done` and `set-value` write the counter; `period` and `frequency` are
/// measured by the terminal. The setting `index` adds an index input that is a pin, and `absolute`
/// the pin abs-mode.
class Counter final : public Channel {
public:
    explicit Counter(const ChannelPlan& plan)
        : count_field_(plan.field("count")),
          latch_field_(plan.field("latch")),
          set_field_(plan.field("set")),
          set_done_field_(plan.field("set-done")),
          set_value_field_(plan.field("set-value")),
          reset_(plan.component, plan.reads, plan.pin("reset").c_str(), "makes the position 0"),
          count_(plan.component, plan.reads, plan.pin("count").c_str(), "counted steps"),
          pos_(plan.component, plan.reads, plan.pin("pos").c_str(), "position"),
          scale_(plan.component, plan.reads, plan.pin("pos-scale").c_str(),
                 "steps of one unit of the position", {.initial = 1.0}) {
        if (count_field_.bits == 64) {
            raw_low_.emplace(plan.component, plan.reads, plan.pin("raw-count-lo").c_str(),
                             "counter of the slave, low 32 bits");
            raw_high_.emplace(plan.component, plan.reads, plan.pin("raw-count-hi").c_str(),
                              "counter of the slave, high 32 bits");
        } else {
            raw_low_.emplace(plan.component, plan.reads, plan.pin("raw-count").c_str(),
                             "counter of the slave");
        }
        declare_latches(plan);
        if (set_field_.present()) {
            set_.emplace(plan.component, plan.writes, plan.pin("set-raw-count").c_str(),
                         "writes the counter; FALSE again when it is written");
            set_value_.emplace(plan.component, plan.writes, plan.pin("set-raw-count-val").c_str(),
                               "value to write");
        }
        if (plan.channel.setting("absolute", 0) != 0) {
            absolute_.emplace(plan.component, plan.reads, plan.pin("abs-mode").c_str(),
                              "the position is that of the counter");
        }
        if (plan.channel.setting("index", 0) != 0) {
            index_.emplace(plan.component, plan.reads, plan.pin("index").c_str(), "index input");
            index_enable_.emplace(plan.component, plan.reads, plan.pin("index-enable").c_str(),
                                  "makes the position 0 at the next rising edge of the index");
        }
        declare_measured(plan);
    }

    void read(const SlaveImage& image) noexcept override {
        if (!image.operational) {
            known_ = false;
            return;
        }
        const std::int64_t raw = count_field_.read_signed(image);
        if (!known_ || set_done(image)) {
            last_ = raw;
            known_ = true;
        }
        const bool setting = set_ && set_->get();
        if (!setting) {
            show_raw(raw);
            show_measured(image);
        }
        if (!initialised_ || reset_) {
            begin_at(raw);
            initialised_ = true;
        }
        follow_latches(image);
        follow_index(raw);
        total_ += difference(raw, last_);
        last_ = raw;
        count_ = static_cast<std::int32_t>(total_);
        if (const double scale = usable_scale(scale_); scale != scale_.get()) {
            scale_ = scale;
        }
        const bool absolute = absolute_ && absolute_->get();
        pos_ = static_cast<double>(absolute ? raw : static_cast<std::int64_t>(count_.get())) /
               scale_.get();
    }

    void write(const SlaveImage& image) noexcept override {
        for (const auto& latch : latches_) {
            if (latch) {
                latch->enable_field.write(image, latch->enable ? 1 : 0);
            }
        }
        if (set_) {
            set_field_.write(image, *set_ ? 1 : 0);
            set_value_field_.write(
                image, static_cast<std::uint64_t>(static_cast<std::int64_t>(set_value_->get())));
        }
    }

private:
    /// An event at which the slave stores its counter.
    struct Latch {
        Latch(const ChannelPlan& plan, ImageField field, const char* suffix, const char* doc)
            : enable_field(field),
              enable(plan.component, plan.writes, plan.pin(suffix).c_str(), doc) {}
        ImageField enable_field;
        Io<bool> enable;
    };
    /// A value that the slave measures.
    struct Measured {
        Measured(const ChannelPlan& plan, ImageField from, const std::string& name)
            : field(from),
              raw(plan.component, plan.reads, plan.pin("raw-" + name).c_str(),
                  "value of the slave") {}
        ImageField field;
        Out<std::uint32_t> raw;
        std::optional<Out<double>> scaled;
        std::optional<Io<double>> scale;
        double factor = 1.0;
    };
    enum LatchOf : std::size_t { index_c, rising, falling };

    void declare_latches(const ChannelPlan& plan) {
        const auto add = [&](LatchOf which, const char* role, const char* suffix, const char* doc) {
            if (const ImageField field = plan.field(role); field.present()) {
                latches_[which] = std::make_unique<Latch>(plan, field, suffix, doc);
            }
        };
        const bool old_name = plan.channel.setting("latch-c-name", 0) != 0;
        add(index_c, "enable-c", old_name ? "latch-c-enable" : "index-c-enable",
            "makes the position 0 at the index mark; FALSE again afterwards");
        add(rising, "enable-pos", "index-ext-pos-enable",
            "makes the position 0 at a rising edge of the latch input; FALSE again afterwards");
        add(falling, "enable-neg", "index-ext-neg-enable",
            "makes the position 0 at a falling edge of the latch input; FALSE again afterwards");
        valid_c_field_ = plan.field("valid-c");
        valid_ext_field_ = plan.field("valid-ext");
        if (valid_c_field_.present()) {
            valid_c_.emplace(plan.component, plan.reads, plan.pin("latch-c-valid").c_str(),
                             "the index mark was latched");
        }
        if (valid_ext_field_.present()) {
            valid_ext_.emplace(plan.component, plan.reads, plan.pin("latch-ext-valid").c_str(),
                               "the latch input was latched");
        }
        if (latch_field_.present()) {
            raw_latch_.emplace(plan.component, plan.reads, plan.pin("raw-latch").c_str(),
                               "latched counter");
        }
    }

    void declare_measured(const ChannelPlan& plan) {
        const auto add = [&](std::unique_ptr<Measured>& measured, const char* role,
                             const char* name, const char* scaled, double factor) {
            const ImageField field = plan.field(role);
            if (!field.present()) return;
            measured = std::make_unique<Measured>(plan, field, name);
            measured->factor = factor;
            if (scaled != nullptr) {
                measured->scaled.emplace(plan.component, plan.reads, plan.pin(scaled).c_str(),
                                         "scaled value");
            }
        };
        add(period_, "period", "period", "period", plan.channel.setting("period-scale", 1e-7));
        add(window_, "window", "window", nullptr, 1.0);
        add(frequency_, "frequency", "freq", "frequency", 1.0);
        if (frequency_) {
            frequency_->scale.emplace(plan.component, plan.reads,
                                      plan.pin("frequency-scale").c_str(), "frequency of one step",
                                      PinOptions<double>{.initial = 0.05});
        }
    }

    bool set_done(const SlaveImage& image) noexcept {
        if (!set_ || !set_done_field_.read_bit(image)) return false;
        *set_ = false;
        return true;
    }
    void show_raw(std::int64_t raw) noexcept {
        *raw_low_ = static_cast<std::int32_t>(raw);
        if (raw_high_) {
            *raw_high_ = static_cast<std::int32_t>(raw >> 32);
        }
    }
    void show_measured(const SlaveImage& image) noexcept {
        for (const auto* measured : {&period_, &window_, &frequency_}) {
            if (!*measured) continue;
            Measured& one = **measured;
            one.raw = static_cast<std::uint32_t>(one.field.read(image));
            if (one.scaled) {
                const double factor = one.scale ? one.scale->get() : one.factor;
                *one.scaled = one.raw.get() * factor;
            }
        }
    }
    void begin_at(std::int64_t raw) noexcept {
        last_ = raw;
        total_ = 0;
    }
    void follow_latches(const SlaveImage& image) noexcept {
        const bool external = valid_ext_field_.read_bit(image);
        const bool mark = valid_c_field_.read_bit(image);
        if (valid_ext_) {
            *valid_ext_ = external;
        }
        if (valid_c_) {
            *valid_c_ = mark;
        }
        if (!external && !mark) return;
        const std::int64_t latched = latch_field_.read_signed(image);
        if (raw_latch_) {
            *raw_latch_ = static_cast<std::int32_t>(latched);
        }
        begin_at(latched);
        if (external) {
            disable(rising);
            disable(falling);
        }
        if (mark) {
            disable(index_c);
        }
    }
    void disable(LatchOf which) noexcept {
        if (latches_[which]) {
            latches_[which]->enable = false;
        }
    }
    void follow_index(std::int64_t raw) noexcept {
        if (!index_) return;
        const bool index = index_->get();
        const bool rose = index && !last_index_;
        last_index_ = index;
        if (rose && *index_enable_) {
            begin_at(raw);
            *index_enable_ = false;
        }
    }
    /// Returns a - b in the range of the counter, which wraps.
    std::int64_t difference(std::int64_t a, std::int64_t b) const noexcept {
        const auto distance = static_cast<std::uint64_t>(a) - static_cast<std::uint64_t>(b);
        return cia301::sign_extended(distance, count_field_.bits);
    }

    ImageField count_field_, latch_field_, set_field_, set_done_field_, set_value_field_;
    ImageField valid_c_field_, valid_ext_field_;
    In<bool> reset_;
    std::optional<Out<std::int32_t>> raw_low_, raw_high_, raw_latch_;
    Out<std::int32_t> count_;
    Out<double> pos_;
    Io<double> scale_;
    std::array<std::unique_ptr<Latch>, 3> latches_;
    std::optional<Out<bool>> valid_c_, valid_ext_;
    std::optional<Io<bool>> set_;
    std::optional<In<std::int32_t>> set_value_;
    std::optional<In<bool>> absolute_, index_;
    std::optional<Io<bool>> index_enable_;
    std::unique_ptr<Measured> period_, window_, frequency_;
    std::int64_t last_ = 0;
    std::int64_t total_ = 0;
    bool known_ = false;
    bool initialised_ = false;
    bool last_index_ = false;
};

}  // namespace hal::ethercat
