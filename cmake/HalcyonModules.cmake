# SPDX-License-Identifier: MIT
# libhalcyon_modules.so runs LinuxCNC's compiled modules. machine/load/module_library.cpp opens it at run time, with its symbols in the global
# scope; nothing links to it. It exports what runtime/linuxcnc/binary/exports.map lists.
if(NOT HALCYON_PACKAGE_LINUXCNC)
    halcyon_remove_products("lib/libhalcyon_modules.so*")
    return()
endif()
file(GLOB sources CONFIGURE_DEPENDS "${PROJECT_SOURCE_DIR}/runtime/linuxcnc/binary/*.cpp")
set(map "${PROJECT_SOURCE_DIR}/runtime/linuxcnc/binary/exports.map")
add_library(halcyon_modules SHARED ${sources})
target_include_directories(halcyon_modules PRIVATE "${PROJECT_SOURCE_DIR}/runtime" "${PROJECT_SOURCE_DIR}/runtime/sdk" "${PROJECT_SOURCE_DIR}/runtime/linuxcnc/source")
target_link_libraries(halcyon_modules PRIVATE halcyon_abi Threads::Threads ${CMAKE_DL_LIBS})
target_compile_features(halcyon_modules PRIVATE cxx_std_20)
target_compile_options(halcyon_modules PRIVATE "$<$<CXX_COMPILER_ID:GNU>:-fno-gnu-unique>")
# Bsymbolic: a module that defines a function with a name of ours must not replace it here.
target_link_options(halcyon_modules PRIVATE "LINKER:--version-script=${map}" "LINKER:-Bsymbolic-functions" "LINKER:-z,nodelete")
set_target_properties(halcyon_modules PROPERTIES CXX_VISIBILITY_PRESET default LINK_DEPENDS "${map}" LIBRARY_OUTPUT_DIRECTORY "${PROJECT_BINARY_DIR}/lib"
    SOVERSION "${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR}" VERSION "${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR}")
install(TARGETS halcyon_modules LIBRARY DESTINATION "${CMAKE_INSTALL_LIBDIR}")
