// SPDX-License-Identifier: MIT
#include "bus/scocan/plan_picture.hpp"

#include <algorithm>
#include <fmt/core.h>

#include "cli/xml_escape.hpp"

namespace hal::tools {

namespace {

using namespace scocan;

constexpr double left = 150;
constexpr double width = 870;
constexpr double slots_top = 56;
constexpr double slot_height = 46;
constexpr double bars_top = 170;

constexpr double row_height = 24;
constexpr double bar = 8;
constexpr const char *ink = "#223344", *sync_colour = "#ffcf99", *private_colour = "#9ec5fe",
                     *shared_colour = "#e4f1e4", *plain_colour = "#d98880";

class Picture {
public:
    Picture(const Table& table, const plan::Plan& p) : t_(table), plan_(p) {
        for (const plan::Latency& l : p.latencies) {
            longest_ = std::max({longest_, l.worst, l.plain});
        }
    }

    std::string draw() {
        text(16, 24, 14, "start",
             fmt::format("A cycle of {:g} ms in {} slots of {:g} us at {} bit/s, mode {}",
                         static_cast<double>(t_.cycle) / 1e6, t_.slots,
                         static_cast<double>(t_.slot()) / 1e3, t_.bit_rate,
                         t_.mode(plan_.mode)->name),
             " font-weight=\"bold\"");
        for (std::uint32_t slot = 0; slot < t_.slots; ++slot) {
            draw_slot(slot);
        }
        text(16, bars_top - 12, 13, "start",
             "Worst-case latency of each message, ms: with slots (blue, green), on plain CAN (red)",
             " font-weight=\"bold\"");
        double y = bars_top;
        for (const plan::Latency& l : plan_.latencies) {
            bars(l, y);
            y += row_height;
        }
        const double height = y + 20;
        return fmt::format(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 1060 {0:g}\" width=\"1060\" "
            "height=\"{0:g}\" "
            "font-family=\"sans-serif\">\n<!-- SPDX-License-Identifier: MIT -->\n<!-- made by: hal "
            "scocan plan -->\n"
            "<rect width=\"1060\" height=\"{0:g}\" fill=\"#ffffff\"/>\n{1}</svg>\n",
            height, body_);
    }

private:
    void text(double x, double y, int size, const char* anchor, const std::string& what,
              const char* more = "") {
        body_ += fmt::format(
            "<text x=\"{:.1f}\" y=\"{:.1f}\" font-size=\"{}\" text-anchor=\"{}\" "
            "fill=\"{}\"{}>{}</text>\n",
            x, y, size, anchor, ink, more, xml_escape(what));
    }
    void box(double x, double y, double wide, double high, const char* fill) {
        body_ += fmt::format(
            "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"{}\" "
            "stroke=\"#8899aa\" stroke-width=\"0.5\"/>\n",
            x, y, std::max(wide, 1.0), high, fill);
    }

    void draw_slot(std::uint32_t slot) {
        constexpr double all = width + left - 20;
        const double wide = all / t_.slots;
        const double x = 20 + wide * slot;
        const auto& uses = t_.mode(plan_.mode)->slots[slot];
        const Kind kind = uses.empty() ? Kind::shared : uses.front().kind;
        box(x, slots_top, wide, slot_height,
            kind == Kind::sync   ? sync_colour
            : kind == Kind::priv ? private_colour
                                 : shared_colour);
        if (wide < 12) return;
        text(x + wide / 2, slots_top - 6, 9, "middle", fmt::format("{}", slot));
        std::string what = kind == Kind::sync ? "SYNC" : "";
        double y = slots_top + 14;
        for (const Use& u : uses) {
            if (u.kind == Kind::priv) {
                what = u.ids.empty() ? t_.nodes[u.node].name : scocan::id_text(u.ids.front()).substr(2);
            }
            if (!what.empty() && y < slots_top + slot_height) {
                text(x + wide / 2, y, 9, "middle", what);
                y += 11;
            }
        }
        if (kind != Kind::priv) return;
        // The frame itself, to scale.
        const Time frame = t_.frame(8);
        box(x, slots_top + slot_height,
            wide * static_cast<double>(frame) / static_cast<double>(t_.slot()), 6, "#3b6ea5");
    }

    void bars(const plan::Latency& l, double y) {
        const Message& m = t_.messages[l.message];
        const auto wide = [&](Time t) {
            return (width - 90) * static_cast<double>(t) /
                   static_cast<double>(std::max<Time>(longest_, 1));
        };
        text(left - 8, y + 13, 11, "end", fmt::format("{} {}", scocan::id_text(m.id), m.name));
        const auto one = [&](Time worst, double at, const char* fill) {
            if (worst >= 0) {
                box(left, at, wide(worst), bar, fill);
            }
            text(left + (worst >= 0 ? wide(worst) : 0) + 4, at + bar, 9, "start",
                 worst < 0 ? "unbounded" : fmt::format("{:.3f}", static_cast<double>(worst) / 1e6));
        };
        one(l.worst, y + 2, l.priv ? private_colour : "#a3d9a5");
        one(l.plain, y + 2 + bar + 1, plain_colour);
    }

    const Table& t_;
    const plan::Plan& plan_;
    Time longest_ = 1;
    std::string body_;
};

}  // namespace

std::string picture_of(const Table& table, const plan::Plan& p) { return Picture(table, p).draw(); }

}  // namespace hal::tools
