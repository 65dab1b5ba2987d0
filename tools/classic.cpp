// SPDX-License-Identifier: MIT
// The table of LinuxCNC's programs. It is compiled once for each program of ours (part.hpp).
#include "classic.hpp"

#include "classic_commands.hpp"
#include "classic_streams.hpp"
#include "classic_views.hpp"
#include "comp/halcompile.hpp"
#include "tcl/tcl.hpp"
#include "text/find_row.hpp"

namespace hal::tools {

namespace {

constexpr Classic table[] = {
    {"halcmd", Part::core, halcmd},
    {"halrun", Part::core, halrun},
    {"halmeter", Part::core, halmeter},
    {"halscope", Part::core, halscope},
    {"halshow", Part::core, halshow},
    {"lcec_conf", Part::core, lcec_conf},
    {"mb2hal", Part::core, mb2hal},
    {"halcompile", Part::tools, IN_TOOLS(halcompile)::run},
    {"halsampler", Part::tools, IN_TOOLS(halsampler)::run},
    {"halstreamer", Part::tools, IN_TOOLS(halstreamer)::run},
    {"haltcl", Part::core, haltcl},
};

}  // namespace

const Classic* find_classic(std::string_view program) {
    return find_row(table, program, &Classic::name);
}

}  // namespace hal::tools
