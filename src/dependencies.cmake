# Libraries that single modules need, beside those every module may use.

# formats: JSON for glTF, and zlib for 3MF
find_package(nlohmann_json REQUIRED)
find_package(ZLIB REQUIRED)
target_link_libraries(its PRIVATE $<BUILD_INTERFACE:nlohmann_json::nlohmann_json> ZLIB::ZLIB)
# formats: what glTF files are packed with. A file that needs one of them is refused by name where it was not found.
set(ITS_WITH_DRACO OFF CACHE INTERNAL "Whether Draco's glTF files are read")
set(ITS_WITH_MESHOPTIMIZER OFF CACHE INTERNAL "Whether meshoptimizer's glTF files are read")
# its_use_packed(<package> <option> <source>): links the library and tells the one source that it is there.
function(its_use_packed package option source)
  find_package(${package} CONFIG QUIET GLOBAL)
  if(NOT TARGET ${package}::${package})
    return()
  endif()
  set(ITS_WITH_${option} ON CACHE INTERNAL "")
  target_link_libraries(its PRIVATE $<LINK_ONLY:${package}::${package}>)
  get_target_property(folders ${package}::${package} INTERFACE_INCLUDE_DIRECTORIES)
  list(REMOVE_ITEM folders folders-NOTFOUND ${CMAKE_CXX_IMPLICIT_INCLUDE_DIRECTORIES})
  set_source_files_properties(${source} PROPERTIES COMPILE_DEFINITIONS ITS_${option} INCLUDE_DIRECTORIES "${folders}")
endfunction()
its_use_packed(draco DRACO formats/gltf_draco.cpp)
its_use_packed(meshoptimizer MESHOPTIMIZER formats/gltf_meshopt.cpp)
message(STATUS "glTF packed with Draco: ${ITS_WITH_DRACO}, with meshoptimizer: ${ITS_WITH_MESHOPTIMIZER}")
# Boost.Multiprecision (headers): the predicates' fallback for coordinates outside the range of expansions.
find_package(Boost 1.74 REQUIRED)
target_link_libraries(its PRIVATE $<BUILD_INTERFACE:Boost::headers>)

# shell: hash of the input; io: checksums of .its files
find_package(PkgConfig REQUIRED)
pkg_check_modules(xxhash REQUIRED IMPORTED_TARGET libxxhash)
target_link_libraries(its PRIVATE PkgConfig::xxhash)

# picture: text is set by FreeType in a font that is compiled in, so that no machine needs to have it.
find_package(Freetype REQUIRED)
target_link_libraries(its PRIVATE Freetype::Freetype)
include(ItsEmbed)
foreach(weight Regular Medium)
  # The second choice where Debian's fonts-roboto-unhinted is not installed; it has no medium weight.
  string(REPLACE Medium "-Bold" fallback ${weight})
  string(REPLACE Regular "" fallback ${fallback})
  find_file(ITS_FONT_${weight} NAMES Roboto-${weight}.ttf DejaVuSans${fallback}.ttf
            PATHS /usr/share/fonts /usr/local/share/fonts
            PATH_SUFFIXES truetype/roboto/unhinted/RobotoTTF truetype/roboto/unhinted truetype/dejavu
            NO_DEFAULT_PATH REQUIRED)
  string(TOLOWER font_${weight} function)
  its_embed(${ITS_FONT_${weight}} picture ${function} ${CMAKE_CURRENT_BINARY_DIR}/${function}.cpp)
  target_sources(its PRIVATE ${CMAKE_CURRENT_BINARY_DIR}/${function}.cpp)
endforeach()

# picture: renderings are traced by Embree.
find_package(embree 3 REQUIRED)
target_link_libraries(its PRIVATE embree)

# picture: the page of its view, built in web/
set_source_files_properties(${ITS_PAGE_SOURCE} PROPERTIES GENERATED ON)
target_sources(its PRIVATE ${ITS_PAGE_SOURCE})
add_dependencies(its its_page)
