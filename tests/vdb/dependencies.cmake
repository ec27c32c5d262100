# OpenVDB itself reads what we wrote.
target_link_libraries(test_vdb PRIVATE its_vdb ${ITS_OPENVDB_LIBRARY} Imath::Imath)
target_include_directories(test_vdb SYSTEM PRIVATE ${ITS_OPENVDB_INCLUDE})
set_target_properties(test_vdb PROPERTIES CXX_VISIBILITY_PRESET default
                                          DISABLE_PRECOMPILE_HEADERS ON)
if(ITS_SANITIZE)
  target_compile_options(test_vdb PRIVATE -fno-sanitize=alignment)  # as for its_vdb
endif()
