# vcp_library(NAME SOURCES... ): one static or shared library a folder, with the project's warnings.
# vcp_room(NAME [OF LIBRARY] SOURCES a.cpp... LINKS x...): a room of a folder, the target vcp_NAME. Its objects go into
#   LIBRARY, which links what of LINKS is not ours once more; without one it is a static library of its own.
# vcp_options(TARGET): the project's language level, warnings, sanitizers and precompiled headers.

function(vcp_options target)
    target_compile_features(${target} PUBLIC cxx_std_20)
    set_target_properties(${target} PROPERTIES CXX_EXTENSIONS OFF POSITION_INDEPENDENT_CODE ON)
    target_compile_options(${target} PRIVATE -Wall -Wextra -Wshadow -Wconversion -Wno-sign-conversion)
    # Results must not depend on how a compiler fuses or reorders arithmetic.
    target_compile_options(${target} PRIVATE -ffp-contract=off)
    if(VCP_WERROR)
        target_compile_options(${target} PRIVATE -Werror)
    endif()
    if(VCP_SANITIZE)
        target_compile_options(${target} PRIVATE -fsanitize=${VCP_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
        # GCC 12 sees uninitialized values in what sanitizers add.
        target_compile_options(${target} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>)
        target_link_options(${target} PUBLIC -fsanitize=${VCP_SANITIZE})
    endif()
    if(VCP_PRECOMPILE)
        vcp_precompiled(${target})
    endif()
endfunction()

# Headers of the standard library, GLM, fmt and GoogleTest, compiled once for libraries and once for programs, whose
# code may lie anywhere in another way. Sources include what they need all the same: the other presets see to it.
function(vcp_precompiled target)
    get_target_property(type ${target} TYPE)
    set(kind library)
    if(type STREQUAL EXECUTABLE)
        set(kind program)
    endif()
    # A macro that a header looks at is the same wherever that header is precompiled.
    target_compile_definitions(${target} PRIVATE $<TARGET_PROPERTY:fmt::fmt,INTERFACE_COMPILE_DEFINITIONS>)
    if(kind STREQUAL program)
        target_compile_definitions(${target} PRIVATE GTEST_HAS_PTHREAD=1)
    endif()
    if(NOT target STREQUAL vcp_precompiled_${kind})
        target_precompile_headers(${target} REUSE_FROM vcp_precompiled_${kind})
        return()
    endif()
    target_precompile_headers(${target} PRIVATE
        <algorithm> <array> <atomic> <chrono> <cmath> <deque> <filesystem> <fstream> <functional> <map> <memory> <mutex>
        <numeric> <optional> <random> <set> <span> <sstream> <string> <string_view> <thread> <unordered_map> <vector>
        <fmt/format.h> <glm/common.hpp> <glm/geometric.hpp> <glm/vec2.hpp> <glm/vec3.hpp> <glm/vec4.hpp>)
    if(kind STREQUAL program)
        target_precompile_headers(${target} PRIVATE <gtest/gtest.h>)
    endif()
endfunction()

function(vcp_library name)
    add_library(vcp_${name} ${ARGN})
    add_library(vcp::${name} ALIAS vcp_${name})
    target_include_directories(vcp_${name} PUBLIC
        $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}> $<INSTALL_INTERFACE:include/vcp>)
    vcp_options(vcp_${name})
endfunction()

function(vcp_room name)
    cmake_parse_arguments(PARSE_ARGV 1 arg "" "OF" "SOURCES;LINKS")
    if(arg_OF)
        add_library(vcp_${name} OBJECT ${arg_SOURCES})
        target_sources(${arg_OF} PRIVATE $<TARGET_OBJECTS:vcp_${name}>)
    else()
        add_library(vcp_${name} STATIC ${arg_SOURCES})
    endif()
    target_include_directories(vcp_${name} PUBLIC ${PROJECT_SOURCE_DIR})
    target_link_libraries(vcp_${name} PUBLIC ${arg_LINKS})
    vcp_options(vcp_${name})
endfunction()
