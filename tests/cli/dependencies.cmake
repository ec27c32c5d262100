find_package(nlohmann_json REQUIRED)
target_link_libraries(test_cli PRIVATE nlohmann_json::nlohmann_json)
target_compile_definitions(test_cli PRIVATE ITS_PROGRAM="$<TARGET_FILE:its_cli>")
add_dependencies(test_cli its_cli)
