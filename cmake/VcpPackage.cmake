# `cpack`, in the folder of a build, makes Debian packages: libvcp0, libvcp-dev, vcp (the program) and python3-vcp.
set(VCP_MAINTAINER "the vcp authors <vcp@localhost>" CACHE STRING "Who answers for the packages: name and address")

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME vcp)
set(CPACK_PACKAGE_VENDOR "the vcp authors")
set(CPACK_PACKAGE_CONTACT "${VCP_MAINTAINER}")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "")  # each package has its own
set(CPACK_RESOURCE_FILE_LICENSE ${PROJECT_SOURCE_DIR}/LICENSE)
set(CPACK_STRIP_FILES ON)
set(CPACK_PACKAGE_DIRECTORY ${PROJECT_BINARY_DIR}/packages)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_COMPONENTS_ALL "")
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_COMPRESSION_TYPE xz)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
find_program(VCP_SHLIBDEPS dpkg-shlibdeps)
if(VCP_SHLIBDEPS)
    set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
    set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${PROJECT_BINARY_DIR}/viewer/widget)
endif()

# vcp_debian(COMPONENT PACKAGE SECTION DESCRIPTION [FIELD VALUE]...): one package, and its licence where Debian looks.
function(vcp_debian component package section description)
    string(TOUPPER ${component} name)
    set(CPACK_COMPONENTS_ALL ${CPACK_COMPONENTS_ALL} ${component} PARENT_SCOPE)
    set(CPACK_DEBIAN_${name}_PACKAGE_NAME ${package} PARENT_SCOPE)
    set(CPACK_DEBIAN_${name}_PACKAGE_SECTION ${section} PARENT_SCOPE)
    set(CPACK_COMPONENT_${name}_DESCRIPTION ${description} PARENT_SCOPE)
    while(ARGN)
        list(POP_FRONT ARGN field value)
        set(CPACK_DEBIAN_${name}_PACKAGE_${field} ${value} PARENT_SCOPE)
    endwhile()
    install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${package} RENAME copyright COMPONENT ${component})
endfunction()

# The static libraries link what the build links: ./run has the one list of packages.
file(STRINGS ${PROJECT_SOURCE_DIR}/run links REGEX "^build +[^ ]+-dev ")
list(TRANSFORM links REPLACE "^build +([^ ]+) .*" "\\1")
list(JOIN links ", " links)

set(library libvcp${PROJECT_VERSION_MAJOR})
set(same_library "${library} (= ${PROJECT_VERSION})")
if(TARGET vcp_widget)
    vcp_debian(library ${library} libs "Viewer of massive scans: the library\n A widget that shows .vcp files, for programs in C, C++ and Python."
        RECOMMENDS libvulkan1)
    # The binary interface only grows: a program needs the library that it was built with, or a later one.
    file(WRITE ${PROJECT_BINARY_DIR}/debian/shlibs "libvcp ${PROJECT_VERSION_MAJOR} ${library} (>= ${PROJECT_VERSION})\n")
    set(CPACK_DEBIAN_LIBRARY_PACKAGE_CONTROL_EXTRA ${PROJECT_BINARY_DIR}/debian/shlibs)
    vcp_debian(dev libvcp-dev libdevel "Viewer of massive scans: headers\n What is needed to build programs with libvcp."
        DEPENDS "${same_library}" RECOMMENDS "${links}")
else()
    vcp_debian(dev libvcp-dev libdevel "Viewer of massive scans: headers\n What is needed to read and build .vcp files."
        DEPENDS "${links}")
endif()
if(TARGET vcp)
    vcp_debian(tools vcp graphics "Viewer of massive scans\n Builds triangle meshes of any size into one file that can be looked at at once, and shows it."
        RECOMMENDS "libvulkan1, mesa-vulkan-drivers | vulkan-icd")
endif()
if(TARGET vcp_python)
    set(minor ${Python3_VERSION_MINOR})
    math(EXPR next "${minor} + 1")
    vcp_debian(python python3-vcp python "Viewer of massive scans: Python\n The module vcp: pictures and picks of .vcp files in NumPy."
        DEPENDS "${same_library}, python3 (>= 3.${minor}), python3 (<< 3.${next}), python3-numpy")
endif()
include(CPack)
