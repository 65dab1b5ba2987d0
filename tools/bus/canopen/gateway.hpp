// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "bus/can/bus_options.hpp"

namespace hal::tools {

struct GatewayOptions : Options {
    std::string connect;         ///< client mode, if not empty
    std::string socket, listen;  ///< where the gateway listens
    std::string state;           ///< a file
    /// reported by the gateway's own node
    std::string identity, vendor_name, product_name, order_code;

    void declare(OptionSet& set) override {
        set.words(
            "ADDRESS",
            "the buses, as nets 1, 2 …; with --connect: a command, or several in quotation marks",
            false);
        set.value("--connect", connect, "HOST:PORT|PATH",
                  "client of a running gateway: 127.0.0.1:6000 or its socket; without commands: an "
                  "interactive session");
        set.value(
            "--socket", socket, "PATH",
            "create this local socket (default: halcyon-canopen-gateway in $XDG_RUNTIME_DIR)");
        set.value("--listen", listen, "ADDRESS:PORT",
                  "listen on a local TCP port instead: 127.0.0.1:6000");
        set.value("--state", state, "FILE", "file for the settings of `store`, read at start-up");
        set.value(
            "--identity", identity, "VENDOR,PRODUCT,REVISION,SERIAL",
            "identity of the gateway's own node (1018h) and of `info version` (default: 0,0,0,0)");
        set.value("--vendor-name", vendor_name, "TEXT",
                  "vendor name of its own node (default: Halcyon)");
        set.value("--product-name", product_name, "TEXT",
                  "product name of its own node (default: Halcyon CiA 309-3 gateway)");
        set.value("--order-code", order_code, "TEXT",
                  "order code of its own node (default: empty)");
    }
};

/// `hal can gateway`. Returns the exit code.
int run_can_gateway(const GatewayOptions&);

/// Runs the client of --connect. Returns the exit code.
int run_can_gateway_client(const GatewayOptions&);

}  // namespace hal::tools
