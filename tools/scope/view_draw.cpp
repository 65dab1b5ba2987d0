// SPDX-License-Identifier: MIT
// The scope's frame: a status line, the picture, a line per channel, the keys.
#include <algorithm>
#include <cmath>
#include <fmt/core.h>

#include "scope/measure.hpp"
#include "scope/view.hpp"
#include "text/glyphs.hpp"
#include "text/numbers.hpp"

namespace hal::tools {

namespace {

constexpr std::size_t least_columns = 40;
constexpr std::size_t least_rows = 10;
constexpr std::uint8_t colours[] = {214, 45, 118, 205, 227, 141, 203, 51, 180, 84, 219, 75};
constexpr std::uint8_t grid_colour = 238;
constexpr std::uint8_t trigger_colour = 244;
constexpr std::uint8_t cursor_colour = 255;

constexpr const char* help_text[] = {
    "space      run, stop                    1-9, Tab   select a channel",
    "u          auto: free without trigger   + -        scale of the channel",
    "n          normal: only by the trigger  PgUp PgDn  move the channel",
    "s          single: one record           a  A       fit the channel, all channels",
    "r          roll                         x          hide or show the channel",
    "f          force a record               [ ]        time per division",
    "t          next kind of trigger         < >        time before the trigger",
    "o          trigger on this channel      c          cursors: first, second, off",
    "up down    trigger level, Shift: 10x    left right move the cursor a sample, Shift: 10",
    "m          measurements on, off         w          write CSV and SVG",
    "q          quit",
};

/// Cuts to `width` terminal columns, and fills.
std::string fitted(std::string_view text, std::size_t width) {
    std::string out;
    std::size_t used = 0;
    for (std::size_t at = 0; at < text.size();) {
        const Glyph glyph = glyph_at(text, at);
        if (used + glyph.columns > width) break;
        append_glyph(out, text, at, glyph);
        used += glyph.columns;
        at += glyph.bytes;
    }
    return out + std::string(width - used, ' ');
}

const char* name_of(Mode mode) {
    static constexpr const char* names[] = {"auto", "normal", "single", "roll"};
    return names[static_cast<std::size_t>(mode)];
}

const char* name_of(State state) {
    static constexpr const char* names[] = {"stopped", "filling", "armed", "triggered"};
    return names[static_cast<std::size_t>(state)];
}

/// A line between two points given in dots, clipped to the raster.
void line(Raster& raster, double x0, double y0, double x1, double y1, std::uint8_t colour) {
    const double high = static_cast<double>(raster.height());
    y0 = std::clamp(y0, -1.0, high);
    y1 = std::clamp(y1, -1.0, high);
    const int steps =
        std::max(1, static_cast<int>(std::ceil(std::max(std::abs(x1 - x0), std::abs(y1 - y0)))));
    for (int i = 0; i <= steps; ++i) {
        const double t = static_cast<double>(i) / steps;
        const double x = std::round(x0 + t * (x1 - x0));

        const double y = std::round(y0 + t * (y1 - y0));
        if (x >= 0 && y >= 0) {
            raster.set(static_cast<std::size_t>(x), static_cast<std::size_t>(y), colour);
        }
    }
}

}  // namespace

std::uint8_t ScopeView::colour_of(std::size_t channel) const {
    return colour_ ? colours[channel % std::size(colours)] : 0;
}

std::string ScopeView::status_line(const Record& record, std::uint64_t lost) const {
    const std::int64_t total = acquisition_.pre_ns() + acquisition_.post_ns();
    std::string text = fmt::format(
        " {} {}  {}/div  trigger {}", name_of(acquisition_.mode()), name_of(acquisition_.state()),
        format_duration(static_cast<double>(total) / divisions_x),
        acquisition_.trigger() ? format_trigger(*acquisition_.trigger(), acquisition_.channels())
                               : "none");
    if (acquisition_.record() && acquisition_.mode() != Mode::roll) {
        text += record.triggered
                    ? fmt::format("  {} ago",
                                  format_duration(static_cast<double>(std::max<std::int64_t>(
                                      acquisition_.now_ns() - record.trigger_ns, 0))))
                    : "  untriggered";
        text += fmt::format("  record {}", acquisition_.finished());
    }
    if (lost > 0) {
        text += fmt::format("  LOST {} samples", lost);
    }
    return text;
}

std::string ScopeView::channel_line(const Record& record, std::size_t channel) const {
    const Channel& about = acquisition_.channels()[channel];
    const ChannelView& trace = traces_[channel];
    const Samples& samples = record.samples[channel];
    std::string text = fmt::format(
        "{}{} {:<20} {:>10}/div{}  ", channel == selected_ ? ">" : " ", channel + 1, about.name,
        format_measured(trace.per_division, about.unit), trace.shown ? "" : " hidden");
    if (cursors_.on) {
        const auto first = value_at(samples, record.trigger_ns + cursors_.at_ns[0], about.stepped);
        const auto second = value_at(samples, record.trigger_ns + cursors_.at_ns[1], about.stepped);
        const auto change = first && second ? std::optional(*second - *first) : std::nullopt;
        text +=
            fmt::format("y1 {}  y2 {}  dy {}  ", format_measured(first, about.unit),
                        format_measured(second, about.unit), format_measured(change, about.unit));
    }
    if (!measures_) {
        return text +
               (samples.empty() ? "no sample" : format_measured(samples.back().value, about.unit));
    }
    const auto [from, to] = std::minmax(cursors_.at_ns[0], cursors_.at_ns[1]);
    const Measurements found =
        cursors_.on
            ? measure(samples, record.trigger_ns + from, record.trigger_ns + to, record.trigger_ns)
            : measure(samples, record.begin_ns, record.end_ns, record.trigger_ns);
    text +=
        fmt::format("min {}  max {}  mean {}  rms {}", format_measured(found.min, about.unit),
                    format_measured(found.max, about.unit), format_measured(found.mean, about.unit),
                    format_measured(found.rms, about.unit));
    if (found.frequency_hz) {
        text += fmt::format("  {}", format_measured(found.frequency_hz, "Hz"));
    }
    if (found.overshoot_percent) {
        text +=
            fmt::format("  overshoot {}  settles {}", format_measured(found.overshoot_percent, "%"),
                        format_measured(found.settling_s, "s"));
    }
    return text;
}

void ScopeView::draw_grid(Raster& raster, const Record& record) const {
    const std::size_t width = raster.width();
    const std::size_t height = raster.height();
    const auto part = [](std::size_t i, std::size_t n, std::size_t all) {
        return std::min(i * all / n, all - 1);
    };
    for (std::size_t i = 0; i <= divisions_x; ++i) {
        for (std::size_t j = 0; j <= divisions_y * 4; ++j) {
            raster.set(part(i, divisions_x, width), part(j, divisions_y * 4, height),
                       colour_ ? grid_colour : 0);
        }
    }
    const auto column = [&](std::int64_t time_ns) {
        return static_cast<double>(time_ns - record.begin_ns) /
               static_cast<double>(std::max<std::int64_t>(record.end_ns - record.begin_ns, 1)) *
               static_cast<double>(width - 1);
    };
    const auto vertical = [&](std::int64_t time_ns, std::size_t every, std::uint8_t colour) {
        const double x = std::round(column(time_ns));
        for (std::size_t y = 0; x >= 0 && y < height; y += every) {
            raster.set(static_cast<std::size_t>(x), y, colour_ ? colour : 0);
        }
    };
    if (record.triggered) {
        vertical(record.trigger_ns, 2, trigger_colour);
    }
    if (const auto& trigger = acquisition_.trigger();
        trigger && trigger->source < traces_.size() && acquisition_.mode() != Mode::roll) {
        const ChannelView& trace = traces_[trigger->source];
        const double middle = static_cast<double>(height - 1) / 2;
        const double y = std::round(middle - (trigger->level - trace.centre) / trace.per_division *
                                                 static_cast<double>(height) / divisions_y);
        for (std::size_t x = 0; y >= 0 && y < 1e6 && x < width; x += 6) {
            raster.set(x, static_cast<std::size_t>(y), colour_of(trigger->source));
        }
    }
    if (cursors_.on) {
        for (const std::int64_t at : cursors_.at_ns) {
            vertical(record.trigger_ns + at, 1, cursor_colour);
        }
    }
}

void ScopeView::draw_trace(Raster& raster, const Record& record, std::size_t channel) const {
    const ChannelView& trace = traces_[channel];
    const bool stepped = acquisition_.channels()[channel].stepped;
    const double per_ns =
        static_cast<double>(raster.width() - 1) /
        static_cast<double>(std::max<std::int64_t>(record.end_ns - record.begin_ns, 1));
    const double middle = static_cast<double>(raster.height() - 1) / 2;
    const double scale = static_cast<double>(raster.height()) / divisions_y / trace.per_division;
    bool any = false;
    double last_x = 0;
    double last_y = 0;
    for (const Sample& sample : record.samples[channel]) {
        if (!std::isfinite(sample.value)) {
            any = false;
            continue;
        }
        const double x =
            std::max(0.0, static_cast<double>(sample.time_ns - record.begin_ns) * per_ns);

        const double y = middle - (sample.value - trace.centre) * scale;
        if (any && stepped) {
            line(raster, last_x, last_y, x, last_y, colour_of(channel));
        }
        line(raster, any && !stepped ? last_x : x, any ? last_y : y, x, y, colour_of(channel));
        any = true;
        last_x = x;
        last_y = y;
    }
    if (any && stepped) {
        line(raster, last_x, last_y, static_cast<double>(raster.width() - 1), last_y,
             colour_of(channel));
    }
}

std::vector<std::string> ScopeView::frame(std::size_t columns, std::size_t rows,
                                          std::uint64_t lost) {
    if (columns < least_columns || rows < least_rows) {
        return {fitted(fmt::format("too small: {} x {}, the scope needs {} x {}", columns, rows,
                                   least_columns, least_rows),
                       columns)};
    }
    const Record record = shown();
    if (!fitted_ &&
        std::any_of(record.samples.begin(), record.samples.end(),
                    [](const Samples& samples) { return samples.size() > 1; }) &&
        (acquisition_.record() || acquisition_.state() == State::armed)) {
        fit_all();
        fitted_ = true;
    }
    std::vector<std::string> lines{fitted(status_line(record, lost), columns)};
    if (colour_) {
        lines[0] = "\033[7m" + lines[0];
    }
    const std::size_t listed = std::min(traces_.size(), rows / 3);
    const std::size_t high = rows - listed - 2;
    if (help_) {
        for (const char* text : help_text) {
            if (lines.size() < high + 1) {
                lines.push_back(fitted(text, columns));
            }
        }
        while (lines.size() < high + 1) {
            lines.emplace_back();
        }
    } else {
        Raster raster(columns, high, unicode_);
        draw_grid(raster, record);
        for (std::size_t i = 0; i < traces_.size(); ++i) {
            if (i != selected_ && traces_[i].shown) {
                draw_trace(raster, record, i);
            }
        }
        if (traces_[selected_].shown) {
            draw_trace(raster, record, selected_);
        }
        for (std::string& row : colour_ ? raster.coloured_rows() : raster.rows()) {
            lines.push_back(std::move(row));
        }
    }
    const std::size_t first = selected_ >= listed ? selected_ + 1 - listed : 0;
    for (std::size_t i = first; i < first + listed; ++i) {
        const std::string text = fitted(channel_line(record, i), columns);
        lines.push_back(colour_ ? fmt::format("\033[38;5;{}m{}", colour_of(i), text) : text);
    }
    const std::int64_t apart = cursors_.at_ns[1] - cursors_.at_ns[0];
    lines.push_back(fitted(
        !message_.empty() ? message_
        : cursors_.on
            ? fmt::format(
                  " cursors: t1 {}  t2 {}  dt {}  1/dt {}",
                  format_measured(static_cast<double>(cursors_.at_ns[0]) * 1e-9, "s"),
                  format_measured(static_cast<double>(cursors_.at_ns[1]) * 1e-9, "s"),
                  format_measured(static_cast<double>(apart) * 1e-9, "s"),
                  format_measured(
                      apart != 0 ? std::optional(1e9 / static_cast<double>(apart)) : std::nullopt,
                      "Hz"))
            : " ? help  space run/stop  u auto  n normal  s single  r roll  t trigger  a fit  c "
              "cursors  w write  q quit",
        columns));
    return lines;
}

}  // namespace hal::tools
