// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <numbers>

#include "estimation/furuta_identification.hpp"
#include "hal/component.hpp"
#include "hal/lasting_fault.hpp"
#include "hal/limit.hpp"
#include "hal/retained.hpp"

namespace {

using hal::estimation::FurutaParameters;

enum class Phase : std::uint32_t { off, swing_up, balance };

struct FurutaControl : hal::Component {
    using Component::Component;

    hal::In<bool> enable{*this, "enable", "FALSE sets the torque to 0"};
    hal::In<bool> gains_valid{*this,
                              "gains-valid",
                              "TRUE: the gains are valid; FALSE prevents balancing",
                              {.initial = true}};
    hal::In<double> arm_angle{*this, "arm-angle", "arm angle", {.unit = "rad"}};
    hal::In<double> arm_velocity{*this, "arm-velocity", "arm velocity", {.unit = "rad/s"}};
    hal::In<double> pendulum_angle{
        *this, "pendulum-angle", "pendulum angle; 0 hanging down", {.unit = "rad"}};
    hal::In<double> pendulum_velocity{
        *this, "pendulum-velocity", "pendulum velocity", {.unit = "rad/s"}};
    hal::In<double> pendulum_age{
        *this,
        "pendulum-age",
        "age of the pendulum's measurements; they are predicted by this time",
        {.unit = "s"}};
    hal::In<bool> identify{*this,
                           "identify",
                           "TRUE: the rig's parameters are identified during motion; FALSE: the "
                           "parameters below are used",
                           {.initial = true}};
    hal::In<double> arm_command{*this, "arm-command", "commanded arm angle", {.unit = "rad"}};

    hal::In<double> gain_arm{
        *this, "gain-arm", "balance: torque per angle of the arm", {.unit = "N*m/rad"}};
    hal::In<double> gain_pendulum{*this,
                                  "gain-pendulum",
                                  "balance: torque per angle of the pendulum from upright",
                                  {.unit = "N*m/rad"}};
    hal::In<double> gain_arm_velocity{
        *this, "gain-arm-velocity", "balance: torque per speed of the arm", {.unit = "N*m*s/rad"}};
    hal::In<double> gain_pendulum_velocity{*this,
                                           "gain-pendulum-velocity",
                                           "balance: torque per speed of the pendulum",
                                           {.unit = "N*m*s/rad"}};

    hal::Out<double> voltage{
        *this, "voltage", "motor voltage", {.unit = "V", .safe = 0.0, .finite = true}};
    hal::Out<double> torque{
        *this, "torque", "commanded torque", {.unit = "N*m", .safe = 0.0, .finite = true}};
    hal::Out<double> from_upright{*this,
                                  "from-upright",
                                  "predicted angle of the pendulum from upright, -pi..pi",
                                  {.unit = "rad", .finite = true}};
    hal::Out<double> energy{*this,
                            "energy",
                            "energy of the pendulum relative to that upright at standstill",
                            {.finite = true}};
    hal::Out<std::uint32_t> phase{*this, "phase", "0 off, 1 swinging up, 2 balancing"};
    hal::Out<bool> balanced{*this, "balanced",
                            "TRUE: upright within upright-angle for upright-time"};
    hal::Out<std::uint32_t> catches{*this, "catches",
                                    "number of transitions from swing-up to balancing"};
    hal::Out<bool> homed{*this,
                         "homed",
                         "FALSE: the pendulum oscillates around an angle other than 0, because it "
                         "was moving at the start; the torque is 0",
                         {.initial = true}};
    hal::Out<double> zero_offset{*this,
                                 "zero-offset",
                                 "identified angle around which the pendulum oscillates",
                                 {.unit = "rad", .finite = true}};
    hal::Out<double> identified_frequency{
        *this,
        "identified-frequency",
        "identified frequency of small oscillations with the arm fixed",
        {.unit = "rad/s", .finite = true}};
    hal::Out<std::uint32_t> bad_inputs{*this, "bad-inputs",
                                       "cycles with a NaN or infinite angle or speed, or an angle "
                                       "of the pendulum beyond 1e6 rad; the torque is 0"};

    hal::LimitParam max_acceleration{*this,
                                     "max-acceleration",
                                     "swing-up: maximum acceleration of the arm",
                                     {.initial = 30.0, .unit = "rad/s^2"}};
    hal::Param<double> energy_gain{
        *this,
        "energy-gain",
        "swing-up: requested acceleration, in multiples of max-acceleration, at zero energy",
        {.initial = 20.0}};
    hal::Param<double> energy_target{*this,
                                     "energy-target",
                                     "swing-up: target for energy; above 1 to compensate friction",
                                     {.initial = 1.15}};
    hal::Param<double> centre_gain{*this,
                                   "centre-gain",
                                   "swing-up: acceleration per angle of the arm from arm-command",
                                   {.initial = 15.0, .unit = "1/s^2"}};
    hal::Param<double> centre_damping{*this,
                                      "centre-damping",
                                      "swing-up: acceleration per speed of the arm",
                                      {.initial = 0.0, .unit = "1/s"}};
    hal::LimitParam max_velocity{
        *this,
        "max-arm-velocity",
        "swing-up: maximum speed of the arm; balancing ends at 1.25 times this speed",
        {.initial = 6.5, .unit = "rad/s"}};
    hal::Param<double> catch_angle{
        *this,
        "catch-angle",
        "maximum angle from upright at which balancing starts, if the prediction succeeds",
        {.initial = 0.4, .unit = "rad"}};
    hal::LimitParam lose_angle{*this,
                               "lose-angle",
                               "angle from upright at which balancing ends",
                               {.initial = 0.6, .unit = "rad"}};
    hal::LimitParam arm_reach{*this,
                              "arm-reach",
                              "balance: limit of the arm's deviation from arm-command",
                              {.initial = 1.0, .unit = "rad"}};
    hal::Param<double> upright_angle{*this,
                                     "upright-angle",
                                     "maximum angle from upright for balanced",
                                     {.initial = 0.1, .unit = "rad"}};
    hal::Param<double> upright_time{*this,
                                    "upright-time",
                                    "time within upright-angle for balanced",
                                    {.initial = 0.5, .unit = "s"}};

    hal::LimitParam max_torque{
        *this,
        "max-torque",
        "maximum torque of motor and amplifier: torque constant times current limit",
        {.initial = 0.2708, .unit = "N*m"}};
    hal::Param<double> torque_constant{*this,
                                       "torque-constant",
                                       "motor: torque per current, and voltage per speed",
                                       {.initial = 0.0677, .unit = "N*m/A"}};
    hal::Param<double> resistance{
        *this, "resistance", "motor: winding resistance", {.initial = 0.68, .unit = "Ohm"}};
    hal::Param<double> friction{*this,
                                "friction",
                                "Coulomb friction of the arm, compensated during swing-up",
                                {.initial = 0.008, .unit = "N*m"}};
    hal::Param<double> arm_inertia{
        *this,
        "arm-inertia",
        "inertia of arm, rotor and the pendulum's mass at the arm's end about the motor axis",
        {.initial = 6.7417e-3, .unit = "kg*m^2"}};
    hal::Param<double> swing_inertia{*this,
                                     "pendulum-inertia",
                                     "inertia of the pendulum about its pivot",
                                     {.initial = 3e-3, .unit = "kg*m^2"}};
    hal::Param<double> coupling{
        *this,
        "coupling",
        "pendulum mass times arm length times distance from pivot to centre of mass",
        {.initial = 3e-3, .unit = "kg*m^2"}};
    hal::Param<double> weight_moment{*this,
                                     "weight-moment",
                                     "pendulum weight times distance from pivot to centre of mass",
                                     {.initial = 0.147099750, .unit = "N*m"}};

    hal::Function run{*this, "update", &FurutaControl::update,
                      "runs one step of swing-up or balancing"};

    void start() { faults_ = hal::extension<hal_faults>("hal.faults/1"); }

    void update(hal::Cycle cycle) noexcept {
        const double dt = cycle.seconds();
        State s{arm_angle - arm_command, pendulum_angle, arm_velocity, pendulum_velocity};
        const bool is_usable = std::isfinite(s.arm + s.pendulum + s.arm_speed + s.pendulum_speed) &&
                               std::fabs(s.pendulum) < 1e6;
        if (!is_usable) {
            bad_inputs = bad_inputs + 1;
            balanced = false;
            upright_s_ = 0.0;
            identification_.forget_motion();
            // the phase stays: one bad sample does not end balancing
            return command_torque(0.0, 0.0);
        }
        update_rig(s, dt);
        predict_pendulum(s);
        const double tilt = std::remainder(s.pendulum - std::numbers::pi, 2.0 * std::numbers::pi);
        const double relative_energy = energy_of_pendulum(tilt, s);
        from_upright = tilt;
        energy = relative_energy;

        choose_phase(tilt, s);
        upright_s_ = std::fabs(tilt) < upright_angle ? upright_s_ + dt : 0.0;
        balanced = now_ == Phase::balance && upright_s_ >= upright_time;
        switch (now_) {
        case Phase::off: return command_torque(0.0, 0.0);
        case Phase::balance: return command_torque(balancing_torque(tilt, s), s.arm_speed);
        case Phase::swing_up:
            return command_torque(swing_up_torque(relative_energy, s), s.arm_speed);
        }
    }

private:
    struct State {
        double arm, pendulum, arm_speed, pendulum_speed;
    };

    /// Returns the energy of the pendulum relative to that upright at standstill, as it is in the
    /// frame that turns with the arm, so less the centrifugal part; 0 when it is not finite.
    double energy_of_pendulum(double tilt, const State& s) const noexcept {
        const double centrifugal_speed = s.arm_speed * std::sin(tilt);
        const double kinetic =
            0.5 * rig_.pendulum_inertia *
            (s.pendulum_speed * s.pendulum_speed - centrifugal_speed * centrifugal_speed);
        const double weight = rig_.weight_moment;
        if (!(weight > 0.0)) return 0.0;
        const double relative = (kinetic + weight * (1.0 + std::cos(tilt))) / (2.0 * weight);
        return std::isfinite(relative) ? relative : 0.0;
    }

    /// Sets the rig to that of the parameters or, with `identify`, to the one identified from its
    /// motion, and `homed`.
    void update_rig(const State& s, double dt) noexcept {
        const FurutaParameters nominal{arm_inertia, swing_inertia, coupling, weight_moment,
                                       friction};
        if (!identify || !is_physical(nominal)) {
            rig_ = nominal;
            homed = true;
            identification_ = {};
            return;
        }
        restart_identification(nominal, dt);
        identification_.add({arm_angle, s.pendulum, s.arm_speed, s.pendulum_speed, torque},
                            pendulum_age, now_ == Phase::swing_up);
        rig_ = identification_.estimate();
        check_zero();
        zero_offset = identification_.zero_offset();
        identified_frequency = std::sqrt(rig_.weight_moment / rig_.pendulum_inertia);
    }

    static bool is_physical(const FurutaParameters& rig) noexcept {
        return rig.arm_inertia > 0.0 && rig.pendulum_inertia > 0.0 && rig.coupling > 0.0 &&
               rig.weight_moment > 0.0;
    }

    /// Restarts the identification for other parameters or another period, and when `enable` rises
    /// after the zero of the pendulum was found wrong.
    void restart_identification(const FurutaParameters& nominal, double dt) noexcept {
        const bool enable_rises = enable && !was_enabled_;
        was_enabled_ = enable;
        const bool is_other_rig =
            nominal != identification_.nominal() || dt != identification_.dt();
        if (is_other_rig || (enable_rises && !homed)) {
            identification_.restart(nominal, dt);
            homed = true;
        }
    }

    /// Ends `homed` if the pendulum does not hang at 0, because every torque would be computed for
    /// a wrong angle. The fault lasts until the identification restarts, or `enable` is FALSE.
    void check_zero() noexcept {
        if (homed && enable && identification_.zero_is_wrong()) {
            homed = false;
            fault_.begin(faults_, this,
                         "not homed: the pendulum oscillates around {} rad, expected 0; the torque "
                         "is 0; let it hang at rest, zero its encoder, "
                         "then set enable to FALSE and TRUE",
                         identification_.zero_offset());
        }
        const bool is_torque_withheld = enable && !homed;
        if (!is_torque_withheld && fault_.lasts()) {
            fault_.end(faults_, this);
        }
    }

    void choose_phase(double tilt, const State& s) noexcept {
        if (!enable || !homed) {
            now_ = Phase::off;
        } else if (now_ != Phase::balance || std::fabs(tilt) >= lose_angle ||
                   std::fabs(s.arm_speed) >= 1.25 * max_velocity || !gains_valid) {
            const bool can = gains_valid && std::fabs(tilt) < catch_angle && succeeds(tilt, s);
            now_ = can ? Phase::balance : Phase::swing_up;
            if (can) {
                catches = catches + 1;
            }
        }
        phase = static_cast<std::uint32_t>(now_);
    }

    double balancing_torque(double tilt, const State& s) const noexcept {
        const double reach = std::fabs(arm_reach);
        return -(gain_arm * std::clamp(s.arm, -reach, reach) + gain_pendulum * tilt +
                 gain_arm_velocity * s.arm_speed + gain_pendulum_velocity * s.pendulum_speed);
    }

    /// Predicts whether balancing succeeds: with less than the available torque, as the amplifier
    /// may limit it further, and with the arm below the speed that ends balancing.
    bool succeeds(double tilt, State s) const noexcept {
        constexpr double dt = 0.005;
        constexpr double part_of_torque = 0.8;
        constexpr double part_of_speed = 0.95;
        constexpr int steps = 120;  // 0.6 s
        const double limit = part_of_torque * std::fabs(max_torque);
        const double fastest = std::fabs(max_velocity);
        for (int i = 0; i < steps; ++i) {
            const Rates rates =
                accelerations(std::clamp(balancing_torque(tilt, s), -limit, limit), s);
            s.arm += dt * (s.arm_speed + 0.5 * dt * rates.arm);
            tilt += dt * (s.pendulum_speed + 0.5 * dt * rates.pendulum);
            s.arm_speed += dt * rates.arm;
            s.pendulum_speed += dt * rates.pendulum;
            s.pendulum = tilt + std::numbers::pi;
            if (!(std::fabs(tilt) < lose_angle &&
                  std::fabs(s.arm_speed) < part_of_speed * 1.25 * fastest)) {
                return false;
            }
            if (std::fabs(tilt) < upright_angle && std::fabs(s.pendulum_speed) < 1.0 &&
                std::fabs(s.arm_speed) < fastest) {
                return true;
            }
        }
        return false;
    }

    /// Energy flows into the pendulum as -(c cos a a' + K sin²a q') q" (K. Åström, K. Furuta,
    /// *Swinging up a pendulum by energy control*, Automatica 36, 2000, and the centrifugal part),
    /// so the arm is accelerated against the sign of that; from rest in either direction.
    double swing_up_torque(double relative_energy, const State& s) const noexcept {
        const double limit = std::fabs(max_acceleration);
        const double sin = std::sin(s.pendulum);
        const double cos = std::cos(s.pendulum);
        const double wanted =
            std::clamp(energy_gain * (energy_target - relative_energy), -1.0, 1.0) * limit;
        const double flow = rig_.coupling * cos * s.pendulum_speed +
                            rig_.pendulum_inertia * sin * sin * s.arm_speed;
        const double sign = relative_energy < 0.01 && flow == 0.0
                                ? 1.0
                                : std::clamp(flow / (0.1 * rig_.coupling), -1.0, 1.0);
        const double centring = -centre_gain * s.arm - centre_damping * s.arm_speed;
        const bool fast = std::fabs(s.arm_speed) > max_velocity;
        const double acceleration = fast ? std::copysign(limit, -s.arm_speed)
                                         : std::clamp(-wanted * sign + centring, -limit, limit);
        // the torque for this acceleration, from the rig's two equations with a" put in from the
        // second
        const double K = rig_.pendulum_inertia;
        const double c = rig_.coupling * cos;
        if (!(K > 0.0)) return 0.0;
        const double on_pendulum =
            K * sin * cos * s.arm_speed * s.arm_speed - rig_.weight_moment * sin;
        const double drive = (rig_.arm_inertia + K * sin * sin - c * c / K) * acceleration +
                             c / K * on_pendulum +
                             2.0 * K * sin * cos * s.arm_speed * s.pendulum_speed -
                             rig_.coupling * sin * s.pendulum_speed * s.pendulum_speed +
                             rig_.friction * std::tanh(s.arm_speed / 0.05);
        // do not brake the arm when the pendulum itself moves it in the commanded direction: that
        // would remove energy from both
        return !fast && wanted > 0.0 && drive * acceleration < 0.0 ? 0.0 : drive;
    }

    struct Rates {
        double arm, pendulum;
    };
    /// Accelerations under a torque, without friction: the rig's two equations, solved. Zeros when
    /// the parameters make no physical sense.
    Rates accelerations(double drive, const State& s) const noexcept {
        const double K = rig_.pendulum_inertia;
        const double sin = std::sin(s.pendulum);
        const double cos = std::cos(s.pendulum);
        const double c = rig_.coupling * cos;
        const double J = rig_.arm_inertia + K * sin * sin;
        const double determinant = J * K - c * c;
        if (!(determinant > 0.0)) {
            return {0.0, 0.0};
        }
        const double on_arm = drive - 2.0 * K * sin * cos * s.arm_speed * s.pendulum_speed +
                              rig_.coupling * sin * s.pendulum_speed * s.pendulum_speed;
        const double on_pendulum =
            K * sin * cos * s.arm_speed * s.arm_speed - rig_.weight_moment * sin;
        return {(K * on_arm - c * on_pendulum) / determinant,
                (J * on_pendulum - c * on_arm) / determinant};
    }

    /// Leads the pendulum on by its age, with the arm's acceleration of the last torque.
    void predict_pendulum(State& s) const noexcept {
        const double age = std::clamp(pendulum_age.get(), 0.0, 0.05);
        if (!(age > 0.0)) return;
        const double acceleration = accelerations(torque, s).pendulum;
        s.pendulum += age * (s.pendulum_speed + 0.5 * age * acceleration);
        s.pendulum_speed += age * acceleration;
    }

    void command_torque(double wanted, double arm_speed) noexcept {
        const double limit = std::fabs(max_torque);

        const double given = std::isfinite(wanted) ? std::clamp(wanted, -limit, limit) : 0.0;
        torque = given;
        const double volts =
            torque_constant > 0.0 && now_ != Phase::off
                ? resistance / torque_constant * given + torque_constant * arm_speed
                : 0.0;
        voltage = std::isfinite(volts) ? volts : 0.0;
    }

    Phase now_ = Phase::off;
    double upright_s_ = 0.0;
    bool was_enabled_ = false;

    const hal_faults* faults_ = nullptr;
    hal::LastingFault fault_;

    FurutaParameters rig_;
    hal::estimation::FurutaIdentification identification_;
    hal::Retained retained_{*this,
                            {{"now", now_},
                             {"upright-s", upright_s_},
                             {"enabled", was_enabled_},
                             {"rig", rig_},
                             {"identification", identification_}}};
};

}  // namespace

HAL_COMPONENT(FurutaControl, "furuta_control", "Swing-up and balancing of a Furuta pendulum", R"(
**Swing-up.** The arm is accelerated so that energy flows into the pendulum until it has the energy
of the upright position (K. Åström, K. Furuta, *Swinging up a pendulum by energy control*,
Automatica 36, 2000), while a weak virtual spring holds the arm around `arm-command`. The torque for
the acceleration is computed by the rig's equations (see the manual of furuta), so the parameters
are those of the rig.

**Identification.** During swing-up, recursive least squares on both equations of motion identifies
the ratios of the rig's inertias, its weight and its friction from the measured motion and the
commanded torque (L. Ljung, *System Identification*, 2nd edition, 11.2); energy, torque and
prediction use them. `identified-frequency` is a result. Parameter errors of 20 % are tolerated.
`identify` FALSE uses the given parameters.

**Homing.** An incremental encoder counts from its position at power-on. If the pendulum was not
hanging at rest then, every angle is wrong, and a swing-up makes the arm spin. The identification
also determines the angle around which the pendulum oscillates, `zero-offset`. Beyond 0.3 rad
`homed` becomes FALSE, a fault is raised, and the torque is 0. Let the pendulum hang at rest, zero
its encoder, and set `enable` to FALSE and TRUE.

**Catching.** Balancing starts within `catch-angle` of upright, if a simulation of the rig 0.6 s
ahead with the available torque succeeds. A pendulum or an arm that is too fast swings through and
tries again.

**Balancing.** torque = -(gain-arm arm + gain-pendulum tilt + gain-arm-velocity arm' +
gain-pendulum-velocity tilt'); link the gains to an lqr with these states and the torque as input.
Beyond `lose-angle` the swing-up starts again. The deviation from `arm-command` is limited to
`arm-reach`, which limits the speed of larger steps.

`pendulum-age` is the latency of the pendulum encoder: angle and speed are predicted by this time
with the rig's equations. The voltage compensates the resistance and the back-EMF of the motor; the
amplifier may limit it further. While a measurement is NaN or infinite, the torque is 0.

    loadrt furuta_control names=swing
    addf swing.update servo
    net arm       => swing.arm-angle
    net pendulum  => swing.pendulum-angle
    net gain-0    => swing.gain-arm
    net motor     <= swing.voltage
)")
