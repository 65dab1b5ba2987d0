// SPDX-License-Identifier: MIT
#include "bus/ethercat/plan_picture.hpp"

#include <algorithm>
#include <fmt/core.h>

#include "cli/xml_escape.hpp"

namespace hal::tools {

using namespace ethercat;

namespace {

constexpr double left = 150;
constexpr double width = 850;
constexpr double top = 58;
constexpr double row = 30;
constexpr double bar = 18;
constexpr std::size_t max_rows = 16;  // of slaves
constexpr const char *ink = "#223344", *thread_colour = "#ffcf99", *wire_colour = "#9ec5fe",
                     *slave_colour = "#a3d9a5", *sync_colour = "#b02a37";

std::string micro(std::int64_t ns) {
    return fmt::format("{:g} us", static_cast<double>(ns) / 1000);
}

class TimingPicture {
public:
    TimingPicture(const config::Bus& bus, const config::Plan& plan,
                  const config::PlanOptions& assumed)
        : bus_(bus),
          plan_(plan),
          assumed_(assumed),
          cycles_(static_cast<double>(plan.input_to_output_ns) >
                          2.3 * static_cast<double>(plan.cycle_ns)
                      ? 3
                      : 2),
          span_((cycles_ + 0.3) * static_cast<double>(plan.cycle_ns)) {}

    std::string draw() {
        const auto& slaves = bus_.setup.slaves;
        const std::size_t shown = std::min(slaves.size(), max_rows);
        const double bottom = y(2 + shown);
        for (int k = 0; k <= cycles_; ++k) {
            const double at = x(k * plan_.cycle_ns);
            line(at, top - 14, at, bottom, "#c5ccd3", "");
            text(at, top - 20, k == 0 ? "start of the cycle" : "+ " + micro(k * plan_.cycle_ns),
                 "start");
        }
        text(left - 10, y(0) + 13, "thread", "end");
        text(left - 10, y(1) + 13, "wire", "end");
        for (int k = 0; k < cycles_; ++k) {
            const std::int64_t begin = k * plan_.cycle_ns;
            const std::int64_t sent = begin + assumed_.master_ns;
            box(begin, sent, 0, thread_colour,
                "receive, components, transmit: at most " + micro(assumed_.master_ns), k == 0);
            box(sent, sent + plan_.wire_ns, 1, wire_colour,
                fmt::format("{} frame{}, {}", plan_.frames, plan_.frames == 1 ? "" : "s",
                            micro(plan_.wire_ns)),
                k == 0);
            for (std::size_t n = 0; n < shown; ++n) {
                slave(n, begin, sent, k == 0);
            }
        }
        double under = bottom + 14;
        if (slaves.size() > shown) {
            text(left - 10, under, fmt::format("and {} more", slaves.size() - shown), "end");
        }
        trip(bottom + 26);
        under = bottom + 62;
        text(20, under,
             fmt::format("Wire load {:.1f} %; shortest cycle {}; worst case from an input to the "
                         "output that answers it {}.",
                         100 * plan_.load, micro(plan_.shortest_cycle_ns),
                         micro(plan_.input_to_output_ns)),
             "start");
        if (synchronised_) {
            line(left + width + 2, under - 13, left + width + 2, under + 3, sync_colour,
                 " stroke-width=\"2\"");
            text(left + width + 8, under, "SYNC0", "start");
        }
        const double height = under + 22;
        return fmt::format(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 1060 {0:g}\" width=\"1060\" "
            "height=\"{0:g}\" "
            "font-family=\"sans-serif\">\n<!-- SPDX-License-Identifier: MIT -->\n<!-- made by: hal "
            "ethercat plan -->\n"
            "<rect width=\"1060\" height=\"{0:g}\" fill=\"#ffffff\"/>\n{1}</svg>\n",
            height, body_);
    }

private:
    double x(std::int64_t ns) const { return left + width * static_cast<double>(ns) / span_; }
    static double y(std::size_t lane) { return top + row * static_cast<double>(lane); }

    void text(double at_x, double at_y, const std::string& what, const char* anchor) {
        body_ += fmt::format(
            "<text x=\"{:.1f}\" y=\"{:.1f}\" font-size=\"12\" text-anchor=\"{}\" "
            "fill=\"{}\">{}</text>\n",
            at_x, at_y, anchor, ink, xml_escape(what));
    }
    void line(double x0, double y0, double x1, double y1, const char* colour, const char* more) {
        body_ += fmt::format(
            "<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"{}\"{}/>\n", x0,
            y0, x1, y1, colour, more);
    }
    /// A bar in a lane, with its words beside it.
    void box(std::int64_t from, std::int64_t to, std::size_t lane, const char* colour,
             const std::string& what, bool words) {
        const double wide = std::max(x(to) - x(from), 2.0);
        body_ += fmt::format(
            "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:g}\" fill=\"{}\" "
            "stroke=\"{}\" stroke-width=\"0.5\"/>\n",
            x(from), y(lane), wide, bar, colour, ink);
        if (words) {
            text(x(from) + wide + 5, y(lane) + 13, what, "start");
        }
    }
    void slave(std::size_t n, std::int64_t begin, std::int64_t sent, bool first) {
        const master::Slave& s = bus_.setup.slaves[n];
        if (first) {
            text(left - 10, y(2 + n) + 13, s.name, "end");
        }
        const std::int64_t arrives =
            sent + static_cast<std::int64_t>(n + 1) * assumed_.slave_delay_ns / 2;
        box(arrives, arrives + plan_.wire_ns, 2 + n, slave_colour, "", false);
        if (!s.dc || s.dc->assign_activate == 0) return;
        const std::int64_t every = s.dc->sync0_cycle_ns > 0 ? s.dc->sync0_cycle_ns : plan_.cycle_ns;
        std::int64_t pulse = begin + s.dc->sync0_shift_ns % plan_.cycle_ns;
        if (pulse < begin) {
            pulse += plan_.cycle_ns;
        }
        for (unsigned count = 0; pulse < begin + plan_.cycle_ns && count < 64;
             pulse += every, ++count) {
            if (every > plan_.cycle_ns && begin != 0) break;
            line(x(pulse), y(2 + n) - 3, x(pulse), y(2 + n) + bar + 3, sync_colour,
                 " stroke-width=\"2\"");
            synchronised_ = true;
        }
    }
    void trip(double at) {
        const double end = std::min(x(plan_.input_to_output_ns), left + width + 40);
        line(x(0), at, end, at, ink, " stroke-dasharray=\"4 3\"");
        for (const double edge : {x(0), end}) {
            line(edge, at - 5, edge, at + 5, ink, "");
        }
        text(x(0), at + 17, "an input changes just after it was sampled", "start");
        text(end, at + 17, "the output that answers it", "end");
    }

    const config::Bus& bus_;
    const config::Plan& plan_;
    const config::PlanOptions& assumed_;
    int cycles_;  // shown in full
    double span_;
    bool synchronised_ = false;
    std::string body_;
};

}  // namespace

std::string ethercat_plan_picture(const config::Bus& bus, const config::Plan& plan,
                                  const config::PlanOptions& assumed) {
    return TimingPicture(bus, plan, assumed).draw();
}

}  // namespace hal::tools
