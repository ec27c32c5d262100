find_package(nlohmann_json REQUIRED)
find_package(ZLIB REQUIRED)
target_link_libraries(test_page PRIVATE its_page ZLIB::ZLIB nlohmann_json::nlohmann_json)
