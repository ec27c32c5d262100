# CGAL (GPL, tests only): the second opinion on intersections.
find_package(CGAL REQUIRED)
target_link_libraries(test_simplify PRIVATE CGAL::CGAL)
