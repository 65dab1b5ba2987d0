// SPDX-License-Identifier: MIT
// The base of all components with a camera: source, helper thread, mailbox, and common pins.
//
//     struct Found { bool found = false; double x = 0; };                       // result: trivially copyable, `found` first
//     struct Settings { double limit = 0; bool operator==(const Settings&) const = default; };
//     struct Blob : vision::CameraComponent<Blob, Found, Settings> {
//         using CameraComponent::CameraComponent;
//         hal::Out<double> x{*this, "x", …};
//         void detect(const vision::Frame&, const Settings&, Found&);           // helper thread; may throw: the frame is bad
//         Settings settings() const noexcept { return {limit}; }                // [realtime] each cycle
//         void show(const Found&, bool fresh, hal::Cycle) noexcept { … }        // [realtime] each cycle, after valid was set
//     };
#pragma once

#include <limits>
#include <memory>
#include <string>

#include "hal/background.hpp"
#include "hal/clock.hpp"
#include "hal/component.hpp"
#include "hal/journal.hpp"
#include "hal/lasting_fault.hpp"
#include "hal/naming.hpp"
#include "hal/queue.hpp"
#include "hal/texts.hpp"
#include "vision/capture/worker.hpp"

namespace hal::vision {

template <class Derived, class Result, class Settings>
class CameraComponent : public hal::Component {
public:
    explicit CameraComponent(const hal_host* host)
        : Component(host),
          instance_(name_of(host)),
          texts_(*this),
          source_(*this, "source", "v4l2:/dev/video0",
                  "frame source: v4l2:/dev/video0?width=640&height=480&fps=30, "
                  "frames:FOLDER?fps=30&loop, sim:SCENE",
                  {.per_instance = true}),
          worker_(instance_,
                  make_source(source_.get(),
                              [this](const std::string& address) { return texts_.find(address); }),
                  [this](const Frame& frame) { work(frame); },
                  [this](const Status& status) { deliver(status); }),
          background_([this](std::int64_t now, bool may_wait) { turn(now, may_wait); }),
          update_(*this, "update", &CameraComponent::update,
                  "copies the newest result to the pins"),
          seq(*this, update_, "seq", "number of results, one per processed frame"),
          stamp_ns(*this, update_, "stamp-ns",
                   "exposure time of the result's frame on the runtime's clock", {.unit = "ns"}),
          age_ms(*this, update_, "age-ms",
                 "age of the result; before the first result: time since the first cycle",
                 {.unit = "ms"}),
          valid(*this, update_, "valid",
                "TRUE: the newest frame has a result, is not older than max-age-ms, and the source "
                "is OK",
                {.safe = false}),
          dropped(*this, update_, "dropped",
                  "number of frames skipped for a newer one or lost by the camera"),
          proc_ms(*this, update_, "proc-ms", "processing time of the frame; 0 on the virtual clock",
                  {.unit = "ms"}),
          frames(*this, update_, "frames", "number of valid frames"),
          bad_frames(*this, update_, "bad-frames",
                     "number of invalid frames: damaged, too large, black, frozen, wrong size"),
          source_ok(*this, update_, "source-ok",
                    "TRUE: the source is open and its last frame was valid"),
          error_code(*this, update_, "error-code",
                     "error code: 0 none, 1 missing, 2 unusable, 3 unplugged, 4 no frames, 5 "
                     "damaged, 6 too large, 7 black, 8 frozen, 9 wrong "
                     "size for the calibration, 10 end of the files"),
          max_age_ms(*this, update_, "max-age-ms", "maximum age of a valid result",
                     {.initial = 200.0, .unit = "ms"}),
          frozen_frames(*this, update_, "frozen-frames",
                        "number of identical frames that count as frozen; 0: never; initially 10 "
                        "for a camera or a scene, 0 for files",
                        {.initial = worker_.source_frozen_after()}) {}

    void start() {
        faults_ = hal::extension<hal_faults>("hal.faults/1");
        raised_ = FrameError::none;
        const hal::JournaledSource journaled;
        background_.start();
    }
    void stop() noexcept {
        background_.stop();
        worker_.close();
    }

    /// [realtime]
    void update(hal::Cycle cycle) noexcept {
        Derived& self = static_cast<Derived&>(*this);
        const Ordered order{true, frozen_frames, self.settings()};
        if (!(order == ordered_)) {
            ordered_ = order;
            orders_.put(order);
        }
        const bool fresh = take_delivery();
        const Delivery& d = delivery_;
        if (began_ns_ == no_time) {
            began_ns_ = cycle.start_ns();
        }
        const bool newer = d.seq != seq;
        if (fresh) {
            seq = d.seq;
            stamp_ns = d.stamp_ns;
            proc_ms = static_cast<double>(d.proc_ns) * 1e-6;
            dropped = d.status.dropped;
            frames = d.status.frames;
            bad_frames = d.status.bad;
            source_ok = d.status.ok;
            error_code = static_cast<std::uint32_t>(d.status.error);
            raise(d.status.error);
        }
        const double age =
            static_cast<double>(cycle.start_ns() - (d.seq == 0 ? began_ns_ : d.stamp_ns)) * 1e-6;
        age_ms = age > 0.0 ? age : 0.0;
        valid = d.result.found && d.status.ok && age_ms <= max_age_ms;
        self.show(d.result, newer, cycle);
    }

protected:
    const hal::Texts& texts() const { return texts_; }
    const std::string& instance() const { return instance_; }
    /// Rejects frames of a size other than that of the calibration `file`. In the constructor.
    /// [setup]
    void expect(int width, int height, const std::string& file) {
        worker_.expect(width, height, file);
    }

private:
    static constexpr std::int64_t no_time = INT64_MIN;
    struct Delivery {
        Status status{};
        Result result{};
        std::int64_t stamp_ns = 0;
        std::int64_t proc_ns = 0;
        std::uint32_t seq = 0;
    };
    struct Ordered {
        bool given = false;
        std::uint32_t frozen = 0;
        Settings settings{};
        bool operator==(const Ordered&) const = default;
    };

    static std::string name_of(const hal_host* host) {
        const auto* naming = hal::extension<hal_naming>(HAL_NAMING);
        return naming != nullptr ? naming->name(host) : "vision";
    }
    void turn(std::int64_t now, bool may_wait) {
        measures_ = may_wait;
        const Ordered& order = orders_.get();
        if (order.given) {
            worker_.freeze_after(order.frozen);
        }
        worker_.turn(now, may_wait);
    }
    void work(const Frame& frame) {
        if (!orders_.get().given) {
            return;  // no cycle has run so far
        }
        const std::int64_t begun = measures_ ? monotonic_ns() : 0;
        next_.result = Result{};
        static_cast<Derived*>(this)->detect(frame, orders_.get().settings, next_.result);
        next_.stamp_ns = frame.stamp_ns;
        next_.proc_ns = measures_ ? monotonic_ns() - begun : 0;
        ++next_.seq;
    }
    void deliver(const Status& status) {
        next_.status = status;
        deliveries_.put(next_);
    }
    /// Takes the newest delivery, which is in the journal. Returns false when nothing came since
    /// the last cycle. [realtime]
    bool take_delivery() noexcept {
        bool fresh = false;
        const Delivery& newest = deliveries_.get(&fresh);
        hal::journaled(fresh);
        if (fresh) {
            delivery_ = newest;
            hal::journaled(delivery_);
        }
        return fresh;
    }
    void raise(FrameError now) noexcept {
        static constexpr const char* reasons[frame_error_count] = {
            "",
            "there is no such source; valid is FALSE",
            "the source cannot be used; valid is FALSE",
            "the source disconnected; valid is FALSE",
            "no frames come; valid is FALSE",
            "a frame is damaged; valid is FALSE",
            "a frame is huge; valid is FALSE",
            "frames are black; valid is FALSE",
            "frames are frozen; valid is FALSE",
            "frames are not of the calibration's size; valid is FALSE",
            "all frames were shown; valid is FALSE"};
        if (now == raised_) return;
        raised_ = now;
        if (now == FrameError::none) {
            fault_.end(faults_, this);
        } else {
            fault_.begin(faults_, this, reasons[static_cast<std::size_t>(now)]);
        }
    }

    const std::string instance_;
    const hal::Texts texts_;
    hal::TextArgument source_;
    Worker worker_;  // of the helper thread
    Delivery next_;  // of the helper thread
    bool measures_ = false;  // of the helper thread
    hal::Mailbox<Delivery> deliveries_;  // helper thread to cycle
    hal::Mailbox<Ordered> orders_;  // cycle to helper thread
    Delivery delivery_;  // the newest one that the cycle has taken
    Ordered ordered_;
    std::int64_t began_ns_ = no_time;
    const hal_faults* faults_ = nullptr;
    hal::LastingFault fault_;
    FrameError raised_ = FrameError::none;
    hal::Background background_;
    hal::Function update_;

public:
    hal::Out<std::uint32_t> seq;
    hal::Out<std::int64_t> stamp_ns;
    hal::Out<double> age_ms;
    hal::Out<bool> valid;
    hal::Out<std::uint32_t> dropped;
    hal::Out<double> proc_ms;
    hal::Out<std::uint32_t> frames, bad_frames;
    hal::Out<bool> source_ok;
    hal::Out<std::uint32_t> error_code;
    hal::Param<double> max_age_ms;
    hal::Param<std::uint32_t> frozen_frames;
};

}  // namespace hal::vision
