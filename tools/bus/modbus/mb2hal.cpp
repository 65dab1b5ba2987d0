// SPDX-License-Identifier: MIT
// `hal modbus mb2hal`, and mb2hal in netlists for LinuxCNC: a program with pins that exchanges the
// transactions of mb2hal's configuration file.
#include <algorithm>
#include <bit>
#include <cmath>
#include <deque>
#include <fmt/core.h>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>

#include "bus/modbus/mb2hal_file.hpp"
#include "bus/modbus/options.hpp"
#include "cli/output.hpp"
#include "cli/signals.hpp"
#include "control/client.hpp"
#include "link/system.hpp"
#include "machine/processes/address.hpp"
#include "modbus/master/event_texts.hpp"
#include "modbus/master/local_master.hpp"

namespace hal::tools {
namespace {

using nlohmann::json;
using namespace modbus;

constexpr std::int64_t exchange_period_ns = 2'000'000;
constexpr int declared_period_ms = 500;
constexpr double max_register = 65535.0;

/// The master of a link, in a thread of its own.
class LinkThread {
public:
    LinkThread(const Mb2halBus& of, std::unique_ptr<line::Line> line)
        : bus_(of.bus), plan_(of.plan), texts_(of.bus, of.plan) {
        const std::size_t size = Image::size_of(bus_, plan_);
        memory_.resize(size + 64);
        void* at = memory_.data();
        std::size_t space = memory_.size();
        image_ = Image(std::align(64, size, at, space), bus_, plan_, true);
        master_ = std::make_unique<LocalMaster>(bus_, plan_, image_, std::move(line));
    }

    void start() {
        thread_ = std::jthread([this](const std::stop_token& stop) {
            while (!stop.stop_requested()) {
                master_->turn(link::monotonic_ns(), true);
            }
        });
    }

    const Image& image() const { return image_; }
    const Bus& bus() const { return bus_; }
    const Plan& plan() const { return plan_; }

    void print_events() const {
        for (EventRecord record; image_.pop(record);) {
            write_all(STDERR_FILENO, fmt::format("mb2hal: {}\n", texts_.line(record)));
        }
    }

private:
    const Bus& bus_;
    const Plan& plan_;
    EventTexts texts_;
    std::vector<std::byte> memory_;
    Image image_;
    std::unique_ptr<LocalMaster> master_;
    std::jthread thread_;
};

/// How often a transaction has failed in a row. While its line is lost or its slave offline, the
/// master does not try each transaction: then those count that would have failed.
class ErrorCount {
public:
    std::uint32_t step(std::uint32_t failures, bool is_lost, std::int64_t interval_ns,
                       std::int64_t now_ns) {
        if (!is_lost) {
            lost_since_ns_ = 0;
            return failures;
        }
        if (lost_since_ns_ == 0) {
            lost_since_ns_ = now_ns;
            before_ = failures;
        }
        const std::int64_t missed = 1 + (now_ns - lost_since_ns_) / interval_ns;
        return before_ + static_cast<std::uint32_t>(std::min<std::int64_t>(missed, INT32_MAX));
    }

private:
    std::int64_t lost_since_ns_ = 0;
    std::uint32_t before_ = 0;
};

/// The pins of one element: of a register both numbers, of a bit also its inverse.
struct Element {
    std::uint32_t value = 0;  ///< index in the plan
    bool is_bit = false;
    bool is_output = false;  ///< written to the slave
    bool is_single = false;  ///< by function 05 or 06
    std::size_t first = 0;  ///< number of its first pin; of an output: its index in what is read
};

/// A transaction of the file with its pins.
struct Transaction {
    std::size_t link = 0;
    std::uint32_t telegram = 0;
    std::vector<Element> elements;
    std::size_t errors_pin = 0;
    ErrorCount errors;
};

class Mb2hal {
public:
    Mb2hal(const Mb2halFile& file, const std::string& path) : file_(file) {
        make_buses(file, path, buses_);
        transactions_.resize(file.transactions.size());
    }

    /// Opens all lines. Returns the problem, or "". A device that is missing is an error.
    std::string open() {
        for (const Mb2halBus& bus : buses_) {
            auto opened = line::open(bus.bus.link, bus.bus.line);
            if (!opened) return opened.problem;
            links_.emplace_back(bus, std::move(opened.line));
        }
        return "";
    }

    json declare() {
        json pins = json::array();
        for (std::size_t link = 0; link < buses_.size(); ++link) {
            for (std::uint32_t n = 0; n < buses_[link].transactions.size(); ++n) {
                declare_transaction(link, n, pins);
            }
        }
        return pins;
    }

    void start() {
        for (LinkThread& link : links_) {
            link.start();
        }
    }

    /// Returns numbers and values of the pins that have changed.
    json collect(std::int64_t now_ns) {
        json changed = json::array();
        for (Transaction& t : transactions_) {
            collect_values(t, changed);
            const std::uint32_t errors = errors_of(t, now_ns);
            put(changed, t.errors_pin, errors);
        }
        return changed;
    }

    /// Passes what was read from the machine to the masters.
    void apply(const json& values) {
        for (const Transaction& t : transactions_) {
            const Image& image = links_[t.link].image();
            for (const Element& element : t.elements) {
                if (!element.is_output) continue;
                if (const auto number = output_of(element, values)) {
                    image.value(element.value).store(*number, std::memory_order_relaxed);
                }
            }
        }
        for (const LinkThread& link : links_) {
            link.image().header().outputs_valid.store(1, std::memory_order_release);
        }
    }

    void print_events() const {
        for (const LinkThread& link : links_) {
            link.print_events();
        }
    }

    /// Prints which slaves go on as they are when this program ends.
    void warn_of_outputs() const {
        for (const Mb2halTransaction& t : file_.transactions) {
            if (!t.is_output) continue;
            write_all(STDERR_FILENO,
                      fmt::format("mb2hal: slave {} keeps what transaction '{}' has written ({} "
                                  "{}) when this program ends; the component modbus has stop "
                                  "telegrams\n",
                                  t.unit, t.name, to_string(t.table), t.address));
        }
    }

private:
    void declare_transaction(std::size_t link, std::uint32_t telegram, json& pins) {
        const std::size_t index = buses_[link].transactions[telegram];
        const Mb2halTransaction& of = file_.transactions[index];
        Transaction& t = transactions_[index];
        t.link = link;
        t.telegram = telegram;
        const std::string prefix = of.name + ".";
        for (std::size_t n = 0; n < of.elements.size(); ++n) {
            Element element;
            element.value = buses_[link].plan.telegrams[telegram].values[n];
            element.is_bit = is_bits(of.table);
            element.is_output = of.is_output;
            element.is_single = of.is_single;
            element.first = of.is_output ? inputs_ : pins.size();
            declare_element(of, prefix + of.elements[n], element, pins);
            t.elements.push_back(element);
        }
        t.errors_pin = pins.size();
        add(pins, prefix + "num_errors", "u32", "out", "failures in a row");
    }

    void declare_element(const Mb2halTransaction& of, const std::string& name,
                         const Element& element, json& pins) {
        const std::string doc = fmt::format("{} {}", to_string(of.table), of.address);
        const char* const direction = of.is_output ? "in" : "out";
        if (element.is_bit) {
            add(pins, file_.has_new_names ? name + ".bit" : name, "bit", direction, doc);
            if (file_.has_new_names && !of.is_output) {
                add(pins, name + ".bit-inv", "bit", direction, doc + ", inverted");
            }
            return;
        }
        const bool has_suffix = file_.has_new_names || !of.is_output;
        add(pins, has_suffix ? name + ".float" : name, "float", direction, doc);
        if (has_suffix) {
            add(pins, name + ".int", "s32", direction, doc);
        }
    }

    void add(json& pins, const std::string& name, const char* type, const char* direction,
             const std::string& doc) {
        pins.push_back({{"name", name}, {"type", type}, {"dir", direction}, {"doc", doc}});
        shown_.emplace_back();
        if (std::string_view(direction) == "in") {
            ++inputs_;
        }
    }

    void collect_values(const Transaction& t, json& changed) {
        const Image& image = links_[t.link].image();
        if (image.stamp(t.telegram).load(std::memory_order_relaxed) == 0) return;
        for (const Element& element : t.elements) {
            if (element.is_output) continue;
            const std::uint64_t value = image.value(element.value).load(std::memory_order_relaxed);
            if (!element.is_bit) {
                put(changed, element.first, static_cast<double>(value));
                put(changed, element.first + 1, value);
                continue;
            }
            put(changed, element.first, value != 0);
            if (file_.has_new_names) {
                put(changed, element.first + 1, value == 0);
            }
        }
    }

    std::uint32_t errors_of(Transaction& t, std::int64_t now_ns) {
        const LinkThread& link = links_[t.link];
        const Telegram& telegram = link.plan().telegrams[t.telegram];
        const Image& image = link.image();
        const bool is_line_lost = image.header().line_open.load(std::memory_order_relaxed) == 0;
        const SlaveImage& slave = image.slave(telegram.slave);
        const bool is_offline = slave.online.load(std::memory_order_relaxed) == 0 &&
                                slave.timeouts.load(std::memory_order_relaxed) +
                                        slave.errors.load(std::memory_order_relaxed) !=
                                    0;
        const std::int64_t interval =
            std::max(link.bus().slaves[telegram.slave].timeout_ns, telegram.period_ns);
        return t.errors.step(image.failures(t.telegram).load(std::memory_order_relaxed),
                             is_line_lost || is_offline, interval, now_ns);
    }

    template <class T>
    void put(json& changed, std::size_t pin, T value) {
        json as_json = value;
        if (shown_[pin] == as_json) return;
        changed.push_back(pin);
        changed.push_back(as_json);
        shown_[pin] = std::move(as_json);
    }

    /// Returns the register: both pins are added, the first without its fraction. As in mb2hal,
    /// the sum is limited above, a negative one wraps, and for function 16 the first number wraps.
    /// Nothing for NaN: the register keeps its value.
    std::optional<std::uint64_t> output_of(const Element& element, const json& values) const {
        const json& first = values[element.first];
        if (element.is_bit) return std::uint64_t{first.get<bool>()};
        double sum = std::trunc(number_of(first));
        if (std::isnan(sum)) return std::nullopt;
        if (!element.is_single) {
            sum = register_of(sum);
        }
        if (file_.has_new_names) {
            sum += values[element.first + 1].get<double>();
        }
        return register_of(std::min(sum, max_register));
    }
    /// Numbers that are not finite are strings (docs/protocol.md).
    static double number_of(const json& value) {
        constexpr double infinity = std::numeric_limits<double>::infinity();
        if (value.is_number()) return value.get<double>();
        if (value == "inf") return infinity;
        if (value == "-inf") return -infinity;
        return std::numeric_limits<double>::quiet_NaN();
    }
    static std::uint16_t register_of(double number) {
        constexpr double limit = 2147483648.0;
        return static_cast<std::uint16_t>(
            static_cast<std::int64_t>(std::clamp(number, -limit, limit)));
    }

    const Mb2halFile& file_;
    std::deque<Mb2halBus> buses_;
    std::deque<LinkThread> links_;
    std::vector<Transaction> transactions_;
    std::vector<json> shown_;  // by the number of the pin
    std::size_t inputs_ = 0;
};

/// Exchanges values until the program or the machine ends. Returns the exit status.
int exchange(const ModbusMb2halOptions& options, Mb2hal& machine, Client& client,
             const std::string& name, StopRequest& stop) {
    while (!stop.wait_ns(exchange_period_ns)) {
        const json reply = client.request(
            {{"exchange", name}, {"write", machine.collect(link::monotonic_ns())}, {"read", true}});
        if (!client.connected()) return 0;
        if (!reply.value("ok", false)) {
            return fail(options, reply.value("error", "the machine rejects an exchange"));
        }
        machine.apply(reply["values"]);
        machine.print_events();
    }
    client.request({{"exit", name}});
    return 0;
}

}  // namespace

int run_modbus_mb2hal(const ModbusMb2halOptions& options) {
    if (options.words.size() != 1) {
        return fail(options, "exactly one file is required: mb2hal config=FILE.ini");
    }
    StopRequest stop;
    std::string path = options.words.front();
    if (path.starts_with("config=")) {
        path.erase(0, std::string_view("config=").size());
    }
    Sources sources;
    Diagnostics diagnostics;
    const Mb2halFile file = read_mb2hal(sources, path, diagnostics);
    write_all(STDERR_FILENO, render(diagnostics, sources, colours(STDERR_FILENO)));
    if (diagnostics.failed()) return 1;
    if (options.check) {
        return exit_code(print(fmt::format("{}: {} on {}\n", path,
                                           counted(file.transactions.size(), "transaction"),
                                           counted(file.links.size(), "line"))));
    }
    Mb2hal machine(file, path);
    const json pins = machine.declare();
    if (std::string problem = machine.open(); !problem.empty()) return fail(options, problem);
    std::string problem;
    const auto client = Client::connect(instance_wanted(options.name), problem);
    if (!client) return fail(options, problem);
    const json reply = client->request(
        {{"component", file.module}, {"every_ms", declared_period_ms}, {"pins", pins}});
    if (!reply.value("ok", false)) {
        return fail(options, reply.value("error", "the machine rejects the component"));
    }
    machine.warn_of_outputs();
    machine.start();
    return exchange(options, machine, *client, file.module, stop);
}

}  // namespace hal::tools
