// SPDX-License-Identifier: MIT
#include "bus/tdma/plan_picture.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/core.h>

#include "cli/xml_escape.hpp"

namespace hal::tools {

namespace {

namespace plan = tdma::plan;
using tdma::Role;
using tdma::Time;
using tdma::config::Schedule;
using tdma::config::StationEntry;
using What = plan::Entry::What;

constexpr double left = 110;
constexpr double width = 910;
constexpr double top = 48;
constexpr double row = 34;
constexpr double bar = 22;
constexpr const char *ink = "#223344", *sync_colour = "#ffcf99", *thread_colour = "#b8860b",
                     *leader_colour = "#9ec5fe", *slave_colour = "#a3d9a5";

constexpr const char* backup_line = " stroke=\"#a35f12\" stroke-dasharray=\"2 2\"";

double us(Time t) { return static_cast<double>(t) / 1e3; }

class Picture {
public:
    Picture(const Schedule& schedule, const plan::Plan& p)
        : s_(schedule), plan_(p), span_(static_cast<double>(schedule.cycle) * 1.36) {}

    std::string draw() {
        grid();
        for (std::size_t i = 0; i < s_.stations.size(); ++i) {
            station(i);
        }
        for (const plan::Entry& e : plan_.entries) {
            for (Time k = 0; k < 2; ++k) {
                frame(e, k * s_.cycle, k == 0);
            }
        }
        threads();
        const double bottom = top + row * static_cast<double>(s_.stations.size());
        key(bottom + 14);
        summary(bottom + 52);
        const double height = bottom + 80;
        return fmt::format(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 1060 {0:g}\" width=\"1060\" "
            "height=\"{0:g}\" "
            "font-family=\"sans-serif\">\n<!-- SPDX-License-Identifier: MIT -->\n<!-- made by: hal "
            "tdma plan -->\n"
            "<rect width=\"1060\" height=\"{0:g}\" fill=\"#ffffff\"/>\n{1}</svg>\n",
            height, body_);
    }

private:
    double x(double ns) const { return left + width * ns / span_; }
    double x(Time t) const { return x(static_cast<double>(t)); }
    static double y(std::size_t station) {
        return top + row * static_cast<double>(station) + (row - bar) / 2;
    }

    void text(double at_x, double at_y, int size, const char* anchor, const std::string& what,
              const char* more = "") {
        body_ += fmt::format(
            "<text x=\"{:.1f}\" y=\"{:.1f}\" font-size=\"{}\" text-anchor=\"{}\" "
            "fill=\"{}\"{}>{}</text>\n",
            at_x, at_y, size, anchor, ink, more, xml_escape(what));
    }
    void line(double x0, double y0, double x1, double y1, const char* how) {
        body_ += fmt::format("<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" {}/>\n",
                             x0, y0, x1, y1, how);
    }
    void box(double x0, double x1, double at_y, const char* fill, const char* more = "") {
        body_ += fmt::format(
            "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" rx=\"2\" "
            "fill=\"{}\"{}/>\n",
            x0, at_y, std::max(x1 - x0, 1.5), bar, fill, more);
    }
    /// Draws a flag where a thread's cycle begins.
    void flag(double at_x, double at_y) {
        body_ += fmt::format(
            "<path d=\"M{0:.1f} {1:.1f}v{2:.1f}m0 {3:.1f}l8 5l-8 5z\" fill=\"{4}\" "
            "stroke=\"{4}\"/>\n",
            at_x, at_y, bar, -bar, thread_colour);
    }

    /// Draws about ten grid lines per cycle, at round times.
    double step() const {
        const double about = us(s_.cycle) / 10;

        const double decade = std::pow(10.0, std::floor(std::log10(about)));
        for (const double round : {1.0, 2.0, 5.0}) {
            if (round * decade >= about * 0.999) return round * decade;
        }
        return 10 * decade;
    }
    void grid() {
        text(16, 24, 14, "start",
             fmt::format(
                 "A cycle of {:g} us; times from the sync, in us; wire times at {} Mbit/s{}",
                 us(s_.cycle), s_.speed,
                 s_.forward == 0 ? "" : fmt::format(", {:g} us in the switch", us(s_.forward))),
             " font-weight=\"bold\"");
        const double bottom = top + row * static_cast<double>(s_.stations.size());
        const double each = step();
        for (int n = 0; each * n * 1e3 <= span_; ++n) {
            const double at = x(each * n * 1e3);
            line(at, top, at, bottom, "stroke=\"#d0d5dd\"");
            text(at, top - 6, 10, "middle", fmt::format("{:g}", each * n));
        }
        line(x(s_.cycle), top, x(s_.cycle), bottom,
             "stroke=\"#c0392b\" stroke-width=\"1.5\" stroke-dasharray=\"4 3\"");
    }
    void station(std::size_t i) {
        const StationEntry& e = s_.stations[i];
        text(left - 10, y(i) + 16, 13, "end", e.name, " font-weight=\"bold\"");
        line(left, y(i) + bar + 6, left + width, y(i) + bar + 6, "stroke=\"#e4e8f4\"");
    }
    void threads() {
        for (std::size_t i = 0; i < s_.stations.size(); ++i) {
            for (Time k = 0; k < 2; ++k) {
                if (const double at = x(s_.stations[i].phase + k * s_.cycle);
                    at <= left + width - 8) {
                    flag(at, y(i));
                }
            }
        }
    }
    /// Draws a frame on its sender's line, and pale until it has left the receiver's.
    void frame(const plan::Entry& e, Time later, bool first) {
        const bool slot = e.what == What::slot;
        const double from = x(e.at + later);
        const double until = x(e.until + later);

        const double there = x(e.at + s_.path(e.bytes) + later);
        const double at_y = y(e.station);
        if (there > left + width) return;
        const char* fill = !slot                                        ? sync_colour
                           : s_.stations[e.station].role == Role::slave ? slave_colour
                                                                        : leader_colour;
        if (e.what == What::backup_sync) {
            box(from, until, at_y, "none", backup_line);
        } else {
            box(until, there, at_y, fill, " fill-opacity=\"0.4\"");
            box(from, until, at_y, fill, " stroke=\"#223344\"");
        }
        if (!first) return;
        if (e.what == What::sync) return text(there + 4, at_y + 15, 10, "start", "sync");
        if (e.what == What::backup_sync) {
            return text(until + 4, at_y + 15, 10, "start", fmt::format("{:g}", us(e.at)));
        }
        const std::string cycles =
            e.period == 1 ? "" : fmt::format(", {} of {} cycles", e.phasing + 1, e.period);
        text(there + 4, at_y + 15, 10, "start", fmt::format("{:g}{}", us(e.at), cycles));
    }
    void key(double at_y) {
        struct Sample {
            const char *colour, *what;
            double width;
        };
        constexpr std::array<Sample, 3> samples{{{sync_colour, "sync", 90},
                                                 {leader_colour, "slot of a master", 160},
                                                 {slave_colour, "slot of a slave", 150}}};
        double at = left;
        for (const auto& [colour, what, wide] : samples) {
            box(at + 16, at + 28, at_y, colour, " fill-opacity=\"0.4\"");
            box(at, at + 16, at_y, colour, " stroke=\"#223344\"");
            text(at + 34, at_y + 15, 12, "start", what);
            at += wide;
        }
        box(at, at + 12, at_y, "none", backup_line);
        text(at + 18, at_y + 15, 12, "start", "backup's sync, if none came");
        at += 200;
        flag(at, at_y);
        text(at + 14, at_y + 15, 12, "start", "thread begins");
        text(at + 120, at_y + 15, 12, "start", "pale: in transit to the receiver");
    }
    void summary(double at_y) {
        std::string line = fmt::format("Line load {:.1f} %", 100 * plan_.load);
        const auto sooner = [](const plan::RoundTrip& a, const plan::RoundTrip& b) {
            return a.worst < b.worst;
        };
        if (const auto worst = std::max_element(plan_.trips.begin(), plan_.trips.end(), sooner);
            worst != plan_.trips.end()) {
            line += fmt::format("; worst-case latency from input to output of {}: {:g} us",
                                s_.stations[worst->station].name, us(worst->worst));
        }
        text(left, at_y + 12, 12, "start", line);
    }

    const Schedule& s_;
    const plan::Plan& plan_;
    const double span_;  // ns
    std::string body_;
};

}  // namespace

std::string picture_of(const Schedule& schedule, const plan::Plan& p) {
    return Picture(schedule, p).draw();
}

}  // namespace hal::tools
