# SPDX-License-Identifier: MIT
# liblinuxcnchal.so.0, by which LinuxCNC's programs connect to a machine; see runtime/linuxcnc/programs/README.md. It is in a folder of its own, which only
# started programs search: outside of that it must not stand in the way of LinuxCNC's library of the same name.
if(NOT HALCYON_PACKAGE_LINUXCNC)
    halcyon_remove_products("lib/halcyon/linuxcnc/liblinuxcnchal.so*")
    return()
endif()
set(source "${PROJECT_SOURCE_DIR}/runtime/linuxcnc/source/linuxcnc")
set(map "${PROJECT_SOURCE_DIR}/runtime/linuxcnc/programs/exports.map")
file(GLOB sources CONFIGURE_DEPENDS "${PROJECT_SOURCE_DIR}/runtime/linuxcnc/programs/*.c" "${PROJECT_SOURCE_DIR}/runtime/linuxcnc/programs/*.cpp")
add_library(linuxcnchal SHARED ${sources} "${PROJECT_SOURCE_DIR}/runtime/linuxcnc/binary/streams.cpp" "${PROJECT_SOURCE_DIR}/runtime/linuxcnc/binary/shared_memory.cpp"
    "${source}/declare.c" "${source}/program.c" "${source}/program_exchange.c" "${source}/program_protocol.c" "${source}/rtapi.c")
target_include_directories(linuxcnchal PRIVATE "${PROJECT_SOURCE_DIR}/runtime" "${PROJECT_SOURCE_DIR}/runtime/sdk" "${PROJECT_SOURCE_DIR}/runtime/linuxcnc/source" "${source}")
target_compile_definitions(linuxcnchal PRIVATE HALCYON_PROGRAM=1 HALCYON_LINUXCNC_PROGRAMS=1 ULAPI=1)
target_link_libraries(linuxcnchal PRIVATE halcyon_abi Threads::Threads ${CMAKE_DL_LIBS})
target_compile_features(linuxcnchal PRIVATE c_std_11 cxx_std_20)
# The programs have no sanitizer's runtime.
if(HALCYON_SANITIZE)
    target_compile_options(linuxcnchal PRIVATE -fno-sanitize=all)
    target_link_options(linuxcnchal PRIVATE -fno-sanitize=all)
endif()
# Bsymbolic only for functions: a program's copies of hal_data and hal_shmem_base are the ones that count.
target_link_options(linuxcnchal PRIVATE "LINKER:--version-script=${map}" "LINKER:-Bsymbolic-functions" "LINKER:-z,defs")
set_target_properties(linuxcnchal PROPERTIES C_VISIBILITY_PRESET default CXX_VISIBILITY_PRESET default LINK_DEPENDS "${map}" UNITY_BUILD OFF
    SOVERSION 0 LIBRARY_OUTPUT_DIRECTORY "${PROJECT_BINARY_DIR}/lib/halcyon/linuxcnc")
install(TARGETS linuxcnchal LIBRARY DESTINATION "${CMAKE_INSTALL_LIBDIR}/halcyon/linuxcnc" NAMELINK_SKIP)
