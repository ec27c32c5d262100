its_link_parts(test_api)
