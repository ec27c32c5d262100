target_link_libraries(test_threads PRIVATE its_vdb)
target_compile_definitions(test_threads PRIVATE ITS_PROGRAM="$<TARGET_FILE:its_cli>")
add_dependencies(test_threads its_cli)
