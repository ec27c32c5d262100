# Libraries that single modules need, beside those every module may use.

# mesh: glTF (a header; its JSON parser comes with it) and 3MF
find_path(ITS_TINYGLTF_INCLUDE tiny_gltf.h REQUIRED)
find_path(ITS_LIB3MF_INCLUDE Model/COM/NMR_DLLInterfaces.h PATH_SUFFIXES lib3mf REQUIRED)
find_library(ITS_LIB3MF_LIBRARY NAMES 3MF REQUIRED)
find_package(nlohmann_json REQUIRED)
target_include_directories(its SYSTEM PRIVATE ${ITS_TINYGLTF_INCLUDE} ${ITS_LIB3MF_INCLUDE})
target_link_libraries(its PRIVATE nlohmann_json::nlohmann_json ${ITS_LIB3MF_LIBRARY})
# Boost.Multiprecision (headers): the predicates' fallback for coordinates outside the range of expansions.
find_package(Boost 1.74 REQUIRED)
target_link_libraries(its PRIVATE Boost::headers)

# io: checksums of .its files
find_package(PkgConfig REQUIRED)
pkg_check_modules(xxhash REQUIRED IMPORTED_TARGET libxxhash)
target_link_libraries(its PRIVATE PkgConfig::xxhash)
