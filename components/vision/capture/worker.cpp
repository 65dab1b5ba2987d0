// SPDX-License-Identifier: MIT
#include "vision/capture/worker.hpp"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <thread>

namespace hal::vision {
namespace {
constexpr std::int64_t second = 1'000'000'000;
constexpr std::int64_t max_wait = second / 10;
constexpr std::int64_t again_after = second;           // retry interval of opening a source
// minimum interval of messages about the same problem
constexpr std::int64_t quiet_for = 10 * second;
constexpr std::int64_t long_ago = INT64_MIN / 2;

std::string seconds(std::int64_t ns) {
    char text[40];
    std::snprintf(text, sizeof text, "%.1f s", static_cast<double>(ns) * 1e-9);
    return text;
}

Problem tried_again(Problem problem) {
    problem.text += "; retrying every second";
    return problem;
}

// FNV-1a over words: a camera's noise changes some bit of it in each frame.
std::uint64_t hash(const std::vector<std::uint8_t>& bytes) {
    std::uint64_t h = 0xcbf29ce484222325u;
    std::size_t i = 0;
    for (; i + 8 <= bytes.size(); i += 8) {
        std::uint64_t w;
        std::memcpy(&w, bytes.data() + i, 8);
        h = (h ^ w) * 0x100000001b3u;
        h ^= h >> 29;
    }
    for (; i < bytes.size(); ++i) {
        h = (h ^ bytes[i]) * 0x100000001b3u;
    }
    return h;
}
}  // namespace

Worker::Worker(std::string instance, std::unique_ptr<Source> source,
               std::function<void(const Frame&)> detect, std::function<void(const Status&)> publish)
    : instance_(std::move(instance)),
      log_(std::make_unique<hal::MessageLog>(instance_)),
      source_(std::move(source)),
      detect_(std::move(detect)),
      publish_(std::move(publish)) {
    std::fill(std::begin(said_ns_), std::end(said_ns_), long_ago);
}

void Worker::expect(int width, int height, std::string file) {
    width_ = width;
    height_ = height;
    file_ = std::move(file);
}

void Worker::print_to(const std::function<void(const std::string&)>& print) {
    log_ = std::make_unique<hal::MessageLog>(instance_, [print](std::string line) {
        line.pop_back();
        print(line);
    });
}

void Worker::turn(std::int64_t now, bool may_wait) noexcept {
    now_ = now;
    try {
        log_->flush(now);
        step(now, may_wait);
    } catch (const std::exception& e) {  // a source that runs out of memory is reopened
        close();
        try_again_ns_ = now + again_after;
        try {
            report(
                tried_again({FrameError::timeout, std::string("cannot read frames: ") + e.what()}),
                now);
            publish();
        } catch (const std::exception&) {  // no memory for the message either
        }
    }
}

void Worker::step(std::int64_t now, bool may_wait) {
    if (!open_ && now >= try_again_ns_) {
        open(now);
    }
    if (!open_) {
        if (may_wait) {
            std::this_thread::sleep_for(std::chrono::nanoseconds(max_wait / 2));
        }
        return;
    }
    const Got got = source_->next(now, may_wait ? max_wait : 0, frame_);
    const std::uint32_t dropped = dropped_before_ + static_cast<std::uint32_t>(source_->skipped());
    const bool more = dropped != status_.dropped;
    status_.dropped = dropped;
    switch (got) {
    case Got::frame:
        last_frame_ns_ = now;
        take(frame_, now);
        return;
    case Got::bad:
        last_frame_ns_ = now;
        ++status_.bad;
        report(source_->problem(), now);
        return publish();
    case Got::ended:
        report(source_->problem(), now);
        return publish();
    case Got::lost:
        report(tried_again(source_->problem()), now);
        close();
        try_again_ns_ = now + again_after;
        return publish();
    case Got::nothing:
        if (static_cast<double>(now - last_frame_ns_) * 1e-9 > source_->timeout_s() &&
            status_.error == FrameError::none) {
            report({FrameError::timeout, "no frame for " + seconds(now - last_frame_ns_)}, now);
            return publish();
        }
        if (more) {
            publish();
        }
    }
}

void Worker::open(std::int64_t now) {
    open_ = source_->open(now);
    if (open_) {
        ++status_.openings;
        last_frame_ns_ = now;
        dropped_before_ = status_.dropped;
        equal_ = 0;
        // nothing was wrong so far
        if (status_.error == FrameError::missing && !reported_) {
            status_.error = FrameError::none;
        }
        // once, not at each reconnection
        if (std::string remark = source_->remark(); remark != remark_) {
            remark_ = std::move(remark);
            if (!remark_.empty()) {
                print(remark_);
            }
        }
        return;
    }
    try_again_ns_ = now + again_after;
    report(tried_again(source_->problem()), now);
    publish();
}

void Worker::close() noexcept {
    if (open_) {
        source_->close();
    }
    open_ = false;
    status_.ok = false;
    try_again_ns_ = INT64_MIN;
}

void Worker::take(const Frame& frame, std::int64_t now) {
    const auto size = [](int w, int h) { return std::to_string(w) + " x " + std::to_string(h); };
    Problem problem;
    if (width_ != 0 && (frame.width != width_ || frame.height != height_)) {
        problem = {FrameError::wrong_size,
                   "frames are " + size(frame.width, frame.height) + " and the calibration " +
                       file_ + " is for " + size(width_, height_) +
                       "; take the file of this camera, or set the source's width and height"};
    } else if (frozen(frame)) {
        problem = {FrameError::frozen, std::to_string(frozen_after_) +
                                           " frames in a row are identical; the camera is frozen"};
    } else if (black(frame)) {
        problem = {FrameError::black, "frames are black; check the light and the lens cap"};
    }
    if (problem.kind != FrameError::none) {
        ++status_.bad;
        report(std::move(problem), now);
        return publish();
    }
    try {
        detect_(frame);
        ++status_.frames;
        recovered(now);
    } catch (const std::exception& e) {
        ++status_.bad;
        report({FrameError::damaged, std::string("cannot process a frame: ") + e.what()}, now);
    }
    publish();
}

bool Worker::frozen(const Frame& frame) {
    if (frozen_after_ == 0) return false;
    const std::uint64_t picture = hash(frame.pixels);
    equal_ = picture == picture_ ? equal_ + 1 : 0;
    picture_ = picture;
    return equal_ + 1 >= std::max(frozen_after_, 2u);
}

// Nothing but noise around 0: the mean is below 8 of 255 and of a thousand pixels hardly one is
// above 40.
bool Worker::black(const Frame& frame) const {
    std::size_t sum = 0;
    std::size_t bright = 0;
    std::size_t count = 0;
    for (std::size_t i = 0; i < frame.pixels.size(); i += 7, ++count) {
        sum += frame.pixels[i];
        bright += frame.pixels[i] > 40;
    }
    return sum < 8 * count && bright * 1000 <= count;
}

void Worker::report(Problem problem, std::int64_t now) {
    const bool known = reported_ && problem.kind == status_.error;
    if (status_.error == FrameError::none || !reported_) {
        since_ns_ = now;
    }
    status_.error = problem.kind;
    status_.ok = false;
    reported_ = true;
    std::int64_t& said = said_ns_[static_cast<std::size_t>(problem.kind)];
    if (known || now - said < quiet_for) return;
    said = now;
    print(problem.text);
}

void Worker::recovered(std::int64_t now) {
    const bool again = reported_ && status_.error != FrameError::none;
    // only after a problem that was logged: messages come in pairs
    if (again && said_ns_[static_cast<std::size_t>(status_.error)] >= since_ns_) {
        print((ever_ ? "frames are valid again after " : "first valid frame after ") +
              seconds(now - since_ns_));
    }
    status_.error = FrameError::none;
    status_.ok = ever_ = true;
    reported_ = false;
}

void Worker::publish() { publish_(status_); }

void Worker::print(const std::string& sentence) { log_->print(sentence, now_); }

}  // namespace hal::vision
