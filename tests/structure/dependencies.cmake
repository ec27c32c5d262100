target_compile_definitions(test_structure PRIVATE ITS_CXX_COMPILER="${CMAKE_CXX_COMPILER}")
