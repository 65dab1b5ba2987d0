// SPDX-License-Identifier: MIT
#include "machine/report/descriptor_watch.hpp"

#include <chrono>
#include <optional>
#include <string>
#include <utility>

#include <unistd.h>

#include "base/own_descriptors.hpp"
#include "execute/core.hpp"
#include "execute/crash_table.hpp"
#include "execute/process_setup.hpp"
#include "machine/report/crash.hpp"
#include "machine/report/file_limit.hpp"

namespace hal {
namespace {

void print_line(const std::string& text) {
    [[maybe_unused]] const auto written = ::write(STDERR_FILENO, text.data(), text.size());
}

}  // namespace

DescriptorWatch::DescriptorWatch(std::function<void()> halt, std::function<bool()> halted)
    : halt_(std::move(halt)), halted_(std::move(halted)), thread_([this] { work(); }) {}

DescriptorWatch::~DescriptorWatch() {
    {
        const std::lock_guard lock(mutex_);
        over_ = true;
    }
    wake_.notify_all();
    thread_.join();
}

void DescriptorWatch::work() {
    release_unused_stack();
    FileLimit limit;
    std::unique_lock lock(mutex_);
    while (!wake_.wait_for(lock, std::chrono::nanoseconds(interval_ns), [this] { return over_; })) {
        if (const std::optional<std::string> line = limit.restore(monotonic_ns())) {
            print_line(*line);
        }
        LostDescriptor lost;
        if (find_lost_descriptor(lost)) {
            end(lost);
        }
    }
}

void DescriptorWatch::end(const LostDescriptor& lost) {
    halt_();
    const std::int64_t until_ns = monotonic_ns() + halt_timeout_ns;
    while (!halted_() && monotonic_ns() < until_ns) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    make_all_safe();
    const std::string text =
        "hal: descriptor " + std::to_string(lost.number) + ", " + lost.name +
        " of the runtime, was " + (lost.replaced ? "replaced" : "closed") +
        ": a component, or a library that it uses, closes descriptors that it has not opened; "
        "outputs were set to their safe values; the process ends [cycle-violation]\n";
    print_line(text);
    end_process(1);
}

}  // namespace hal
