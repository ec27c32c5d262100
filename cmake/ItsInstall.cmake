# cmake --install: the libraries, their headers, the program with its manual page and completions, licences, and what
# find_package(its) and pkg-config need. Two components: runtime and development; cpack makes a Debian package of each.
include(CMakePackageConfigHelpers)
set(package ${CMAKE_INSTALL_LIBDIR}/cmake/its)
set(pkgconfig ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
file(RELATIVE_PATH ITS_PREFIX_OF_PC /${pkgconfig} /)

# its_install(<name> <target> <pkg-config names> <other libraries> <find_package arguments>...): one library, its file
# for pkg-config, and what its users have to find. Those of a shared one need only the libraries of ours.
function(its_install name target requires libraries)
  install(TARGETS ${target} EXPORT its_${name}_targets
          LIBRARY COMPONENT runtime NAMELINK_COMPONENT development
          ARCHIVE COMPONENT development
          RUNTIME COMPONENT runtime)
  install(EXPORT its_${name}_targets NAMESPACE its:: DESTINATION ${package} FILE its-${name}-targets.cmake
          COMPONENT development)
  set(ITS_NAME ${target})
  set(ITS_REQUIRES ${requires})
  set(ITS_LIBS ${libraries})
  set(find_calls "")
  if(BUILD_SHARED_LIBS)
    set(ITS_LIBS "")
    string(REGEX MATCH "its = [^ ]*" ITS_REQUIRES "${requires}")
  else()
    foreach(call ${ARGN})
      string(APPEND find_calls "its_find(${name} ${call})\n")
    endforeach()
  endif()
  configure_file(${PROJECT_SOURCE_DIR}/cmake/its.pc.in ${PROJECT_BINARY_DIR}/${target}.pc @ONLY)
  file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/its-${name}.cmake CONTENT "${find_calls}")
  install(FILES ${PROJECT_BINARY_DIR}/${target}.pc DESTINATION ${pkgconfig} COMPONENT development)
  install(FILES ${PROJECT_BINARY_DIR}/its-${name}.cmake DESTINATION ${package} COMPONENT development)
endfunction()

set(packed)
foreach(package draco meshoptimizer)
  if(TARGET ${package}::${package})
    list(APPEND packed ${package})
  endif()
endforeach()
list(TRANSFORM packed PREPEND -l OUTPUT_VARIABLE libraries)
list(JOIN libraries " " libraries)
its_install(its its "tbb fmt zlib libxxhash" "${libraries}" TBB fmt ZLIB xxhash ${packed})
set(same "its = ${PROJECT_VERSION}")
if(TARGET its_picture)
  its_install(picture its_picture "${same} libpng freetype2" "-lembree${ITS_EMBREE}"
              PNG Freetype "embree ${ITS_EMBREE}")
endif()
if(TARGET its_page)
  its_install(page its_page "${same}" "" ZLIB)
endif()
if(TARGET its_vdb)
  its_install(vdb its_vdb "${same} Imath" "-lopenvdb" Imath)
endif()

set(left_out)
foreach(part picture page vdb)
  if(NOT TARGET its_${part})
    list(APPEND left_out PATTERN ${part}.h EXCLUDE)
  endif()
endforeach()
install(DIRECTORY ${PROJECT_SOURCE_DIR}/include/its TYPE INCLUDE COMPONENT development ${left_out})
configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/its-config.cmake.in ${PROJECT_BINARY_DIR}/its-config.cmake
                              INSTALL_DESTINATION ${package})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/its-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/its-config.cmake ${PROJECT_BINARY_DIR}/its-config-version.cmake
        DESTINATION ${package} COMPONENT development)

# The program says itself what its manual page and completions are.
if(TARGET its_cli)
  install(TARGETS its_cli RUNTIME COMPONENT runtime)
  set(manual ${PROJECT_BINARY_DIR}/manual)
  file(MAKE_DIRECTORY ${manual})
  add_custom_command(OUTPUT ${manual}/its.1 ${manual}/its.bash ${manual}/_its ${manual}/its.fish
    COMMAND its_cli man >${manual}/its.1
    COMMAND its_cli completions bash >${manual}/its.bash
    COMMAND its_cli completions zsh >${manual}/_its
    COMMAND its_cli completions fish >${manual}/its.fish
    DEPENDS its_cli COMMENT "Writing the manual page and completions")
  add_custom_target(its_manual ALL DEPENDS ${manual}/its.1)
  install(FILES ${manual}/its.1 DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT runtime)
  set(share ${CMAKE_INSTALL_DATADIR})
  install(FILES ${manual}/its.bash DESTINATION ${share}/bash-completion/completions RENAME its COMPONENT runtime)
  install(FILES ${manual}/_its DESTINATION ${share}/zsh/vendor-completions COMPONENT runtime)
  install(FILES ${manual}/its.fish DESTINATION ${share}/fish/vendor_completions.d COMPONENT runtime)
endif()

# The licence, and those of what is compiled in. Debian's name for them is copyright.
foreach(component runtime development)
  set(name its)
  if(component STREQUAL development)
    set(name libits-dev)
  endif()
  install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${name} RENAME copyright
          COMPONENT ${component})
  install(FILES ${PROJECT_SOURCE_DIR}/THIRD-PARTY.md DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${name}
          COMPONENT ${component})
endforeach()

# cpack: its_VERSION_ARCHITECTURE.deb has the program and libits-dev_… the libraries. What they depend on is read from
# the programs by dpkg-shlibdeps.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_VENDOR "ITS")
set(CPACK_PACKAGE_CONTACT "ITS <its@localhost>")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPONENTS_ALL runtime development)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_RUNTIME_PACKAGE_NAME its)
set(CPACK_DEBIAN_RUNTIME_PACKAGE_SECTION graphics)
set(CPACK_COMPONENT_RUNTIME_DESCRIPTION "Implicit thin shells of triangle meshes\n\
 Builds a function and two numbers that enclose a mesh with proof, tells inside from\n\
 outside, extracts surfaces that wrap it, and simplifies it within a proven distance.")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libits-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS
    "its (= ${PROJECT_VERSION}), libtbb-dev, libfmt-dev, zlib1g-dev, libxxhash-dev, libdraco-dev, libmeshoptimizer-dev, pkgconf")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SUGGESTS
    "libpng-dev, libfreetype-dev, libembree-dev, libopenvdb-dev, libimath-dev")
set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION "Implicit thin shells of triangle meshes, C++ library\n\
 Headers and libraries, for CMake and pkg-config.")
if(BUILD_SHARED_LIBS)
  set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${PROJECT_BINARY_DIR}/src)
  foreach(part picture page vdb)
    list(APPEND CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${PROJECT_BINARY_DIR}/src/${part})
  endforeach()
endif()
include(CPack)
