# SPDX-License-Identifier: MIT
# What is installed: program, headers of the sdk, and the CMake package. Each component installs itself. The build tree has the same
# package in the same place, so that -DCMAKE_PREFIX_PATH=BUILD works like an installation.
include(CMakePackageConfigHelpers)

set(HALCYON_PACKAGE_DIR "${CMAKE_INSTALL_LIBDIR}/cmake/Halcyon")
install(DIRECTORY runtime/abi/hal runtime/sdk/hal runtime/sdk/linuxcnc runtime/sdk/check DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}" FILES_MATCHING PATTERN "*.h" PATTERN "*.hpp" PATTERN "*.c")
install(TARGETS halcyon_abi halcyon_sdk EXPORT HalcyonTargets)
install(EXPORT HalcyonTargets NAMESPACE Halcyon:: DESTINATION "${HALCYON_PACKAGE_DIR}")
write_basic_package_version_file("${PROJECT_BINARY_DIR}/HalcyonConfigVersion.cmake" COMPATIBILITY SameMajorVersion)
set(HALCYON_PACKAGE_FILES cmake/HalcyonConfig.cmake cmake/HalcyonComponent.cmake cmake/HalcyonTest.cmake cmake/plugin.map)
install(FILES ${HALCYON_PACKAGE_FILES} "${PROJECT_BINARY_DIR}/HalcyonConfigVersion.cmake" DESTINATION "${HALCYON_PACKAGE_DIR}")

set(package "${PROJECT_BINARY_DIR}/lib/cmake/Halcyon")
export(TARGETS halcyon_abi halcyon_sdk halcyon_link halcyon_canopen NAMESPACE Halcyon:: FILE "${package}/HalcyonTargets.cmake")
foreach(file IN LISTS HALCYON_PACKAGE_FILES ITEMS "${PROJECT_BINARY_DIR}/HalcyonConfigVersion.cmake")
    cmake_path(GET file FILENAME name)
    configure_file("${file}" "${package}/${name}" COPYONLY)
endforeach()
