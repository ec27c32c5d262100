target_link_libraries(test_picture PRIVATE PNG::PNG)
