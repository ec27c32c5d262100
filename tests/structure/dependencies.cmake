target_compile_definitions(test_structure PRIVATE ITS_CXX_COMPILER="${CMAKE_CXX_COMPILER}")

# The verifier once more, without optimisation: every function that it calls is then a symbol, inline ones and templates
# too. The test reads their names.
file(GLOB verify_sources CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/src/verify/*.cpp)
add_library(its_verify_symbols OBJECT ${verify_sources})
target_include_directories(its_verify_symbols PRIVATE ${PROJECT_SOURCE_DIR}/src ${PROJECT_SOURCE_DIR}/include)
target_link_libraries(its_verify_symbols PRIVATE its_compile fmt::fmt TBB::tbb)
target_compile_options(its_verify_symbols PRIVATE -O0 -fno-inline)
add_dependencies(test_structure its_verify_symbols)
file(GENERATE OUTPUT ${CMAKE_CURRENT_BINARY_DIR}/verify_objects.txt
     CONTENT "$<JOIN:$<TARGET_OBJECTS:its_verify_symbols>,\n>\n")
target_compile_definitions(test_structure PRIVATE
  ITS_NM="${CMAKE_NM}" ITS_VERIFY_OBJECTS="${CMAKE_CURRENT_BINARY_DIR}/verify_objects.txt")
