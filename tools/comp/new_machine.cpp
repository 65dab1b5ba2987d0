// SPDX-License-Identifier: MIT
#include "comp/new_machine.hpp"

#include <fmt/core.h>
#include <iterator>

#include "text/quoting.hpp"

namespace hal::tools {

namespace {

constexpr std::string_view axis_letters = "xyzabcuvw";

// In the templates @NAME@ is the machine's name, @ALL@ the axes, as x,y,z. In those for an axis @A@
// is its letter, @N@ its number from 0, @ID@ its node.
// clang-format off: templates

constexpr std::string_view loads = R"HAL(loadrt estop_latch names=estop
loadrt interlock names=chain inputs=2
loadrt not names=each(@A@-idle)
loadrt mux2 names=each(@A@-source)
loadrt limit3 names=each(@A@-path)
loadrt near names=each(@A@-there)
)HAL";

constexpr std::string_view chain_functions = R"HAL(addf chain servo-thread
addf estop servo-thread
)HAL";

constexpr std::string_view axis_functions = R"HAL(addf @A@-idle servo-thread
addf @A@-source servo-thread
addf @A@-path servo-thread
addf @A@-there servo-thread
)HAL";

constexpr std::string_view chain_nets = R"HAL(
# Everything is off until the chain is closed and `reset` becomes TRUE.
net chain-closed => chain.in-00
net chain-ok chain.ok => estop.ok-in
net reset => chain.reset estop.reset
)HAL";

// While the axis is off its path follows the position, so that it does not jump when it is enabled.
constexpr std::string_view axis_path = R"HAL(
# @A@: `sets @A@-target 10` moves it, within its travel, speed and acceleration
net @A@-position => @A@-source.in0 @A@-there.in1
net @A@-target => @A@-source.in1 @A@-there.in2
net @ACTIVE@ => @A@-source.sel @A@-idle.in
net @A@-track @A@-idle.out => @A@-path.load
net @A@-wanted @A@-source.out => @A@-path.in
setp @A@-path.min [JOINT_@N@]MIN_LIMIT
setp @A@-path.max [JOINT_@N@]MAX_LIMIT
setp @A@-path.maxv [JOINT_@N@]MAX_VELOCITY
setp @A@-path.maxa [JOINT_@N@]MAX_ACCELERATION
setp @A@-there.difference 0.01
)HAL";

constexpr std::string_view axis_settings = R"INI(
[JOINT_@N@]
# @A@: its travel, and how it moves
MIN_LIMIT = -1000
MAX_LIMIT = 1000
MAX_VELOCITY = 100
MAX_ACCELERATION = 500
)INI";

constexpr std::string_view drive_nets = R"HAL(net @A@-operational @BUS@.0.@A@.operational => @A@.operational
net @A@-statusword @BUS@.0.@A@.statusword => @A@.statusword
net @A@-count @BUS@.0.@A@.position-actual-value => @A@.position-actual-value
net @A@-mode-display @BUS@.0.@A@.modes-of-operation-display => @A@.modes-of-operation-display
net @A@-controlword @A@.controlword => @BUS@.0.@A@.controlword
net @A@-set-point @A@.target-position => @BUS@.0.@A@.target-position
net @A@-mode @A@.modes-of-operation => @BUS@.0.@A@.modes-of-operation
net @A@-command @A@-path.out => @A@.position-cmd
net @A@-position @A@.position-fb
net @A@-active @A@.active
net enable => @A@.enable
net reset => @A@.reset
setp @A@.position-scale [JOINT_@N@]SCALE
)HAL";

constexpr std::string_view motor_nets = R"HAL(net @A@-command @A@-path.out => @A@-pid.command
net @A@-position @A@-motor.out => @A@-pid.feedback
net @A@-effort @A@-pid.output => @A@-motor.in
net enable => @A@-pid.enable
setp @A@-pid.Pgain [JOINT_@N@]P
setp @A@-pid.FF1 1
)HAL";

struct Bus {
    std::string_view name;
    int axes_per_ms;                 ///< whose frames fit into a millisecond
    std::string_view active;         ///< the signal that is TRUE while an axis follows its command
    std::string_view loads;
    std::string_view receive;        ///< functions before those of the axes
    std::string_view receive_axis;
    std::string_view transmit_axis;  ///< functions behind those of the axes
    std::string_view transmit;
    std::string_view transmit_node;
    std::string_view nets;
    std::string_view axis_nets;
    std::string_view settings;       ///< of an axis in the INI file
    std::string_view config_ending;  ///< of the configuration file; empty: there is none
    std::string_view config;
    std::string_view config_axis;
    std::string_view real;           ///< what to change for real drives
};

constexpr Bus buses[] = {
    {"none", NewMachine::max_axes, "enable",
     R"HAL(loadrt pid names=each(@A@-pid)
loadrt integ names=each(@A@-motor)   # a motor whose speed is its input
)HAL",
     "", "",
     "addf @A@-pid.do-pid-calcs servo-thread\naddf @A@-motor servo-thread\n", "", "",
     "net bus-ok => chain.in-01\nsets bus-ok TRUE\nnet enable estop.ok-out\n", motor_nets,
     "P = 20\n", "", "", "",
     "Replace `integ` by the components of your hardware: an output for `x-effort`, an encoder for `x-position`."},
    {"canopen", 3, "@A@-active",
     R"HAL(loadrt canopen config=@NAME@.canopen
loadrt canopen_drive link=sim:@NAME@ id=each(@ID@)   # simulated: not for real drives
loadrt cia402 names=@ALL@
)HAL",
     "addf canopen.0.receive servo-thread\n", "addf @A@.read-all servo-thread\n",
     "addf @A@.write-all servo-thread\n", "addf canopen.0.transmit servo-thread\n",
     "addf canopen-drive.@N@.update servo-thread\n",
     "net bus-ok canopen.0.operational => chain.in-01\nnet enable estop.ok-out\n", drive_nets,
     "SCALE = 100\n", "canopen",  // the simulated drive has 50 revolutions of 4096 counts
     R"TXT(# SPDX-License-Identifier: MIT
[bus]
link = sim:@NAME@
bitrate = 1M
sync = cycle

[defaults]
heartbeat = 50ms

[type drive]
device = cia402
tpdo1 = statusword, position-actual-value, modes-of-operation-display
rpdo1 = controlword, target-position, modes-of-operation
write interpolation-time-period-value = @MS@   # the period of the thread
)TXT",
     "\n[node @ID@ @A@]\ntype = drive\n",
     "Write `link = can:can0` in `@NAME@.canopen`, and remove the lines with `canopen_drive` and `canopen-drive` from `@NAME@.hal`."},
    {"ethercat", NewMachine::max_axes, "@A@-active",
     R"HAL(loadrt ethercat config=@NAME@.ethercat
loadrt ethercat_segment devices="each(servo)" link=sim:@NAME@   # simulated: not for real drives
loadrt cia402 names=@ALL@
)HAL",
     "addf ethercat.0.receive servo-thread\n", "addf @A@.read-all servo-thread\n",
     "addf @A@.write-all servo-thread\n",
     "addf ethercat.0.transmit servo-thread\naddf ethercat-segment.0.update servo-thread\n", "",
     "net bus-ok ethercat.0.all-op => chain.in-01\nnet enable estop.ok-out\n", drive_nets,
     "SCALE = 1000\n", "ethercat",
     R"TXT(# SPDX-License-Identifier: MIT
[bus]
link  = sim:@NAME@
cycle = 1ms
)TXT",
     R"TXT(
[slave @N@ @A@]
vendor  = 0x00ffffff
device  = cia402
outputs = 6040 607A 6060
inputs  = 6041 6064 6061
)TXT",
     "`hal ethercat config eth:enp2s0` writes the configuration of your drives. Write its `link`, and remove the lines with "
     "`ethercat_segment` and `ethercat-segment` from `@NAME@.hal`."},
};

constexpr std::string_view readme = R"MD(# @NAME@

@AXES@ (@ALL@) and an emergency-stop chain. Everything is simulated, so it runs at once:

    hal run --ini @NAME@.ini @NAME@.hal

In another terminal close the chain, switch on, and move:

    hal shell sets chain-closed TRUE
    hal shell sets reset TRUE
    hal shell sets reset FALSE
    hal shell sets x-target 10
    hal watch x-position @ACTIVE@

`sets chain-closed FALSE` stops all axes. They stay off until the chain is closed and `reset` becomes TRUE again. `hal shell getp chain.first` prints which of
the conditions of the chain opened first: 0 is `chain-closed`, 1 is `bus-ok`.

* `@NAME@.hal` is the netlist, and `@NAME@.ini` has the settings of the axes.
* `test.hal` is the test. This prints nothing when it passes:
  `hal sim --quiet --ini @NAME@.ini test.hal 2>/dev/null | diff expected -`

**Real drives.** @REAL@
)MD";
// clang-format on

void replace_all(std::string& text, std::string_view what, std::string_view by) {
    for (std::size_t at = 0; (at = text.find(what, at)) != text.npos; at += by.size()) {
        text.replace(at, what.size(), by);
    }
}

class Generator {
public:
    explicit Generator(const NewMachine& machine) : machine_(machine), bus_(bus_of(machine.bus)) {}

    std::string netlist() const {
        std::string text = fmt::format(
            "# SPDX-License-Identifier: MIT\n# {}. Start it: hal run --ini @NAME@.ini @NAME@.hal\n"
            "loadrt threads name1=servo-thread period1=@MS@000000\n",
            counted(machine_.axes, "simulated axis", "simulated axes"));
        text.append(bus_.loads).append(loads).append("\n").append(bus_.receive);
        text += each(bus_.receive_axis);
        text.append(chain_functions);
        text += each(axis_functions) + each(bus_.transmit_axis);
        text.append(bus_.transmit);
        text += each(bus_.transmit_node);
        text.append(chain_nets).append(bus_.nets);
        text += each(axis_path, bus_.axis_nets);
        return filled(text + "\nstart\n");
    }
    std::string settings() const {
        return filled(
            "# The netlist, for: hal run @NAME@.ini, hal check @NAME@.ini\n[HAL]\n"
            "HALFILE = @NAME@.hal\n\n# The settings of the axes, in mm and s.\n" +
            each(axis_settings, bus_.settings));
    }
    std::string config() const { return filled(std::string(bus_.config) + each(bus_.config_axis)); }
    std::string_view config_ending() const { return bus_.config_ending; }

    /// The axes start, move, and stop when the chain opens.
    std::string test() const {
        std::string text =
            "# SPDX-License-Identifier: MIT\nsource @NAME@.hal\nadvance 1s\n"
            "gets bus-ok      # TRUE\ngets enable      # FALSE: the chain is open\n"
            "sets chain-closed TRUE\nsets reset TRUE\nadvance 500ms\nsets reset FALSE\n";
        text += each("gets enable      # TRUE\nsets @A@-target 1@N@\n");
        text += "advance 3s\n" + each("getp @A@-there.out   # TRUE\n");
        text +=
            "sets x-target 500\nadvance 500ms\ngetp x-there.out   # FALSE\n"
            "sets chain-closed FALSE\nadvance 1s\ngets enable      # FALSE\n"
            "getp x-there.out   # FALSE: it stopped on its way\n";
        return filled(text);
    }
    std::string expected() const {
        std::string text = "TRUE\nFALSE\n";
        for (int n = 0; n < 2 * machine_.axes; ++n) {
            text += "TRUE\n";
        }
        return text + "FALSE\nFALSE\nFALSE\n";
    }
    std::string page() const {
        std::string text(readme);
        replace_all(text, "@REAL@", bus_.real);
        replace_all(text, "@AXES@", counted(machine_.axes, "axis", "axes"));
        return filled(for_axis(text, 0));
    }

private:
    static const Bus& bus_of(std::string_view name) {
        for (const Bus& bus : buses) {
            if (bus.name == name) return bus;
        }
        return buses[0];
    }
    std::string for_axis(std::string_view text, int n) const {
        std::string result(text);
        replace_all(result, "@ACTIVE@", bus_.active);
        replace_all(result, "@A@", axis_letters.substr(static_cast<std::size_t>(n), 1));
        replace_all(result, "@N@", std::to_string(n));
        replace_all(result, "@ID@", std::to_string(n + 2));
        return result;
    }
    std::string each(std::string_view first, std::string_view second = {}) const {
        std::string text;
        for (int n = 0; n < machine_.axes; ++n) {
            text += for_axis(first, n) + for_axis(second, n);
        }
        return text;
    }
    /// Fills in what belongs to the machine, and each(...), a list over the axes.
    std::string filled(std::string text) const {
        constexpr std::string_view list = "each(";
        for (std::size_t at = 0; (at = text.find(list, at)) != text.npos;) {
            const std::size_t end = text.find(')', at);
            const std::string item = text.substr(at + list.size(), end - at - list.size());
            text.replace(at, end + 1 - at, listed(item));
        }
        replace_all(text, "@ALL@", listed("@A@"));
        replace_all(text, "@BUS@", bus_.name);
        replace_all(text, "@MS@", std::to_string((machine_.axes - 1) / bus_.axes_per_ms + 1));
        replace_all(text, "@NAME@", machine_.name);
        return text;
    }
    std::string listed(const std::string& item) const {
        std::string text;
        for (int n = 0; n < machine_.axes; ++n) {
            append_item(text, for_axis(item, n), ",");
        }
        return text;
    }

    const NewMachine& machine_;
    const Bus& bus_;
};

}  // namespace

std::vector<std::string_view> machine_buses() {
    std::vector<std::string_view> names;
    for (const Bus& bus : buses) {
        names.push_back(bus.name);
    }
    return names;
}

std::vector<NewFile> machine_files(const NewMachine& machine) {
    const Generator generator(machine);
    std::vector<NewFile> files{{machine.name + ".hal", generator.netlist()},
                               {machine.name + ".ini", generator.settings()}};
    if (!generator.config_ending().empty()) {
        files.push_back(
            {fmt::format("{}.{}", machine.name, generator.config_ending()), generator.config()});
    }
    files.push_back({"test.hal", generator.test()});
    files.push_back({"expected", generator.expected()});
    files.push_back({"README.md", generator.page()});
    return files;
}

}  // namespace hal::tools
