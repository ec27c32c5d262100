# Libraries that single modules need, beside those every module may use.

# Boost.Multiprecision (headers): the predicates' fallback for coordinates outside the range of expansions.
find_package(Boost 1.74 REQUIRED)
target_link_libraries(its PRIVATE Boost::headers)
