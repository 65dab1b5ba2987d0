// SPDX-License-Identifier: MIT
// The deprecated name of arm_kinematics, mill_kinematics and drive_kinematics.
#include <string>
#include <variant>

#include "estimation/arm_kinematics.hpp"
#include "estimation/drive_kinematics.hpp"
#include "estimation/mill_kinematics.hpp"
#include "hal/message_log.hpp"
#include "hal/naming.hpp"
#include "hal/texts.hpp"

namespace {

using namespace hal::estimation;

class KinematicsAlias : public hal::Component {
public:
    explicit KinematicsAlias(const hal_host* host)
        : Component(host),
          machine_(*this, "machine", "arm",
                   "arm: arm_kinematics; mill: mill_kinematics; drive: drive_kinematics") {
        const std::string& machine = machine_.get();
        if (machine != "arm" && machine != "mill" && machine != "drive") {
            throw hal::ArgumentError("machine",
                                     "machine=" + machine + " is not arm, mill or drive");
        }
        if (hal::Texts(*this).offered()) {  // not in `hal doc`
            const std::string name = hal::own_name("kinematics");

            const std::string replacement = machine + "_kinematics";
            hal::MessageLog(name).print(
                "warning: component 'kinematics' is deprecated; type: loadrt " + replacement +
                " names=" + name);
        }
        if (machine == "arm") {
            chosen_.emplace<ArmKinematics>(host);
        } else if (machine == "mill") {
            chosen_.emplace<MillKinematics>(host);
        } else {
            chosen_.emplace<DriveKinematics>(host);
        }
    }

private:
    hal::TextArgument machine_;
    std::variant<std::monostate, ArmKinematics, MillKinematics, DriveKinematics> chosen_;
};

}  // namespace

HAL_COMPONENT(KinematicsAlias, "kinematics",
              "Deprecated name of arm_kinematics, mill_kinematics and drive_kinematics", R"(
Loads the component that `machine` selects, with its pins, and prints a warning with the name to use
instead: `arm_kinematics`, `mill_kinematics` or `drive_kinematics`.

    loadrt kinematics names=scara machine=arm dh=0.3,0,0,0;0.2,0,0,0
    addf scara.update servo
)")
