// SPDX-License-Identifier: MIT
// frames:FOLDER: the PGM and PPM files of a folder, in the order of their names.
#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <thread>

#include "hal/rejection.hpp"
#include "vision/capture/pnm.hpp"

namespace hal::vision {
namespace {

namespace fs = std::filesystem;
constexpr std::size_t max_files = 100'000;
// of a file: what the largest frame has in 16 bits
constexpr std::size_t max_bytes = std::size_t{3} * 2 * max_pixels + 4096;

class Frames final : public Source {
public:
    Frames(Address address, const std::function<std::string(const std::string&)>& find) {
        period_ns_ = std::llround(1e9 / address.number("fps", 30.0, 0.001, 10'000.0));
        delay_ns_ = std::llround(1e6 * address.number("delay-ms", 0.0, 0.0, 10'000.0));
        loop_ = address.flag("loop");
        address.finish();
        shown_ = address.place();
        folder_ = find ? find(shown_) : shown_;
    }
    bool open(std::int64_t now) override {
        files_.clear();
        std::error_code error;
        for (auto at = fs::directory_iterator(folder_, error);
             !error && at != fs::directory_iterator() && files_.size() < max_files;
             at.increment(error)) {
            const std::string end = at->path().extension().string();
            if (end == ".pgm" || end == ".ppm") {
                files_.push_back(at->path().filename().string());
            }
        }
        if (error) {
            return fail(FrameError::missing,
                        "the folder " + shown_ + " cannot be read: " + error.message());
        }
        if (files_.empty()) {
            return fail(FrameError::missing, "the folder " + shown_ + " has no .pgm or .ppm file");
        }
        std::sort(files_.begin(), files_.end());
        // After an interruption it goes on where it was, as a camera would.
        if (!begun_) {
            begin_ns_ = now;
        } else {
            next_ = std::max(next_, due(now));
        }
        begun_ = true;
        skipped_ = 0;
        return true;
    }
    Got next(std::int64_t now, std::int64_t timeout, Frame& frame) override {
        if (const std::int64_t wait = end_reported_ ? INT64_MAX : at(next_) - now; wait > 0) {
            if (timeout > 0) {
                std::this_thread::sleep_for(std::chrono::nanoseconds(std::min(wait, timeout)));
            }
            if (wait > timeout) return Got::nothing;
            now += wait;
        }
        if (!loop_ && next_ >= files_.size()) {
            end_reported_ = true;
            fail(FrameError::ended, "all frames of " + shown_ +
                                        " were shown; to repeat them, write frames:" + shown_ +
                                        "?loop");
            return Got::ended;
        }
        std::uint64_t newest = std::max(next_, due(now));
        if (!loop_) {
            newest = std::min<std::uint64_t>(newest, files_.size() - 1);
        }
        skipped_ += newest - next_;
        next_ = newest + 1;
        const std::string name = files_[newest % files_.size()];
        if (!read(name)) return Got::bad;
        if (auto problem = read_pnm(bytes_.data(), bytes_.size(), frame)) {
            fail(problem->kind, shown_ + "/" + name + ": " + problem->text);
            return Got::bad;
        }
        frame.number = newest;
        frame.stamp_ns = at(newest) - delay_ns_;
        return Got::frame;
    }
    void close() noexcept override {}
    double timeout_s() const override { return 1.0 + 2e-9 * static_cast<double>(period_ns_); }

private:
    std::int64_t at(std::uint64_t k) const {
        return begin_ns_ + delay_ns_ + static_cast<std::int64_t>(k) * period_ns_;
    }
    /// The newest that there is at `now`.
    std::uint64_t due(std::int64_t now) const {
        const std::int64_t since = now - begin_ns_ - delay_ns_;
        return since < 0 ? 0 : static_cast<std::uint64_t>(since / period_ns_);
    }
    bool read(const std::string& name) {
        const fs::path path = fs::path(folder_) / name;
        const auto bad = [&](const char* why) {
            return fail(FrameError::damaged, shown_ + "/" + name + " cannot be read: " + why);
        };
        const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(
            std::fopen(path.c_str(), "rb"), [](std::FILE* f) { return std::fclose(f); });
        if (!file) return bad(std::strerror(errno));
        std::error_code error;
        const auto size = fs::file_size(path, error);
        if (error) return bad(error.message().c_str());
        if (size > max_bytes) {
            return fail(FrameError::too_large, shown_ + "/" + name + " has " +
                                                   std::to_string(size) +
                                                   " bytes, more than the limit for a frame");
        }
        bytes_.resize(static_cast<std::size_t>(size));
        bytes_.resize(std::fread(bytes_.data(), 1, bytes_.size(), file.get()));
        return true;
    }

    std::string folder_, shown_;
    std::int64_t period_ns_ = 0;
    std::int64_t delay_ns_ = 0;
    std::int64_t begin_ns_ = 0;
    bool loop_ = false;
    bool begun_ = false;
    bool end_reported_ = false;
    std::vector<std::string> files_;
    std::uint64_t next_ = 0;  // counts on over the end of the folder when it loops
    std::vector<std::uint8_t> bytes_;
};

}  // namespace

std::unique_ptr<Source> frames_source(Address address,
                                      const std::function<std::string(const std::string&)>& find) {
    if (address.place().empty()) {
        throw hal::ArgumentError(
            "source", "source=" + address.text() + " has no folder; write frames:FOLDER");
    }
    return std::make_unique<Frames>(std::move(address), find);
}

}  // namespace hal::vision
