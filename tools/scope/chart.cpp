// SPDX-License-Identifier: MIT
#include "scope/chart.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/core.h>
#include <limits>

#include "cli/xml_escape.hpp"
#include "scope/measure.hpp"
#include "scope/view.hpp"

namespace hal::tools {

namespace {

constexpr double left = 84;
constexpr double plot_width = 880;
constexpr double right = 20;
constexpr double top = 42;
constexpr double float_height = 130;

constexpr double bit_height = 34;
constexpr double gap = 30;
constexpr const char* colours[] = {"#1f6fb4", "#c2410c", "#15803d", "#7c3aed",
                                   "#0e7490", "#be185d", "#a16207", "#4d7c0f"};

struct Axis {
    double min = 0;
    double max = 1;
    double step = 1;
};

/// Whole steps of 1, 2 or 5 around the range.
Axis axis_of(double min, double max, int about) {
    if (!(max > min)) {
        const double around = std::max(std::abs(min) * 0.1, 0.5);
        min -= around;
        max += around;
    }
    const double fine = (max - min) / about;
    double step = std::pow(10.0, std::floor(std::log10(fine)));
    while (step < fine * (1 - 1e-9)) {
        step = next_step(step, true);
    }
    return {std::floor(min / step + 1e-9) * step, std::ceil(max / step - 1e-9) * step, step};
}

struct TimeUnit {
    const char* name;
    double ns;
};
TimeUnit time_unit(std::int64_t length_ns) {
    const auto length = static_cast<double>(length_ns);
    if (length >= 2e9) {
        return TimeUnit{"s", 1e9};
    }
    if (length >= 2e6) {
        return TimeUnit{"ms", 1e6};
    }
    return TimeUnit{"us", 1e3};
}

std::string label(double value, double step) {
    return fmt::format("{:.6g}", std::abs(value) < step * 1e-6 ? 0 : value);
}

std::string summary(const Channel& channel, const Measurements& found) {
    if (channel.bit) {
        return found.frequency_hz
                   ? fmt::format("{}, duty {}", format_measured(found.frequency_hz, "Hz"),
                                 format_measured(*found.duty * 100, "%"))
                   : "";
    }
    std::string text = fmt::format(
        "min {}, max {}, mean {}, rms {}", format_measured(found.min, channel.unit),
        format_measured(found.max, channel.unit), format_measured(found.mean, channel.unit),
        format_measured(found.rms, channel.unit));
    if (found.frequency_hz) {
        text += fmt::format(", frequency {}", format_measured(found.frequency_hz, "Hz"));
    }
    if (found.overshoot_percent) {
        text += fmt::format(", overshoot {}, settling time {}",
                            format_measured(found.overshoot_percent, "%"),
                            format_measured(found.settling_s, "s"));
    }
    return text;
}

class Chart {
public:
    Chart(const std::vector<Channel>& channels, const Record& record, const std::string& title)
        : channels_(channels), record_(record) {
        double height = top;
        for (const Channel& channel : channels) {
            height += gap + (channel.bit ? bit_height : float_height);
        }
        height += 40;
        text_ = fmt::format(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1}\" viewBox=\"0 0 "
            "{0} {1}\" font-family=\"sans-serif\" "
            "font-size=\"11\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n<text "
            "x=\"{2}\" y=\"22\" "
            "font-size=\"14\">{3}</text>\n",
            left + plot_width + right, height, left, xml_escape(title));
        y_ = top;
        for (std::size_t i = 0; i < channels.size(); ++i) {
            lane(i);
        }
        time_axis();
        text_ += "</svg>\n";
    }
    std::string text() && { return std::move(text_); }

private:
    double x_of(std::int64_t time_ns) const {
        return left + static_cast<double>(time_ns - record_.begin_ns) /
                          static_cast<double>(
                              std::max<std::int64_t>(record_.end_ns - record_.begin_ns, 1)) *
                          plot_width;
    }

    void lane(std::size_t i) {
        const Channel& channel = channels_[i];
        const Measurements found =
            measure(record_.samples[i], record_.begin_ns, record_.end_ns, record_.step_ns());
        const double height = channel.bit ? bit_height : float_height;
        const char* const colour = colours[i % std::size(colours)];
        y_ += gap;
        text_ += fmt::format(
            "<text x=\"{}\" y=\"{:.1f}\" fill=\"{}\" font-weight=\"bold\">{}{}</text>\n<text "
            "x=\"{}\" y=\"{:.1f}\" fill=\"#555\" "
            "text-anchor=\"end\">{}</text>\n",
            left, y_ - 6, colour, xml_escape(channel.name),
            channel.unit.empty() ? "" : " [" + xml_escape(channel.unit) + "]", left + plot_width,
            y_ - 6, xml_escape(summary(channel, found)));
        double min = std::numeric_limits<double>::infinity();
        double max = -min;
        for (const Sample& sample : record_.samples[i]) {
            if (std::isfinite(sample.value)) {
                min = std::min(min, sample.value);
                max = std::max(max, sample.value);
            }
        }
        Axis axis;
        if (channel.bit) {
            axis = {0, 1, 1};
        } else if (min <= max) {
            axis = axis_of(min, max, 4);
        }
        const auto y_of = [&](double value) {
            return y_ + height - (value - axis.min) / (axis.max - axis.min) * height;
        };
        for (int k = 0; axis.min + k * axis.step <= axis.max + axis.step * 0.5; ++k) {
            const double value = axis.min + k * axis.step;
            text_ += fmt::format(
                "<path d=\"M{} {:.1f}H{}\" stroke=\"#e4e4e4\"/><text x=\"{}\" y=\"{:.1f}\" "
                "text-anchor=\"end\" fill=\"#555\">{}</text>\n",
                left, y_of(value), left + plot_width, left - 6, y_of(value) + 4,
                label(value, axis.step));
        }
        trace(record_.samples[i], channel.stepped, colour, y_of);
        y_ += height;
    }

    /// With many samples per pixel only the extremes of each half pixel are drawn, in their order.
    template <class Y>
    void trace(const Samples& samples, bool stepped, const char* colour, Y y_of) {
        std::string path;
        bool any = false;
        const auto point = [&](const Sample& sample) {
            const double x = std::max(x_of(sample.time_ns), left);
            const double y = y_of(sample.value);
            if (!any) {
                path += fmt::format("M{:.2f} {:.2f}", x, y);
            } else if (stepped) {
                path += fmt::format("H{:.2f}V{:.2f}", x, y);
            } else {
                path += fmt::format("L{:.2f} {:.2f}", x, y);
            }
            any = true;
        };
        const auto bin_of = [&](const Sample& sample) {
            return std::floor(x_of(sample.time_ns) * 2);
        };
        for (std::size_t i = 0; i < samples.size();) {
            if (!std::isfinite(samples[i].value)) {
                any = false;
                ++i;
                continue;
            }
            std::size_t end = i + 1;
            std::size_t low = i;
            std::size_t high = i;
            for (; end < samples.size() && std::isfinite(samples[end].value) &&
                   bin_of(samples[end]) == bin_of(samples[i]);
                 ++end) {
                if (samples[end].value < samples[low].value) {
                    low = end;
                }
                if (samples[end].value > samples[high].value) {
                    high = end;
                }
            }
            std::vector<std::size_t> drawn{i, low, high, end - 1};
            std::sort(drawn.begin(), drawn.end());
            drawn.erase(std::unique(drawn.begin(), drawn.end()), drawn.end());
            for (const std::size_t at : drawn) {
                point(samples[at]);
            }
            i = end;
        }
        if (any && stepped) {
            path += fmt::format("H{:.2f}", left + plot_width);
        }
        text_ += fmt::format("<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.4\"/>\n",
                             path, colour);
    }

    void time_axis() {
        const TimeUnit unit = time_unit(record_.end_ns - record_.begin_ns);
        const double from = static_cast<double>(record_.begin_ns - record_.trigger_ns) / unit.ns;

        const double to = static_cast<double>(record_.end_ns - record_.trigger_ns) / unit.ns;
        const Axis axis = axis_of(from, to, 10);
        for (double value = std::ceil(from / axis.step - 1e-9) * axis.step;
             value <= to + axis.step * 1e-6; value += axis.step) {
            const double x = x_of(record_.trigger_ns + std::llround(value * unit.ns));
            text_ += fmt::format(
                "<path d=\"M{0:.1f} {1}V{2:.1f}\" stroke=\"#e4e4e4\" stroke-dasharray=\"2 "
                "3\"/><text x=\"{0:.1f}\" y=\"{3:.1f}\" "
                "text-anchor=\"middle\" "
                "fill=\"#555\">{4}</text>\n",
                x, top, y_, y_ + 16, label(value, axis.step));
        }
        if (record_.triggered) {
            text_ += fmt::format("<path d=\"M{0:.1f} {1}V{2:.1f}\" stroke=\"#888\"/>\n",
                                 x_of(record_.trigger_ns), top, y_);
        }
        text_ += fmt::format(
            "<text x=\"{}\" y=\"{:.1f}\" text-anchor=\"end\" fill=\"#555\">time [{}]{}</text>\n",
            left + plot_width, y_ + 32, unit.name, record_.triggered ? ", 0: trigger" : "");
    }

    const std::vector<Channel>& channels_;
    const Record& record_;
    std::string text_;
    double y_ = 0;
};

std::string csv_name(const Channel& channel) {
    const std::string name =
        channel.unit.empty() ? channel.name : fmt::format("{} [{}]", channel.name, channel.unit);
    if (name.find_first_of(",\"\n") == std::string::npos) return name;
    std::string quoted = "\"";
    for (const char c : name) {
        quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
    }
    return quoted + '"';
}

}  // namespace

std::string chart_svg(const std::vector<Channel>& channels, const Record& record,
                      const std::string& title) {
    return Chart(channels, record, title).text();
}

std::string chart_csv(const std::vector<Channel>& channels, const Record& record) {
    std::string text = "time_s";
    for (const Channel& channel : channels) {
        text += "," + csv_name(channel);
    }
    text += '\n';
    std::vector<std::size_t> next(channels.size(), 0);
    std::vector<const Sample*> held(channels.size(), nullptr);
    while (true) {
        std::int64_t now = std::numeric_limits<std::int64_t>::max();
        for (std::size_t i = 0; i < channels.size(); ++i) {
            if (next[i] < record.samples[i].size()) {
                now = std::min(now, record.samples[i][next[i]].time_ns);
            }
        }
        if (now == std::numeric_limits<std::int64_t>::max()) return text;
        for (std::size_t i = 0; i < channels.size(); ++i) {
            if (next[i] < record.samples[i].size() && record.samples[i][next[i]].time_ns == now) {
                held[i] = &record.samples[i][next[i]++];
            }
        }
        if (now < record.begin_ns) continue;
        text += fmt::format("{:.9f}", static_cast<double>(now - record.trigger_ns) * 1e-9);
        for (std::size_t i = 0; i < channels.size(); ++i) {
            text += ',';
            if (held[i] != nullptr) {
                text += channels[i].wide == Channel::Wide::no ? fmt::format("{}", held[i]->value)
                                                              : digits(channels[i], *held[i]);
            }
        }
        text += '\n';
    }
}

std::string measurement_table(const std::vector<Channel>& channels, const Record& record) {
    std::string text =
        fmt::format("{:<24} {:>8} {:>12} {:>12} {:>12} {:>12} {:>12} {:>11} {:>11}\n", "CHANNEL",
                    "SAMPLES", "MIN", "MAX", "MEAN", "RMS", "FREQUENCY", "OVERSHOOT", "SETTLING");
    for (std::size_t i = 0; i < channels.size(); ++i) {
        const std::string& unit = channels[i].unit;
        const Measurements found =
            measure(record.samples[i], record.begin_ns, record.end_ns, record.step_ns());
        text += fmt::format(
            "{:<24} {:>8} {:>12} {:>12} {:>12} {:>12} {:>12} {:>11} {:>11}\n", channels[i].name,
            found.count, format_measured(found.min, unit), format_measured(found.max, unit),
            format_measured(found.mean, unit), format_measured(found.rms, unit),
            format_measured(found.frequency_hz, "Hz"),
            format_measured(found.overshoot_percent, "%"), format_measured(found.settling_s, "s"));
    }
    return text;
}

}  // namespace hal::tools
