# SPDX-License-Identifier: MIT
# halcyon_component_library(NAME [EXCEPT REGEX] [LIBRARIES LIBRARY...]): makes the library halcyon_NAME, Halcyon::NAME, of the sources of
# this folder below components/, which needs no thread and no runtime: for components, tools, tests and programs of others. It goes into
# plugins, so it can be moved in memory. The components in plugins/ are not in it, nor what the regular expression matches.
function(halcyon_component_library name)
    cmake_parse_arguments(PARSE_ARGV 1 with "" "EXCEPT" "LIBRARIES")
    set(library halcyon_${name})
    file(GLOB_RECURSE sources CONFIGURE_DEPENDS "${CMAKE_CURRENT_SOURCE_DIR}/*.cpp")
    list(FILTER sources EXCLUDE REGEX "/plugins/")
    if(with_EXCEPT)
        list(FILTER sources EXCLUDE REGEX "${with_EXCEPT}")
    endif()
    add_library(${library} STATIC ${sources})
    add_library(Halcyon::${name} ALIAS ${library})
    target_include_directories(${library} PUBLIC "$<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/components>"
        "$<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/drivers>" "$<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>")
    target_link_libraries(${library} PUBLIC ${with_LIBRARIES})
    target_compile_features(${library} PUBLIC cxx_std_20)
    set_target_properties(${library} PROPERTIES EXPORT_NAME ${name} POSITION_INDEPENDENT_CODE ON
        CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON)

    # the headers keep their path below components/
    cmake_path(RELATIVE_PATH CMAKE_CURRENT_SOURCE_DIR BASE_DIRECTORY "${PROJECT_SOURCE_DIR}/components" OUTPUT_VARIABLE path)
    cmake_path(GET path PARENT_PATH folder)
    install(TARGETS ${library} EXPORT HalcyonTargets ARCHIVE DESTINATION "${CMAKE_INSTALL_LIBDIR}")
    install(DIRECTORY "${CMAKE_CURRENT_SOURCE_DIR}" DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}/${folder}" FILES_MATCHING PATTERN "*.hpp" PATTERN "plugins" EXCLUDE)
endfunction()

# halcyon_package_library(NAME ...): the same for the protocol of the package NAME of this tree.
function(halcyon_package_library name)
    halcyon_component_library(${ARGV})
    halcyon_unity_quick(halcyon_${name})
endfunction()
