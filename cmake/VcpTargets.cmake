# vcp_library(NAME SOURCES... ): one static or shared library a folder, with the project's warnings.
# vcp_room(NAME [OF LIBRARY] SOURCES a.cpp... LINKS x...): a room of a folder, the target vcp_NAME. Its objects go into
#   LIBRARY, which links what of LINKS is not ours once more; without one it is a static library of its own.
# vcp_options(TARGET): the project's language level, warnings and sanitizers.

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
    if(VCP_FUZZ)
        # What libFuzzer learns from as it runs.
        target_compile_options(${target} PRIVATE -fsanitize=fuzzer-no-link)
        target_link_options(${target} PUBLIC -fsanitize=fuzzer-no-link)
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
