# SPDX-License-Identifier: MIT
# Generates the source that puts the files of page/ into the program, by the assembler's .incbin.
set(types ".html=text/html" ".css=text/css" ".js=text/javascript" ".svg=image/svg+xml")
file(GLOB assets CONFIGURE_DEPENDS "${CMAKE_CURRENT_SOURCE_DIR}/panel/page/*.html" "${CMAKE_CURRENT_SOURCE_DIR}/panel/page/*.css"
     "${CMAKE_CURRENT_SOURCE_DIR}/panel/page/*.js" "${CMAKE_CURRENT_SOURCE_DIR}/panel/page/*.svg")
set(data "")
set(rows "")
set(number 0)
foreach(asset IN LISTS assets)
    cmake_path(GET asset FILENAME name)
    cmake_path(GET asset EXTENSION LAST_ONLY extension)
    foreach(type IN LISTS types)
        if(type MATCHES "^[.]${extension}=|^\\${extension}=(.*)")
            set(mime "${CMAKE_MATCH_1}")
        endif()
    endforeach()
    string(APPEND data "asm(\".section .rodata\\nasset_${number}: .incbin \\\"${asset}\\\"\\nasset_${number}_end: .byte 0\\n.previous\");\n"
        "extern \"C\" const char asset_${number}[], asset_${number}_end[];\n")
    string(APPEND rows "    {\"/${name}\", \"${mime}\", {asset_${number}, static_cast<std::size_t>(asset_${number}_end - asset_${number})}},\n")
    math(EXPR number "${number} + 1")
endforeach()
set(HALCYON_PAGE "${PROJECT_BINARY_DIR}/generated/panel_assets.cpp")
file(CONFIGURE OUTPUT "${HALCYON_PAGE}" @ONLY CONTENT [[
// SPDX-License-Identifier: MIT
#include "panel/assets.hpp"

@data@
namespace hal::tools {

static const Asset files[] = {
@rows@};
const std::span<const Asset> assets(files);

}  // namespace hal::tools
]])
set_source_files_properties("${HALCYON_PAGE}" PROPERTIES OBJECT_DEPENDS "${assets}")
