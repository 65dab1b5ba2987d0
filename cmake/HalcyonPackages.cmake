# SPDX-License-Identifier: MIT
# The packages of this tree, from the table cmake/packages: for each a switch HALCYON_PACKAGE_NAME.
set(HALCYON_PACKAGE_TABLE "${PROJECT_SOURCE_DIR}/cmake/packages")
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS "${HALCYON_PACKAGE_TABLE}")
file(STRINGS "${HALCYON_PACKAGE_TABLE}" rows REGEX "^[a-z]")
set(HALCYON_PACKAGES "")
foreach(row IN LISTS rows)
    string(REGEX MATCH "^([a-z]+) ([^ ]+) ([^ ]+) (.+)$" row "${row}")
    set(name "${CMAKE_MATCH_1}")
    list(APPEND HALCYON_PACKAGES ${name})
    set(HALCYON_PACKAGE_PAGE_${name} "${CMAKE_MATCH_2}")
    string(REPLACE "," ";" HALCYON_PACKAGE_FOLDERS_${name} "${CMAKE_MATCH_3}")
    set(HALCYON_PACKAGE_SUMMARY_${name} "${CMAKE_MATCH_4}")
    string(TOUPPER "${name}" switch)
    option(HALCYON_PACKAGE_${switch} "Build the package ${name}: ${CMAKE_MATCH_4}" ON)
endforeach()
list(JOIN HALCYON_PACKAGES "|" HALCYON_PACKAGE_NAMES)  # for regular expressions

# halcyon_package_switched_off(VARIABLE NAME): whether the switch of the package is OFF.
function(halcyon_package_switched_off variable name)
    string(TOUPPER "${name}" switch)
    if(HALCYON_PACKAGE_${switch})
        set(${variable} OFF PARENT_SCOPE)
    else()
        set(${variable} ON PARENT_SCOPE)
    endif()
endfunction()

# halcyon_package_needs(NAME PACKAGE): states that this build leaves the package of the tree out for want of a Debian package.
function(halcyon_package_needs name package)
    set_property(GLOBAL PROPERTY HALCYON_PACKAGE_NEEDS_${name} "${package}")
endfunction()

# halcyon_remove_products(PATH...): removes files and folders of the build tree that an earlier build with the package made, by patterns.
function(halcyon_remove_products)
    list(TRANSFORM ARGN PREPEND "${PROJECT_BINARY_DIR}/")
    file(GLOB stale LIST_DIRECTORIES true ${ARGN})
    if(stale)
        file(REMOVE_RECURSE ${stale})
    endif()
endfunction()

# halcyon_package_built(VARIABLE NAME): whether this build has the package. Call it after the folder of the package was added.
function(halcyon_package_built variable name)
    halcyon_package_switched_off(is_off ${name})
    get_property(needs GLOBAL PROPERTY HALCYON_PACKAGE_NEEDS_${name})
    if(is_off OR needs)
        set(${variable} OFF PARENT_SCOPE)
    else()
        set(${variable} ON PARENT_SCOPE)
    endif()
endfunction()

# halcyon_packages_built(VARIABLE NAME...): whether this build has all of these packages.
function(halcyon_packages_built variable)
    set(${variable} ON PARENT_SCOPE)
    foreach(name IN LISTS ARGN)
        halcyon_package_built(built ${name})
        if(NOT built)
            set(${variable} OFF PARENT_SCOPE)
        endif()
    endforeach()
endfunction()

# halcyon_package_of_component(SOURCE NAME): notes which package of the tree a component is in.
function(halcyon_package_of_component source name)
    cmake_path(ABSOLUTE_PATH source BASE_DIRECTORY "${CMAKE_CURRENT_SOURCE_DIR}")
    cmake_path(RELATIVE_PATH source BASE_DIRECTORY "${PROJECT_SOURCE_DIR}")
    foreach(package IN LISTS HALCYON_PACKAGES)
        foreach(folder IN LISTS HALCYON_PACKAGE_FOLDERS_${package})
            if(source MATCHES "^${folder}/")
                set_property(GLOBAL PROPERTY HALCYON_PACKAGE_OF_${name} ${package})
            endif()
        endforeach()
    endforeach()
endfunction()

# halcyon_packages_of_sources(VARIABLE SOURCE...): the packages whose headers the sources include.
function(halcyon_packages_of_sources variable)
    set(found "")
    foreach(source IN LISTS ARGN)
        file(STRINGS "${source}" includes REGEX "^#include \"")
        foreach(package IN LISTS HALCYON_PACKAGES)
            foreach(folder IN LISTS HALCYON_PACKAGE_FOLDERS_${package})
                string(REGEX REPLACE "^(components|tools)/" "(\\1/)?" folder "${folder}")
                if(includes MATCHES "#include \"${folder}/")
                    list(APPEND found ${package})
                endif()
            endforeach()
        endforeach()
    endforeach()
    list(REMOVE_DUPLICATES found)
    set(${variable} "${found}" PARENT_SCOPE)
endfunction()

# halcyon_packages_of_commands(VARIABLE LINE...): the packages of the commands `hal ethercat`, `hal can sdo` and so on in the lines. The other
# commands of `hal can` are in the core.
function(halcyon_packages_of_commands variable)
    set(found "")
    string(REGEX REPLACE "hal node (${HALCYON_PACKAGE_NAMES}) " "hal \\1 " lines "${ARGN}")
    foreach(package IN LISTS HALCYON_PACKAGES)
        if(lines MATCHES "hal ${package} ")
            list(APPEND found ${package})
        endif()
    endforeach()
    if(lines MATCHES "hal (node|can (nodes|scan|sdo|pdo|nmt|dcf|lss|eds|drive|gateway|flash|produce|read-all)) ")
        list(APPEND found canopen)
    endif()
    set(${variable} "${found}" PARENT_SCOPE)
endfunction()

# halcyon_packages_of_text(VARIABLE FILE...): the packages that netlists, command lines or the examples of a page use: those of the components
# that they load, also by files that they name, and those of the commands that they start.
function(halcyon_packages_of_text variable)
    set(lines "")
    set(netlists ${ARGN})
    foreach(file IN LISTS ARGN)
        file(STRINGS "${file}" read REGEX "hal (can|node|examples|${HALCYON_PACKAGE_NAMES}) |halfiles/[^ ]*[.](hal|ini)")
        string(REGEX REPLACE "hal examples ([-a-z0-9_]+/[-a-z0-9_]+)" "halfiles/\\1.hal" read "${read}")
        list(APPEND lines ${read})
        string(REGEX MATCHALL "halfiles/[-a-z0-9_/]*[.](hal|ini)" machines "${read}")
        foreach(machine IN LISTS machines)
            if(EXISTS "${PROJECT_SOURCE_DIR}/${machine}")
                list(APPEND netlists "${PROJECT_SOURCE_DIR}/${machine}")
            endif()
        endforeach()
    endforeach()
    halcyon_packages_of_commands(found ${lines})
    list(GET ARGN 0 first)
    cmake_path(GET first PARENT_PATH folder)
    execute_process(COMMAND awk -v command=run -f "${PROJECT_SOURCE_DIR}/cmake/needs.awk" -- run ${netlists} WORKING_DIRECTORY "${folder}" TIMEOUT 20
                    OUTPUT_VARIABLE names ERROR_QUIET)
    string(REGEX REPLACE "\n" ";" names "${names}")
    foreach(name IN LISTS names)
        get_property(package GLOBAL PROPERTY HALCYON_PACKAGE_OF_${name})
        if(name STREQUAL "python")
            set(package python)
        endif()
        list(APPEND found ${package})
    endforeach()
    list(REMOVE_DUPLICATES found)
    set(${variable} "${found}" PARENT_SCOPE)
endfunction()

# halcyon_packages_source(): writes generated/tree_packages.cpp, with the values of runtime/base/tree_packages.hpp; and the table
# of the packages that this build leaves out, for the script `hal` and for the tests: NAME SWITCH, or NAME and what it needs.
function(halcyon_packages_source)
    set(rows "")
    set(left_out "")
    foreach(name IN LISTS HALCYON_PACKAGES)
        halcyon_package_switched_off(is_off ${name})
        get_property(needs GLOBAL PROPERTY HALCYON_PACKAGE_NEEDS_${name})
        if(is_off)
            set(state "PackageState::switched_off")
            string(TOUPPER "${name}" switch)
            string(APPEND left_out "${name} HALCYON_PACKAGE_${switch}\n")
        elseif(needs)
            set(state "PackageState::incomplete")
            string(APPEND left_out "${name} ${needs}\n")
        else()
            set(state "PackageState::built")
        endif()
        string(APPEND rows "    {\"${name}\", \"${HALCYON_PACKAGE_SUMMARY_${name}}\", ${state}, \"${needs}\"},\n")
    endforeach()
    file(CONFIGURE OUTPUT "${HALCYON_COMPONENT_OUTPUT_DIRECTORY}/packages_left_out" CONTENT "${left_out}")
    file(CONFIGURE OUTPUT "${PROJECT_BINARY_DIR}/generated/tree_packages.cpp" @ONLY CONTENT [[
// SPDX-License-Identifier: MIT
#include "base/tree_packages.hpp"

namespace hal {

static constexpr TreePackage rows[] = {
@rows@};
constinit const std::span<const TreePackage> tree_packages(rows);

}  // namespace hal
]])
endfunction()
