# SPDX-License-Identifier: MIT
# What is installed: headers of the sdk, the CMake package, pages and machines. Programs and components install themselves. The build tree has
# the same package in the same place, so that -DCMAKE_PREFIX_PATH=BUILD works like an installation. An installation may be moved.
include(CMakePackageConfigHelpers)

set(HALCYON_PACKAGE_DIR "${CMAKE_INSTALL_LIBDIR}/cmake/Halcyon")
install(DIRECTORY runtime/abi/hal runtime/sdk/hal runtime/linuxcnc/source/linuxcnc runtime/sdk/check DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}" FILES_MATCHING PATTERN "*.h" PATTERN "*.hpp" PATTERN "*.c")
set_target_properties(halcyon_text PROPERTIES EXPORT_NAME text)
install(TARGETS halcyon_abi halcyon_sdk halcyon_text EXPORT HalcyonTargets ARCHIVE DESTINATION "${CMAKE_INSTALL_LIBDIR}")
install(DIRECTORY runtime/text DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}" FILES_MATCHING PATTERN "*.hpp")
install(EXPORT HalcyonTargets NAMESPACE Halcyon:: DESTINATION "${HALCYON_PACKAGE_DIR}")
write_basic_package_version_file("${PROJECT_BINARY_DIR}/HalcyonConfigVersion.cmake" COMPATIBILITY SameMajorVersion)
set(HALCYON_PACKAGE_FILES cmake/HalcyonConfig.cmake cmake/HalcyonComponent.cmake cmake/HalcyonTest.cmake cmake/plugin.map)
install(FILES ${HALCYON_PACKAGE_FILES} "${PROJECT_BINARY_DIR}/HalcyonConfigVersion.cmake" DESTINATION "${HALCYON_PACKAGE_DIR}")

foreach(library IN ITEMS text link cia301 cia402 can_timing bus_config canopen tdma scocan modbus mesa)
    if(TARGET halcyon_${library})
        add_dependencies(installed halcyon_${library})
    endif()
endforeach()

# Pages, and the machines to start from, in the order of the tree, so that links between them are right.
install(FILES LICENSE README.md CHANGELOG.md CONTRIBUTING.md SECURITY.md DESTINATION "${CMAKE_INSTALL_DOCDIR}")
install(DIRECTORY docs halfiles DESTINATION "${CMAKE_INSTALL_DOCDIR}" USE_SOURCE_PERMISSIONS
    PATTERN "driven" EXCLUDE PATTERN "*.var*" EXCLUDE)  # what a machine has written beside its files
install(DIRECTORY components drivers runtime tests tools DESTINATION "${CMAKE_INSTALL_DOCDIR}" FILES_MATCHING PATTERN "*.md")
install(DIRECTORY tests/netlists/semantics DESTINATION "${CMAKE_INSTALL_DOCDIR}/tests/netlists")

set(package "${PROJECT_BINARY_DIR}/lib/cmake/Halcyon")
set(exported halcyon_abi halcyon_sdk halcyon_text halcyon_link halcyon_cia301 halcyon_cia402 halcyon_can_timing halcyon_bus_config)
if(TARGET halcyon_canopen)
    list(APPEND exported halcyon_canopen)
endif()
export(TARGETS ${exported} NAMESPACE Halcyon:: FILE "${package}/HalcyonTargets.cmake")
foreach(file IN LISTS HALCYON_PACKAGE_FILES ITEMS "${PROJECT_BINARY_DIR}/HalcyonConfigVersion.cmake")
    cmake_path(GET file FILENAME name)
    configure_file("${file}" "${package}/${name}" COPYONLY)
endforeach()
install(FILES tools/wireshark/halcyon.lua DESTINATION "${CMAKE_INSTALL_DATADIR}/halcyon/wireshark")
install(DIRECTORY tools/lsp/vscode tools/lsp/kate DESTINATION "${CMAKE_INSTALL_DATADIR}/halcyon/editors" PATTERN node_modules EXCLUDE)
