target_link_libraries(test_vdb PRIVATE its_vdb)
# OpenVDB itself reads what we wrote, where it is installed.
find_package(Imath QUIET)
if(ITS_OPENVDB_INCLUDE AND ITS_OPENVDB_LIBRARY AND Imath_FOUND)
  target_compile_definitions(test_vdb PRIVATE ITS_TEST_OPENVDB)
  target_include_directories(test_vdb SYSTEM PRIVATE ${ITS_OPENVDB_INCLUDE})
  target_link_libraries(test_vdb PRIVATE ${ITS_OPENVDB_LIBRARY} Imath::Imath)
  set_target_properties(test_vdb PROPERTIES CXX_VISIBILITY_PRESET default)
endif()
