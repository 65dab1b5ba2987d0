# SPDX-License-Identifier: MIT
# halcyon_interface(LIBRARY TARGET FOLDER): ties users of the shared library LIBRARY to its headers below FOLDER. These contain C++ classes, so
# the layout in a plugin of another build may differ. TARGET, whose objects are in the library, defines a symbol with the hash of the headers in
# its name, and each target that links the library references it: a plugin compiled with other headers does not load.
function(halcyon_interface library target folder)
    file(GLOB_RECURSE headers CONFIGURE_DEPENDS "${folder}/*.hpp")
    list(SORT headers)
    list(JOIN headers "," joined)
    set(definition "${PROJECT_BINARY_DIR}/generated/${library}_defines.cpp")
    set(reference "${PROJECT_BINARY_DIR}/generated/${library}_needs.cpp")
    add_custom_command(OUTPUT "${definition}" "${reference}"
        COMMAND "${CMAKE_COMMAND}" "-DNAME=${library}" "-DHEADERS=${joined}" "-DREFERENCE=${reference}" "-DDEFINITION=${definition}"
                -P "${PROJECT_SOURCE_DIR}/cmake/interface_hash.cmake"
        DEPENDS ${headers} "${PROJECT_SOURCE_DIR}/cmake/interface_hash.cmake" VERBATIM)
    target_sources(${target} PRIVATE "${definition}")
    add_custom_target(${library}_interface DEPENDS "${definition}" "${reference}")
    add_dependencies(${target} ${library}_interface)
    add_dependencies(${library} ${library}_interface)
    set_source_files_properties("${definition}" "${reference}" PROPERTIES SKIP_PRECOMPILE_HEADERS ON SKIP_UNITY_BUILD_INCLUSION ON)
    target_sources(${library} INTERFACE "$<BUILD_INTERFACE:${reference}>" "$<INSTALL_INTERFACE:$<INSTALL_PREFIX>/${CMAKE_INSTALL_INCLUDEDIR}/halcyon/${library}_needs.cpp>")
endfunction()
