its_link_parts(test_threads)
target_compile_definitions(test_threads PRIVATE ITS_PROGRAM="$<TARGET_FILE:its_cli>")
add_dependencies(test_threads its_cli)
