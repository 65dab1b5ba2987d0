// SPDX-License-Identifier: MIT
// `hal record` and halsampler: the samples of a sampler as text. Values without a sampler:
// record/recorder.hpp.
#include "inspect/record.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fmt/core.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include "cli/output.hpp"
#include "cli/signals.hpp"
#include "inspect/stream.hpp"
#include "link/record_file.hpp"
#include "record/csv_field.hpp"
#include "text/numbers.hpp"
#include "text/quoting.hpp"

namespace hal::tools {

namespace {

using nlohmann::json;

double real_of(const json& value) {
    return value.is_string() ? std::strtod(value.get_ref<const std::string&>().c_str(), nullptr)
                             : value.get<double>();
}

/// Returns a value as text, bits as 0 and 1. In CSV floats have the digits needed to read the same
/// value again; in LinuxCNC's form they have six decimals.
std::string value_text(hal_type type, const json& value, bool csv) {
    switch (type) {
    case HAL_TYPE_BIT: return value.get<bool>() ? "1" : "0";
    case HAL_TYPE_FLOAT: return fmt::format(fmt::runtime(csv ? "{}" : "{:f}"), real_of(value));
    default: return value.dump();
    }
}

/// The signals linked to the columns, or the pins' own names.
std::string csv_header(Stream& stream, bool tag) {
    std::vector<std::string> names(stream.types.size());
    for (std::size_t i = 0; i < names.size(); ++i) {
        names[i] = fmt::format("{}.pin.{}", stream.name, i);
    }
    const json pins = stream.client->request(
        {{"describe", "pin"}, {"patterns", json::array({stream.name + ".pin."})}});
    for (const json& pin : pins.value("objects", json::array())) {
        if (const auto at = std::find(names.begin(), names.end(), pin.value("name", ""));
            at != names.end() && pin.contains("signal")) {
            *at = pin["signal"];
        }
    }
    std::string line = tag ? "sample" : "";
    if (stream.timed) {
        line += line.empty() ? "time_s" : ",time_s";
    }
    for (const std::string& name : names) {
        append_item(line, csv_field(name), ",");
    }
    return line + "\n";
}

class Lines {
public:
    Lines(const Stream& stream, const RecordOptions& options)
        : types_(stream.types), csv_(options.csv), tag_(options.tag), timed_(stream.timed) {}

    /// Writes the records of a reply as lines. A line `overrun` marks lost records; CSV has no such
    /// lines, and its losses are counted.
    bool write(const json& reply, RecordFile& file) {
        const json& records = reply.at("records");
        const json losses = reply.value("lost_before", json::array());
        for (std::size_t i = 0; i < records.size(); ++i) {
            const std::uint64_t lost = i < losses.size() ? losses[i].get<std::uint64_t>() : 0;
            const bool overrun = known_ && lost != lost_;
            lost_in_all_ += overrun ? lost - lost_ : 0;
            known_ = true;
            lost_ = lost;
            const std::string text = (overrun && !csv_ ? "overrun\n" : "") + line(reply, i);
            if (!file.put(text)) return false;
        }
        return file.flush();
    }

    /// Returns a record as a line; a blank follows each value of LinuxCNC's form.
    std::string line(const json& reply, std::size_t i) const {
        const char* const separator = csv_ ? "," : " ";
        std::string line;
        if (tag_) {
            line = std::to_string(reply.at("numbers").at(i).get<std::int64_t>());
        }
        if (csv_ && timed_) {
            const auto ns = reply.at("times_ns").at(i).get<std::int64_t>();
            append_item(line, fmt::format("{}.{:09}", ns / 1'000'000'000, ns % 1'000'000'000),
                        separator);
        }
        const json& values = reply.at("records").at(i);
        for (std::size_t c = 0; c < types_.size(); ++c) {
            append_item(line, value_text(types_[c], values.at(c), csv_), separator);
        }
        return line + (csv_ ? "\n" : " \n");
    }

    /// Prints how many records are missing in a CSV, which does not show it.
    void report_losses() const {
        if (!csv_ || lost_in_all_ == 0) return;
        write_all(STDERR_FILENO, fmt::format("hal: {} lost, because the sampler was "
                                             "full: raise its depth\n",
                                             counted(lost_in_all_, "sample between the lines was",
                                                     "samples between the lines were")));
    }

private:
    const std::vector<hal_type>& types_;
    bool csv_, tag_, timed_, known_ = false;
    std::uint64_t lost_ = 0;  // before the newest record
    std::uint64_t lost_in_all_ = 0;
};

/// Takes records until the count is reached or the command is ended. Returns the exit code.
int follow(Stream& stream, const RecordOptions& options, RecordFile& file) {
    StopRequest stop;
    const std::size_t headers = options.csv ? 1 : 0;
    const auto lost = [&] {
        if (file.error() == EPIPE) return 1;
        const std::size_t records = file.records() - std::min(file.records(), headers);
        return fail(
            options,
            fmt::format("cannot write{}: {}; what was written ends with a whole line, after {}",
                        stream.file.empty() ? "" : " '" + stream.file + "'",
                        std::strerror(file.error()), counted(records, "record")));
    };
    if (options.csv && !(file.put(csv_header(stream, options.tag)) && file.flush())) return lost();
    Lines lines(stream, options);
    std::uint64_t taken = 0;
    while (!stop.requested() && (options.count == 0 || taken < options.count)) {
        constexpr std::uint64_t at_once = 4096;
        const std::uint64_t wanted =
            options.count == 0 ? at_once : std::min(at_once, options.count - taken);
        const json reply = stream.client->request({{"stream", stream.name}, {"take", wanted}});
        if (!reply.value("ok", false)) return fail(options, stream.problem(reply));
        const std::size_t got = reply.at("records").size();
        if (!lines.write(reply, file)) return lost();
        taken += got;
        if (got == 0) {
            stop.wait_ns(poll_ns);
        }
    }
    lines.report_losses();
    return file.close() ? 0 : lost();
}

bool has_wildcard(const std::string& word) {
    return word.find_first_of("*?[") != std::string::npos;
}

}  // namespace

int run_record(const RecordOptions& options) {
    const std::vector<std::string>& words = options.words;
    const bool channel = !words.empty() && parse_natural(words[0]);
    const bool named =
        !words.empty() && !channel && (words[0].ends_with(".mcap") || words.size() > 1);
    if (!options.classic && (named || options.values.asked())) {
        if (words.empty()) return fail(options, "missing file: hal record FILE.mcap NAMES");
        if (options.csv || options.tag || options.count != 0 || !options.channel.empty()) {
            return fail(options,
                        "--csv, --tag, --count and --channel are for a sampler; the ending of the "
                        "file chooses the format, --for the end");
        }
        Recording what = options.values;
        what.file = words[0];
        what.names.assign(words.begin() + 1, words.end());
        return record_values(options, instance_wanted(options.name), std::move(what));
    }
    if (!options.classic && words.size() == 1 && has_wildcard(words[0])) {
        return fail(options, fmt::format("'{0}' names values, not a file; name the file first: hal "
                                         "record FILE.mcap '{0}'",
                                         words[0]));
    }
    Stream stream;
    if (!stream.open(options, "sampler")) return 1;
    if (options.no_samples) return 0;
    if (stream.file.empty()) {
        RecordFile out(STDOUT_FILENO);
        return follow(stream, options, out);
    }
    RecordFile file(stream.file);
    if (file.error() != 0) {
        return fail(options,
                    fmt::format("cannot write '{}': {}", stream.file, std::strerror(file.error())));
    }
    return follow(stream, options, file);
}

}  // namespace hal::tools
