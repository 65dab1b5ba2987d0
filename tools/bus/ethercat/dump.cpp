// SPDX-License-Identifier: MIT
// `hal ethercat dump`: the datagrams on a wire or in a capture, one per line.
#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fmt/core.h>

#include "bus/ethercat/datagram_text.hpp"
#include "bus/ethercat/options.hpp"
#include "bus/ethercat/words.hpp"
#include "cli/output.hpp"
#include "cli/signals.hpp"
#include "ethercat/recorded/frame_directions.hpp"
#include "hal/clock.hpp"
#include "link/ethernet.hpp"
#include "link/ethernet_capture.hpp"

namespace hal::tools {

namespace {

using namespace hal::ethercat;

/// Prints the datagrams of frames.
class Dump {
public:
    Dump(const EthercatDumpOptions& options, bool is_live) : options_(options), is_live_(is_live) {}

    /// Returns false when nothing more is wanted.
    bool frame(std::int64_t time_ns, std::span<std::uint8_t> bytes) {
        FrameReader reader(bytes);
        if (!reader.valid()) return true;
        // what an interface receives has passed the slaves, the first of which marks its address
        const bool passed = is_live_ ? is_marked(bytes) : directions_.take(bytes).returned;
        if (first_ns_ < 0) {
            first_ns_ = time_ns;
        }
        ++frames_;
        std::string text;
        while (const auto d = reader.next()) {
            const std::string words = datagram_text(*d);
            const std::string address = datagram_address(*d, passed);
            if (!wanted(*d, words, address)) continue;
            text += options_.json ? json(time_ns, passed, *d, words)
                                  : line(time_ns, passed, *d, words, address);
            if (++datagrams_ == options_.count) break;
        }
        if (reader.malformed()) {
            text += fmt::format("{:12.6f}  malformed frame of {} bytes\n", seconds(time_ns),
                                bytes.size());
        }
        return (text.empty() || print(text)) &&
               (options_.count == 0 || datagrams_ < options_.count);
    }
    std::uint64_t frames() const { return frames_; }
    std::uint64_t datagrams() const { return datagrams_; }

private:
    static constexpr std::size_t max_bytes = 16;
    double seconds(std::int64_t time_ns) const {
        return static_cast<double>(time_ns - first_ns_) / 1e9;
    }
    bool wanted(const DatagramView& d, const std::string& words, const std::string& address) const {
        const auto contains = [&](const std::string& text) {
            return std::search(text.begin(), text.end(), options_.filter.begin(),
                               options_.filter.end(), [](char a, char b) {
                return std::tolower(static_cast<unsigned char>(a)) ==
                       std::tolower(static_cast<unsigned char>(b));
            }) != text.end();
        };
        return options_.filter.empty() || contains(to_string(d.command)) || contains(words) ||
               contains(address);
    }
    std::string line(std::int64_t time_ns, bool passed, const DatagramView& d,
                     const std::string& words, const std::string& address) const {
        const std::string location = is_logical(d.command) || d.command == Command::nop
                                         ? ""
                                         : fmt::format(" {:04X}", d.register_address());
        std::string bytes;
        for (std::size_t i = 0; i < std::min<std::size_t>(d.length, max_bytes); ++i) {
            bytes += fmt::format(" {:02X}", d.data[i]);
        }
        if (d.length > max_bytes) {
            bytes += " …";
        }
        std::string text = fmt::format("{:12.6f}  {}  {:4} {}{}  [{}]{}  WKC {}", seconds(time_ns),
                                       passed ? "<-" : "->", to_string(d.command), address,
                                       location, d.length, bytes, d.wkc());
        if (!words.empty()) {
            text += "  " + words;
        }
        return text + "\n";
    }
    std::string json(std::int64_t time_ns, bool passed, const DatagramView& d,
                     const std::string& words) const {
        return fmt::format(
            R"({{"time_s":{:.6f},"returned":{},"command":"{}","address":{},"register":{},"length":{},"wkc":{},"data":"{}","meaning":{}}})"
            "\n",
            seconds(time_ns), passed, to_string(d.command),
            is_logical(d.command) ? d.address : d.position(),
            is_logical(d.command) ? "null" : std::to_string(d.register_address()), d.length,
            d.wkc(), hex_text({d.data, d.length}), words.empty() ? "null" : json_string(words));
    }

    const EthercatDumpOptions& options_;
    const bool is_live_;
    FrameDirections directions_;
    std::int64_t first_ns_ = -1;
    std::uint64_t frames_ = 0;
    std::uint64_t datagrams_ = 0;
};

int dump_file(const EthercatDumpOptions& options, const std::string& file) {
    const ethernet::Capture capture = ethernet::read_capture(file);
    if (!capture.problem.empty() && capture.frames.empty()) {
        return fail(options, fmt::format("{}: {}", file, capture.problem));
    }
    Dump dump(options, false);
    for (ethernet::Captured frame : capture.frames) {
        if (!dump.frame(frame.time_ns, frame.bytes)) break;
    }
    if (!capture.problem.empty()) {
        return fail(options, fmt::format("{}: {}", file, capture.problem));
    }
    if (dump.frames() == 0) {
        return fail(options, fmt::format("{}: none of its {} frames is an EtherCAT frame", file,
                                         capture.frames.size()));
    }
    return 0;
}

}  // namespace

int run_ethercat_dump(const EthercatDumpOptions& options) {
    if (options.words.size() != 1) {
        return fail(options,
                    "type: hal ethercat dump eth:INTERFACE, or a capture: FILE.pcapng, FILE.pcap");
    }
    const std::string& what = options.words.front();
    const ethernet::Description about = ethernet::describe(what);
    const bool is_capture = what.ends_with(".pcapng") || what.ends_with(".pcap");
    if (std::filesystem::is_regular_file(what) || (about.transport.empty() && is_capture)) {
        return dump_file(options, what);
    }
    if (about.in_memory) {
        return fail(options, fmt::format("'{}' is a segment in memory, which belongs to another "
                                         "process; record it with the component segment_record",
                                         what));
    }
    ethernet::Options how;
    how.types = {ethertype};
    how.promiscuous = true;
    how.policy = ethernet::Policy::block;
    StopRequest stop;
    auto opened = ethernet::open(what, how);
    if (!opened) return fail(options, opened.problem);
    Dump dump(options, !about.recorded);
    std::vector<std::uint8_t> bytes;
    const std::int64_t began = monotonic_ns();

    const std::int64_t end = options.for_ns >= 0 ? began + options.for_ns : INT64_MAX;
    for (bool more = true; more && !stop.wait_ns(0) && monotonic_ns() < end;) {
        opened.port->wait(std::min(end, monotonic_ns() + 50'000'000));
        while (more) {
            const auto arrival = opened.port->receive(monotonic_ns());
            if (!arrival) break;
            bytes.assign(arrival->bytes.begin(), arrival->bytes.end());
            more = dump.frame(arrival->time_ns, bytes);
        }
        if (about.recorded && !opened.port->statistics().up) {
            break;  // all of it was printed
        }
    }
    const std::uint64_t lost = opened.port->statistics().lost;
    if (lost != 0) {
        write_all(
            2, fmt::format("{} frames were lost here: the output could not keep up; use --filter\n",
                           lost));
    }
    if (dump.frames() == 0) {
        return fail(options, fmt::format("no EtherCAT frame arrived on {} within {:.1f} s", what,
                                         static_cast<double>(monotonic_ns() - began) / 1e9));
    }
    return 0;
}

}  // namespace hal::tools
