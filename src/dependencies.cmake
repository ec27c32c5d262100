# Libraries that single modules need, beside those every module may use.

# mesh: glTF (a header; its JSON parser comes with it), and zlib for 3MF
find_path(ITS_TINYGLTF_INCLUDE tiny_gltf.h REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(ZLIB REQUIRED)
target_include_directories(its SYSTEM PRIVATE ${ITS_TINYGLTF_INCLUDE})
target_link_libraries(its PRIVATE $<BUILD_INTERFACE:nlohmann_json::nlohmann_json> ZLIB::ZLIB)
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
