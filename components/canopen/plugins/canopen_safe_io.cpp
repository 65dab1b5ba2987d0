// SPDX-License-Identifier: MIT
#include "canopen/device/component.hpp"
#include "canopen/device/safety/safe_io.hpp"
#include "hal/edge.hpp"

namespace {

using namespace hal::canopen;

struct CanopenSafeIo final : NodeComponent {
    explicit CanopenSafeIo(const hal_host* host) : NodeComponent(host, 3) {}

    hal::Function run{*this, "update", &CanopenSafeIo::update,
                      "receives and sends frames, copies values between pins and objects"};

    hal::Ins<bool> in{*this, "in-#", 8, "terminal of safety input #"};
    hal::Outs<bool> out{*this,
                        "out-#",
                        8,
                        "terminal of safety output #; off unless the last SRDO is valid",
                        {.safe = false}};
    hal::In<bool> acknowledge{
        *this, "acknowledge",
        "rising edge: acknowledges a fault; outputs follow the next valid SRDO"};
    hal::In<bool> fail_safe{*this, "fail-safe",
                            "rising edge: sends the global fail-safe command (GFC)"};
    hal::Out<std::uint32_t> fault{*this, "fault",
                                  "cause of the outputs being off: 0 no fault, 1 late, 2 "
                                  "incomplete, 3 order, 4 length, 5 not inverted, "
                                  "6 global fail-safe command, 7 own objects do not match"};
    hal::Out<bool> configured{*this, "configured",
                              "the SRDO configuration is valid (13FEh): its signatures match"};

    void update(hal::Cycle cycle) noexcept {
        for (unsigned n = 0; n < 8; ++n) {
            io_->set_input(n, in[n]);
        }
        if (acknowledge_edge_.rises(acknowledge)) {
            io_->acknowledge(cycle.start_ns());
        }
        if (fail_safe_edge_.rises(fail_safe)) {
            io_->send_fail_safe();
        }
        turn(cycle);
        const bool on = node().powered();
        for (unsigned n = 0; n < 8; ++n) {
            out[n] = on && io_->output(n);
        }
        fault = static_cast<std::uint32_t>(io_->fault());
        configured = on && node().device().srdos().configuration_valid();
    }

private:
    Program& program() override {
        io_ = std::make_unique<SafeIo>(
            SafeIoSettings{.serial = serial(), .heartbeat_ms = heartbeat()});
        return *io_;
    }
    std::unique_ptr<SafeIo> io_;
    hal::RisingEdge acknowledge_edge_;
    hal::RisingEdge fail_safe_edge_;
};

}  // namespace

HAL_COMPONENT(CanopenSafeIo, "canopen_safe_io", "Simulated CANopen safety I/O node (EN 50325-5)",
              R"(
Eight safety inputs, sent by SRDO 1, and eight safety outputs, received by SRDO 2, after EN 50325-5
(CiA 304). It implements the protocol for testing a machine and is not a certified safety device: do
not rely on it for anyone's safety.

Both SRDOs are active once a master has configured them (`tsrdo1` and `rsrdo2` of its
configuration). A changed input is sent at once, otherwise every refresh time. Any fault switches
the outputs off: an SRDO that is late, incomplete, out of order or not inverted, or a global
fail-safe command. They stay off until a rising edge of `acknowledge`, or until the node is started
again. The faults no-srdo, srdo-half, srdo-wrong, srdo-order and late-srdo (load argument `faults=`)
corrupt the SRDOs it sends.
    loadrt canopen_safe_io link=sim:cell id=7 faults=srdo-wrong
    addf canopen-safe-io.0.update servo
    start
)")
