# How all our targets are compiled. Same bits on every machine: no contraction into fused multiply-adds.
# A library's calls of its own public functions stay within it, and may be inlined.
# No floating-point traps and no errno from sqrt: both let the compiler vectorise selections.
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_CXX_VISIBILITY_PRESET hidden)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)

add_library(its_compile INTERFACE)
target_compile_options(its_compile INTERFACE
  -fno-semantic-interposition
  -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor -Wno-unknown-pragmas
  -ffp-contract=off -fno-trapping-math -fno-math-errno
  $<$<CONFIG:Release>:-O3>)
if(ITS_PLAIN)
  target_compile_definitions(its_compile INTERFACE ITS_PLAIN)
endif()
if(ITS_WERROR)
  target_compile_options(its_compile INTERFACE -Werror)
endif()
if(ITS_SANITIZE)
  target_compile_options(its_compile INTERFACE
    -fsanitize=${ITS_SANITIZE} -fno-sanitize-recover=all -fno-omit-frame-pointer -g1)
  # GCC's manual: with sanitizers this warning has false positives (here: in CGAL's headers).
  target_compile_options(its_compile INTERFACE $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>)
  target_link_options(its_compile INTERFACE -fsanitize=${ITS_SANITIZE})
  target_compile_definitions(its_compile INTERFACE ITS_SANITIZED)
  if(ITS_SANITIZE MATCHES thread)
    target_compile_definitions(its_compile INTERFACE ITS_SANITIZE_THREAD)  # see src/base/parallel.h
  endif()
endif()

if(ITS_FUZZ)
  target_compile_options(its_compile INTERFACE -fsanitize=fuzzer-no-link)
endif()

find_program(ITS_CCACHE ccache)
if(ITS_CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  # Without this sloppiness, ccache takes nothing that was compiled with a precompiled header from its cache; with this
  # base, what one build folder compiled serves the others, build and build-shared for instance.
  set(CMAKE_CXX_COMPILER_LAUNCHER
      env CCACHE_SLOPPINESS=pch_defines,time_macros,include_file_mtime,include_file_ctime
      CCACHE_BASEDIR=${PROJECT_SOURCE_DIR} ${ITS_CCACHE})
endif()
include(ItsPrecompile)
