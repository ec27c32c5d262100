# Rational numbers as an oracle.
find_package(Boost 1.74 REQUIRED)
target_link_libraries(test_base PRIVATE Boost::headers)
