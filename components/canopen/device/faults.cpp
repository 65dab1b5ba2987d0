// SPDX-License-Identifier: MIT
#include "faults.hpp"

#include <algorithm>
#include <charconv>
#include <utility>
#include <vector>

#include "text/find_row.hpp"
#include "text/numbers.hpp"
#include "text/quoting.hpp"

namespace hal::canopen {

namespace {

constexpr FaultRow rows[] = {
    {Fault::mute, "mute", "sent frame is lost", 0},
    {Fault::deaf, "deaf", "received frame is ignored", 0},
    {Fault::twice, "twice", "sent frame is duplicated", 0},
    {Fault::late_sdo, "late-sdo", "SDO response is delayed by `time`", 700 * millisecond},
    {Fault::late_pdo, "late-pdo", "PDO is delayed by `time`", 2 * millisecond},
    {Fault::no_boot_up, "no-boot-up", "boot-up message is not sent", 0},
    {Fault::boot_storm, "boot-storm", "`time` a boot-up message is sent without a restart",
     100 * millisecond},
    {Fault::reboot, "reboot", "`time` the device restarts as after a loss of power", 2 * second},
    {Fault::no_heartbeat, "no-heartbeat", "heartbeat or guarding response is not sent", 0},
    {Fault::wrong_state, "wrong-state", "heartbeat reports the state stopped", 0},
    {Fault::guard_toggle, "guard-toggle", "guarding response has a wrong toggle bit", 0},
    {Fault::no_sdo, "no-sdo", "SDO response is not sent", 0},
    {Fault::abort, "abort", "SDO request is aborted with a general error", 0},
    {Fault::stale_abort, "stale-abort",
     "SDO response is preceded by an abort of the previous request", 0},
    {Fault::toggle, "toggle", "SDO segment has a wrong toggle bit", 0},
    {Fault::block_gap, "block-gap", "segment of a block upload is lost", 0},
    {Fault::block_crc, "block-crc", "block transfer ends with a wrong CRC", 0},
    {Fault::short_pdo, "short-pdo", "PDO is one byte short", 0},
    {Fault::long_pdo, "long-pdo", "PDO is one byte long", 0},
    {Fault::wrong_type, "wrong-type", "read of the device type (1000h) returns a wrong value", 0},
    {Fault::wrong_vendor, "wrong-vendor", "read of the vendor ID (1018h:1) returns a wrong value",
     0},
    {Fault::wrong_product, "wrong-product",
     "read of the product code (1018h:2) returns a wrong value", 0},
    {Fault::wrong_revision, "wrong-revision",
     "read of the revision number (1018h:3) returns a wrong value", 0},
    {Fault::wrong_serial, "wrong-serial",
     "read of the serial number (1018h:4) returns a wrong value", 0},
    {Fault::wrong_software, "wrong-software",
     "read of the software identification (1F56h:1) returns a wrong value", 0},
    {Fault::babble, "babble", "`time` a frame of the highest priority is sent", 200 * microsecond},
    {Fault::emcy_storm, "emcy-storm", "`time` an emergency is sent", 10 * millisecond},
    {Fault::no_srdo, "no-srdo", "SRDO is not sent", 0},
    {Fault::srdo_half, "srdo-half", "SRDO is sent without its second frame", 0},
    {Fault::srdo_wrong, "srdo-wrong", "SRDO is sent with a wrong bit in its second frame", 0},
    {Fault::srdo_order, "srdo-order", "SRDO is sent with its second frame first", 0},
    {Fault::late_srdo, "late-srdo", "second frame of an SRDO is delayed by `time`",
     30 * millisecond},
};
static_assert([] {
    for (std::size_t n = 0; n < std::size(rows); ++n) {
        if (rows[n].fault != static_cast<Fault>(n)) return false;
    }
    return true;
}(), "the table is in the order of the enumeration");

/// Returns 0 for an unknown unit.
double nanoseconds_of(std::string_view unit) {
    if (unit == "s") return 1e9;
    if (unit == "ms") return 1e6;
    if (unit == "us") return 1e3;
    return 0.0;
}

/// "20ms", "1.5s", "200us".
bool parse_time(std::string_view text, Time& time) {
    double value = 0;
    const auto [end, wrong] = std::from_chars(text.data(), text.data() + text.size(), value);
    const auto unit = text.substr(static_cast<std::size_t>(end - text.data()));
    const double factor = nanoseconds_of(unit);
    if (wrong != std::errc{} || factor == 0.0 || !(value >= 0.0 && value * factor <= 1e15)) {
        return false;
    }
    time = static_cast<Time>(value * factor);
    return true;
}

std::string names() {
    std::string all;
    for (const auto& row : rows) {
        append_item(all, row.name);
    }
    return all;
}

constexpr bool is_srdo(const Frame& f) noexcept {
    return !f.extended && f.id > 0x100 && f.id <= 0x180;
}
constexpr bool is_pdo(const Frame& f, std::uint8_t node) noexcept {
    if (f.extended || f.remote) return f.extended;
    return f.id > 0x180 && f.id < 0x700 && f.id != 0x580U + node && f.id != 0x600U + node;
}

}  // namespace

std::span<const FaultRow> fault_rows() noexcept { return rows; }

const FaultRow* find_fault(std::string_view name) noexcept {
    return find_row(rows, name, &FaultRow::name);
}

bool parse_fault(std::string_view text, Fault& fault, FaultSetting& setting, std::string& problem) {
    const auto next_part = [&] {
        const auto part = text.substr(0, text.find(':'));
        text.remove_prefix(std::min(part.size() + 1, text.size()));
        return part;
    };
    const auto name = next_part();
    const auto* row = find_fault(name);
    if (row == nullptr) {
        problem = "unknown fault '" + std::string(name) + "'; use one of: " + names();
        return false;
    }
    fault = row->fault;
    setting = {.every = 1};
    Time lasting = 0;
    while (!text.empty()) {
        const auto part = next_part();
        const auto equals = std::min(part.find('='), part.size());
        const auto key = part.substr(0, equals);

        const auto value = part.substr(std::min(equals + 1, part.size()));
        bool good = false;
        if (key == "every") {
            good = parse_whole(value, setting.every) && setting.every != 0;
        } else if (key == "time" && row->time != 0) {
            good = parse_time(value, setting.time) && setting.time != 0;
        } else if (key == "from") {
            good = parse_time(value, setting.from);
        } else if (key == "for") {
            good = parse_time(value, lasting) && lasting != 0;
        }
        if (good) continue;
        problem = "invalid property '" + std::string(part) + "' of fault " + row->name +
                  "; write every=3, " + (row->time != 0 ? "time=20ms, " : "") + "from=5s or for=1s";
        return false;
    }
    if (lasting != 0) {
        setting.until = setting.from + lasting;
    }
    return true;
}

Faults::Faults(std::size_t held) : held_(std::make_unique<Held[]>(held)), held_capacity_(held) {}

void Faults::find_any() noexcept {
    any_ = std::any_of(settings_.begin(), settings_.end(),
                       [](const FaultSetting& s) { return s.every != 0; });
    for (std::size_t n = 0; n < kinds; ++n) {
        if (settings_[n].every == 0) {
            next_[n] = 0;
        }
    }
}

void Faults::start(Time now) noexcept {
    if (!started_) {
        started_ = true;
        began_ = now;
    }
    now_ = now;
}

bool Faults::active(Fault fault) const noexcept {
    const auto& s = settings_[index(fault)];
    return s.every != 0 && now_ - began_ >= s.from && now_ - began_ < s.until;
}

bool Faults::hit(Fault fault) noexcept {
    if (!active(fault)) return false;
    if (++seen_[index(fault)] % settings_[index(fault)].every != 0) return false;
    ++hits_[index(fault)];
    return true;
}

Time Faults::time(Fault fault) const noexcept {
    const auto own = settings_[index(fault)].time;
    return std::max<Time>(own != 0 ? own : rows[index(fault)].time, microsecond);
}

bool Faults::periodic(Fault fault) noexcept {
    if (!active(fault)) return false;
    auto& next = next_[index(fault)];
    if (next == 0) {
        next = now_ + time(fault) * settings_[index(fault)].every;
    }
    if (now_ < next) return false;
    next += time(fault) * settings_[index(fault)].every;
    // a late turn does not catch up on every event
    if (next <= now_ - 32 * time(fault)) {
        next = now_ + time(fault);
    }
    ++hits_[index(fault)];
    return true;
}

namespace {

/// What a frame of an SDO client is (CiA 301, 7.2.4.3).
enum class SdoCommand {
    names_object,  ///< its bytes 1 to 3 are index and sub-index
    start_block_upload,
    acknowledge_block,
    abort,
    other,
};

SdoCommand sdo_command(std::uint8_t specifier) noexcept {
    switch (specifier) {
    case 0x80: return SdoCommand::abort;
    case 0xa2: return SdoCommand::acknowledge_block;
    case 0xa3: return SdoCommand::start_block_upload;
    default: break;
    }
    switch (specifier >> 5) {
    case 1:  // download
    case 2:  // upload
    case 6:  // block download
        return SdoCommand::names_object;
    case 5:  // block upload
        return (specifier & 3) == 0 ? SdoCommand::names_object : SdoCommand::other;
    default: return SdoCommand::other;
    }
}

bool is_sdo_request(const Frame& f, std::uint8_t node) noexcept {
    return f.id == 0x600U + node && !f.extended && f.length == 8;
}

}  // namespace

bool Faults::swallows(const Frame& f, std::uint8_t node, Time now) noexcept {
    start(now);
    if (hit(Fault::deaf)) return true;
    if (is_sdo_request(f, node)) {
        follow_transfer(f);
    }
    return false;
}

void Faults::follow_transfer(const Frame& request) noexcept {
    const SdoCommand command = sdo_command(request.data[0]);
    // between start and acknowledgement of a block all bytes but those of an abort are data
    if (block_ == Block::receiving && command != SdoCommand::abort) return;
    switch (command) {
    case SdoCommand::start_block_upload:
        block_ = Block::sending;
        last_sequence_ = 0;
        break;
    case SdoCommand::acknowledge_block: {
        const bool was_all = last_sequence_ != 0 && request.data[1] == last_sequence_;
        if (block_ == Block::sending && was_all) {
            block_ = Block::ending;
        }
        last_sequence_ = 0;
        break;
    }
    case SdoCommand::names_object:
        block_ = Block::none;
        previous_ = request_;
        std::copy_n(request.data.begin() + 1, request_.size(), request_.begin());
        break;
    case SdoCommand::abort:
    case SdoCommand::other: block_ = Block::none; break;
    }
}

void Faults::identity(Frame& f) noexcept {
    struct Row {
        std::uint16_t index;
        std::uint8_t sub;
        Fault fault;
    };
    static constexpr Row objects[] = {
        {0x1000, 0, Fault::wrong_type},    {0x1018, 1, Fault::wrong_vendor},
        {0x1018, 2, Fault::wrong_product}, {0x1018, 3, Fault::wrong_revision},
        {0x1018, 4, Fault::wrong_serial},  {0x1f56, 1, Fault::wrong_software},
    };
    if ((f.data[0] >> 5) != 2 || (f.data[0] & 2) == 0) return;
    const auto index = load<std::uint16_t>(f.data.data() + 1);
    for (const Row& row : objects) {
        const bool is_it = row.index == index && (row.sub == f.data[3] || index == 0x1000);
        if (is_it && hit(row.fault)) {
            f.data[4] ^= 0xff;
        }
    }
}

namespace {

/// Responses of an SDO server: the upper three bits of byte 0, CiA 301, 7.2.4.3.
constexpr std::uint8_t last_segment_kind = 1;
constexpr std::uint8_t download_block = 5;
constexpr std::uint8_t upload_block = 6;
/// Whole bytes 0.
constexpr std::uint8_t abort_transfer = 0x80;
constexpr std::uint8_t end_of_download = 0xa1;
constexpr std::uint8_t block_confirmed = 0xa2;

void make_abort(Frame& f, const std::array<std::uint8_t, 3>& object, Abort why) noexcept {
    f.data[0] = abort_transfer;
    std::copy(object.begin(), object.end(), f.data.begin() + 1);
    store(f.data.data() + 4, static_cast<std::uint32_t>(why));
}

}  // namespace

/// Alters a response within a block transfer. Returns false when it must not be sent.
bool Faults::answer_in_block(Frame& f) noexcept {
    if (block_ == Block::sending) {  // only segments follow
        if ((f.data[0] & 0x80) != 0) {
            last_sequence_ = f.data[0] & 0x7f;
        }
        return !hit(Fault::block_gap);
    }
    if (block_ == Block::receiving && f.data[0] == block_confirmed) return true;
    const bool was_receiving = std::exchange(block_, Block::none) == Block::receiving;
    if (was_receiving) {
        if (f.data[0] == end_of_download && hit(Fault::block_crc)) {
            make_abort(f, request_, Abort::crc);
        }
    } else if (f.data[0] >> 5 == upload_block && hit(Fault::block_crc)) {
        f.data[1] ^= 0xff;
    }
    return true;
}

/// Alters a response of the SDO server. Returns false when it must not be sent.
bool Faults::answer(Frame& f, FrameQueue& bus) noexcept {
    if (hit(Fault::no_sdo)) return false;
    if (block_ != Block::none) return answer_in_block(f);
    const auto kind = f.data[0] >> 5;
    if (kind <= last_segment_kind) {
        if (hit(Fault::toggle)) {
            f.data[0] ^= 0x10;
        }
        return true;
    }
    if (hit(Fault::stale_abort)) {
        Frame stale = f;
        make_abort(stale, previous_, Abort::command);
        bus.push(stale);
    }
    if (f.data[0] == abort_transfer) return true;
    if (hit(Fault::abort)) {
        make_abort(f, request_, Abort::general);
        return true;
    }
    if (kind == download_block) {
        block_ = Block::receiving;
    }
    identity(f);
    return true;
}

void Faults::hold(const Frame& f, Time due, FrameQueue& bus) noexcept {
    if (held_count_ == held_capacity_) return void(bus.push(f));
    held_[held_count_++] = {f, due};
}

/// Alters a frame of an SRDO, the first (odd identifier) or the second. Returns false when it must
/// not be sent now.
bool Faults::safety(Frame& f, Time& late, FrameQueue& bus) noexcept {
    if (f.id % 2 == 1) {
        skips_srdo_ = hit(Fault::no_srdo);
        swaps_srdo_ = hit(Fault::srdo_order);
        first_of_srdo_ = f;
        return !skips_srdo_ && !swaps_srdo_;
    }
    if (skips_srdo_ || hit(Fault::srdo_half)) return false;
    if (f.length > 0 && hit(Fault::srdo_wrong)) {
        f.data[0] ^= 0x01;
    }
    if (hit(Fault::late_srdo)) {
        late = time(Fault::late_srdo);
    }
    if (swaps_srdo_) {
        bus.push(f);
        f = first_of_srdo_;
    }
    return true;
}

void Faults::send(Frame f, std::uint8_t node, FrameQueue& bus, Time now) noexcept {
    start(now);
    if (hit(Fault::mute)) return;
    Time late = 0;
    if (!f.extended && f.id == 0x580U + node && f.length == 8) {
        if (!answer(f, bus)) return;
        late = hit(Fault::late_sdo) ? time(Fault::late_sdo) : 0;
    } else if (!f.extended && f.id == 0x700U + node && f.length == 1) {
        if (!error_control(f)) return;
    } else if (is_srdo(f)) {
        if (!safety(f, late, bus)) return;
    } else if (is_pdo(f, node)) {
        process_data(f);
        late = hit(Fault::late_pdo) ? time(Fault::late_pdo) : 0;
    }
    if (late != 0) return hold(f, now + late, bus);
    bus.push(f);
    if (hit(Fault::twice)) {
        bus.push(f);
    }
}

/// Alters a heartbeat or boot-up message. Returns false when it must not be sent.
bool Faults::error_control(Frame& f) noexcept {
    if (f.data[0] == 0) return !hit(Fault::no_boot_up);
    if (hit(Fault::no_heartbeat)) return false;
    if (hit(Fault::wrong_state)) {
        f.data[0] = static_cast<std::uint8_t>((f.data[0] & 0x80) | 0x04);
    }
    if (hit(Fault::guard_toggle)) {
        f.data[0] ^= 0x80;
    }
    return true;
}

/// Alters the length of a PDO.
void Faults::process_data(Frame& f) noexcept {
    if (f.length > 0 && hit(Fault::short_pdo)) {
        --f.length;
    } else if (f.length < 8 && hit(Fault::long_pdo)) {
        f.data[f.length] = 0;
        ++f.length;
    }
}

bool Faults::poll(std::uint8_t node, FrameQueue& bus, Time now) noexcept {
    start(now);
    std::size_t kept = 0;
    for (std::size_t n = 0; n < held_count_; ++n) {
        if (now >= held_[n].due && bus.push(held_[n].frame)) continue;
        if (kept != n) {
            held_[kept] = held_[n];
        }
        ++kept;
    }
    held_count_ = kept;
    if (!any_) return false;
    if (periodic(Fault::boot_storm)) {
        bus.push(make_frame(0x700U + node, 1));
    }
    if (periodic(Fault::emcy_storm)) {
        Frame f = make_frame(0x80U + node, 8);
        store(f.data.data(), std::uint16_t{0xff00});
        f.data[2] = 0x81;
        bus.push(f);
    }
    for (unsigned n = 0; n < 32 && periodic(Fault::babble); ++n) {
        bus.push(make_frame(0x001, 8));
    }
    return periodic(Fault::reboot);
}

}  // namespace hal::canopen
