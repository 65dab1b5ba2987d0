// SPDX-License-Identifier: MIT
// `hal scope`: an oscilloscope for a running instance, in the terminal or writing one record to
// files.
#include "scope/scope.hpp"

#include <algorithm>
#include <chrono>
#include <ctime>
#include <fmt/core.h>
#include <optional>
#include <poll.h>
#include <unistd.h>

#include "cli/filter.hpp"
#include "cli/output.hpp"
#include "cli/screen.hpp"
#include "cli/signals.hpp"
#include "scope/chart.hpp"
#include "scope/input.hpp"
#include "scope/view.hpp"
#include "text/numbers.hpp"

namespace hal::tools {

namespace {

using Clock = std::chrono::steady_clock;
constexpr auto frame_time = std::chrono::milliseconds(66);  // 15 frames/s
constexpr int key_wait_ms = 30;  // then a lone Esc is a key

/// The samples of the instance on their way into the acquisition.
class Source {
public:
    /// Attaches to the names and the trigger's source. Returns false after printing the error.
    bool attach(const ScopeOptions& options) {
        std::string problem;
        TriggerText text;
        if (!options.trigger.empty()) {
            text = read_trigger(options.trigger);
            if (!text.problem.empty()) return fail(options, text.problem) == 0;
        }
        if (!input_.connect(options.name, problem)) return fail(options, problem) == 0;
        std::vector<std::string> names = input_.expand(options.words, problem);
        if (!problem.empty()) return fail(options, problem) == 0;
        if (!options.trigger.empty()) {
            names.push_back(text.name);
        }
        if (!input_.attach(names, options.every, problem)) return fail(options, problem) == 0;
        acquisition_.emplace(input_.channels(), options.pre_ns, options.post_ns);
        if (options.trigger.empty()) return true;
        const auto& channels = input_.channels();
        const auto source =
            std::find_if(channels.begin(), channels.end(),
                         [&](const Channel& channel) { return channel.name == text.name; });
        text.trigger.source = source == channels.end()
                                  ? channels.size() - 1
                                  : static_cast<std::size_t>(source - channels.begin());
        if (!text.has_level && !channels[text.trigger.source].bit) {
            return fail(options, fmt::format("'{0}' is not a bit: the trigger needs a level; type: "
                                             "--trigger '{0} > 0'",
                                             text.name)) == 0;
        }
        acquisition_->set_trigger(text.trigger);
        return true;
    }

    /// Takes what has come, and waits for it up to `timeout_ms`. Returns false when the connection
    /// is lost.
    bool take(int timeout_ms) {
        return input_.take(timeout_ms, [this](std::size_t channel, Sample sample) {
            acquisition_->feed(channel, sample);
        }, [this](const Input::Batch& batch) {
            if (batch.lost) {
                acquisition_->gap();
            }
        }, [this](const Input::Batch& batch) { acquisition_->progress(batch.until_ns); });
    }

    Acquisition& acquisition() { return *acquisition_; }
    const Input& input() const { return input_; }

private:
    Input input_;
    std::optional<Acquisition> acquisition_;
};

std::string title_of(const Acquisition& acquisition, const Record& record) {
    return record.triggered ? format_trigger(*acquisition.trigger(), acquisition.channels())
                            : "untriggered";
}

/// Writes a file, or standard output for "-". Returns an error message, or an empty string.
std::string write_to(const std::string& path, const std::string& text) {
    if (path == "-") return print(text) ? "" : "cannot write to standard output";
    return write_file(path, text);
}

int write_files(const ScopeOptions& options, const Acquisition& acquisition) {
    const Record& record = *acquisition.record();
    const std::string svg =
        chart_svg(acquisition.channels(), record, title_of(acquisition, record));
    std::string why;
    if (!options.svg.empty()) {
        why = write_to(options.svg, svg);
    }
    if (why.empty() && !options.csv.empty()) {
        why = write_to(options.csv, chart_csv(acquisition.channels(), record));
    }
    if (why.empty() && !options.png.empty()) {
        std::string png;
        why = run_filter({"rsvg-convert", "--format=png"}, svg, png, "librsvg2-bin");
        if (!why.empty()) {
            why = fmt::format("cannot draw '{}': {} (or write a .svg file: --svg FILE)",
                              options.png, why);
        }
        if (why.empty()) {
            why = write_to(options.png, png);
        }
    }
    return why.empty() ? 0 : fail(options, why);
}

/// Returns the reason for a missing record.
std::string no_record(const ScopeOptions& options, Source& source) {
    const Acquisition& acquisition = source.acquisition();
    const std::string duration = format_duration(static_cast<double>(options.timeout_ns));
    if (source.input().rows() == 0) {
        return fmt::format(
            "no sample in {}: no thread runs that uses '{}'; see: hal shell show thread", duration,
            options.words.front());
    }
    if (!acquisition.trigger()) {
        return fmt::format("the record is not complete after {}; type a longer --timeout",
                           duration);
    }
    const TriggerSearch& search = *acquisition.search();
    const Trigger& trigger = *acquisition.trigger();
    const std::string& plain = acquisition.channels()[trigger.source].name;
    const std::string name = trigger.magnitude ? "|" + plain + "|" : plain;
    if (acquisition.state() == State::triggered) {
        return fmt::format(
            "triggered, but the record is not complete after {}; type a longer --timeout",
            duration);
    }
    std::string range =
        fmt::format("{} was between {:g} and {:g}", name, search.min(), search.max());
    if (search.min() > search.max()) {
        range = fmt::format("'{}' had no value", name);
    } else if (search.min() == search.max()) {
        range = fmt::format("{} was {:g}", name, search.min());
    }
    return fmt::format("no trigger '{}' in {}: {}; type another level, or a longer --timeout",
                       format_trigger(trigger, acquisition.channels()), duration, range);
}

int run_once(const ScopeOptions& options, Source& source) {
    Acquisition& acquisition = source.acquisition();
    acquisition.set_mode(Mode::single);
    const auto end = Clock::now() + std::chrono::nanoseconds(options.timeout_ns);
    while (acquisition.finished() == 0) {
        const auto left =
            std::chrono::duration_cast<std::chrono::milliseconds>(end - Clock::now()).count();
        if (left <= 0) return fail(options, no_record(options, source));
        if (!source.take(static_cast<int>(std::min<std::int64_t>(left, 1000)))) {
            return fail(options, source.input().end_reason());
        }
    }
    const Record& record = *acquisition.record();
    if (options.svg.empty() && options.csv.empty() && options.png.empty()) {
        ScopeView view(acquisition, unicode_terminal(), false);
        std::string text;
        for (const std::string& line : view.frame(100, 24 + acquisition.channels().size())) {
            text += line + "\n";
        }
        // without the line of keys
        return exit_code(print(text.substr(0, text.rfind('\n', text.size() - 2) + 1)));
    }
    if (const int status = write_files(options, acquisition); status != 0) return status;
    if (source.input().lost() > 0) {
        fail(options,
             fmt::format("{} samples were lost; type a larger --every", source.input().lost()));
    }
    return exit_code(options.csv == "-" ||
                     print(fmt::format("{}\n{}", title_of(acquisition, record),
                                       measurement_table(acquisition.channels(), record))));
}

/// Writes the shown record as CSV and SVG. Returns the sentence about it.
std::string save(const Acquisition& acquisition, const Record& record) {
    char stamp[32] = "";
    const std::time_t now = std::time(nullptr);
    std::tm parts{};
    std::strftime(stamp, sizeof stamp, "%Y%m%dT%H%M%S", ::localtime_r(&now, &parts));
    const std::string base = fmt::format("scope-{}", stamp);
    std::string why = write_file(
        base + ".svg", chart_svg(acquisition.channels(), record, title_of(acquisition, record)));
    if (why.empty()) {
        why = write_file(base + ".csv", chart_csv(acquisition.channels(), record));
    }
    return why.empty() ? fmt::format(" wrote {0}.svg and {0}.csv", base) : " " + why;
}

int run_interactive(const ScopeOptions& options, Source& source) {
    StopRequest stop;
    Acquisition& acquisition = source.acquisition();
    ScopeView view(acquisition, unicode_terminal(), colours(STDOUT_FILENO));
    const ScopeOptions usual;
    if (options.mode == "roll" && options.pre_ns == usual.pre_ns &&
        options.post_ns == usual.post_ns) {
        view.key({Code::character, 'r', false});
    }
    std::string ended;
    {
        Screen screen;
        bool quit = false;
        bool dirty = true;
        auto next_frame = Clock::now();
        while (!quit && !stop.requested()) {
            pollfd waiting[] = {{STDIN_FILENO, POLLIN, 0},
                                {source.input().fd(), POLLIN, 0},
                                {stop.fd(), POLLIN, 0}};
            ::poll(waiting, 3, key_wait_ms);
            for (const Key& key : screen.keys((waiting[0].revents & POLLIN) != 0)) {
                const auto action = view.key(key);
                quit = quit || action == ScopeView::Action::quit;
                if (action == ScopeView::Action::save) {
                    view.say(save(acquisition, view.shown()));
                }
                dirty = true;
            }
            if ((waiting[0].revents & (POLLHUP | POLLERR)) != 0) {
                quit = true;
            }
            if (!source.take(0)) {
                ended = source.input().end_reason();
                break;
            }
            dirty = screen.measure() || dirty;
            if (!dirty && Clock::now() < next_frame) continue;
            if (!screen.draw(view.frame(screen.columns(), screen.rows(), source.input().lost()))) {
                quit = true;
            }
            next_frame = Clock::now() + frame_time;
            dirty = false;
        }
    }
    return ended.empty() ? 0 : fail(options, ended);
}

}  // namespace

int run_scope(const ScopeOptions& options) {
    static constexpr std::pair<std::string_view, Mode> modes[] = {{"auto", Mode::automatic},
                                                                  {"normal", Mode::normal},
                                                                  {"single", Mode::single},
                                                                  {"roll", Mode::roll}};
    const auto* const mode = std::find_if(std::begin(modes), std::end(modes), [&](const auto& one) {
        return one.first == (options.mode.empty() ? "auto" : options.mode);
    });
    if (mode == std::end(modes)) {
        return fail(options,
                    fmt::format("invalid --mode '{}'; type: --mode auto, normal, single or roll",
                                options.mode));
    }
    const bool files = !options.svg.empty() || !options.csv.empty() || !options.png.empty();
    if (files && !options.mode.empty()) {
        return fail(options,
                    "--mode is for the terminal: a file gets the first record; leave --mode out");
    }
    Source source;
    if (!source.attach(options)) return 1;
    if (files || !has_screen()) return run_once(options, source);
    source.acquisition().set_mode(mode->second);
    return run_interactive(options, source);
}

}  // namespace hal::tools
