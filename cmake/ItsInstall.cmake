# cmake --install: the headers, the libraries, the program, and what find_package(its) needs.
include(CMakePackageConfigHelpers)
include(GNUInstallDirs)
set(package ${CMAKE_INSTALL_LIBDIR}/cmake/its)
install(TARGETS its its_vdb EXPORT its_targets ARCHIVE LIBRARY RUNTIME)
install(TARGETS its_cli RUNTIME)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/include/its TYPE INCLUDE)
install(EXPORT its_targets NAMESPACE its:: DESTINATION ${package} FILE its-targets.cmake)
configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/its-config.cmake.in ${PROJECT_BINARY_DIR}/its-config.cmake
                              INSTALL_DESTINATION ${package})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/its-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/its-config.cmake ${PROJECT_BINARY_DIR}/its-config-version.cmake
        DESTINATION ${package})
