// SPDX-License-Identifier: MIT
#include "run/picture.hpp"

#include <algorithm>
#include <cmath>
#include <condition_variable>
#include <cstdlib>
#include <fmt/core.h>
#include <mutex>
#include <numbers>
#include <thread>
#include <unistd.h>

#include "base/types.hpp"
#include "cli/drawn_lines.hpp"
#include "cli/output.hpp"
#include "cli/screen.hpp"
#include "execute/process_setup.hpp"
#include "run/canvas.hpp"

namespace hal::tools {

namespace {

constexpr std::size_t side_columns = 24;
constexpr std::size_t side_rows = 11;
constexpr std::size_t min_columns = 60;  // of the terminal at the start
constexpr std::size_t min_rows = 16;

/// Side by side, with a title above each.
std::vector<std::string> beside(const char* left_title, const Canvas& left, const char* right_title,
                                const Canvas& right) {
    std::vector<std::string> lines{
        fmt::format("  {:{}}    {}", left_title, side_columns, right_title)};
    const auto a = left.rows();
    const auto b = right.rows();
    for (std::size_t i = 0; i < a.size(); ++i) {
        lines.push_back("  " + a[i] + "    " + b[i]);
    }
    return lines;
}

std::string degrees(double radians) {
    return fmt::format("{:8.1f}{}",
                       std::remainder(radians, 2.0 * std::numbers::pi) * 180.0 / std::numbers::pi,
                       " deg");
}

/// The time and the thread, and a line about faults.
std::vector<std::string> status_lines(const Scene& scene) {
    std::vector<std::string> lines{
        fmt::format("  t {:6.1f} s   {} wake-up latency p50 {} p99 {}   missed {}", scene.seconds,
                    scene.thread.name, format_duration(scene.thread.wakeup_p50_ns),
                    format_duration(scene.thread.wakeup_p99_ns), scene.missed)};
    if (scene.faults != 0) {
        lines.push_back(fmt::format("  faults {}: show fault", scene.faults));
    }
    return lines;
}

/// Angles in rad: the arm's from straight ahead, seen from above; the pendulum's from hanging, seen
/// from the arm's end.
std::vector<std::string> draw_furuta(const Scene& scene, bool unicode) {
    const double arm = scene.values[0];
    const double pendulum = scene.values[1];
    Canvas above(side_columns, side_rows, unicode), side(side_columns, side_rows, unicode);
    above.circle(0, 0, 0.95);
    above.circle(0, 0, 0.08);
    above.line(0, 0, 0.85 * std::cos(arm), 0.85 * std::sin(arm));
    // the pendulum swings across the arm
    const double reach = 0.3 * std::sin(pendulum);
    const double end = 0.85;
    above.line(end * std::cos(arm), end * std::sin(arm),
               end * std::cos(arm) - reach * std::sin(arm),
               end * std::sin(arm) + reach * std::cos(arm));
    side.circle(0, 0, 0.06);
    side.line(-0.25, 0, 0.25, 0);
    const double x = 0.85 * std::sin(pendulum);
    const double y = -0.85 * std::cos(pendulum);
    side.line(0, 0, x, y);
    side.circle(x, y, 0.1);
    auto lines = beside("arm, from above", above, "pendulum, from the side", side);
    lines.push_back(fmt::format("  arm {}        pendulum {}", degrees(arm), degrees(pendulum)));
    return lines;
}

/// A carriage on a rail that is as long as the farthest position seen so far.
std::vector<std::string> draw_axis(const Scene& scene, bool unicode) {
    static double farthest = 1.0;  // one picture per process, drawn by one thread
    const double position = scene.values[0];
    if (std::isfinite(position)) {
        farthest = std::max(farthest, std::abs(position));
    }
    constexpr std::size_t columns = 60;
    const double fraction = std::isfinite(position) ? (position / farthest + 1.0) / 2.0 : 0.5;
    const auto at =
        static_cast<std::size_t>(std::lround(fraction * static_cast<double>(columns - 5)));
    std::string rail;
    for (std::size_t i = 0; i < columns; ++i) {
        rail += unicode ? "─" : "-";
    }
    const std::string roof = unicode ? "┌───┐" : "+---+";
    const std::string floor = unicode ? "└─┴─┘" : "+-+-+";
    return {"  " + std::string(at, ' ') + roof, "  " + std::string(at, ' ') + floor, "  " + rail,
            fmt::format("  {:<{}.4g}{:>{}.4g}", -farthest, columns / 2, farthest, columns / 2),
            fmt::format("  position {:10.4f}", position)};
}

const Motif motifs[] = {
    {{"arm-angle", "pendulum-angle"}, draw_furuta},
    {{"axis-position"}, draw_axis},
};

}  // namespace

const Motif* motif_for(const Model& model) {
    for (const Motif& motif : motifs) {
        bool all = true;
        for (const std::string& name : motif.signals) {
            const Signal* signal = model.find_signal(name);
            all = all && signal && signal->type == HAL_TYPE_FLOAT;
        }
        if (all) return &motif;
    }
    return nullptr;
}

struct Picture::State {
    Session& session;
    const Motif& motif;
    State(Session& s, const Motif& m) : session(s), motif(m) {}
    const bool unicode = unicode_terminal();
    std::int64_t start_ns = 0;
    DrawnLines drawn;
    std::mutex mutex;
    std::condition_variable wake;
    bool ending = false;
    std::thread thread;

    std::optional<Scene> look() {
        const auto lock = session.lock();
        Scene scene;
        for (const auto& reading : session.values().read(motif.signals)) {
            // the signal was deleted
            if (!reading || reading->type != HAL_TYPE_FLOAT) return std::nullopt;
            scene.values.push_back(reading->value.real);
        }
        scene.seconds = static_cast<double>(session.threads().now_ns() - start_ns) * 1e-9;
        scene.faults = session.reports().fault_count();
        for (const ThreadReport& report : session.reports().threads()) {
            scene.missed += report.missed;
            if (report.period_ns >= scene.thread.period_ns) {
                scene.thread = report;
            }
        }
        return scene;
    }

    void draw() {
        const auto scene = look();
        if (!scene) return;
        std::vector<std::string> lines = motif.draw(*scene, unicode);
        for (std::string& line : status_lines(*scene)) {
            lines.push_back(std::move(line));
        }
        print(drawn.replaced_by(std::move(lines), terminal_size()));
    }

    void loop() {
        release_unused_stack();
        for (std::unique_lock lock(mutex); !ending;
             wake.wait_for(lock, std::chrono::milliseconds(50), [this] { return ending; })) {
            draw();
        }
        draw();
    }
};

Picture::Picture(Session& session, const Motif& motif)
    : state_(std::make_unique<State>(session, motif)) {
    {
        const auto lock = session.lock();
        state_->start_ns = session.threads().now_ns();
    }
    state_->thread = std::thread([this] { state_->loop(); });
}

Picture::~Picture() {
    {
        const std::lock_guard lock(state_->mutex);
        state_->ending = true;
    }
    state_->wake.notify_all();
    state_->thread.join();
}

void Picture::print_above(const std::string& line) {
    const std::lock_guard lock(state_->mutex);
    if (::isatty(STDERR_FILENO)) {
        print(state_->drawn.erased(terminal_size()));
    }
    write_all(STDERR_FILENO, line);
}

std::unique_ptr<Picture> Picture::start(Session& session) {
    const char* term = std::getenv("TERM");
    if (!::isatty(STDOUT_FILENO) || !term || std::string_view(term) == "dumb") return nullptr;
    const TerminalSize size = terminal_size();
    if (size.columns < min_columns || size.rows < min_rows) return nullptr;
    const Motif* motif = nullptr;
    {
        const auto lock = session.lock();
        motif = motif_for(session.model());
    }
    return motif ? std::unique_ptr<Picture>(new Picture(session, *motif)) : nullptr;
}

}  // namespace hal::tools
