# SPDX-License-Identifier: MIT
# What is installed: program, headers of the sdk, and the CMake package. Each component installs itself.
include(CMakePackageConfigHelpers)

set(HALCYON_PACKAGE_DIR "${CMAKE_INSTALL_LIBDIR}/cmake/Halcyon")
install(DIRECTORY runtime/abi/hal runtime/sdk/hal DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}" FILES_MATCHING PATTERN "*.h" PATTERN "*.hpp")
install(TARGETS halcyon_abi halcyon_sdk EXPORT HalcyonTargets)
install(EXPORT HalcyonTargets NAMESPACE Halcyon:: DESTINATION "${HALCYON_PACKAGE_DIR}")
write_basic_package_version_file("${PROJECT_BINARY_DIR}/HalcyonConfigVersion.cmake" COMPATIBILITY SameMajorVersion)
install(FILES cmake/HalcyonConfig.cmake cmake/HalcyonComponent.cmake cmake/plugin.map "${PROJECT_BINARY_DIR}/HalcyonConfigVersion.cmake"
        DESTINATION "${HALCYON_PACKAGE_DIR}")
