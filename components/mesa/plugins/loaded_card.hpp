// SPDX-License-Identifier: MIT
// The load arguments of an instance, and the card that they name.
#pragma once

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "hal/component.hpp"
#include "hal/hardware.h"
#include "hal/naming.hpp"
#include "hal/texts.hpp"
#include "mesa/driver/card_image.hpp"
#include "mesa/driver/remote_discovery.hpp"
#include "mesa/hostmot2/registers.hpp"
#include "mesa/lbp16/spaces.hpp"

namespace hal::mesa {

/// How a component names its arguments.
struct MesaNames {
    const char* board;      ///< name of the argument
    const char* board_doc;  ///< what it is
    const char* example;    ///< how it is written
    bool is_linuxcncs;      ///< has the other arguments of LinuxCNC's driver
};

/// The first base of a component: it reads what the card has before the pins are declared, because
/// the pins and the name of the instance depend on it. It contacts the card also for `hal check`,
/// and only reads, unless smart serial is used. In an editor it contacts none.
class LoadedCard {
protected:
    LoadedCard(const hal_host* host, const MesaNames& names) {
        hal::Component c(host);
        const hal::TextArgument board(c, names.board, "", names.board_doc, {.per_instance = true});
        const hal::TextArgument config(
            c, "config", "",
            "modules in use: num_encoders=N num_stepgens=N … sserial_port_0=MODES; a list has an "
            "element for each card",
            {.per_instance = true});
        const hal::TextArgument clock(c, "clock", "thread",
                                      "thread: the timers of the card follow the thread; card: all "
                                      "threads follow the DPLL of the card");
        if (names.is_linuxcncs) {
            const hal::TextArgument mac(c, "board_mac", "", "not used", {.per_instance = true});
            const hal::Argument debug(c, "debug", 0, "not used");
        }
        parse(config.get());
        leads_ = parse_clock(clock.get());
        if (!board.get().empty()) {
            contact(names, board.get());
        } else if (hal::Texts(c).offered()) {
            throw std::invalid_argument(std::string("missing card; type: loadrt ") + names.example);
        } else {
            image_ = example_card();
        }
        const hal::InstanceName instance(c, ("hm2_" + image_.name).c_str());
        claim(names);
        if (const std::string problem = apply(config_, image_); !problem.empty()) {
            throw hal::ArgumentError("config", problem);
        }
        discover(names);
    }

    /// Throws when another program sends requests to the card. [setup]
    void check_alone(SetupLink& link) const {
        if (link.in_memory()) return;
        const std::uint16_t before = received(link);
        const std::uint32_t sent_before = link.sent();
        const timespec pause{0, 20'000'000};
        nanosleep(&pause, nullptr);
        const std::uint16_t after = received(link);
        const auto others = static_cast<std::uint16_t>(after - before) -
                            static_cast<int>(link.sent() - sent_before);
        if (others > 0) {
            throw CardError(image_.address + " (" + image_.card +
                            "): another program uses this card (" + std::to_string(others) +
                            " requests in 20 ms); stop it first: a card has one master");
        }
    }

    ConfigString config_;
    CardImage image_;
    std::unique_ptr<datagram::Port> port_;  ///< nullptr: an example
    std::shared_ptr<const std::string> claim_;
    std::vector<RemotePort> remote_ports_;
    std::vector<unsigned> inm_widths_, inmux_widths_;
    bool leads_ = false;  ///< the DPLL of the card leads the threads

private:
    static std::uint16_t received(SetupLink& link) {
        return load<std::uint16_t>(link.read16(Space::status, status::received_packets, 1).data());
    }
    void parse(const std::string& text) {
        const ConfigString::Problem problem = config_.parse(text);
        if (problem.text.empty()) return;
        throw hal::ArgumentError("config", problem.text, problem.help);
    }
    static bool parse_clock(const std::string& text) {
        if (text == "thread" || text == "card") return text == "card";
        throw hal::ArgumentError("clock", "invalid clock '" + text + "'; write thread or card");
    }
    static bool is_hardware_denied() {
        const auto* const hardware = hal::extension<hal_hardware>(HAL_HARDWARE);
        return hardware != nullptr && !hardware->request(hal::detail::creating);
    }
    void contact(const MesaNames& names, const std::string& board) {
        const std::string address = datagram::address_of(board);
        if (!datagram::describe(address).in_memory && is_hardware_denied()) {
            hal::detail::rejected();
        }
        datagram::Opened opened = datagram::open(address, {.port = udp_port});
        if (!opened) {
            throw hal::ArgumentError(names.board, opened.problem);
        }
        port_ = std::move(opened.port);
        try {
            SetupLink link(*port_);
            image_ = probe(link);
        } catch (const CardError& e) {
            throw hal::ArgumentError(names.board, e.what());
        }
    }
    /// Before the first request that writes.
    void claim(const MesaNames& names) {
        if (port_ == nullptr) return;
        const std::string& address = port_->description().address;
        const std::string component = names.is_linuxcncs ? "hm2_eth" : "mesa";
        datagram::Claimed claimed =
            datagram::claim(address, hal::own_name("hm2_card.0") + " (" + component + ")");
        if (!claimed) {
            throw hal::ArgumentError(
                names.board, address + " (" + image_.card + "): " + claimed.holder +
                                 " uses this card; unload that first: a card has one master");
        }
        claim_ = std::move(claimed.claim);
    }
    void discover(const MesaNames& names) {
        if (port_ == nullptr) return;
        SetupLink link(*port_);
        try {
            inm_widths_ = read_widths(link, Tag::inm);
            inmux_widths_ = read_widths(link, Tag::inmux);
            if (has_serial()) {
                check_alone(link);
                remote_ports_ = discover_remotes(link, image_, config_);
                release_channels();
            }
        } catch (const CardError& e) {
            throw hal::ArgumentError(names.board, e.what());
        }
    }
    /// As in LinuxCNC's driver.
    void release_channels() {
        for (unsigned port = 0; port < ConfigString::max_ports; ++port) {
            const auto found = std::ranges::find(remote_ports_, port, &RemotePort::port);
            image_.release_channels(port, found == remote_ports_.end() ? 0 : found->mask());
        }
    }
    bool has_serial() const {
        for (const Tag tag : {Tag::smart_serial, Tag::wide_smart_serial}) {
            const CardModule* const module = image_.find(tag);
            if (module == nullptr) continue;
            for (unsigned port = 0; port < module->used; ++port) {
                if (image_.serial_channels(config_, port) != 0) return true;
            }
        }
        return false;
    }
    std::vector<unsigned> read_widths(SetupLink& link, Tag tag) const {
        std::vector<unsigned> widths;
        const CardModule* const module = image_.find(tag);
        for (unsigned unit = 0; module != nullptr && unit < module->used; ++unit) {
            const std::uint32_t control = link.read32(module->addresses.at(inm::control, unit));
            widths.push_back((control & 0x1fU) + 1);
        }
        return widths;
    }
};

}  // namespace hal::mesa
