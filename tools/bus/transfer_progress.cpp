// SPDX-License-Identifier: MIT
#include "bus/transfer_progress.hpp"

#include <cmath>
#include <fmt/core.h>
#include <unistd.h>

#include "cli/output.hpp"
#include "hal/clock.hpp"

namespace hal::tools {

namespace {

constexpr std::int64_t first_after_ns = 500'000'000;
constexpr std::int64_t between_ns = 200'000'000;
constexpr const char* clear_line = "\r\x1b[K";

std::string amount(double bytes, double max) {
    return max < 1e6 ? fmt::format("{:.1f}", bytes / 1e3) : fmt::format("{:.1f}", bytes / 1e6);
}

}  // namespace

std::string progress_text(std::size_t done, std::size_t total, std::int64_t elapsed_ns) {
    if (total < done) {
        total = 0;
    }
    const double so_far = static_cast<double>(done);
    const double all = static_cast<double>(total);

    const double elapsed_s = static_cast<double>(elapsed_ns) * 1e-9;
    const double max = total != 0 ? all : so_far;
    const char* const unit = max < 1e6 ? "kB" : "MB";
    if (total == 0) {
        return fmt::format("{} {}", amount(so_far, max), unit);
    }
    std::string text = fmt::format("{} of {} {}, {:.0f} %", amount(so_far, max), amount(all, max),
                                   unit, std::floor(100 * so_far / all));
    if (done == 0 || done > total) return text;
    return text + fmt::format(", {:.0f} s left", std::ceil(elapsed_s * (all - so_far) / so_far));
}

TransferProgress::TransferProgress(std::string what)
    : what_(std::move(what)), terminal_(::isatty(STDERR_FILENO) == 1) {
    if (!terminal_) return;
    began_ns_ = monotonic_ns();
    next_ns_ = began_ns_ + first_after_ns;
}

TransferProgress::~TransferProgress() {
    if (shown_) {
        write_all(STDERR_FILENO, clear_line);
    }
}

void TransferProgress::update(std::size_t done, std::size_t total) {
    if (!terminal_) return;
    const std::int64_t now_ns = monotonic_ns();
    if (now_ns < next_ns_) return;
    next_ns_ = now_ns + between_ns;
    shown_ = true;
    write_all(STDERR_FILENO, fmt::format("{}{}: {}", clear_line, what_,
                                         progress_text(done, total, now_ns - began_ns_)));
}

}  // namespace hal::tools
