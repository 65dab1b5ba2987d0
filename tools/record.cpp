// SPDX-License-Identifier: MIT
// `hal record` and halsampler: what a sampler samples, as text.
#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <fmt/core.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include "options.hpp"
#include "say.hpp"
#include "signals.hpp"
#include "stream.hpp"

namespace hal::tools {

namespace {

using nlohmann::json;

double real_of(const json& value) {
    return value.is_string() ? std::strtod(value.get_ref<const std::string&>().c_str(), nullptr) : value.get<double>();
}

/// LinuxCNC's form: bits 0 and 1, floats with six decimals, a blank after each value.
void append_plain(std::string& to, hal_type type, const json& value) {
    if (type == HAL_TYPE_BIT) to += value.get<bool>() ? "1 " : "0 ";
    else if (type == HAL_TYPE_FLOAT) to += fmt::format("{:f} ", real_of(value));
    else to += value.dump() + " ";
}

/// Floats with as many digits as give the same value back.
void append_csv(std::string& to, hal_type type, const json& value) {
    if (type == HAL_TYPE_BIT) to += value.get<bool>() ? "1" : "0";
    else if (type == HAL_TYPE_FLOAT) to += fmt::format("{}", real_of(value));
    else to += value.dump();
}

std::string csv_field(const std::string& text) {
    if (text.find_first_of(",\"\n") == std::string::npos) return text;
    std::string quoted = "\"";
    for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
    return quoted + '"';
}

/// The signals linked to the columns, or the pins' own names.
std::string csv_header(Stream& stream, bool tag) {
    std::vector<std::string> names(stream.types.size());
    for (std::size_t i = 0; i < names.size(); ++i) names[i] = fmt::format("{}.pin.{}", stream.name, i);
    const json pins = stream.client->request({{"describe", "pin"}, {"patterns", json::array({stream.name + ".pin."})}});
    for (const json& pin : pins.value("objects", json::array()))
        if (const auto at = std::find(names.begin(), names.end(), pin.value("name", "")); at != names.end() && pin.contains("signal"))
            *at = pin["signal"];
    std::string line = tag ? "sample" : "";
    for (const std::string& name : names) line += (line.empty() ? "" : ",") + csv_field(name);
    return line + "\n";
}

class Lines {
public:
    Lines(const Stream& stream, const Options& options) : types_(stream.types), csv_(options.csv), tag_(options.tag) {}

    /// The records of a reply as text. A gap in the sample numbers is a line `overrun`; CSV shows it by the numbers only.
    std::string of(const json& reply) {
        std::string text;
        const json& records = reply.at("records");
        for (std::size_t i = 0; i < records.size(); ++i) {
            const auto number = reply.at("numbers").at(i).get<std::int64_t>();
            if (!csv_ && known_ && number != next_) text += "overrun\n";
            known_ = true;
            next_ = number + 1;
            if (tag_) text += fmt::format("{}{}", number, csv_ ? "" : " ");
            for (std::size_t c = 0; c < types_.size(); ++c) {
                if (csv_ && (tag_ || c > 0)) text += ',';
                (csv_ ? append_csv : append_plain)(text, types_[c], records[i].at(c));
            }
            text += '\n';
        }
        return text;
    }

private:
    const std::vector<hal_type>& types_;
    bool csv_, tag_, known_ = false;
    std::int64_t next_ = 0;
};

/// Takes records until there are enough, or somebody ends it. Returns the exit code.
int follow(Stream& stream, const Options& options, int descriptor) {
    StopRequest stop;
    stop.listen();
    const auto write = [&](const std::string& text) {
        if (write_all(descriptor, text)) return true;
        if (errno != EPIPE) fail(options, fmt::format("cannot write: {}", std::strerror(errno)));
        return false;
    };
    if (options.csv && !write(csv_header(stream, options.tag))) return 1;
    Lines lines(stream, options);
    std::uint64_t taken = 0;
    while (!stop.requested() && (options.count == 0 || taken < options.count)) {
        constexpr std::uint64_t at_once = 4096;
        const std::uint64_t wanted = options.count == 0 ? at_once : std::min(at_once, options.count - taken);
        const json reply = stream.client->request({{"stream", stream.name}, {"take", wanted}});
        if (!reply.value("ok", false)) { return fail(options, stream.lost()); }
        const std::size_t got = reply.at("records").size();
        if (!write(lines.of(reply))) return 1;
        taken += got;
        if (got == 0) stop.wait_ns(poll_ns);
    }
    return 0;
}

}  // namespace

int run_record(const Options& options) {
    Stream stream;
    if (!stream.open(options, "sampler")) return 1;
    if (stream.file.empty()) return follow(stream, options, STDOUT_FILENO);
    const int descriptor = ::open(stream.file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    if (descriptor < 0) return fail(options, fmt::format("cannot write '{}': {}", stream.file, std::strerror(errno)));
    const int status = follow(stream, options, descriptor);
    ::close(descriptor);
    return status;
}

}  // namespace hal::tools
