// SPDX-License-Identifier: MIT
// `hal can sniff`: a line per identifier with its newest data, changed bytes marked.
#include "bus/can/sniff.hpp"

#include <algorithm>
#include <array>
#include <fmt/core.h>
#include <map>
#include <unistd.h>

#include "bus/can/bus.hpp"
#include "bus/can/frame_decoder.hpp"
#include "cli/output.hpp"

namespace hal::tools {

namespace {

// how long a change stays marked in a live list
constexpr std::int64_t redraw_ns = 200'000'000;
constexpr std::int64_t marked_ns = 1'000'000'000;

struct Row {
    can::Frame frame;
    std::uint64_t count = 0;
    std::int64_t period = 0;                    ///< between the newest two frames
    /// when each byte changed; 0: unchanged since the first frame
    std::array<std::int64_t, 64> changed{};
};

using Rows = std::map<std::uint64_t, Row>;  // by kind and identifier

void take(Rows& rows, const can::Frame& f) {
    if (f.error) return;
    Row& row = rows[std::uint64_t{f.extended} << 33 | std::uint64_t{f.remote} << 32 | f.id];
    if (row.count > 0) {
        row.period = f.time_ns - row.frame.time_ns;
        for (unsigned i = 0; i < f.bytes().size() && i < row.changed.size(); ++i) {
            if (i >= row.frame.bytes().size() || f.data[i] != row.frame.data[i]) {
                row.changed[i] = std::max<std::int64_t>(f.time_ns, 1);
            }
        }
    }
    row.frame = f;
    ++row.count;
}

/// Marks changed bytes in bold red, or with a star without colours. `now` 0: marks every change
/// since the start.
std::string table(const Rows& rows, std::int64_t now, bool coloured) {
    std::string text = fmt::format("{:>8}  {:>8}  {:>10}  {}\n", "id", "frames", "period",
                                   "data, changed bytes marked");
    for (const auto& [key, row] : rows) {
        std::string data =
            row.frame.remote ? fmt::format("remote request, {} bytes", row.frame.length) : "";
        for (unsigned i = 0; i < row.frame.bytes().size(); ++i) {
            const bool changed =
                row.changed[i] != 0 && (now == 0 || now - row.changed[i] < marked_ns);
            const std::string byte = fmt::format("{:02X}", row.frame.data[i]);
            data += coloured && changed ? fmt::format("\x1b[1;31m{}\x1b[0m ", byte)
                                        : byte + (coloured || !changed ? " " : "*");
        }
        while (data.ends_with(' ')) {
            data.pop_back();
        }
        const std::string period =
            row.count > 1 ? fmt::format("{:.1f} ms", static_cast<double>(row.period) / 1e6) : "-";
        text +=
            fmt::format("{:>8}  {:>8}  {:>10}  {}\n", id_text(row.frame), row.count, period, data);
    }
    return text;
}

}  // namespace

int run_can_sniff(const SniffOptions& options) {
    Bus bus;
    if (!bus.open(options, options.words[0], true, options.filters)) return 1;
    const bool live = ::isatty(STDOUT_FILENO) == 1 && !bus.is_capture() && !options.once;
    if (!live) {
        bus.announce(options);
    }
    Rows rows;
    std::int64_t drawn = 0;
    std::uint64_t frames = 0;
    bool written = true;
    listen(bus, options.for_ns >= 0 || live ? options.for_ns : 2'000'000'000,
           [&](std::span<const can::Frame> batch) {
        for (const can::Frame& f : batch) {
            take(rows, f);
            if (++frames == options.count) return false;
        }
        return written;
    }, redraw_ns, [&] {
        if (!live || monotonic_ns() - drawn < redraw_ns) return;
        drawn = monotonic_ns();
        written = print("\x1b[H\x1b[J" + table(rows, drawn, colours(STDOUT_FILENO)));
        if (!written) {
            bus.stop.request();
        }
    });
    if (live) return exit_code(written);
    if (rows.empty()) return fail(options, "no frames received");
    return exit_code(print(table(rows, 0, colours(STDOUT_FILENO))));
}

}  // namespace hal::tools
