# CGAL (GPL, tests only): the second opinion on inside and outside.
find_package(CGAL REQUIRED)
target_link_libraries(test_signs PRIVATE CGAL::CGAL)
