# OpenVDB itself reads what we wrote.
target_link_libraries(test_vdb PRIVATE its_vdb ${ITS_OPENVDB_LIBRARY} Imath::Imath)
target_include_directories(test_vdb SYSTEM PRIVATE ${ITS_OPENVDB_INCLUDE})
set_target_properties(test_vdb PROPERTIES CXX_VISIBILITY_PRESET default
                                          DISABLE_PRECOMPILE_HEADERS ON)
if(ITS_SANITIZE)
  set_source_files_properties(${sources} PROPERTIES COMPILE_OPTIONS -fno-sanitize=alignment)  # as in src/vdb
endif()
