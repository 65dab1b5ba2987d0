// SPDX-License-Identifier: MIT
// `hal play` and halstreamer: lines of values into a streamer's FIFO.
#include "inspect/play.hpp"

#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <fmt/core.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include "base/types.hpp"
#include "cli/editor.hpp"
#include "cli/output.hpp"
#include "cli/signals.hpp"
#include "inspect/stream.hpp"

namespace hal::tools {

namespace {

using nlohmann::json;

/// Blanks or commas separate; `#` begins a comment.
std::vector<std::string> fields_of(std::string_view line) {
    constexpr std::string_view separators = " \t,;\r";
    line = line.substr(0, line.find('#'));
    std::vector<std::string> fields;
    for (std::size_t at = line.find_first_not_of(separators); at != line.npos;
         at = line.find_first_not_of(separators, at)) {
        const std::size_t end = std::min(line.find_first_of(separators, at), line.size());
        fields.emplace_back(line.substr(at, end - at));
        at = end;
    }
    return fields;
}

/// Returns the number of columns before the values in a table of `hal record --csv`: the sample
/// number and the time.
std::size_t leading_columns(const std::vector<std::string>& names) {
    std::size_t leading = 0;
    for (const char* const name : {"sample", "time_s"}) {
        leading += leading < names.size() && names[leading] == name;
    }
    return leading;
}

/// A line of column names, as `hal record --csv` begins with: commas, and no value where a value
/// should be.
bool header(const std::string& line, const std::vector<std::string>& fields, const Stream& stream) {
    if (line.find(',') == line.npos) return false;
    if (fields.size() > stream.types.size()) {
        return leading_columns(fields) == fields.size() - stream.types.size();
    }
    if (fields.size() < stream.types.size()) return false;
    for (std::size_t i = 0; i < fields.size(); ++i) {
        if (parse_value(stream.types[i], fields[i], LeadingZero::decimal).problem.empty()) {
            return false;
        }
    }
    return true;
}

/// Returns the error of a record, or an empty string.
std::string problem_of(const std::vector<std::string>& fields, const Stream& stream) {
    if (fields.size() != stream.types.size()) {
        return fmt::format("{} values, but '{}' has {} pins", fields.size(), stream.name,
                           stream.types.size());
    }
    for (std::size_t i = 0; i < fields.size(); ++i) {
        if (const Parsed value = parse_value(stream.types[i], fields[i], LeadingZero::decimal);
            !value.problem.empty()) {
            return fmt::format("value {} ({}): {}", i + 1, name(stream.types[i]), value.problem);
        }
    }
    return {};
}

/// Sends records, waiting for space. Returns false after an error, which it prints, or when it is
/// ended.
bool feed(Stream& stream, const PlayOptions& options, json records, const StopRequest& stop) {
    while (!records.empty()) {
        const json reply = stream.client->request({{"stream", stream.name}, {"records", records}});
        if (!reply.value("ok", false)) {
            fail(options, stream.problem(reply));
            return false;
        }
        const auto taken = reply.value("taken", std::ptrdiff_t{0});
        records.erase(records.begin(), records.begin() + taken);
        if (!records.empty() && taken == 0 && stop.wait_ns(poll_ns)) return false;
    }
    return true;
}

int follow(Stream& stream, const PlayOptions& options, int descriptor) {
    StopRequest stop;
    constexpr std::size_t at_once = 1000;
    LineReader input(descriptor, stop.fd());
    std::string line;
    json records = json::array();
    std::size_t leading = 0;
    for (std::size_t number = 1; input.read(line); ++number) {
        std::vector<std::string> fields = fields_of(line);
        if (number == 1 && header(line, fields, stream)) {
            leading = leading_columns(fields);
        } else if (!fields.empty()) {
            fields.erase(fields.begin(), fields.begin() + static_cast<std::ptrdiff_t>(
                                                              std::min(leading, fields.size())));
            if (const std::string problem = problem_of(fields, stream); !problem.empty()) {
                feed(stream, options, std::move(records), stop);  // what came before it was good
                return fail(options,
                            fmt::format("{}:{}: {}", stream.file.empty() ? "<stdin>" : stream.file,
                                        number, problem));
            }
            records.push_back(fields);
        }
        if (records.size() < at_once && input.waiting()) continue;
        if (!feed(stream, options, std::exchange(records, json::array()), stop)) {
            return exit_code(stop.requested());
        }
    }
    const bool fed = feed(stream, options, std::move(records), stop) || stop.requested();
    if (fed && input.error() != 0) {
        return fail(options, fmt::format("cannot read '{}': {}",
                                         stream.file.empty() ? "<stdin>" : stream.file,
                                         std::strerror(input.error())));
    }
    return exit_code(fed);
}

}  // namespace

int run_play(const PlayOptions& options) {
    Stream stream;
    if (!stream.open(options, "streamer")) return 1;
    if (stream.file.empty() || stream.file == "-") return follow(stream, options, STDIN_FILENO);
    const int descriptor = ::open(stream.file.c_str(), O_RDONLY | O_CLOEXEC);
    if (descriptor < 0) {
        return fail(options,
                    fmt::format("cannot read '{}': {}", stream.file, std::strerror(errno)));
    }
    const int status = follow(stream, options, descriptor);
    ::close(descriptor);
    return status;
}

}  // namespace hal::tools
