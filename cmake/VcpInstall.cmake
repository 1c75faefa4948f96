# Installs the libraries, their public headers, the program and the CMake package, in four components: library
# (libvcp.so), dev (headers, static libraries, packages of CMake and pkg-config), tools (the program), python.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

# What a user's find_package(vcp) must find again, for each target that our libraries link.
function(vcp_dependency_line result target)
    set(packages
        Threads::Threads Threads glm::glm glm fmt::fmt fmt TBB::tbb TBB Vulkan::Vulkan Vulkan Vulkan::Headers Vulkan
        PNG::PNG PNG glfw glfw3 FastFloat::fast_float FastFloat nlohmann_json::nlohmann_json nlohmann_json
        spdlog::spdlog spdlog CLI11::CLI11 CLI11 ZLIB::ZLIB ZLIB CURL::libcurl CURL JPEG::JPEG JPEG imgui::imgui imgui
        meshoptimizer::meshoptimizer meshoptimizer Freetype::Freetype Freetype)
    set(line "")
    if(target MATCHES "^PkgConfig::(.+)$")
        set(module ${CMAKE_MATCH_1})
        string(REPLACE ";" " " modules "${${module}_MODULE_NAME}")
        if(NOT modules)
            set(modules ${module})
        endif()
        set(line "find_dependency(PkgConfig)\npkg_check_modules(${module} REQUIRED QUIET IMPORTED_TARGET ${modules})")
    elseif(target IN_LIST packages)
        list(FIND packages ${target} index)
        math(EXPR index "${index} + 1")
        list(GET packages ${index} package)
        set(line "find_dependency(${package})")
    elseif(target MATCHES "::")
        message(FATAL_ERROR "vcp: ${target} is linked by an installed library, but cmake/VcpInstall.cmake does not know its package")
    endif()
    set(${result} "${line}" PARENT_SCOPE)
endfunction()

set(vcp_installed "")
set(VCP_DEPENDENCIES "")
foreach(folder octree builder mesostructure streaming render viewer)
    if(NOT TARGET vcp_${folder})
        continue()
    endif()
    list(APPEND vcp_installed vcp_${folder})
    set_target_properties(vcp_${folder} PROPERTIES EXPORT_NAME ${folder})
    if(BUILD_SHARED_LIBS)
        set_target_properties(vcp_${folder} PROPERTIES VERSION ${PROJECT_VERSION} SOVERSION ${PROJECT_VERSION_MAJOR} INSTALL_RPATH "$ORIGIN")
    endif()
    get_target_property(links vcp_${folder} INTERFACE_LINK_LIBRARIES)
    foreach(link IN LISTS links)
        # A private dependency of a static library is wrapped in $<LINK_ONLY:...>.
        string(REGEX REPLACE "^\\$<LINK_ONLY:(.*)>$" "\\1" link "${link}")
        if(link AND NOT link MATCHES "^vcp(_|::)")
            vcp_dependency_line(line ${link})
            list(APPEND VCP_DEPENDENCIES "${line}")
        endif()
    endforeach()
endforeach()
list(REMOVE_DUPLICATES VCP_DEPENDENCIES)
list(JOIN VCP_DEPENDENCIES "\n" VCP_DEPENDENCIES)

# The widget: one header for C, one for C++, and the library. Targets vcp::vcp and vcp::vcp_static.
set(vcp_package ${CMAKE_INSTALL_LIBDIR}/cmake/vcp)
if(TARGET vcp_widget)
    set_target_properties(vcp_widget PROPERTIES EXPORT_NAME vcp)
    set_target_properties(vcp_widget_static PROPERTIES EXPORT_NAME vcp_static)
    if(BUILD_SHARED_LIBS)
        set_target_properties(vcp_widget PROPERTIES INSTALL_RPATH "$ORIGIN")
    endif()
    list(APPEND vcp_installed vcp_widget_static)
    set(headers ${PROJECT_SOURCE_DIR}/viewer/widget)
    install(FILES ${headers}/vcp.h ${headers}/vcp.hpp ${headers}/vcp_qt.hpp
        DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/vcp COMPONENT dev)
    install(TARGETS vcp_widget EXPORT vcpWidgetTargets
        LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT library NAMELINK_COMPONENT dev)
    install(EXPORT vcpWidgetTargets NAMESPACE vcp:: DESTINATION ${vcp_package} COMPONENT dev)
    file(RELATIVE_PATH VCP_PC_PREFIX /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
    configure_file(${CMAKE_CURRENT_LIST_DIR}/vcp.pc.in ${PROJECT_BINARY_DIR}/vcp.pc @ONLY)
    install(FILES ${PROJECT_BINARY_DIR}/vcp.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT dev)
endif()

# The package `vcp` of Python: PYTHONPATH=PREFIX/lib/python3/dist-packages where the prefix is not the system's. In a
# wheel the library lies beside the module.
set(vcp_python_folder lib/python3/dist-packages/vcp)
if(TARGET vcp_python)
    find_package(Python3 COMPONENTS Interpreter REQUIRED)
    file(RELATIVE_PATH library_from_python /${vcp_python_folder} /${CMAKE_INSTALL_LIBDIR})
    set_target_properties(vcp_python PROPERTIES INSTALL_RPATH "$ORIGIN;$ORIGIN/${library_from_python}")
    install(TARGETS vcp_python LIBRARY DESTINATION ${vcp_python_folder} COMPONENT python)
    install(DIRECTORY ${PROJECT_SOURCE_DIR}/viewer/widget/python/ DESTINATION ${vcp_python_folder} COMPONENT python
        FILES_MATCHING PATTERN "*.py" PATTERN "*.pyi" PATTERN "py.typed")
    # cmake --build BUILD --target wheel: a wheel, in the folder of the packages.
    set(prefix ${PROJECT_BINARY_DIR}/wheel)
    add_custom_target(wheel
        COMMAND ${CMAKE_COMMAND} -E rm -rf ${prefix}
        COMMAND ${CMAKE_COMMAND} --install ${PROJECT_BINARY_DIR} --prefix ${prefix} --component python --strip
        COMMAND ${CMAKE_COMMAND} --install ${PROJECT_BINARY_DIR} --prefix ${prefix} --component library --strip
        COMMAND Python3::Interpreter ${CMAKE_CURRENT_LIST_DIR}/make_wheel.py ${prefix} ${PROJECT_VERSION}
            ${PROJECT_SOURCE_DIR}/LICENSE ${PROJECT_BINARY_DIR}/packages
        VERBATIM)
    add_dependencies(wheel vcp_python vcp_widget)
endif()

if(TARGET vcp)
    if(BUILD_SHARED_LIBS)
        set_target_properties(vcp PROPERTIES INSTALL_RPATH "$ORIGIN/../${CMAKE_INSTALL_LIBDIR}")
    endif()
    install(TARGETS vcp RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT tools)
    set(desktop ${PROJECT_SOURCE_DIR}/viewer/desktop)
    install(FILES ${desktop}/vcp.desktop DESTINATION ${CMAKE_INSTALL_DATADIR}/applications COMPONENT tools)
    install(FILES ${desktop}/vcp.svg DESTINATION ${CMAKE_INSTALL_DATADIR}/icons/hicolor/scalable/apps COMPONENT tools)
    install(FILES ${desktop}/vcp.xml DESTINATION ${CMAKE_INSTALL_DATADIR}/mime/packages COMPONENT tools)
    install(FILES ${desktop}/vcp.thumbnailer DESTINATION ${CMAKE_INSTALL_DATADIR}/thumbnailers COMPONENT tools)
endif()

# The viewer for browsers, for `vcp publish`, where its target was built.
if(TARGET vcp AND TARGET web)
    get_target_property(web_files web VCP_FILES)
    install(FILES ${web_files} DESTINATION ${CMAKE_INSTALL_DATADIR}/vcp/web COMPONENT tools OPTIONAL)
endif()

# What the program wrote about itself.
if(TARGET vcp_manual)
    set(zsh zsh/site-functions)
    if(EXISTS /etc/debian_version)
        set(zsh zsh/vendor-completions)
    endif()
    set(manual ${PROJECT_BINARY_DIR}/manual)
    install(DIRECTORY ${manual}/man1 DESTINATION ${CMAKE_INSTALL_MANDIR} COMPONENT tools)
    install(FILES ${manual}/vcp.bash DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions RENAME vcp COMPONENT tools)
    install(FILES ${manual}/_vcp DESTINATION ${CMAKE_INSTALL_DATADIR}/${zsh} COMPONENT tools)
    install(FILES ${manual}/vcp.fish DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d COMPONENT tools)
endif()

install(TARGETS ${vcp_installed} EXPORT vcpTargets
    ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT dev
    LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT library NAMELINK_COMPONENT dev
    FILE_SET HEADERS DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/vcp COMPONENT dev)
install(EXPORT vcpTargets NAMESPACE vcp:: DESTINATION ${vcp_package} COMPONENT dev)
configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/vcpConfig.cmake.in ${PROJECT_BINARY_DIR}/vcpConfig.cmake
    INSTALL_DESTINATION ${vcp_package})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/vcpConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/vcpConfig.cmake ${PROJECT_BINARY_DIR}/vcpConfigVersion.cmake
    DESTINATION ${vcp_package} COMPONENT dev)
