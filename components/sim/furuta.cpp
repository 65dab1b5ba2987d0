// SPDX-License-Identifier: MIT
#include <cmath>

#include "furuta_rig.hpp"
#include "hal/component.hpp"
#include "hal/edge.hpp"
#include "hal/limit.hpp"
#include "hal/retained.hpp"

namespace {

struct Furuta : hal::Component {
    static constexpr hal::Traits traits{.singleton = true};
    static constexpr sim::FurutaConstants usual{};

    hal::RealArgument arm_start, pendulum_start;

    hal::Function run{*this, "update", &Furuta::update, "simulates one period"};

    hal::In<double> voltage{
        *this, "voltage", "voltage at the motor; the pwm input adds to it", {.unit = "V"}};
    hal::In<bool> pwm{*this, "pwm", "TRUE: the amplifier applies the supply voltage to the motor"};
    hal::In<bool> direction{*this, "dir", "TRUE reverses the direction of pwm"};
    hal::In<bool> enable{*this,
                         "enable",
                         "FALSE: the amplifier is off and the motor current is 0",
                         {.initial = true}};
    hal::Io<double> push{
        *this,
        "push",
        "a tap on the pendulum: the speed change of its centre of mass; set to 0 when done",
        {.unit = "m/s"}};
    hal::In<bool> lift{*this, "lift", "TRUE lifts the base off the table"};
    hal::In<bool> reset{*this, "reset", "a rising edge sets the initial angles at standstill"};

    hal::Out<bool> arm_a{*this, "arm-phase-A", "arm encoder, phase A"};
    hal::Out<bool> arm_b{*this, "arm-phase-B", "arm encoder, phase B"};
    hal::Out<bool> arm_z{*this, "arm-phase-Z",
                         "arm encoder, index: TRUE at count 0 of every revolution"};
    hal::Out<bool> pendulum_a{*this, "pendulum-phase-A",
                              "pendulum encoder, phase A, after the radio link"};
    hal::Out<bool> pendulum_b{*this, "pendulum-phase-B",
                              "pendulum encoder, phase B, after the radio link"};
    hal::Out<bool> pendulum_z{
        *this, "pendulum-phase-Z",
        "pendulum encoder, index: TRUE at count 0 of every revolution, after the radio link"};
    hal::Out<std::int32_t> arm_counts{*this, "arm-counts", "arm encoder, counts"};
    hal::Out<std::int32_t> pendulum_counts{*this, "pendulum-counts",
                                           "pendulum encoder, counts, after the radio link"};
    hal::Out<bool> base_down{*this,
                             "base-down",
                             "contact under the base: TRUE while the base is on the table",
                             {.initial = true}};
    hal::Out<bool> base_lifted{
        *this, "base-lifted",
        "second contact of that switch: TRUE while the base is off the table"};
    hal::Out<double> tip_ratio{
        *this, "tip-ratio",
        "reaction moment as a fraction of the moment that tips the base; it lifts at 1"};
    hal::Out<double> arm_angle{
        *this, "arm-angle", "true angle of the arm", {.unit = "rad", .finite = true}};
    hal::Out<double> arm_velocity{
        *this, "arm-velocity", "true speed of the arm", {.unit = "rad/s", .finite = true}};
    hal::Out<double> pendulum_angle{*this,
                                    "pendulum-angle",
                                    "true angle of the pendulum: 0 hanging down, pi upright",
                                    {.unit = "rad", .finite = true}};
    hal::Out<double> pendulum_velocity{*this,
                                       "pendulum-velocity",
                                       "true speed of the pendulum",
                                       {.unit = "rad/s", .finite = true}};
    hal::Out<double> motor_current{
        *this, "motor-current", "current in the motor", {.unit = "A", .finite = true}};
    hal::Out<double> motor_torque{
        *this, "motor-torque", "torque of the motor on the arm", {.unit = "N*m", .finite = true}};
    hal::Out<double> energy{
        *this,
        "energy",
        "kinetic and potential energy of arm and pendulum; 0 hanging at standstill",
        {.unit = "J"}};

    hal::Param<std::uint32_t> encoder_counts{
        *this,
        "encoder-counts",
        "counts per revolution of both encoders, after x4 decoding; as in the source rig",
        {.initial = usual.encoder_counts}};
    hal::Param<double> radio_delay{*this,
                                   "radio-delay",
                                   "latency of the pendulum encoder's radio link; assumed",
                                   {.initial = usual.radio_delay, .unit = "s"}};

    hal::Param<double> supply{*this,
                              "supply-voltage",
                              "supply voltage of the amplifier; as in the source rig",
                              {.initial = usual.supply, .unit = "V"}};
    hal::OptionalLimitParam current_limit{
        *this,
        "current-limit",
        "current limit of the amplifier, 0: no limit; as in the source rig",
        {.initial = usual.current_limit, .unit = "A"}};
    hal::Param<double> torque_constant{
        *this,
        "torque-constant",
        "motor: torque per current, and voltage per speed; from 85 W at 3000 rpm and 4 A",
        {.initial = usual.torque_constant, .unit = "N*m/A"}};
    hal::Param<double> resistance{*this,
                                  "resistance",
                                  "motor: winding resistance; from 24 V at 3000 rpm and 4 A",
                                  {.initial = usual.resistance, .unit = "Ohm"}};
    hal::Param<double> inductance{*this,
                                  "inductance",
                                  "motor: winding inductance; typical for this size",
                                  {.initial = usual.inductance, .unit = "H"}};
    hal::Param<double> rotor_inertia{*this,
                                     "rotor-inertia",
                                     "motor: rotor inertia; typical for this size",
                                     {.initial = usual.rotor_inertia, .unit = "kg*m^2"}};

    hal::Param<double> arm_length{*this,
                                  "arm-length",
                                  "distance from the motor axis to the pendulum pivot; assumed",
                                  {.initial = usual.arm_length, .unit = "m"}};
    hal::Param<double> arm_mass{
        *this, "arm-mass", "mass of the arm; assumed", {.initial = usual.arm_mass, .unit = "kg"}};
    hal::Param<double> arm_centre{
        *this,
        "arm-centre",
        "distance from the motor axis to the arm's centre of mass; uniform bar",
        {.initial = usual.arm_centre, .unit = "m"}};
    hal::Param<double> arm_inertia{
        *this,
        "arm-inertia",
        "inertia of the arm about its centre of mass; uniform bar, m L^2 / 12",
        {.initial = usual.arm_inertia, .unit = "kg*m^2"}};
    hal::Param<double> arm_viscous{*this,
                                   "arm-viscous",
                                   "viscous friction of arm and motor; assumed",
                                   {.initial = usual.arm_viscous, .unit = "N*m*s/rad"}};
    hal::Param<double> arm_coulomb{
        *this,
        "arm-coulomb",
        "Coulomb friction of arm and motor; typical for brushes of this size",
        {.initial = usual.arm_coulomb, .unit = "N*m"}};

    hal::Param<double> pendulum_mass{*this,
                                     "pendulum-mass",
                                     "mass of the pendulum; assumed",
                                     {.initial = usual.pendulum_mass, .unit = "kg"}};
    hal::Param<double> pendulum_centre{
        *this,
        "pendulum-centre",
        "distance from the pivot to the pendulum's centre of mass; uniform rod of 0.3 m",
        {.initial = usual.pendulum_centre, .unit = "m"}};
    hal::Param<double> pendulum_inertia{
        *this,
        "pendulum-inertia",
        "inertia of the pendulum about its centre of mass; uniform rod, m L^2 / 12",
        {.initial = usual.pendulum_inertia, .unit = "kg*m^2"}};
    hal::Param<double> pendulum_viscous{
        *this,
        "pendulum-viscous",
        "viscous friction of the pivot; a free oscillation halves in about 15 s",
        {.initial = usual.pendulum_viscous, .unit = "N*m*s/rad"}};
    hal::Param<double> pendulum_coulomb{*this,
                                        "pendulum-coulomb",
                                        "Coulomb friction of the pivot; two small ball bearings",
                                        {.initial = usual.pendulum_coulomb, .unit = "N*m"}};

    hal::Param<double> base_mass{*this,
                                 "base-mass",
                                 "mass of base and motor; assumed",
                                 {.initial = usual.base_mass, .unit = "kg"}};
    hal::Param<double> base_radius{*this,
                                   "base-radius",
                                   "radius of the foot of the base; assumed",
                                   {.initial = usual.base_radius, .unit = "m"}};
    hal::Param<double> base_height{*this,
                                   "base-height",
                                   "height of the arm above the table; assumed",
                                   {.initial = usual.base_height, .unit = "m"}};
    hal::Param<double> lift_hold{*this,
                                 "lift-hold",
                                 "time for which a tipped base remains off the table; assumed",
                                 {.initial = usual.lift_hold, .unit = "s"}};
    hal::Param<double> gravity{
        *this, "gravity", "standard gravity", {.initial = usual.gravity, .unit = "m/s^2"}};

    explicit Furuta(const hal_host* host)
        : Component(host),
          arm_start(*this, "arm_angle", 0.0, "initial angle of the arm, also after reset, rad"),
          pendulum_start(*this, "pendulum_angle", 0.0,
                         "initial angle of the pendulum, also after reset, rad") {
        rest();
    }

    void update(hal::Cycle cycle) noexcept {
        if (reset_edge_.rises(reset)) {
            rest();
        }

        const sim::FurutaConstants now = constants();
        if (const double given = push; given != 0.0) {
            push = 0.0;
            rig_.tap(now, given);
        }
        const double bridge = direction ? -supply : supply.get();
        const double wanted = voltage + (pwm ? bridge : 0.0);
        if (!rig_.step(now, wanted, enable, cycle.period_ns())) {
            rest();
        }
        rig_.show(now, cycle.period_ns());
        show(now);
    }

private:
    void rest() noexcept { rig_.rest(constants(), arm_start, pendulum_start); }

    sim::FurutaConstants constants() const noexcept {
        sim::FurutaConstants c;
        c.radio_delay = radio_delay;
        c.supply = supply;
        c.current_limit = current_limit;
        c.torque_constant = torque_constant;
        c.resistance = resistance;
        c.inductance = inductance;
        c.rotor_inertia = rotor_inertia;
        c.arm_length = arm_length;
        c.arm_mass = arm_mass;
        c.arm_centre = arm_centre;
        c.arm_inertia = arm_inertia;
        c.arm_viscous = arm_viscous;
        c.arm_coulomb = arm_coulomb;
        c.pendulum_mass = pendulum_mass;
        c.pendulum_centre = pendulum_centre;
        c.pendulum_inertia = pendulum_inertia;
        c.pendulum_viscous = pendulum_viscous;
        c.pendulum_coulomb = pendulum_coulomb;
        c.base_mass = base_mass;
        c.base_radius = base_radius;
        c.base_height = base_height;
        c.lift_hold = lift_hold;
        c.gravity = gravity;
        c.encoder_counts = encoder_counts;
        return c;
    }

    void show(const sim::FurutaConstants& now) noexcept {
        const sim::FurutaState& state = rig_.state();
        arm_angle = state.arm;
        arm_velocity = state.arm_speed;
        pendulum_angle = state.pendulum;
        pendulum_velocity = state.pendulum_speed;
        motor_current = rig_.current();
        motor_torque = rig_.torque();
        energy = now.dynamics().energy(state);

        const sim::Quadrature of_arm(rig_.arm_count(), now.encoder_counts),
            of_pendulum(rig_.pendulum_count(), now.encoder_counts);
        arm_a = of_arm.a;
        arm_b = of_arm.b;
        arm_z = of_arm.z;
        pendulum_a = of_pendulum.a;
        pendulum_b = of_pendulum.b;
        pendulum_z = of_pendulum.z;
        arm_counts = static_cast<std::int32_t>(rig_.arm_count());
        pendulum_counts = static_cast<std::int32_t>(rig_.pendulum_count());

        tip_ratio = rig_.tip_ratio();
        base_lifted = lift || rig_.tipped();
        base_down = !base_lifted;
    }

    sim::FurutaRig rig_;
    hal::RisingEdge reset_edge_;
    hal::Retained retained_{*this, {{"rig", rig_}, {"was-reset", reset_edge_}}};
};

}  // namespace

HAL_COMPONENT(Furuta, "furuta",
              "Simulated Furuta pendulum with motor, encoders, radio link and base", R"(
A motor turns a horizontal arm; at its end a pendulum swings freely in the plane perpendicular to
the arm. The component simulates the whole rig, from the inputs of the amplifier to the outputs of
the encoders and of the switch under the base.

## Equations

With *q* the angle of the arm, *a* that of the pendulum (0 hanging), *L* the length of the arm, *m*,
*l* mass and centre of the pendulum, *J* = rotor + arm + m L², *K* = pendulum-inertia + m l²:

    (J + K sin²a) q" + m L l cos a a" + K sin 2a q' a' - m L l sin a a'²  = k i - friction(q')
    m L l cos a q"   + K a"           - ½ K sin 2a q'² + m g l sin a      =     - friction(a')
    inductance i' = u - resistance i - k q',   |i| <= current-limit
    friction(w)  = viscous w + coulomb tanh(w / 0.01 rad/s)

from the Lagrangian of arm and slender rod; the same as equations 31 and 32 of B. S. Cazzolato and Z. Prime, *On the
Dynamics of the Furuta Pendulum*, Journal of Control Science and Engineering, 2011. The current is solved exactly over a
step, the angles by fourth-order Runge-Kutta in steps of at most 0.1 ms. Without motor and friction the energy drifts by
less than one part in 10⁹ a minute; small swings have the angular frequency √(m g l J / (J K - (m L l)²)).

The friction model has no stiction: with a constant torque below the Coulomb torque the arm creeps.

## Encoders

Counts change half a count to either side of 0. The thread must be fast enough for the quadrature
outputs: with 2000 counts per revolution and 100 us the shafts may turn at up to 31 rad/s. The
pendulum encoder is sent by radio with the latency `radio-delay`.

## The base

The Newton-Euler equations of arm and rod give the force and the moment between base and table.
`tip-ratio` is how far from the middle of the foot, in radii, the table pushes back; beyond 1 it
would have to pull, and the base lifts: `base-down` opens and `base-lifted` closes, for at least
`lift-hold`. The tilt itself is not simulated.

## Source of the numbers

The source system's rig has a DC motor of 24 V and 85 W, an amplifier limited to 4 A and encoders of
2000 counts per turn on both axes. Torque constant and resistance follow from 85 W at 4 A if that is
at 3000 rpm: 85 W / (314 rad/s 4 A) = 0.0677 N·m/A; (24 V - 0.0677 V·s 314 rad/s) / 4 A = 0.68 Ω.
Lengths and masses were not published: those here are assumed, and parameters.

## Example

    loadrt furuta
    loadrt encoder
    addf furuta.update base-thread
    addf encoder.update-counters base-thread
    net arm-A furuta.arm-phase-A => encoder.0.phase-A
    setp furuta.push 0.2
)")
