# Installs the build into a fresh prefix, then configures, builds and runs the outside project against it.
# Wants BUILD_DIR, SOURCE_DIR, WORK_DIR, BUILD_TYPE, GENERATOR, CXX_COMPILER.
set(prefix ${WORK_DIR}/prefix)
file(REMOVE_RECURSE ${WORK_DIR})

function(step)
    execute_process(COMMAND ${ARGN} RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE output)
    if(NOT status EQUAL 0)
        list(JOIN ARGN " " command)
        message(FATAL_ERROR "${command}: ${status}\n${output}")
    endif()
endfunction()

step(${CMAKE_COMMAND} --install ${BUILD_DIR} --prefix ${prefix})
step(${CMAKE_COMMAND} -S ${SOURCE_DIR}/tests/install -B ${WORK_DIR}/build -G ${GENERATOR}
    -DCMAKE_BUILD_TYPE=${BUILD_TYPE} -DCMAKE_CXX_COMPILER=${CXX_COMPILER} -DCMAKE_PREFIX_PATH=${prefix})
step(${CMAKE_COMMAND} --build ${WORK_DIR}/build)
step(${WORK_DIR}/build/vcp_user)
if(EXISTS ${BUILD_DIR}/vcp)
    step(${prefix}/bin/vcp --help)
    # The viewer for browsers is found where it was installed; where it was not built, one line says so.
    step(${prefix}/bin/vcp build ${SOURCE_DIR}/tests/install/octahedron.off -o ${WORK_DIR}/scan.vcp --progress none)
    set(site ${WORK_DIR}/site)
    if(EXISTS ${BUILD_DIR}/web/vcp.wasm)
        step(${prefix}/bin/vcp publish ${WORK_DIR}/scan.vcp -o ${site})
        step(${CMAKE_COMMAND} -E compare_files ${WORK_DIR}/scan.vcp ${site}/scan.vcp)
        step(${CMAKE_COMMAND} -E compare_files ${BUILD_DIR}/web/vcp.wasm ${site}/vcp.wasm)
    else()
        execute_process(COMMAND ${prefix}/bin/vcp publish ${WORK_DIR}/scan.vcp -o ${site} RESULT_VARIABLE status
            OUTPUT_QUIET ERROR_VARIABLE said)
        if(NOT status EQUAL 1 OR NOT said MATCHES "share/vcp/web: .*--viewer" OR EXISTS ${site})
            message(FATAL_ERROR "without a viewer: ${status}, ${said}")
        endif()
    endif()
endif()
