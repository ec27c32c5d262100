# CGAL (GPL, tests only): second opinion on self-intersections, orientation and inside.
find_package(CGAL REQUIRED)
target_link_libraries(test_surface PRIVATE CGAL::CGAL)
