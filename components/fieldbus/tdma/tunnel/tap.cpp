// SPDX-License-Identifier: MIT
#include "tap.hpp"

#include <arpa/inet.h>
#include <poll.h>

#include <algorithm>
#include <bit>
#include <thread>

#include "hal/message_log.hpp"
#include "link/system.hpp"
#include "tap/tap.hpp"
#include "text/numbers.hpp"

namespace hal::tdma {

namespace {

// The cycle cannot wake a thread without a system call, so the thread polls, faster while packets
// pass.
constexpr int busy_ms = 1;
constexpr int idle_ms = 5;
// an error may be transient; after so many polls the interface is lost for this descriptor
constexpr unsigned max_errors = 200;
constexpr Time busy_for = 200'000'000;
constexpr std::size_t at_once = 64;  // packets in one direction before the other is served

class TapDevice final : public Tap {
public:
    TapDevice(Tunnel& tunnel, hal::LinePrefix prefix) : tunnel_(tunnel), log_(std::move(prefix)) {}
    ~TapDevice() override {
        ended_.store(true);
        if (thread_.joinable()) {
            thread_.join();
        }
    }
    const std::string& name() const noexcept override { return interface_.name(); }
    void scheduled(const std::optional<config::Ip>& ip, std::size_t mtu) noexcept override {
        news_.store(valid | (ip ? has_ip | std::bit_cast<std::uint32_t>(*ip) : 0) |
                        std::uint64_t{mtu} << 34,
                    std::memory_order_release);
    }

    /// Opens the interface. Returns the reason of a failure. [setup]
    std::string open(const TapSetup& setup) {
        has_ip_ = setup.ip.has_value();
        if (setup.ip) {
            ip_ = *setup.ip;
        }
        shown_mtu_ = tunnel_.mtu();
        if (auto problem =
                interface_.open({setup.name, setup.address, shown_mtu_, setup.ip, setup.prefix});
            !problem.empty()) {
            return problem;
        }
        show_carrier(false);
        thread_ = std::thread([this] { run(); });
        return {};
    }

private:
    // MTU above these bits, IP below
    static constexpr std::uint64_t valid = std::uint64_t{1} << 32;

private:
    // MTU above these bits, IP below
    static constexpr std::uint64_t has_ip = std::uint64_t{1} << 33;

    /// Uses a schedule received by RTcfg.
    void apply(std::uint64_t news) {
        const std::size_t mtu = news >> 34;
        if ((news & has_ip) != 0) {
            has_ip_ = true;
            ip_ = std::bit_cast<config::Ip>(static_cast<std::uint32_t>(news));
            if (const auto problem = interface_.set_ip(ip_); !problem.empty()) {
                log(problem);
            }
        }
        if (mtu == 0) {
            log("tunnel: ordinary packets use slot 1, and the block of this station has none; add "
                "slot 1 OFFSET to it in the "
                "master's file");
        } else {
            log("tunnel open for ordinary packets: " + name() + ", MTU " + std::to_string(mtu) +
                (has_ip_ ? ", IP " + config::to_string(ip_) : ""));
        }
    }
    void show_carrier(bool up) noexcept {
        interface_.show_carrier(up);
        carrier_ = up;
    }
    void log(const std::string& sentence) { log_.print(sentence); }

    void run() {
        pthread_setname_np(pthread_self(), "tap");
        Time busy_until = 0;
        while (!ended_.load()) {
            if (const auto news = news_.exchange(0, std::memory_order_acquire); news != 0) {
                apply(news);
            }
            if (const std::size_t mtu = tunnel_.mtu(); mtu != shown_mtu_) {  // the schedule changed
                if (const auto problem = interface_.set_mtu(mtu); !problem.empty()) {
                    log(problem);
                }
                shown_mtu_ = mtu;
            }
            log_.flush();
            if (tunnel_.open() != carrier_) {
                show_carrier(!carrier_);
            }
            const Time now = link::monotonic_ns();
            if (write_all() + read_all() != 0) {
                busy_until = now + busy_for;
            }
            pollfd source{interface_.descriptor(), POLLIN, 0};
            ::poll(&source, 1, now < busy_until ? busy_ms : idle_ms);
            if ((source.revents & (POLLERR | POLLHUP | POLLNVAL)) == 0) {
                gone_ = 0;
            } else if (++gone_ == max_errors) {
                log("interface " + name() +
                    " was deleted; ordinary packets pass again after unloadrt and loadrt");
                return;
            } else {
                std::this_thread::sleep_for(std::chrono::milliseconds(idle_ms));
            }
        }
    }
    std::size_t write_all() noexcept {
        std::size_t packets = 0;
        for (std::size_t length = 0; packets < at_once && (length = tunnel_.take(buffer_)) != 0;
             ++packets) {
            interface_.write({buffer_.data(), length});
        }
        return packets;
    }
    std::size_t read_all() noexcept {
        std::size_t packets = 0;
        for (; packets < at_once; ++packets) {
            const std::size_t length = interface_.read(buffer_);
            if (length == 0) break;
            tunnel_.give({buffer_.data(), length});
        }
        return packets;
    }

    Tunnel& tunnel_;
    hal::MessageLog log_;
    // used by the thread while that runs, as the next two
    tap::Interface interface_;
    config::Ip ip_{};
    bool has_ip_ = false;
    std::size_t shown_mtu_ = 0;
    bool carrier_ = false;
    unsigned gone_ = 0;
    // space for a VLAN tag, so that such a frame is counted
    std::array<std::uint8_t, ethernet::max_frame + 4> buffer_{};
    // written by the cycle, taken by the thread; 0: none
    std::atomic<std::uint64_t> news_{0};
    std::atomic<bool> ended_{false};
    std::thread thread_;
};

}  // namespace

OpenedTap open_tap(Tunnel& tunnel, const TapSetup& setup, const hal::LinePrefix& prefix) {
    auto tap = std::make_unique<TapDevice>(tunnel, prefix);
    if (auto problem = tap->open(setup); !problem.empty()) {
        return {nullptr, std::move(problem)};
    }
    return {std::move(tap), {}};
}

std::string wrong_name(std::string_view name) { return tap::wrong_name(name); }

std::optional<unsigned> parse_prefix(std::string_view text) {
    if (const auto mask = config::parse_ip(text)) {
        const std::uint32_t bits = ntohl(std::bit_cast<std::uint32_t>(*mask));
        if (std::countl_one(bits) + std::countr_zero(bits) < 32) {
            return {};
        }
        return static_cast<unsigned>(std::countl_one(bits));
    }
    unsigned bits = 0;
    return parse_whole(text, bits) && bits <= 32 ? std::optional(bits) : std::nullopt;
}

}  // namespace hal::tdma
