# Headers that most sources of a target include, compiled once. Of other people's libraries only: ours change.
set(ITS_STANDARD_HEADERS <algorithm> <array> <cmath> <cstdint> <filesystem> <functional> <memory> <optional> <span>
                         <string> <string_view> <tuple> <utility> <vector>)

# its_precompile(<target> <header>...)
function(its_precompile target)
  if(ITS_PCH)
    target_precompile_headers(${target} PRIVATE ${ITS_STANDARD_HEADERS} ${ARGN})
    # GCC 12 forgets in a precompiled header which of the standard library's warnings are off, and warns falsely.
    target_compile_options(${target} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-Wno-array-bounds;-Wno-stringop-overflow>)
    # A hit in the compiler's cache needs the names of what was included.
    target_compile_options(${target} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-fpch-preprocess>
                                             "$<$<CXX_COMPILER_ID:Clang>:SHELL:-Xclang -fno-pch-timestamp>")
  endif()
endfunction()
