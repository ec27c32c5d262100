find_package(nlohmann_json REQUIRED)
find_package(ZLIB REQUIRED)
target_link_libraries(test_picture PRIVATE its_picture PNG::PNG ZLIB::ZLIB nlohmann_json::nlohmann_json)
