// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Ohmic : hal::Component {
    using Component::Component;
    hal::In<double> zero_frequency{
        *this, "thcad-0-volt-freq", "frequency of the card at 0 V, from its label", {.unit = "Hz"}};
    hal::In<double> full_frequency{*this,
                                   "thcad-max-volt-freq",
                                   "frequency of the card at full scale, from its label",
                                   {.unit = "Hz"}};
    hal::In<double> divide{*this,
                           "thcad-divide",
                           "frequency divider set on the card: 1, 32, 64 or 128",
                           {.initial = 32.0}};
    hal::In<double> full_scale{*this,
                               "thcad-fullscale",
                               "full scale of the card: 5, 10 or 300",
                               {.initial = 5.0, .unit = "V"}};
    hal::In<double> velocity_in{
        *this, "velocity-in", "divided frequency, as an encoder velocity", {.unit = "Hz"}};
    hal::In<double> volt_divider{
        *this, "volt-divider", "ratio of sensed voltage to voltage at the card", {.initial = 4.9}};
    hal::In<double> threshold{*this,
                              "ohmic-threshold",
                              "at or above this voltage the torch touches the material",
                              {.initial = 18.0, .unit = "V"}};
    hal::In<double> low{
        *this,
        "ohmic-low",
        "at or below this voltage ohmic-on becomes FALSE while the machine is not probing",
        {.initial = 5.0, .unit = "V"}};
    hal::Out<bool> arc_on{*this, "arc-on",
                          "TRUE while the card is at full scale: an arc is present"};
    hal::Out<double> thcad_volts{*this, "thcad-volts", "voltage at the card", {.unit = "V"}};
    hal::Out<double> ohmic_volts{*this, "ohmic-volts", "sensed voltage", {.unit = "V"}};
    hal::Out<bool> ohmic_on{*this, "ohmic-on",
                            "TRUE: the torch touches the material; set while probing"};
    hal::In<bool> is_probing{*this, "is-probing", "TRUE while the machine is probing"};
    hal::Function run{*this, "", &Ohmic::update, "computes the voltages and the contact state"};

    void update(hal::Cycle) noexcept {
        const double span = full_frequency - zero_frequency;
        const double hertz_per_volt = span / full_scale / divide;  // at velocity-in
        const double volts =
            span != 0.0 ? (velocity_in - zero_frequency / divide) * (1.0 / hertz_per_volt) : 0.0;
        thcad_volts = volts;
        ohmic_volts = volts * volt_divider;
        arc_on = span != 0.0 && volts >= full_scale;
        if (is_probing) {
            ohmic_on = ohmic_volts >= threshold;
        } else if (ohmic_volts <= low) {
            ohmic_on = false;
        }
    }
};

}  // namespace

HAL_COMPONENT(Ohmic, "ohmic", "Ohmic sensing of a plasma torch with a voltage-to-frequency card",
              R"(
    thcad-volts = (velocity-in * thcad-divide - thcad-0-volt-freq) / (thcad-max-volt-freq - thcad-0-volt-freq) * thcad-fullscale
    ohmic-volts = thcad-volts * volt-divider

`arc-on` is TRUE while the card is at full scale. While `is-probing` is TRUE, `ohmic-on` is TRUE at
and above `ohmic-threshold`; afterwards it keeps its state until the voltage is at or below
`ohmic-low`.

**Differences from LinuxCNC:** While the two frequencies are equal, as before they are set, the
voltages are 0 (LinuxCNC: infinite or NaN). In 2.9, `ohmic-on` compares the voltage with 1 instead
of `ohmic-threshold`; this is the component of 2.10.

    loadrt ohmic names=touch
    addf touch servo
    setp touch.thcad-0-volt-freq 122900
    setp touch.thcad-max-volt-freq 925700
    setp touch.ohmic-threshold 22
    net touch-frequency => touch.velocity-in
    net probing         => touch.is-probing
    net touched         <= touch.ohmic-on
)")
