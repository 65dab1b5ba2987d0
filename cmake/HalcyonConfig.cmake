# SPDX-License-Identifier: MIT
# find_package(Halcyon REQUIRED) gives Halcyon::sdk and add_hal_component(NAME SOURCE...), and Halcyon::canopen for CANopen devices.
find_package(pugixml QUIET)  # Halcyon::canopen reads device descriptions in XML with it
include("${CMAKE_CURRENT_LIST_DIR}/HalcyonTargets.cmake")
include("${CMAKE_CURRENT_LIST_DIR}/HalcyonComponent.cmake")

# The program that runs a component's test.hal: the one this package belongs to, installed or in its build tree.
find_program(HALCYON_PROGRAM hal PATHS "${CMAKE_CURRENT_LIST_DIR}/../../../bin" "${CMAKE_CURRENT_LIST_DIR}/../../../../bin" NO_DEFAULT_PATH)
find_program(HALCYON_PROGRAM hal)
mark_as_advanced(HALCYON_PROGRAM)
enable_testing()  # here, because within a function it would be forgotten at its end
