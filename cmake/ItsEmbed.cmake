# its_embed(<file> <namespace> <function> <output>): writes a C++ source whose function, in its::<namespace>, returns
# the bytes of the file.
# As a script, for files that are themselves built: cmake -D FILE= -D NAMESPACE= -D FUNCTION= -D OUTPUT= -P ItsEmbed.cmake
function(its_embed_now file namespace function output)
  file(READ ${file} bytes HEX)
  string(REGEX REPLACE "(................................................................)" "\\1\n" bytes "${bytes}")
  string(REGEX REPLACE "([0-9a-f][0-9a-f])" "0x\\1," bytes "${bytes}")
  file(WRITE ${output} "#include <span>
namespace its::${namespace} {
std::span<const unsigned char> ${function}();
std::span<const unsigned char> ${function}() {
    static constexpr unsigned char bytes[] = {
${bytes}};
    return bytes;
}
}  // namespace its::${namespace}
")
endfunction()

function(its_embed file namespace function output)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${file})
  if(EXISTS ${output} AND ${output} IS_NEWER_THAN ${file} AND ${output} IS_NEWER_THAN ${CMAKE_CURRENT_FUNCTION_LIST_FILE})
    return()
  endif()
  its_embed_now(${file} ${namespace} ${function} ${output})
endfunction()

if(CMAKE_SCRIPT_MODE_FILE)
  its_embed_now(${FILE} ${NAMESPACE} ${FUNCTION} ${OUTPUT})
endif()
