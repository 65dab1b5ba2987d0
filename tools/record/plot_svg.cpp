// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <fmt/core.h>
#include <limits>
#include <optional>
#include <string>

#include "cli/xml_escape.hpp"
#include "record/plot.hpp"

namespace hal::tools {
namespace {

constexpr const char* colours[] = {"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                   // distinct for the colour-blind
                                   "#8a6d00", "#56a0c8", "#444444", "#9467bd"};
constexpr double left = 78;
constexpr double right = 12;
constexpr double top = 14;
constexpr double gap = 12;
constexpr double bit_height = 22;
constexpr double strip_height = 150;

constexpr double legend_line = 17;

/// Traces with one scale.
struct Strip {
    std::vector<const Trace*> traces;
    bool bit = false;
    double low = 0;
    double high = 1;
    double y = 0;
    double height = 0;
};

// A fourth of the height of its scale: the whole one may be more than a double has.
double quarter(const Strip& strip) { return strip.high / 4 - strip.low / 4; }

// 1, 2 or 5 times a power of ten, for about `parts` intervals.
double tick_step(double span, double parts) {
    const double raw = span / parts;
    const double power = std::pow(10, std::floor(std::log10(raw)));
    const double digit = raw / power;
    if (digit < 1.5) return power;
    if (digit < 3.5) return power * 2;
    return digit < 7.5 ? power * 5 : power * 10;
}

class Picture {
public:
    Picture(const std::vector<mcap::Event>& events, std::int64_t begin_ns, std::int64_t end_ns,
            int width)
        : events_(events),
          begin_(begin_ns),
          end_(std::max(end_ns, begin_ns + 1)),
          width_(width),
          plot_(width - left - right) {}

    std::string draw(std::vector<Strip> strips) {
        double y = top;
        for (Strip& strip : strips) {
            y += strip.bit ? 0 : legend_line;
            strip.y = y;
            strip.height = strip.bit ? bit_height : strip_height;
            y += strip.height + gap;
        }
        const double bottom = y - gap;
        const double height = bottom + 40;
        svg_ = fmt::format(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1:.0f}\" "
            "viewBox=\"0 0 {0} {1:.0f}\" "
            "font-family=\"sans-serif\" "
            "font-size=\"12\">\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n",
            width_, height);
        time_axis(bottom);
        std::size_t colour = 0;
        for (Strip& strip : strips) {
            if (!strip.bit) {
                value_axis(strip);
            }
            double x = left;
            for (const Trace* trace : strip.traces) {
                const char* const stroke = colours[colour++ % std::size(colours)];
                if (strip.bit) {
                    svg_ += fmt::format(
                        "<text x=\"{:.0f}\" y=\"{:.1f}\" text-anchor=\"end\" fill=\"{}\" "
                        "textLength=\"{:.0f}\" "
                        "lengthAdjust=\"spacingAndGlyphs\">{}</text>\n",
                        left - 6, strip.y + 15, stroke,
                        std::min(left - 10, 6.6 * static_cast<double>(trace->name.size())),
                        xml_escape(trace->name));
                } else {
                    const std::string label =
                        trace->name + (trace->unit.empty() ? "" : " [" + trace->unit + "]");
                    svg_ += fmt::format("<text x=\"{:.0f}\" y=\"{:.1f}\" fill=\"{}\">{}</text>\n",
                                        x, strip.y - 4, stroke, xml_escape(label));
                    x += 7.0 * static_cast<double>(label.size()) + 16;
                }
                line(strip, *trace, stroke);
            }
        }
        marks(bottom);
        return svg_ + "</svg>\n";
    }

private:
    double x_of(std::int64_t time_ns) const {
        return left +
               plot_ * static_cast<double>(time_ns - begin_) / static_cast<double>(end_ - begin_);
    }
    static double y_of(const Strip& strip, double value) {
        const double share =
            (std::clamp(value, strip.low, strip.high) / 4 - strip.low / 4) / quarter(strip);
        return strip.y + strip.height - strip.height * share;
    }

    void time_axis(double bottom) {
        const double span = static_cast<double>(end_ - begin_) * 1e-9;

        const double step = tick_step(span, std::max(2.0, plot_ / 110));
        for (double t = 0; t <= span * 1.0001; t += step) {
            const double x = left + plot_ * t / span;
            svg_ += fmt::format(
                "<path d=\"M{0:.1f} {1:.0f}V{2:.1f}\" stroke=\"#ddd\"/><text x=\"{0:.1f}\" "
                "y=\"{3:.1f}\" "
                "text-anchor=\"middle\">{4:.6g}</text>\n",
                x, top, bottom, bottom + 16, std::abs(t) < step / 1000 ? 0.0 : t);
        }
        svg_ +=
            fmt::format("<text x=\"{:.0f}\" y=\"{:.1f}\" text-anchor=\"middle\">time in s</text>\n",
                        left + plot_ / 2, bottom + 33);
    }

    void value_axis(const Strip& strip) {
        const double step = tick_step(quarter(strip), 1);
        for (double value = std::ceil(strip.low / step) * step;
             value / 4 <= strip.high / 4 + step / 4000; value += step) {
            const double y = y_of(strip, value);
            svg_ += fmt::format(
                "<path d=\"M{0:.0f} {1:.1f}H{2:.0f}\" stroke=\"#ddd\"/><text x=\"{3:.0f}\" "
                "y=\"{4:.1f}\" "
                "text-anchor=\"end\">{5:.6g}</text>\n",
                left, y, left + plot_, left - 6, y + 4,
                std::abs(value) < step / 1000 ? 0.0 : value);
        }
        svg_ += fmt::format(
            "<rect x=\"{:.0f}\" y=\"{:.1f}\" width=\"{:.0f}\" height=\"{:.1f}\" fill=\"none\" "
            "stroke=\"#999\"/>\n",
            left, strip.y, plot_, strip.height);
    }

    /// The values of a trace within one pixel: what enters it, the extremes in it, what leaves it.
    struct Pixel {
        double first = NAN;  ///< the first finite one
        double low = std::numeric_limits<double>::infinity();
        double high = -std::numeric_limits<double>::infinity();
        double last = NAN;

        void add(double value) {
            last = value;
            if (!std::isfinite(value)) return;
            first = std::isnan(first) ? value : first;
            low = std::min(low, value);
            high = std::max(high, value);
        }
        bool is_gap() const { return std::isnan(first); }
    };

    double pixel_x(std::int64_t time_ns) const { return std::max(x_of(time_ns), left); }

    /// Takes the rows of one pixel, beginning with `row`, which is then the first behind them.
    Pixel pixel_of(const Trace& trace, std::size_t& row) const {
        const auto& times = trace.table->times_ns;
        const double column = std::floor(pixel_x(times[row]));
        Pixel pixel;
        for (; row < times.size() && times[row] <= end_; ++row) {
            if (std::floor(pixel_x(times[row])) != column) break;
            pixel.add(trace.table->real(row, trace.column));
        }
        return pixel;
    }

    void line(const Strip& strip, const Trace& trace, const char* stroke) {
        const auto& times = trace.table->times_ns;
        const auto after_begin = std::upper_bound(times.begin(), times.end(), begin_);
        auto row = static_cast<std::size_t>(after_begin - times.begin());
        if (row > 0) {
            --row;
        }
        const auto y = [&](double value) { return fmt::format("{:.1f}", y_of(strip, value)); };
        std::string path;
        std::optional<std::string> pen_y;  // none: the pen is up
        while (row < times.size() && times[row] <= end_) {
            const double x = pixel_x(times[row]);
            const Pixel pixel = pixel_of(trace, row);
            if (pixel.is_gap()) {
                pen_y.reset();
                continue;
            }
            const bool goes_on_flat = pixel.low == pixel.high && pen_y == y(pixel.low);
            if (goes_on_flat && std::isfinite(pixel.last)) continue;
            path += pen_y ? fmt::format("H{:.1f}V{}", x, y(pixel.first))
                          : fmt::format("M{:.1f} {}", x, y(pixel.first));
            // enters at the first value, covers all, leaves at the last
            if (pixel.low != pixel.first) {
                path += "V" + y(pixel.low);
            }
            if (pixel.high != pixel.low) {
                path += "V" + y(pixel.high);
            }
            pen_y.reset();
            if (!std::isfinite(pixel.last)) continue;
            if (pixel.last != pixel.high) {
                path += "V" + y(pixel.last);
            }
            pen_y = y(pixel.last);
        }
        if (pen_y) {
            const double right_edge = left + plot_;
            const bool goes_on = row < times.size();
            const double end = std::min(x_of(std::max(times.back(), begin_)), right_edge);
            path += fmt::format("H{:.1f}", goes_on ? right_edge : end);
        }
        svg_ += fmt::format(
            "<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.4\" "
            "stroke-linejoin=\"round\"/>\n",
            path, stroke);
    }

    void marks(double bottom) {
        for (const mcap::Event& event : events_) {
            if (event.time_ns < begin_ || event.time_ns > end_) continue;
            const char* const colour = event.kind == "fault" ? "#c00" : "#777";
            const double x = x_of(event.time_ns);
            svg_ += fmt::format(
                "<g><title>{}: {}</title><path d=\"M{:.1f} {:.0f}V{:.1f}\" stroke=\"{}\" "
                "stroke-dasharray=\"4 3\"/><text x=\"{:.1f}\" "
                "y=\"{:.0f}\" fill=\"{}\" "
                "font-size=\"10\">{}</text></g>\n",
                xml_escape(event.kind), xml_escape(event.text), x, top - 4, bottom, colour, x + 3,
                top + 2, colour, xml_escape(event.kind));
        }
    }

    const std::vector<mcap::Event>& events_;
    const std::int64_t begin_, end_;
    const int width_;
    const double plot_;
    std::string svg_;
};

struct Range {
    // nothing
    double low = std::numeric_limits<double>::infinity();

    double high = -std::numeric_limits<double>::infinity();
    double min = 0;  // the smallest size of what was added; 0: only zeros

    bool empty() const { return !(low <= high); }
    double half() const { return high / 2 - low / 2; }
    double size() const { return empty() ? 0 : std::max(std::abs(low), std::abs(high)); }
    void add(const Range& other) {
        if (const double size = other.size(); size != 0) {
            min = min == 0 ? size : std::min(min, size);
        }
        low = std::min(low, other.low);
        high = std::max(high, other.high);
    }
};

// The extremes between the times.
Range range_of(const Trace& trace, std::int64_t begin_ns, std::int64_t end_ns) {
    Range range;
    const auto& times = trace.table->times_ns;
    auto row = static_cast<std::size_t>(std::upper_bound(times.begin(), times.end(), begin_ns) -
                                        times.begin());
    for (row -= row > 0 ? 1 : 0; row < times.size() && times[row] <= end_ns; ++row) {
        const double value = trace.table->real(row, trace.column);
        if (std::isfinite(value)) {
            range.low = std::min(range.low, value);
            range.high = std::max(range.high, value);
        }
    }
    return range;
}

// The range with a margin, so high that its parts differ.
void scale(Strip& strip, Range range) {
    constexpr double max = std::numeric_limits<double>::max();
    if (range.empty()) {
        range = {0, 1};
    }
    const double size = std::max(std::abs(range.low), std::abs(range.high));
    const double margin = range.low == range.high
                              ? std::max(size * 0.1, 0.5)
                              : std::max({range.half() * 0.1, size * 1e-10, 1e-290});
    strip.low = std::max(range.low - margin, -max);
    strip.high = std::min(range.high + margin, max);
}

// Values without a unit are often of different kinds: the smaller would be a line in the strip of
// the larger. Zero goes with all.
bool alike(const Range& strip, const Range& range) {
    constexpr double max = 20;
    const double size = range.size();
    return size == 0 || strip.size() == 0 ||
           (size / max <= strip.min && strip.size() / max <= size);
}

}  // namespace

std::string plot_svg(const std::vector<Trace>& traces, const std::vector<mcap::Event>& events,
                     std::int64_t begin_ns, std::int64_t end_ns, int width) {
    std::vector<Strip> strips;
    std::vector<Range> ranges;  // of the strips
    for (const Trace& trace : traces) {
        const Range range = range_of(trace, begin_ns, end_ns);
        const bool bit = trace.type == HAL_TYPE_BIT;
        const bool integer = trace.type != HAL_TYPE_FLOAT;
        const auto fits = [&](const Strip& strip) {
            const Trace& other = *strip.traces[0];
            const Range& own = ranges[static_cast<std::size_t>(&strip - strips.data())];
            return !bit && !strip.bit && other.unit == trace.unit &&
                   (other.type != HAL_TYPE_FLOAT) == integer &&
                   (!trace.unit.empty() || alike(own, range));
        };
        const auto at = static_cast<std::size_t>(std::find_if(strips.begin(), strips.end(), fits) -
                                                 strips.begin());
        if (at == strips.size()) {
            strips.emplace_back();
            ranges.emplace_back();
        }
        strips[at].traces.push_back(&trace);
        strips[at].bit = bit;
        ranges[at].add(range);
    }
    for (std::size_t i = 0; i < strips.size(); ++i) {
        if (strips[i].bit) {
            strips[i].low = -0.15;
            strips[i].high = 1.15;
        } else {
            scale(strips[i], ranges[i]);
        }
    }
    std::stable_partition(strips.begin(), strips.end(),
                          [](const Strip& strip) { return !strip.bit; });
    return Picture(events, begin_ns, end_ns, width).draw(std::move(strips));
}

}  // namespace hal::tools
