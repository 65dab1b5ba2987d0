// SPDX-License-Identifier: MIT
#include "linuxcnc/installation.hpp"

#include <cstdlib>
#include <filesystem>
#include <fmt/core.h>
#include <unistd.h>

#include "comp/toolchain.hpp"
#include "linuxcnc/find/home.hpp"

namespace hal::tools {

Installation linuxcnc_installation() {
    const LinuxcncHome where = linuxcnc_home();
    const std::string& home = where.folder;
    Installation all;
    all.home = home;
    all.modules = where.modules();
    all.python = home + "/lib/python";
    if (where.in_place) {
        all.programs = {home + "/bin", home + "/scripts", home + "/tcl"};
        all.libraries = home + "/lib";
        all.hallib = home + "/lib/hallib";
        all.tcl = home + "/tcl";
        all.messages = home + "/src/objects";
        all.help = home + "/docs/help";
        all.ncfiles = home + "/nc_files";
        all.nml = home + "/configs/common/linuxcnc.nml";
    } else {
        all.programs = {home + "/bin"};
        all.hallib = home + "/share/linuxcnc/hallib";
        all.tcl = home + "/lib/tcltk/linuxcnc";
        all.messages = all.tcl + "/msgs";
        all.help = home + "/share/doc/linuxcnc";
        all.ncfiles = home + "/share/linuxcnc/ncfiles";
        all.nml = home + "/share/linuxcnc/linuxcnc.nml";
    }
    return all;
}

std::string ask_version(Installation& of) {
    for (const std::string& folder : of.programs) {
        const std::string program = folder + "/linuxcnc_var";
        if (::access(program.c_str(), X_OK) != 0) continue;
        std::string text;
        if (run_program({program, "LINUXCNCVERSION"}, text) != 0) {
            return {};
        }
        while (text.ends_with('\n')) {
            text.pop_back();
        }
        ::setenv("LINUXCNCVERSION", text.c_str(), 1);
        // 2.10.0~pre1: 2.10
        const std::string series = text.substr(0, text.find('.', text.find('.') + 1));
        if (series != "2.9" && series != "2.10") {
            return fmt::format(
                "LinuxCNC in {} is version {}; 2.9 and 2.10 are supported: LINUXCNC_HOME names "
                "another installation",
                of.home, text);
        }
        of.version = series == "2.10" ? LinuxcncVersion::v2_10 : LinuxcncVersion::v2_9;
        return {};
    }
    return {};
}

}  // namespace hal::tools
