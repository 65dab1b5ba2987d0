// SPDX-License-Identifier: MIT
#include "scope/picture.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/core.h>
#include <optional>

#include "cli/cut_text.hpp"
#include "scope/measure.hpp"
#include "text/numbers.hpp"

namespace hal::tools {

namespace {

constexpr std::uint8_t colours[] = {214, 45, 118, 205, 227, 141, 203, 51, 180, 84, 219, 75};
constexpr std::uint8_t grid_colour = 238;
constexpr std::uint8_t trigger_colour = 244;
constexpr std::uint8_t cursor_colour = 255;

constexpr const char* help_text[] = {
    "space      run, stop                    1-9, Tab   select a channel",
    "u          auto: free without trigger   + -        scale of the channel",
    "n          normal: only by the trigger  PgUp PgDn  move the channel",
    "s          single: one record           a  A       fit the channel, all channels",
    "r          roll, through 20 s or more   x          hide or show the channel",
    "f          force a record               [ ]        time per division",
    "t          next kind of trigger         < >        time before the trigger",
    "o          trigger on this channel      c          cursors: first, second, off",
    "up down    trigger level, Shift: 10x    left right move the cursor a sample, Shift: 10",
    "m          measurements on, off         w          write CSV and SVG",
    "q          quit",
};

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

std::uint8_t ScopePicture::colour_of(std::size_t channel) const {
    return colour_ ? colours[channel % std::size(colours)] : 0;
}

std::string ScopePicture::status_line(const Record& record, std::uint64_t lost) const {
    const std::int64_t total = acquisition_.pre_ns() + acquisition_.post_ns();
    const auto& trigger = acquisition_.trigger();
    std::string text = fmt::format(
        " {} {}  {}/div  trigger {}", name_of(acquisition_.mode()), name_of(acquisition_.state()),
        format_duration(static_cast<double>(total) / divisions_x),
        trigger ? format_trigger(*trigger, acquisition_.channels()) : "none");
    if (view_.rolls()) {
        text += acquisition_.mode() == Mode::roll ? "" : "  rolls";
    } else if (acquisition_.record() && acquisition_.mode() != Mode::roll) {
        if (record.triggered) {
            const auto age_ns =
                std::max<std::int64_t>(acquisition_.now_ns() - record.trigger_ns, 0);
            text += fmt::format("  {} ago", format_duration(static_cast<double>(age_ns)));
        } else {
            text += "  untriggered";
        }
        text += fmt::format("  record {}", acquisition_.finished());
    }
    if (lost > 0) {
        text += fmt::format("  LOST {} samples", lost);
    }
    return text;
}

std::string ScopePicture::cursor_values(const Record& record, std::size_t channel) const {
    const Channel& about = acquisition_.channels()[channel];
    const Samples& samples = record.samples[channel];
    const auto& at_ns = view_.cursors().at_ns;
    const auto first = value_at(samples, record.trigger_ns + at_ns[0], about.stepped);
    const auto second = value_at(samples, record.trigger_ns + at_ns[1], about.stepped);
    const auto change = first && second ? std::optional(*second - *first) : std::nullopt;
    return fmt::format("y1 {}  y2 {}  dy {}  ", format_measured(first, about.unit),
                       format_measured(second, about.unit), format_measured(change, about.unit));
}

std::string ScopePicture::channel_line(const Record& record, std::size_t channel) const {
    const Channel& about = acquisition_.channels()[channel];
    const ChannelView& trace = view_.traces()[channel];
    const Samples& samples = record.samples[channel];
    const ScopeView::Cursors& cursors = view_.cursors();
    const char* const mark = channel == view_.selected() ? ">" : " ";
    const char* const hidden = trace.shown ? "" : " hidden";
    std::string text = fmt::format("{}{} {:<20} {:>10}/div{}  ", mark, channel + 1, about.name,
                                   format_measured(trace.per_division, about.unit), hidden);
    if (cursors.on) {
        text += cursor_values(record, channel);
    }
    if (!view_.measures()) {
        if (samples.empty()) return text + "no sample";
        return text + format_measured(samples.back().value, about.unit);
    }
    std::int64_t begin_ns = record.begin_ns;
    std::int64_t end_ns = record.end_ns;
    if (cursors.on) {
        const auto [from, to] = std::minmax(cursors.at_ns[0], cursors.at_ns[1]);
        begin_ns = record.trigger_ns + from;
        end_ns = record.trigger_ns + to;
    }
    const Measurements found = measure(samples, begin_ns, end_ns, record.step_ns());
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

void ScopePicture::draw_grid(Raster& raster) const {
    const auto dot = [](std::size_t i, std::size_t divisions, std::size_t size) {
        return std::min(i * size / divisions, size - 1);
    };
    constexpr std::size_t dots_y = divisions_y * 4;
    for (std::size_t i = 0; i <= divisions_x; ++i) {
        for (std::size_t j = 0; j <= dots_y; ++j) {
            raster.set(dot(i, divisions_x, raster.width()), dot(j, dots_y, raster.height()),
                       colour_ ? grid_colour : 0);
        }
    }
}

/// The trigger level, in the scale of its channel.
void ScopePicture::draw_level(Raster& raster) const {
    const auto& trigger = acquisition_.trigger();
    if (!trigger || trigger->source >= view_.traces().size()) return;
    if (acquisition_.mode() == Mode::roll) return;
    const ChannelView& trace = view_.traces()[trigger->source];
    const auto height = static_cast<double>(raster.height());
    const double above_centre = (trigger->level - trace.centre) / trace.per_division;
    const double y = std::round((height - 1) / 2 - above_centre * height / divisions_y);
    if (y < 0 || y >= 1e6) return;
    for (std::size_t x = 0; x < raster.width(); x += 6) {
        raster.set(x, static_cast<std::size_t>(y), colour_of(trigger->source));
    }
}

/// A vertical line at a time of the record; nothing before its begin.
void ScopePicture::draw_time(Raster& raster, const Record& record, std::int64_t time_ns,
                             std::size_t step, std::uint8_t colour) const {
    const auto duration_ns = std::max<std::int64_t>(record.end_ns - record.begin_ns, 1);
    const double x =
        std::round(static_cast<double>(time_ns - record.begin_ns) /
                   static_cast<double>(duration_ns) * static_cast<double>(raster.width() - 1));
    if (x < 0) return;
    for (std::size_t y = 0; y < raster.height(); y += step) {
        raster.set(static_cast<std::size_t>(x), y, colour_ ? colour : 0);
    }
}

void ScopePicture::draw_cursors(Raster& raster, const Record& record) const {
    if (!view_.cursors().on) return;
    for (const std::int64_t at : view_.cursors().at_ns) {
        draw_time(raster, record, record.trigger_ns + at, 1, cursor_colour);
    }
}

void ScopePicture::draw_trace(Raster& raster, const Record& record, std::size_t channel) const {
    const ChannelView& trace = view_.traces()[channel];
    const bool stepped = acquisition_.channels()[channel].stepped;
    const std::uint8_t colour = colour_of(channel);
    const double per_ns =
        static_cast<double>(raster.width() - 1) /
        static_cast<double>(std::max<std::int64_t>(record.end_ns - record.begin_ns, 1));
    const double middle = static_cast<double>(raster.height() - 1) / 2;
    const double scale = static_cast<double>(raster.height()) / divisions_y / trace.per_division;
    bool has_last = false;
    double last_x = 0;
    double last_y = 0;
    for (const Sample& sample : record.samples[channel]) {
        if (!std::isfinite(sample.value)) {
            has_last = false;
            continue;
        }
        const double x =
            std::max(0.0, static_cast<double>(sample.time_ns - record.begin_ns) * per_ns);
        const double y = middle - (sample.value - trace.centre) * scale;
        if (!has_last) {
            line(raster, x, y, x, y, colour);
        } else if (stepped) {
            line(raster, last_x, last_y, x, last_y, colour);
            line(raster, x, last_y, x, y, colour);
        } else {
            line(raster, last_x, last_y, x, y, colour);
        }
        has_last = true;
        last_x = x;
        last_y = y;
    }
    if (has_last && stepped) {
        line(raster, last_x, last_y, static_cast<double>(raster.width() - 1), last_y, colour);
    }
}

/// An arrow with the number of each channel that leaves the picture, at the right of its upper or
/// lower edge.
void ScopePicture::draw_arrows(Raster& raster, const Record& record, std::size_t columns,
                               std::size_t rows) const {
    constexpr double half = divisions_y / 2.0;
    const auto draw = [&](std::size_t channel, std::size_t row, const char* sign,
                          std::size_t& column) {
        const std::string text = std::to_string(channel + 1);
        if (column < text.size() + 2) return;
        raster.write(--column, row, sign, colour_of(channel));
        for (std::size_t i = text.size(); i-- > 0;) {
            raster.write(--column, row, std::string(1, text[i]), colour_of(channel));
        }
        --column;
    };
    std::size_t above_column = columns;
    std::size_t below_column = columns;
    for (std::size_t i = 0; i < view_.traces().size(); ++i) {
        const ChannelView& trace = view_.traces()[i];
        if (!trace.shown) continue;
        bool above = false;
        bool below = false;
        for (const Sample& sample : record.samples[i]) {
            const double divisions = (sample.value - trace.centre) / trace.per_division;
            above = above || divisions > half;
            below = below || divisions < -half;
        }
        if (above) {
            draw(i, 0, unicode_ ? "\u25b2" : "^", above_column);
        }
        if (below) {
            draw(i, rows - 1, unicode_ ? "\u25bc" : "v", below_column);
        }
    }
}

std::vector<std::string> ScopePicture::help(std::size_t columns, std::size_t rows) const {
    std::vector<std::string> lines;
    for (const char* text : help_text) {
        if (lines.size() == rows) break;
        lines.push_back(fit_text(text, columns));
    }
    lines.resize(rows);
    return lines;
}

std::vector<std::string> ScopePicture::traces(const Record& record, std::size_t columns,
                                              std::size_t rows) const {
    Raster raster(columns, rows, unicode_);
    draw_grid(raster);
    if (record.triggered) {
        draw_time(raster, record, record.trigger_ns, 2, trigger_colour);
    }
    draw_level(raster);
    draw_cursors(raster, record);
    const std::size_t selected = view_.selected();
    for (std::size_t i = 0; i < view_.traces().size(); ++i) {
        if (i != selected && view_.traces()[i].shown) {
            draw_trace(raster, record, i);
        }
    }
    if (view_.traces()[selected].shown) {
        draw_trace(raster, record, selected);
    }
    draw_arrows(raster, record, columns, rows);
    return colour_ ? raster.coloured_rows() : raster.rows();
}

/// The message, the cursors, or the keys.
std::string ScopePicture::last_line() const {
    if (!view_.message().empty()) return view_.message();
    const ScopeView::Cursors& cursors = view_.cursors();
    if (!cursors.on) {
        return " ? help  space run/stop  u auto  n normal  s single  r roll  t trigger  a fit  c "
               "cursors  w write  q quit";
    }
    const auto seconds = [](std::int64_t ns) {
        return format_measured(static_cast<double>(ns) * 1e-9, "s");
    };
    const std::int64_t apart = cursors.at_ns[1] - cursors.at_ns[0];
    std::optional<double> frequency_hz;
    if (apart != 0) {
        frequency_hz = 1e9 / static_cast<double>(apart);
    }
    return fmt::format(" cursors: t1 {}  t2 {}  dt {}  1/dt {}", seconds(cursors.at_ns[0]),
                       seconds(cursors.at_ns[1]), seconds(apart),
                       format_measured(frequency_hz, "Hz"));
}

std::vector<std::string> ScopePicture::lines(std::size_t columns, std::size_t rows,
                                             std::uint64_t lost) const {
    if (columns < min_columns || rows < min_rows) {
        return {fit_text(fmt::format("too small: {} x {}, the scope needs {} x {}", columns, rows,
                                     min_columns, min_rows),
                         columns)};
    }
    const Record record = view_.shown();
    std::vector<std::string> lines{fit_text(status_line(record, lost), columns)};
    if (colour_) {
        lines[0] = "\033[7m" + lines[0];
    }
    const std::size_t listed = std::min(view_.traces().size(), rows / 3);
    const std::size_t height = rows - listed - 2;
    const std::vector<std::string> middle =
        view_.help() ? help(columns, height) : traces(record, columns, height);
    lines.insert(lines.end(), middle.begin(), middle.end());
    const std::size_t selected = view_.selected();
    const std::size_t first = selected >= listed ? selected + 1 - listed : 0;
    for (std::size_t i = first; i < first + listed; ++i) {
        const std::string text = fit_text(channel_line(record, i), columns);
        lines.push_back(colour_ ? fmt::format("\033[38;5;{}m{}", colour_of(i), text) : text);
    }
    lines.push_back(fit_text(last_line(), columns));
    return lines;
}

}  // namespace hal::tools
