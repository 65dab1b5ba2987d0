// SPDX-License-Identifier: MIT
#include "bus/ethercat/ethercat_line.hpp"

#include <atomic>
#include <fmt/core.h>
#include <memory>
#include <thread>
#include <utility>
#include <vector>

#include "cli/output.hpp"
#include "cli/signals.hpp"
#include "ethercat/devices/registry.hpp"
#include "ethercat/esc/line.hpp"
#include "ethercat/esc/responder.hpp"
#include "ethercat/wire/al_status_codes.hpp"
#include "ethercat/wire/registers.hpp"
#include "hal/message_log.hpp"
#include "link/ethernet.hpp"
#include "link/system.hpp"
#include "text/numbers.hpp"
#include "text/quoting.hpp"

namespace hal::tools {

namespace {

using namespace hal::ethercat;

/// Copies AL status and its code out of the controllers, in the thread that serves the line.
class StatusCopy final : public esc::ServeControl {
public:
    explicit StatusCopy(std::size_t slaves) : status_(slaves) {}

    void work(esc::Line& line, std::int64_t) noexcept override {
        for (std::size_t n = 0; n < status_.size(); ++n) {
            esc::Controller& controller = line.controller(n);
            const std::uint8_t* code = controller.memory(registers::al_status_code);
            status_[n].store(
                controller.al_status() | static_cast<std::uint32_t>(code[0] | code[1] << 8) << 16,
                std::memory_order_relaxed);
        }
    }
    /// Returns AL status in the low half, its code in the high half. [any]
    std::uint32_t operator[](std::size_t slave) const noexcept {
        return status_[slave].load(std::memory_order_relaxed);
    }

private:
    std::vector<std::atomic<std::uint32_t>> status_;
};

std::unique_ptr<ethernet::Port> open_interface(const Options& options, const std::string& address) {
    const ethernet::Description about = ethernet::describe(address);
    if (about.in_memory) {
        fail(options, fmt::format("'{}' is a segment in memory, which other programs cannot open; "
                                  "write --link eth:enp3s0, or emulate the line in the "
                                  "netlist of the master: loadrt ethercat_segment link={}",
                                  address, address));
        return nullptr;
    }
    if (about.recorded) {
        fail(options, fmt::format("'{}' is a capture, which no master can reach; write --link "
                                  "eth:enp3s0 or --link udp:127.0.0.1",
                                  address));
        return nullptr;
    }
    ethernet::Options how;
    how.types = {0x88a4};
    how.promiscuous = how.listen = true;
    how.policy = ethernet::Policy::block;
    how.send_capacity = how.receive_capacity = 256;
    ethernet::Opened opened = ethernet::open(address, how);
    if (!opened) {
        fail(options, opened.problem);
    }
    return std::move(opened.port);
}

std::string state_text(std::uint32_t status) {
    const auto code = static_cast<std::uint16_t>(status >> 16);
    std::string text;
    switch (status & 0xf) {
    case 1: text = "INIT"; break;
    case 2: text = "PRE-OP"; break;
    case 3: text = "BOOT"; break;
    case 4: text = "SAFE-OP"; break;
    case 8: text = "OP"; break;
    default: text = fmt::format("AL status 0x{:04X}", status & 0xffff);
    }
    if ((status & 0x10) != 0) {
        const AlStatusCode* row = al_status(code);
        text += fmt::format(", error 0x{:04X}{}{}", code, row == nullptr ? "" : ": ",
                            row == nullptr ? "" : row->text);
    }
    return text;
}

/// Returns the terminals of an output device as text; empty for other devices.
std::string output_text(const devices::Device& device) {
    auto* io = dynamic_cast<const devices::IoBehaviour*>(&device.firmware->behaviour());
    if (io == nullptr) {
        return {};
    }
    std::string text;
    for (unsigned c = 0; c < io->channels(); ++c) {
        if (device.name == "digital_out") {
            text += io->output(c) != 0 ? '1' : '0';
        } else if (device.name == "analog_out") {
            text += fmt::format("{}{}", c == 0 ? "" : " ", io->output(c));
        }
    }
    return text;
}

/// Prints what changes on the line, each change with its time; of outputs that change all the time
/// the newest, with the number of the others.
class LineReporter {
public:
    LineReporter(const std::vector<devices::Device>& line, const StatusCopy& status,
                 std::int64_t began)
        : line_(line),
          status_(status),
          log_(hal::LinePrefix::time_since(began),
               [this](const std::string& changed) { text_ += changed; }),
          seen_(line.size(), 1),
          outputs_(line.size()) {
        for (std::size_t n = 0; n < line.size(); ++n) {
            outputs_[n] = output_text(line[n]);
        }
    }

    /// Returns false when standard output is closed.
    bool look(std::int64_t now) {
        const auto report = [&](std::size_t n, const char* kind, const std::string& what) {
            log_.print(hal::MessageSubject{fmt::format("{} of {}", kind, n), what},
                       fmt::format("slave {} ({}): {}", n, line_[n].name, what), now);
        };
        for (std::size_t n = 0; n < line_.size(); ++n) {
            const std::uint32_t status = status_[n];
            if (status == 0 || status == seen_[n]) continue;
            seen_[n] = status;
            report(n, "state", state_text(status));
        }
        for (std::size_t n = 0; n < line_.size(); ++n) {
            if (std::string words = output_text(line_[n]); words != outputs_[n]) {
                outputs_[n] = std::move(words);
                report(n, "outputs", "outputs " + outputs_[n]);
            }
        }
        log_.flush(now);
        return print_changes();
    }
    /// Prints what was only counted so far. Returns false when standard output is closed.
    bool finish() {
        log_.close();
        return print_changes();
    }

private:
    bool print_changes() {
        const std::string text = std::exchange(text_, {});
        return text.empty() || print(text);
    }

    const std::vector<devices::Device>& line_;
    const StatusCopy& status_;
    std::string text_;  // to be printed
    hal::MessageLog log_;
    std::vector<std::uint32_t> seen_;  // INIT is not reported at the start
    std::vector<std::string> outputs_;
};

/// Reads the description of the line. Returns false after printing what is wrong.
bool read_devices(const Options& options, std::vector<devices::Device>& to) {
    if (options.words.size() != 1) {
        fail(options, "one line per process; write one FILE");
        return false;
    }
    const std::string& path = options.words.front();
    std::string text;
    if (!read_file(path, text)) {
        fail(options, fmt::format("cannot read '{}': {}", path, text));
        return false;
    }
    const devices::LineDescription description =
        devices::read_line(text, ethercat::devices::beside(path));
    bool good = true;
    for (const auto& message : description.messages) {
        const std::string location =
            message.at.line == 0
                ? path
                : fmt::format("{}:{}:{}", path, message.at.line, message.at.column);
        const bool is_error = message.severity == Severity::error;
        good = good && !is_error;
        fail(options, fmt::format("{}: {}{}; {}", location,
                                  is_error ? "" : "warning: ", message.sentence, message.help));
    }
    if (good) {
        to = devices::make_line(description);
    }
    return good;
}

/// Reads `N:NAME=VALUE` as a command to the line. Returns what is wrong, or an empty text.
std::string read_fault(const std::string& text, std::size_t slaves, esc::LineCommand& to) {
    struct Row {
        const char* name;
        esc::LineFault fault;
    };
    static constexpr Row rows[] = {{"lose-every", esc::LineFault::loss},
                                   {"corrupt-every", esc::LineFault::corruption},
                                   {"double-every", esc::LineFault::duplicate},
                                   {"noise-every", esc::LineFault::noise}};
    const auto colon = text.find(':');
    const auto equals = text.find('=');
    const auto slave = parse_natural(text.substr(0, colon));
    if (colon == text.npos || equals == text.npos || equals < colon || !slave) {
        return fmt::format("invalid --fault '{}'; write --fault 1:corrupt-every=9", text);
    }
    if (*slave >= slaves) {
        return fmt::format("--fault {}: no slave {}; the last one of {} is {}", text, *slave,
                           slaves, slaves - 1);
    }
    const std::string name = text.substr(colon + 1, equals - colon - 1);

    const std::string value = text.substr(equals + 1);
    to.slave = static_cast<unsigned>(*slave);
    if (name == "drift") {
        const auto ppm = parse_real(value);
        if (!ppm || *ppm < -1000 || *ppm > 1000) {
            return fmt::format("--fault {}: invalid drift '{}'; write -1000..1000 ppm", text,
                               value);
        }
        to.kind = esc::LineCommand::Kind::drift;
        to.value = *ppm;
        return {};
    }
    for (const Row& row : rows) {
        if (name != row.name) continue;
        const auto every = parse_natural(value);
        if (!every || *every < 1 || *every > 1'000'000'000) {
            return fmt::format("--fault {}: invalid number '{}'; write 1..1000000000", text, value);
        }
        to.kind = esc::LineCommand::Kind::disturb;
        to.disturbance = {.fault = row.fault,
                          .slave = static_cast<int>(*slave),
                          .port = 0,
                          .every = static_cast<std::uint32_t>(*every)};
        return {};
    }
    return fmt::format(
        "--fault {}: unknown fault '{}'; write one of: lose-every, corrupt-every, double-every, "
        "noise-every, drift",
        text, name);
}

/// Reads the faults of the command line. Returns false after printing what is wrong.
bool read_faults(const EthercatLineOptions& options, std::size_t devices,
                 std::vector<esc::LineCommand>& faults) {
    if (options.faults.size() > esc::Line::max_disturbances) {
        fail(options, fmt::format("at most {} faults are possible", esc::Line::max_disturbances));
        return false;
    }
    faults.resize(options.faults.size());
    for (std::size_t n = 0; n < faults.size(); ++n) {
        const std::string problem = read_fault(options.faults[n], devices, faults[n]);
        if (!problem.empty()) {
            fail(options, problem);
            return false;
        }
    }
    return true;
}

/// Returns what is printed at the start: the interfaces, and the devices with their positions.
std::string start_text(const std::vector<devices::Device>& devices, const ethernet::Port& primary,
                       const ethernet::Port* secondary) {
    std::string addresses = primary.description().address;
    if (secondary != nullptr) {
        addresses += " and " + secondary->description().address;
    }
    std::string text =
        fmt::format("EtherCAT line of {} on {} ({}); press Ctrl-C to end\n",
                    counted(devices.size(), "slave"), addresses, primary.description().transport);
    for (std::size_t n = 0; n < devices.size(); ++n) {
        text += fmt::format("{:4}  {}\n", n, devices[n].name);
    }
    return text;
}

/// Serves the frames of the ports by a thread of its own until `end_ns`, or Ctrl-C, and prints what
/// happens. Returns false when nobody reads what is printed.
bool serve(esc::Line& line, const std::vector<devices::Device>& devices, ethernet::Port& primary,
           ethernet::Port* secondary, std::int64_t began_ns, std::int64_t end_ns,
           const StopRequest& stop) {
    StatusCopy status(devices.size());
    LineReporter reporter(devices, status, began_ns);
    std::atomic<bool> ended{false};
    std::thread server([&] { esc::serve(line, primary, secondary, ended, &status); });
    bool is_read = true;
    while (is_read && !stop.wait_ns(10'000'000) && link::monotonic_ns() < end_ns) {
        is_read = reporter.look(link::monotonic_ns());
    }
    ended = true;
    server.join();
    return is_read && reporter.look(link::monotonic_ns()) && reporter.finish();
}

}  // namespace

int run_node_ethercat(const EthercatLineOptions& options) {
    if (options.link.empty()) {
        return fail(options,
                    "missing --link; add --link eth:enp3s0, the interface towards the master, or "
                    "--link udp:127.0.0.1 for one on this machine");
    }
    std::vector<devices::Device> devices;
    if (!read_devices(options, devices)) return 1;
    std::vector<esc::LineCommand> faults;
    if (!read_faults(options, devices.size(), faults)) return 1;
    StopRequest stop;
    const auto primary = open_interface(options, options.link);
    if (!primary) return 1;
    std::unique_ptr<ethernet::Port> secondary;
    if (!options.backup.empty() && !(secondary = open_interface(options, options.backup))) return 1;

    esc::Line line;
    for (devices::Device& d : devices) {
        line.add({.controller = {.dc = d.dc}, .sii = d.sii, .application = d.firmware.get()});
    }
    if (secondary && !line.close_ring(static_cast<unsigned>(devices.size() - 1), 1)) {
        return fail(
            options,
            "--backup: the last device has no second port; put one with two ports at the end");
    }
    const std::int64_t began = link::monotonic_ns();
    const std::int64_t end = options.for_ns >= 0 ? began + options.for_ns : INT64_MAX;
    line.power_on(began);
    for (const esc::LineCommand& fault : faults) {
        line.execute(fault, began);
    }
    if (!print(start_text(devices, *primary, secondary.get()))) return 1;
    if (!serve(line, devices, *primary, secondary.get(), began, end, stop)) return 1;
    const std::int64_t now = link::monotonic_ns();
    const ethernet::Statistics s = primary->statistics();
    return print(fmt::format("{:.1f} s: {} frames passed, {} sent, {} lost here\n",
                             static_cast<double>(now - began) / 1e9, line.frames(),
                             s.sent + (secondary ? secondary->statistics().sent : 0),
                             s.lost + s.dropped))
               ? 0
               : 1;
}

}  // namespace hal::tools
