// SPDX-License-Identifier: MIT
// Shares one camera between all components of the process that name it: the kernel delivers its
// frames to one reader only.
#include <map>
#include <mutex>

#include "vision/capture/v4l2.hpp"

namespace hal::vision {
namespace {

/// An open camera. The first component that finds no newer frame reads one for all; meanwhile the
/// others wait for the same frame.
struct Hub {
    std::string address;
    std::unique_ptr<Source> camera;
    ~Hub() { camera->close(); }

    std::mutex mutex;  // of what follows
    Frame frame;
    std::uint64_t count = 0;  // frames so far
    bool lost = false;
};

using Name = std::pair<VideoSystem*, std::string>;
struct Hubs {
    std::mutex mutex;
    std::map<Name, std::weak_ptr<Hub>> open;
};
Hubs& hubs() {
    static Hubs all;
    return all;
}

class Shared final : public Source {
public:
    Shared(Address address, VideoSystem& system)
        : address_(address), system_(system), model_(v4l2_source(std::move(address), system)) {}

    bool open(std::int64_t now) override {
        Hubs& all = hubs();
        const std::lock_guard lock(all.mutex);
        std::weak_ptr<Hub>& known = all.open[{&system_, address_.place()}];
        hub_ = known.lock();
        if (hub_ && !lost()) {
            if (hub_->address != address_.text()) {
                const std::string other = hub_->address;
                hub_.reset();
                return fail(FrameError::unusable,
                            "another component has opened " + other +
                                "; a camera has one set of options: use the same source= for both");
            }
        } else {
            auto made = std::make_shared<Hub>();
            made->address = address_.text();
            made->camera = v4l2_source(address_, system_);
            if (!made->camera->open(now)) {
                hub_.reset();
                return fail(made->camera->problem().kind, made->camera->problem().text);
            }
            known = hub_ = std::move(made);
        }
        const std::lock_guard of_frame(hub_->mutex);
        seen_ = hub_->count;
        any_ = false;
        skipped_ = 0;
        return true;
    }
    Got next(std::int64_t now, std::int64_t timeout, Frame& frame) override {
        const std::lock_guard lock(hub_->mutex);
        if (!hub_->lost && hub_->count == seen_) {
            const Got got = hub_->camera->next(now, timeout, hub_->frame);
            if (got == Got::nothing) return got;
            if (got == Got::frame) {
                ++hub_->count;
            } else {
                fail(hub_->camera->problem().kind, hub_->camera->problem().text);
            }
            if (got == Got::bad || got == Got::ended) return got;
            hub_->lost = got == Got::lost;
        }
        if (hub_->lost) {
            fail(hub_->camera->problem().kind, hub_->camera->problem().text);
            return Got::lost;
        }
        seen_ = hub_->count;
        frame = hub_->frame;
        if (any_) {
            skipped_ += frame.number - last_ - 1;
        }
        last_ = frame.number;
        any_ = true;
        return Got::frame;
    }
    void close() noexcept override { hub_.reset(); }
    std::string remark() const override { return hub_ ? hub_->camera->remark() : std::string(); }
    double timeout_s() const override {
        return hub_ ? hub_->camera->timeout_s() : model_->timeout_s();
    }
    std::uint32_t frozen_after() const override { return model_->frozen_after(); }

private:
    bool lost() {
        const std::lock_guard lock(hub_->mutex);
        return hub_->lost;
    }
    const Address address_;
    VideoSystem& system_;
    // never opened: rejects invalid options when the netlist is checked, and has the constants of
    // the camera
    const std::unique_ptr<Source> model_;
    std::shared_ptr<Hub> hub_;
    std::uint64_t seen_ = 0;
    std::uint64_t last_ = 0;
    bool any_ = false;
};

}  // namespace

std::unique_ptr<Source> shared_camera(Address address, VideoSystem& system) {
    return std::make_unique<Shared>(std::move(address), system);
}
std::unique_ptr<Source> v4l2_source(Address address) {
    return shared_camera(std::move(address), kernel());
}

}  // namespace hal::vision
