# SPDX-License-Identifier: MIT
# find_package(Halcyon REQUIRED) gives Halcyon::sdk and add_hal_component(NAME SOURCE...).
include("${CMAKE_CURRENT_LIST_DIR}/HalcyonTargets.cmake")
include("${CMAKE_CURRENT_LIST_DIR}/HalcyonComponent.cmake")
