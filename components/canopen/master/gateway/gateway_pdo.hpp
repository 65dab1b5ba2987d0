// SPDX-License-Identifier: MIT
// The gateway's own PDOs: no object dictionary, only values of types, as `set rpdo` and `set tpdo`
// name them.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "canopen/protocol/frames.hpp"
#include "gateway_command.hpp"

namespace hal::canopen::gateway {

class Pdos {
public:
    explicit Pdos(FrameQueue& out) : out_(out) {}

    /// `set rpdo` and `set tpdo`. Data types are not supported: their numbers were withdrawn.
    Error configure(bool received, const Command&);
    /// `r p N`: "pdo 1 2 17 -5". Error::state: nothing has come yet.
    Error read(unsigned number, std::string& text) const;
    /// `w p N`: sends it, now or by its transmission type.
    Error write(const Command&, std::string& why);
    /// Requests a PDO of type `rtr`; returns false for another type.
    bool request(unsigned number);
    bool arrived(unsigned number) const;

    /// Gets the text of a PDO that has been received.
    using Report = std::function<void(const std::string&)>;

    /// Passes on PDOs, remote requests and SYNC.
    void handle(const Frame&, const Report& on_pdo);
    void clear() {
        received_.clear();
        sent_.clear();
    }

private:
    struct Pdo {
        std::uint32_t cob = 0;
        std::uint32_t transmission = on_event;
        std::vector<const Format*> formats = {};
        std::array<std::uint8_t, 8> data = {};
        /// has a value; of a synchronous one sent: it waits for its SYNC
        bool fresh = false;
        bool held = false;         ///< received, and waits for the SYNC
        std::array<std::uint8_t, 8> waiting = {};
        unsigned syncs = 0;
    };
    static unsigned bits(const Pdo&);
    static std::string text(unsigned number, const Pdo&);
    bool send(const Pdo&);
    void pass_synchronous(const Report&);
    void send_synchronous();
    void send_requested(const Frame&);
    void accept(const Frame&, const Report&);

    FrameQueue& out_;
    std::map<unsigned, Pdo> received_, sent_;
};

}  // namespace hal::canopen::gateway
