// SPDX-License-Identifier: MIT
#include "plan.hpp"

#include <algorithm>
#include <tuple>

namespace hal::modbus {

namespace {

struct Limits {
    unsigned max_count;
    unsigned max_gap;
};

Limits limits_of(const Slave& slave, const Value& value) {
    if (value.table == Table::huanyang) return {1, 0};
    if (value.is_output) {
        if (slave.single_writes) return {0, 0};
        return {std::min<unsigned>(slave.max_registers, max_write_registers), 0};
    }
    if (is_bits(value.table))
        return {std::min(slave.max_registers * 16U, 2000U), slave.max_gap * 16U};
    return {slave.max_registers, slave.max_gap};
}

/// Adds telegrams for the values of a slave that are read, or for those that are written.
class Merger {
public:
    Merger(Plan& plan, const Bus& bus, std::uint32_t slave, bool outputs)
        : plan_(plan), slave_(bus.slaves[slave]), index_(slave) {
        for (const Value& value : slave_.values) {
            if (value.is_output == outputs) {
                sorted_.push_back(&value);
            }
        }
        std::stable_sort(sorted_.begin(), sorted_.end(),
                         [](const Value* a, const Value* b) { return key(*a) < key(*b); });
    }

    void run() {
        for (const Value* value : sorted_) {
            if (open_ == nullptr || !extends(*value)) {
                begin(*value);
            }
            add(*value);
        }
    }

private:
    static std::tuple<Table, std::int64_t, unsigned> key(const Value& v) {
        return {v.table, v.period_ns, v.address};
    }

    bool extends(const Value& v) const {
        const Telegram& t = plan_.telegrams.back();
        const Limits limits = limits_of(slave_, v);
        const unsigned end = std::max<unsigned>(t.address + t.count, v.address + v.size());
        const bool same = open_->table == v.table && open_->period_ns == v.period_ns;
        return same && v.address <= t.address + t.count + limits.max_gap &&
               end - t.address <= limits.max_count;
    }

    void begin(const Value& v) {
        open_ = &v;
        Telegram t;
        t.kind = v.is_output ? Telegram::Kind::write : Telegram::Kind::read;
        t.slave = index_;
        t.table = v.table;
        t.address = v.address;
        t.period_ns = v.period_ns;
        plan_.telegrams.push_back(t);
    }

    void add(const Value& v) {
        Telegram& t = plan_.telegrams.back();
        const auto end = std::max<unsigned>(t.address + t.count, v.address + v.size());
        t.count = static_cast<std::uint16_t>(end - t.address);
        t.values.push_back(static_cast<std::uint32_t>(plan_.values.size()));
        plan_.values.push_back({index_, &v, static_cast<std::uint32_t>(plan_.telegrams.size() - 1),
                                static_cast<std::uint16_t>(v.address - t.address)});
    }

    Plan& plan_;
    const Slave& slave_;
    std::uint32_t index_;
    std::vector<const Value*> sorted_;
    const Value* open_ = nullptr;  // the first value of the last telegram
};

/// Bytes of a PDU.
struct Sizes {
    std::size_t request;
    std::size_t answer;
    unsigned requests = 1;
};

Sizes sizes_of(const Telegram& t, const Slave& slave) {
    if (t.kind == Telegram::Kind::drive) {
        if (slave.drive->one_telegram) return {10, 5};
        const auto writes = static_cast<unsigned>(slave.drive->forward.size() + 1);
        return {5, 5, writes};
    }
    if (t.table == Table::huanyang) return {5, 5};
    const std::size_t bytes = is_bits(t.table) ? (t.count + 7U) / 8 : t.count * 2U;
    if (t.kind == Telegram::Kind::read) return {5, 2 + bytes};
    const bool single = t.count == 1;
    return {single ? 5 : 6 + bytes, 5};
}

std::size_t framed(std::size_t pdu, Framing framing) {
    return pdu + (framing == Framing::tcp ? 7 : 3);
}

}  // namespace

Plan make_plan(const Bus& bus) {
    Plan plan;
    for (std::uint32_t slave = 0; slave < bus.slaves.size(); ++slave) {
        if (const auto& drive = bus.slaves[slave].drive) {
            Telegram t;
            t.kind = Telegram::Kind::drive;
            t.slave = slave;
            t.period_ns = std::max<std::int64_t>(drive->period_ns * 5, 500'000'000);
            plan.telegrams.push_back(t);
        }
        Merger(plan, bus, slave, true).run();
        Merger(plan, bus, slave, false).run();
    }
    return plan;
}

std::int64_t silence_ns(const line::Options& options) noexcept {
    if (options.baud > 19200) return 1'750'000;
    return line::characters_ns(options, 7) / 2;
}

TelegramTime time_of(const Telegram& telegram, const Bus& bus, Framing framing) {
    const Slave& slave = bus.slaves[telegram.slave];
    const Sizes sizes = sizes_of(telegram, slave);
    TelegramTime time;
    if (framing == Framing::tcp) return time;
    const std::int64_t silence = silence_ns(bus.line);
    time.request = sizes.requests * line::characters_ns(bus.line, framed(sizes.request, framing));
    time.answer = sizes.requests * line::characters_ns(bus.line, framed(sizes.answer, framing));
    time.silence = sizes.requests * (silence + std::max(silence, slave.gap_ns));
    return time;
}

Load load_of(const Plan& plan, const Bus& bus, Framing framing, std::int64_t thinking) {
    Load load;
    std::int64_t round = 0;
    std::int64_t max = 0;
    for (const Telegram& t : plan.telegrams) {
        const std::int64_t all = time_of(t, bus, framing).all(thinking);
        load.use += static_cast<double>(all) / static_cast<double>(t.period_ns);
        round += all;
        max = std::max(max, all);
    }
    const double stretch = std::max(1.0, load.use);
    for (const Telegram& t : plan.telegrams) {
        load.ages.push_back(static_cast<std::int64_t>(static_cast<double>(t.period_ns) * stretch) +
                            round);
        if (t.kind != Telegram::Kind::read) {
            const TelegramTime own = time_of(t, bus, framing);
            load.set_point_ns = std::max(load.set_point_ns, max + own.request + own.silence);
        }
    }
    const bool is_tcp = framing == Framing::tcp;
    const std::int64_t silence = is_tcp ? 0 : silence_ns(bus.line);
    const std::int64_t frame = is_tcp ? 0 : line::characters_ns(bus.line, 8);
    const auto broadcasts = static_cast<std::int64_t>(bus.broadcast_stop.size());
    if (broadcasts != 0) {
        const std::int64_t one = silence + bus.max_gap_ns() + frame + bus.turnaround_ns;
        load.stop_ns = max + broadcasts * one;
        load.broadcast_ns = load.stop_ns - bus.turnaround_ns;
    } else {
        load.stop_ns = max;
    }
    for (const Slave& slave : bus.slaves) {
        const std::int64_t one =
            is_tcp ? thinking : 2 * frame + 2 * silence + slave.gap_ns + thinking;
        load.stop_ns += static_cast<std::int64_t>(slave.stop.size()) * one;
    }
    return load;
}

std::int64_t max_stop_ns(const Plan& plan, const Bus& bus) {
    constexpr std::int64_t burst_ns = 20'000'000;  // of a USB adapter
    const std::int64_t silence = silence_ns(bus.line);
    const std::int64_t frame = line::characters_ns(bus.line, 16);  // at most 13: 32 coils
    // a late answer is waited for once more
    const auto waits = [&](const Slave& slave) { return 2 * slave.timeout_ns + burst_ns; };
    std::int64_t on_line = bus.broadcast_stop.empty() ? 0 : bus.turnaround_ns;
    for (const Telegram& t : plan.telegrams) {
        on_line = std::max(on_line, time_of(t, bus, Framing::rtu).all(waits(bus.slaves[t.slave])));
    }
    std::int64_t all = 2 * on_line;  // it ends, and a register may be read for the echo
    const auto broadcasts = 2 * static_cast<std::int64_t>(bus.broadcast_stop.size());
    all += broadcasts * (silence + bus.max_gap_ns() + frame + bus.turnaround_ns);
    for (const Slave& slave : bus.slaves) {
        const auto requests = static_cast<std::int64_t>(slave.stop.size()) * slave.stop_attempts;
        all += requests * (2 * frame + 2 * silence + slave.gap_ns + waits(slave));
    }
    return all;
}

}  // namespace hal::modbus
