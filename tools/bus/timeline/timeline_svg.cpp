// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <fmt/core.h>

#include "bus/timeline/timeline.hpp"
#include "cli/xml_escape.hpp"

namespace hal::tools {

namespace {

constexpr double left = 150;
constexpr double width = 870;
constexpr double top = 48;
constexpr double lane_height = 32;
constexpr double bar_height = 20;
constexpr double response_height = 24;
constexpr double response_bar = 8;
constexpr double response_width = width - 90;  // leaves space for the number behind a bar
constexpr const char* ink = "#223344";
constexpr const char* thread_colour = "#b8860b";
constexpr const char* tick_colour = "#b02a37";
constexpr const char* bold = " font-weight=\"bold\"";
constexpr const char* dashes = " stroke=\"#a35f12\" stroke-dasharray=\"2 2\"";

const char* code_of(Colour colour) {
    switch (colour) {
    case Colour::clock: return "#ffcf99";
    case Colour::leader: return "#9ec5fe";
    case Colour::follower: return "#a3d9a5";
    case Colour::idle: return "#e4f1e4";
    case Colour::compared: return "#d98880";
    }
    return ink;
}

/// Leaves out what does not fit to the left of the lanes.
std::string fitting(const std::string& name) {
    constexpr std::size_t max_length = 24;
    if (name.size() <= max_length) return name;
    std::size_t end = max_length - 1;
    while (end > 0 && (static_cast<unsigned char>(name[end]) & 0xc0) == 0x80) {
        --end;  // within a character of several bytes
    }
    return name.substr(0, end) + "…";
}

double us(std::int64_t ns) { return static_cast<double>(ns) / 1e3; }

/// At most fourteen lines, at round times in microseconds.
double grid_step_us(std::int64_t shown_ns) {
    const double wanted = us(shown_ns) / 14;
    const double decade = std::pow(10.0, std::floor(std::log10(wanted)));
    for (const double round : {1.0, 2.0, 5.0}) {
        if (round * decade >= wanted * 0.999) return round * decade;
    }
    return 10 * decade;
}

/// Draws from the top to the bottom; `y_` is where the next part begins.
class Drawing {
public:
    explicit Drawing(const Timeline& timeline) : timeline_(timeline) {}

    std::string draw() {
        text(16, 24, 14, "start", timeline_.title, bold);
        if (!timeline_.lanes.empty()) {
            grid();
            for (const Lane& lane : timeline_.lanes) {
                draw_lane(lane);
            }
            end_of_cycle();
            y_ += 12;
        }
        for (const Journey& journey : timeline_.journeys) {
            draw_journey(journey);
        }
        key();
        responses();
        for (const std::string& line : timeline_.summary) {
            text(20, y_ + 16, 12, "start", line);
            y_ += 20;
        }
        return fmt::format(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 1060 {0:g}\" width=\"1060\" "
            "height=\"{0:g}\" "
            "font-family=\"sans-serif\">\n<!-- SPDX-License-Identifier: MIT -->\n<!-- made by: {1} "
            "-->\n<rect width=\"1060\" height=\"{0:g}\" fill=\"#ffffff\"/>\n{2}</svg>\n",
            y_ + 12, timeline_.command, body_);
    }

private:
    double x(double ns) const {
        return left + width * ns / static_cast<double>(timeline_.shown_ns);
    }
    double x(std::int64_t ns) const { return x(static_cast<double>(ns)); }
    double bottom_of_lanes() const {
        return top + lane_height * static_cast<double>(timeline_.lanes.size());
    }

    void text(double at_x, double at_y, int size, const char* anchor, const std::string& what,
              const char* more = "") {
        body_ += fmt::format(
            "<text x=\"{:.1f}\" y=\"{:.1f}\" font-size=\"{}\" text-anchor=\"{}\" "
            "fill=\"{}\"{}>{}</text>\n",
            at_x, at_y, size, anchor, ink, more, xml_escape(what));
    }
    void line(double x0, double y0, double x1, double y1, const std::string& how) {
        body_ += fmt::format("<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" {}/>\n",
                             x0, y0, x1, y1, how);
    }
    void box(double x0, double x1, double at_y, double high, const char* fill, const char* more) {
        body_ += fmt::format(
            "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"{}\"{}/>\n",
            x0, at_y, std::max(x1 - x0, 1.5), high, fill, more);
    }
    void bar(double x0, double x1, double at_y, Colour colour, Bar::Shape shape) {
        switch (shape) {
        case Bar::Shape::solid:
            return box(x0, x1, at_y, bar_height, code_of(colour),
                       " stroke=\"#223344\" stroke-width=\"0.5\"");
        case Bar::Shape::pale:
            return box(x0, x1, at_y, bar_height, code_of(colour), " fill-opacity=\"0.4\"");
        case Bar::Shape::dashed: return box(x0, x1, at_y, bar_height, "none", dashes);
        }
    }
    void moment(double at_x, double at_y, Moment::Kind kind) {
        if (kind == Moment::Kind::tick) {
            return line(at_x, at_y - 3, at_x, at_y + bar_height + 3,
                        fmt::format("stroke=\"{}\" stroke-width=\"2\"", tick_colour));
        }
        body_ += fmt::format(
            "<path d=\"M{0:.1f} {1:.1f}v{2:.1f}m0 {3:.1f}l8 5l-8 5z\" fill=\"{4}\" "
            "stroke=\"{4}\"/>\n",
            at_x, at_y, bar_height, -bar_height, thread_colour);
    }

    void grid() {
        const double step = grid_step_us(timeline_.shown_ns);
        for (int n = 0; step * n * 1e3 <= static_cast<double>(timeline_.shown_ns); ++n) {
            const double at = x(step * n * 1e3);
            line(at, top, at, bottom_of_lanes(), "stroke=\"#d0d5dd\"");
            text(at, top - 6, 10, "middle", fmt::format("{:g}", step * n));
        }
        text(left - 10, top - 6, 10, "end", "us");
        y_ = top;
    }
    void end_of_cycle() {
        const bool shown = timeline_.cycle_ns < timeline_.shown_ns;
        if (shown) {
            line(x(timeline_.cycle_ns), top, x(timeline_.cycle_ns), bottom_of_lanes(),
                 "stroke=\"#c0392b\" stroke-width=\"1.5\" stroke-dasharray=\"4 3\"");
        }
    }
    void draw_lane(const Lane& lane) {
        const double at_y = y_ + (lane_height - bar_height) / 2;
        text(left - 10, at_y + 15, 12, "end", fitting(lane.name), bold);
        line(left, y_ + lane_height, left + width, y_ + lane_height, "stroke=\"#e4e8f4\"");
        for (const Bar& one : lane.bars) {
            bar(x(one.from_ns), x(one.until_ns), at_y, one.colour, one.shape);
        }
        for (const Moment& one : lane.moments) {
            moment(x(one.at_ns), at_y, one.kind);
        }
        for (const Label& label : lane.labels) {
            const char* const anchor = label.centred ? "middle" : "start";
            const double gap = label.centred ? 0 : 4;
            text(x(label.at_ns) + gap, at_y + 14, 10, anchor, label.text);
        }
        y_ += lane_height;
    }
    void draw_journey(const Journey& journey) {
        const double begin = x(journey.from_ns);
        const double end = std::min(x(journey.until_ns), left + width);
        line(begin, y_, end, y_, fmt::format("stroke=\"{}\" stroke-dasharray=\"4 3\"", ink));
        for (const double edge : {begin, end}) {
            line(edge, y_ - 5, edge, y_ + 5, fmt::format("stroke=\"{}\"", ink));
        }
        text(begin, y_ + 17, 12, "start", journey.from);
        text(end, y_ + 17, 12, "end", journey.until);
        y_ += 32;
    }
    void sample(double at, const KeyEntry& entry) {
        using Sample = KeyEntry::Sample;
        switch (entry.sample) {
        case Sample::bar: return bar(at, at + 16, y_, entry.colour, Bar::Shape::solid);
        case Sample::pale: return bar(at, at + 16, y_, entry.colour, Bar::Shape::pale);
        case Sample::dashed: return bar(at, at + 16, y_, entry.colour, Bar::Shape::dashed);
        case Sample::thread: return moment(at + 4, y_, Moment::Kind::thread);
        case Sample::tick: return moment(at + 8, y_, Moment::Kind::tick);
        }
    }
    void key() {
        if (timeline_.key.empty()) return;
        double at = 20;
        for (const KeyEntry& entry : timeline_.key) {
            const double wide = 40 + 6.5 * static_cast<double>(entry.text.size());
            if (at > 20 && at + wide > left + width) {
                at = 20;
                y_ += bar_height + 8;
            }
            sample(at, entry);
            text(at + 22, y_ + 15, 12, "start", entry.text);
            at += wide;
        }
        y_ += bar_height + 12;
    }
    /// Returns the length of a bar.
    double response_length(std::int64_t ns, std::int64_t max_ns) const {
        return response_width * static_cast<double>(ns) / static_cast<double>(max_ns);
    }
    void response_bar_of(std::int64_t ns, std::int64_t max_ns, double at_y, Colour colour) {
        const double length = ns < 0 ? 0 : response_length(ns, max_ns);
        if (ns >= 0) {
            box(left, left + length, at_y, response_bar, code_of(colour),
                " stroke=\"#8899aa\" stroke-width=\"0.5\"");
        }
        const std::string number =
            ns < 0 ? "unbounded" : fmt::format("{:.3f}", static_cast<double>(ns) / 1e6);
        text(left + length + 6, at_y + response_bar, 9, "start", number);
    }
    std::int64_t max_response() const {
        std::int64_t max = 1;
        for (const ResponseTime& one : timeline_.responses) {
            max = std::max(
                {max, one.worst_ns, one.compared_ns.value_or(0), one.deadline_ns.value_or(0)});
        }
        return max;
    }
    void responses() {
        if (timeline_.responses.empty()) return;
        y_ = std::max(y_, top - 12);
        text(16, y_ + 14, 13, "start", timeline_.response_title, bold);
        y_ += 26;
        const std::int64_t max = max_response();
        for (const ResponseTime& one : timeline_.responses) {
            text(left - 8, y_ + 13, 11, "end", fitting(one.name));
            response_bar_of(one.worst_ns, max, y_ + 2, one.colour);
            if (one.compared_ns) {
                response_bar_of(*one.compared_ns, max, y_ + 2 + response_bar + 1, Colour::compared);
            }
            if (one.deadline_ns) {
                const double at = left + response_length(*one.deadline_ns, max);
                line(at, y_, at, y_ + response_height - 3,
                     fmt::format("stroke=\"{}\" stroke-width=\"1.5\"", tick_colour));
            }
            y_ += response_height;
        }
        y_ += 8;
    }

    const Timeline& timeline_;
    double y_ = top - 12;
    std::string body_;
};

}  // namespace

std::string timeline_svg(const Timeline& timeline) { return Drawing(timeline).draw(); }

}  // namespace hal::tools
