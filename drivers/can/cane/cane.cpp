// SPDX-License-Identifier: MIT
#include "cane.hpp"

#include <algorithm>
#include <array>
#include <ctime>
#include <memory>
#include <vector>

#include "cane_settings.hpp"
#include "cane_stations.hpp"
#include "command_guard.hpp"
#include "discipline/discipline.hpp"
#include "hal/queue.hpp"
#include "link/filtering.hpp"
#include "link/segment.hpp"
#include "link/system.hpp"
#include "seal.hpp"

namespace hal::can::cane {

namespace {

constexpr unsigned max_messages = 255;  // per packed frame: the count is one byte
constexpr std::size_t max_payload = ethernet::max_frame - ethernet::header_bytes;

/// Share of the line used by the frames of this link in both directions. Both threads add to it;
/// the receiving one closes the windows.
class Load {
public:
    void add(std::size_t frame_bytes) noexcept {
        bytes_.fetch_add(ethernet::wire_bytes(frame_bytes), std::memory_order_relaxed);
    }
    void tick(std::int64_t now_ns, std::uint32_t mbit_per_s) noexcept {
        constexpr std::int64_t window_ns = 100'000'000;
        if (now_ns >= since_ns_ && now_ns - since_ns_ < window_ns) return;
        const auto bits = 8.0 * static_cast<double>(bytes_.exchange(0, std::memory_order_relaxed));
        const auto ns = static_cast<double>(now_ns > since_ns_ ? now_ns - since_ns_ : window_ns);
        share_.store(mbit_per_s == 0 ? 0.0 : std::min(1.0, bits * 1e3 / mbit_per_s / ns),
                     std::memory_order_relaxed);
        since_ns_ = now_ns;
    }
    double share() const noexcept { return share_.load(std::memory_order_relaxed); }

private:
    std::int64_t since_ns_ = 0;
    std::atomic<std::uint64_t> bytes_{0};
    std::atomic<double> share_{0.0};
};

Description describe_settings(const Settings& s) {
    Description d;
    d.address = "cane:" + s.segment.substr(s.segment.starts_with("eth:") ? 4 : 0);
    if (s.slot) {
        d.address += "?slot=" + std::to_string(*s.slot);
    }
    d.transport = std::string("CAN in Ethernet frames, ") +
                  (s.format == Format::packed ? "packed" : "one each");
    d.segment = s.segment;
    d.in_slots = s.slot.has_value();
    const auto line = ethernet::describe(s.segment);
    d.simulated = line.simulated;
    d.in_memory = line.in_memory;
    d.has_bit_rate = false;
    d.has_stamps = true;
    return d;
}

class CaneLink final : public FilteringLink {
public:
    CaneLink(Settings settings, const Options& options, std::unique_ptr<ethernet::Port> port,
             std::shared_ptr<ethernet::DisciplineHandle> discipline, std::uint16_t session)
        : settings_(std::move(settings)),
          options_(options),
          port_(std::move(port)),
          discipline_(std::move(discipline)),
          session_(session),
          simulated_(port_->description().simulated),
          process_data_(options.send_capacity),
          service_data_(options.send_capacity) {
        for (const auto& [id, address] : settings_.nodes) {
            nodes_.fix(id, address);
        }
        guard_.learn(settings_.learns);
        if (settings_.master) {
            guard_.fix(*settings_.master);
        }
        for (const auto& other : settings_.also) {
            guard_.allow(other);
        }
        seal_ = Seal::take(settings_.key, simulated_);
        description_ = describe_settings(settings_);
        auto own = port_->address();
        if (discipline_) {
            discipline_->with([&](const ethernet::Discipline& d) { own = d.address(); });
        }
        std::copy(own.begin(), own.end(), frame_.begin() + 6);
        frame_[12] = ether_type >> 8;
        frame_[13] = ether_type & 0xff;
        look_at_line();
    }

    Sent send(const Frame& frame, std::int64_t now_ns) noexcept override {
        if (frame.fd || !may_send(frame, options_)) return counting_.drop(Sent::rejected);
        guard_.sent(frame, now_ns != unclocked || simulated_ ? now_ns : link::monotonic_ns());
        if (is_replaced(frame)) return Sent::queued;
        auto& queue = is_service(frame) ? service_data_ : process_data_;
        if (queue.push(frame)) return Sent::queued;
        flush(now_ns);
        return queue.push(frame) ? Sent::queued : counting_.drop(Sent::full);
    }

    void flush(std::int64_t now_ns) noexcept override {
        if (settings_.format == Format::packed) {
            flush_packed(now_ns);
        } else {
            flush_single(now_ns);
        }
        held_ = process_data_.size();
    }

    std::size_t receive(std::span<Frame> frames, std::int64_t now_ns) noexcept override {
        std::size_t count = 0;
        while (count < frames.size()) {
            if (next_ == filled_ && !refill(now_ns)) break;
            frames[count++] = buffer_[next_++];
        }
        return count;
    }

    Statistics statistics() const noexcept override {
        auto s = counting_.read(process_data_.size() + service_data_.size());
        const auto line = port_->statistics();
        // Messages dropped here are gaps in the sequence, too.
        s.lost_on_wire = s.lost - std::min(s.lost, line.lost);
        s.lost = s.lost_on_wire + line.lost;
        s.errors += line.errors;
        s.load = load_.share();
        return s;
    }
    int descriptor() const noexcept override { return port_->descriptor(); }
    bool rejected(Rejected& what) noexcept override { return rejections_.take(what); }
    std::vector<DeliveryTime> delivery_times() const override {
        return discipline_ ? discipline_->delivery_times(*settings_.slot)
                           : std::vector<DeliveryTime>{};
    }

    bool wait(std::int64_t at_most_ns) override {
        if (next_ != filled_) return true;
        if (!simulated_) return port_->wait(link::monotonic_ns() + at_most_ns);
        // a segment in memory does not wake a waiting thread
        constexpr std::int64_t step_ns = 100'000;
        for (; !refill(ethernet::unclocked); at_most_ns -= step_ns) {
            if (at_most_ns <= 0) return false;
            const timespec pause{0, static_cast<long>(std::min(step_ns, at_most_ns))};
            nanosleep(&pause, nullptr);
        }
        return true;
    }

private:
    /// Returns true for SDO, heartbeat, boot-up and LSS, which wait for messages with a deadline:
    /// process data, SYNC, NMT and EMCY.
    static bool is_service(const Frame& f) noexcept { return f.id >= 0x580; }
    /// Returns true for SYNC and the PDOs of the predefined connection set, of which only the
    /// newest is valid.
    static bool is_state(const Frame& f) noexcept {
        return !f.extended && !f.remote && (f.id == 0x080 || (f.id >= 0x180 && f.id < 0x580));
    }
    /// Replaces an older message still waiting from the last cycle, so that one delay does not
    /// accumulate. Returns true when it did.
    bool is_replaced(const Frame& frame) noexcept {
        if (held_ == 0 || !is_state(frame)) return false;
        for (std::size_t n = 0; n < held_; ++n) {
            Frame& older = *process_data_.at(n);
            if (older.id != frame.id || !is_state(older)) continue;
            older = frame;
            Counting::add(counting_.dropped);
            return true;
        }
        return false;
    }

    /// Returns the payload bytes a frame may have now; 0: nothing can leave.
    std::size_t capacity() const noexcept {
        if (!discipline_) return max_payload;
        std::size_t capacity = 0;
        discipline_->with([&](const ethernet::Discipline& d) {
            capacity = std::min(d.capacity(*settings_.slot), max_payload);
        });
        return capacity;
    }
    bool is_up() const noexcept {
        bool ready = !discipline_;
        if (discipline_) {
            discipline_->with([&](const ethernet::Discipline& d) { ready = d.ready(); });
        }
        return line_up_ && ready;
    }
    void look_at_line() noexcept {
        const auto line = port_->statistics();
        line_up_ = line.up;
        speed_ = line.speed;
        const auto is = is_up() ? State::active : State::down;

        const auto was = counting_.state.exchange(is, std::memory_order_relaxed);
        if (is == State::active && was == State::down && was_up_) {
            Counting::add(counting_.restarts);
        }
        was_up_ = was_up_ || is == State::active;
    }

    void address_to(const ethernet::Address& to) noexcept {
        std::copy(to.begin(), to.end(), frame_.begin());
    }

    /// Sends the frame in `frame_`. On `full` the caller keeps its messages for the next call.
    ethernet::Sent launch(std::size_t length, bool service, std::int64_t now_ns) noexcept {
        ethernet::Finisher* const finisher =
            settings_.format == Format::packed ? seal_.get() : nullptr;
        if (!line_up_) return count_dropped(ethernet::Sent::down);
        const std::span whole(frame_.data(), length);
        auto sent = ethernet::Sent::down;
        if (!discipline_) {
            sent = port_->send(whole, {.finisher = finisher}, now_ns);
        } else {
            // a station that may not send drops it and counts it
            discipline_->with([&](ethernet::Discipline& d) {
                sent = d.send(whole, *settings_.slot, settings_.priority + (service ? 1 : 0),
                              finisher);
            });
        }
        if (sent == ethernet::Sent::queued) {
            load_.add(length);
        }
        return sent;
    }
    /// Counts a frame that is not passed to the discipline.
    ethernet::Sent count_dropped(ethernet::Sent why) noexcept {
        if (discipline_) {
            discipline_->with([](ethernet::Discipline& d) { d.count_dropped(); });
        }
        return why;
    }
    /// Removes the first `count` messages of a queue and counts them as sent or lost.
    void done(hal::Queue<Frame>& queue, std::size_t count, ethernet::Sent sent) noexcept {
        if (sent == ethernet::Sent::queued) {
            for (std::size_t n = 0; n < count; ++n) {
                counting_.count_sent(*queue.at(n));
            }
        } else {
            Counting::add(counting_.dropped, count);
        }
        queue.drop(count);
    }

    void flush_single(std::int64_t now_ns) noexcept {
        for (auto* queue : {&process_data_, &service_data_}) {
            while (const Frame* f = queue->front()) {
                const auto to =
                    f->extended ? std::nullopt : nodes_.where(f->id, settings_.produced_to_master);
                address_to(to.value_or(ethernet::broadcast));
                const auto bytes =
                    put_single(*f, settings_.order,
                               std::span(frame_).subspan(ethernet::header_bytes, capacity()));
                const auto sent = bytes == 0 ? count_dropped(ethernet::Sent::rejected)
                                             : launch(ethernet::header_bytes + bytes,
                                                      queue == &service_data_, now_ns);
                if (sent == ethernet::Sent::full) return;
                done(*queue, 1, sent);
            }
        }
    }

    /// What one frame holds of the two queues, and where it goes.
    struct Packing {
        std::array<std::size_t, 2> counts{};  // process data, service data
        std::size_t bytes = 0;
        std::optional<ethernet::Address> to;  // nothing: to all

        std::size_t messages() const { return counts[0] + counts[1]; }
        bool is_service() const { return counts[0] == 0; }
    };

    std::size_t packed_header_bytes() const noexcept {
        return packed_header + (settings_.key ? counter_bytes : 0);
    }
    std::size_t packed_tail_bytes() const noexcept { return settings_.key ? tag_bytes : 0; }

    /// The part of the frame that messages are packed into; empty when it can hold none.
    std::span<std::uint8_t> packed_space() noexcept {
        const std::size_t header = packed_header_bytes();
        const std::size_t tail = packed_tail_bytes();
        const std::size_t payload = capacity();
        if (payload < header + tail) return {};
        return std::span(frame_).subspan(ethernet::header_bytes + header, payload - header - tail);
    }

    std::optional<ethernet::Address> destination_of(const Frame& f) noexcept {
        if (f.extended) return std::nullopt;
        return nodes_.where(f.id, settings_.produced_to_master);
    }

    /// Packs as many messages as fit, process data first. The frame goes to one station if all of
    /// them do.
    Packing pack() noexcept {
        const auto space = packed_space();
        Packing packing;
        const std::array queues{&process_data_, &service_data_};
        for (std::size_t q = 0; q < queues.size(); ++q) {
            while (const Frame* f = queues[q]->at(packing.counts[q])) {
                if (packing.messages() == max_messages) return packing;
                const std::size_t bytes = put_packed(*f, space.subspan(packing.bytes));
                if (bytes == 0) return packing;
                const auto to = destination_of(*f);
                const bool is_first = packing.messages() == 0;
                packing.to = is_first || packing.to == to ? to : std::nullopt;
                packing.bytes += bytes;
                ++packing.counts[q];
            }
        }
        return packing;
    }

    ethernet::Sent launch_packed(const Packing& packing, std::int64_t now_ns) noexcept {
        address_to(packing.to.value_or(ethernet::broadcast));
        const std::size_t length =
            ethernet::header_bytes + packed_header_bytes() + packing.bytes + packed_tail_bytes();
        const bool service = packing.is_service();
        begin_packed(std::span(frame_.data(), length),
                     static_cast<std::uint8_t>(packing.messages()),
                     service ? session_ | services_alone : session_, settings_.key.has_value());
        return launch(length, service, now_ns);
    }

    void flush_packed(std::int64_t now_ns) noexcept {
        while (process_data_.front() != nullptr || service_data_.front() != nullptr) {
            Packing packing = pack();
            auto sent = ethernet::Sent::rejected;
            if (packing.messages() == 0) {  // not even one fits
                count_dropped(sent);
                packing.counts[process_data_.front() != nullptr ? 0 : 1] = 1;
            } else {
                sent = launch_packed(packing, now_ns);
                if (sent == ethernet::Sent::full) return;
            }
            done(process_data_, packing.counts[0], sent);
            done(service_data_, packing.counts[1], sent);
        }
    }

    /// Opens the next frame with messages for this link. Returns false when no frame is left.
    bool refill(std::int64_t now_ns) noexcept {
        next_ = filled_ = 0;
        // per call: a babbling station must not delay the cycle without limit
        constexpr unsigned max_frames = 256;
        for (unsigned n = 0; n < max_frames; ++n) {
            const auto arrival = port_->receive(now_ns);
            if (!arrival) break;
            take(*arrival);
            if (filled_ != 0) return true;
        }
        const auto now =
            now_ns != ethernet::unclocked || simulated_ ? now_ns : link::monotonic_ns();
        if (now != looked_at_) {
            look_at_line();
            looked_at_ = now;
        }
        if (now != ethernet::unclocked) {
            load_.tick(now, speed_);
        }
        return false;
    }

    void take(const ethernet::Arrival& arrival) noexcept {
        const auto whole = arrival.bytes;
        if (whole.size() < ethernet::header_bytes || whole[12] != ether_type >> 8 ||
            whole[13] != (ether_type & 0xff)) {
            return Counting::add(counting_.errors);
        }
        Sender sender;
        std::copy_n(whole.begin() + 6, 6, sender.address.begin());
        sender.time_ns = arrival.time_ns;
        // a multicast source address is invalid
        if (is_multicast(sender.address)) return Counting::add(counting_.errors);
        load_.add(whole.size());
        if (discipline_) {
            discipline_->with([&](const ethernet::Discipline& d) {
                sender.origin = d.origin(sender.address, arrival.time_ns, whole.size());
            });
        }
        if (sender.origin == ethernet::Discipline::Origin::unknown_station) {
            return reject(Rejected::Why::unknown_station, 0, sender.address, arrival.time_ns);
        }
        if (settings_.format == Format::single) {
            take_single(whole.subspan(ethernet::header_bytes), sender);
        } else {
            take_packed(whole, sender);
        }
    }

    /// Who has sent an Ethernet frame, and when it arrived.
    struct Sender {
        ethernet::Address address{};
        std::int64_t time_ns = 0;
        ethernet::Discipline::Origin origin = ethernet::Discipline::Origin::plausible;
    };

    static bool is_multicast(const ethernet::Address& address) noexcept {
        return (address[0] & 1) != 0;
    }

    /// Returns false for a command that is not from the master, or not in its slot.
    bool is_allowed(const Frame& f, const Sender& sender) noexcept {
        if (Guard::negotiates(f)) {
            guard_.release();
        }
        if (!Guard::commands(f)) return true;
        if (sender.origin == ethernet::Discipline::Origin::out_of_slot) {
            reject(Rejected::Why::out_of_slot, f.id, sender.address, sender.time_ns);
            return false;
        }
        if (guard_.may_command(sender.address, sender.time_ns)) return true;
        reject(Rejected::Why::not_the_master, f.id, sender.address, sender.time_ns);
        return false;
    }

    void take_single(std::span<const std::uint8_t> bytes, const Sender& sender) noexcept {
        Frame f;
        if (get_single(bytes, settings_.order, f) != Wrong::none) {
            return Counting::add(counting_.errors);
        }
        if (is_allowed(f, sender)) {
            keep(f, sender.address, sender.time_ns);
        }
    }

    /// Takes all CAN frames of an Ethernet frame, or none when one of them is not allowed.
    void take_packed(std::span<const std::uint8_t> whole, const Sender& sender) noexcept {
        const ethernet::Address& from = sender.address;
        const bool to_many = (whole[0] & 1) != 0;
        Unpacker packed;
        switch (packed.open(whole, settings_.key ? &*settings_.key : nullptr)) {
        case Wrong::none: break;
        case Wrong::not_signed:
            return reject(Rejected::Why::unsigned_frame, 0, from, sender.time_ns);
        case Wrong::tag: return reject(Rejected::Why::wrong_tag, 0, from, sender.time_ns);
        default: return Counting::add(counting_.errors);
        }
        if (settings_.key && !replays_.fresh(from, packed.counter())) {
            return reject(Rejected::Why::replayed, 0, from, sender.time_ns);
        }
        Frame f;
        for (Unpacker look = packed; look.next(f);) {
            if (!is_allowed(f, sender)) return;
        }
        const auto verdict = streams_.take(from, to_many, packed.stamp(), sender.time_ns);
        if (verdict.lost != 0) {
            Counting::add(counting_.lost, verdict.lost);
        }
        if (!verdict.fresh) return Counting::add(counting_.errors);
        while (packed.next(f)) {
            keep(f, from, sender.time_ns);
        }
    }

    void reject(Rejected::Why why, std::uint32_t id, const ethernet::Address& from,
                std::int64_t now_ns) noexcept {
        Counting::add(counting_.rejected);
        rejections_.add(why, id, from, now_ns);
    }

    void keep(Frame& f, const ethernet::Address& from, std::int64_t time_ns) noexcept {
        f.time_ns = time_ns;
        if (settings_.learns && !f.extended && !f.remote && !nodes_.learn(f.id, from, time_ns)) {
            Counting::add(counting_.errors);
        }
        if (!filters_.pass(f)) return;
        counting_.count_received(f);
        buffer_[filled_++] = f;
    }

    const Settings settings_;
    const Options options_;
    const std::unique_ptr<ethernet::Port> port_;
    const std::shared_ptr<ethernet::DisciplineHandle> discipline_;  // nullptr: frames leave at once
    const std::uint16_t session_;
    const bool simulated_;
    Load load_;
    Nodes nodes_;
    std::atomic<bool> line_up_{true};  // written by the receiving thread

    hal::Queue<Frame> process_data_, service_data_;  // used by the sending thread, as the next four
    // at the front of process_data_: left by the last flush()
    std::size_t held_ = 0;
    std::shared_ptr<Seal> seal_;
    std::array<std::uint8_t, ethernet::max_frame> frame_{};

    Streams streams_;  // from here on: used by the receiving thread
    Guard guard_;
    Rejections rejections_;
    Replays replays_;
    std::array<Frame, max_messages> buffer_;
    std::size_t next_ = 0;
    std::size_t filled_ = 0;
    std::int64_t looked_at_ = ethernet::unclocked;
    std::uint32_t speed_ = 0;
    bool was_up_ = false;
};

}  // namespace

Description describe(const std::string& target) {
    Settings settings;
    (void)parse(target, settings, false);  // open() reports what is wrong with the options
    return describe_settings(settings);
}

Opened open(const std::string& target, const Options& options) {
    Settings settings;
    if (auto problem = parse(target, settings); !problem.empty()) {
        return {nullptr, std::move(problem)};
    }
    if (options.fd) {
        return {nullptr, "0x9023 frames cannot carry CAN FD; remove fd"};
    }
    ethernet::Options how;
    how.types = {ether_type};
    how.receive_capacity = std::clamp<std::size_t>(options.receive_capacity / 8, 64, 1024);
    const std::string segment = settings.segment + settings.segment_options;
    auto opened = ethernet::open(segment, how);
    if (!opened) {  // the caller adds the address as written
        if (opened.problem.starts_with(segment + ": ")) {
            opened.problem.erase(0, segment.size() + 2);
        }
        return {nullptr, std::move(opened.problem)};
    }
    std::shared_ptr<ethernet::DisciplineHandle> discipline;
    if (settings.slot) {
        discipline = ethernet::discipline_of(*opened.port);
        if (!discipline) {
            return {nullptr, "no TDMA runs on " + settings.segment +
                                 "; loadrt tdma for it first, or remove slot="};
        }
        std::size_t capacity = 0;
        discipline->with(
            [&](const ethernet::Discipline& d) { capacity = d.capacity(*settings.slot); });
        if (capacity <
            packed_header + max_message_size + (settings.key ? counter_bytes + tag_bytes : 0)) {
            return {nullptr, "TDMA on " + settings.segment + " has no slot " +
                                 std::to_string(*settings.slot) + " of at least " +
                                 (settings.key ? "60" : "46") +
                                 " bytes; add one to the schedule, or change slot="};
        }
    }
    // Different for each link of this machine, and repeatable on a segment in memory.
    static std::atomic<std::uint16_t> opened_before{0};
    auto session = ++opened_before;
    if (!opened.port->description().simulated) {
        session = static_cast<std::uint16_t>(session ^ link::clock_ns(CLOCK_REALTIME) / 1'000'000);
    }
    session = static_cast<std::uint16_t>(session & ~services_alone);
    return {std::make_unique<CaneLink>(std::move(settings), options, std::move(opened.port),
                                       std::move(discipline), session),
            {}};
}

}  // namespace hal::can::cane
