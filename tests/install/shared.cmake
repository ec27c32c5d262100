# A shared library with pictures and without the other parts, installed and used: nothing that it needs is missing from
# what it exports, exceptions cross it, and what was left out says so.
# cmake -D SOURCE=… -D FOLDER=… -D CXX=… -D WERROR=… -D TYPE=… -P shared.cmake
function(run)
  execute_process(COMMAND ${ARGN} COMMAND_ERROR_IS_FATAL ANY)
endfunction()
function(refuses message)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE status ERROR_VARIABLE error OUTPUT_QUIET)
  if(NOT status EQUAL 2 OR NOT error MATCHES "^its: error: [^\n]*${message}[^\n]*\n$")
    message(FATAL_ERROR "${ARGN}: status ${status}, not 2 with a line on '${message}': ${error}")
  endif()
endfunction()

set(build ${FOLDER})
set(prefix ${FOLDER}/prefix)
file(REMOVE_RECURSE ${prefix} ${FOLDER}/user)
run(${CMAKE_COMMAND} -S ${SOURCE} -B ${build} -G Ninja -DCMAKE_CXX_COMPILER=${CXX} -DCMAKE_BUILD_TYPE=${TYPE}
    -DITS_WERROR=${WERROR} -DBUILD_SHARED_LIBS=ON -DITS_PICTURE=ON -DITS_PAGE=OFF -DITS_VDB=OFF -DITS_LSCG=OFF
    -DITS_TESTS=OFF -DITS_EXAMPLES=OFF --log-level=NOTICE)
run(${CMAKE_COMMAND} --build ${build})
run(${CMAKE_COMMAND} --install ${build} --prefix ${prefix})
file(GLOB_RECURSE library ${prefix}/libits.so.*.*.*)
cmake_path(GET library PARENT_PATH folder)
set(with_library ${CMAKE_COMMAND} -E env LD_LIBRARY_PATH=${folder})

# What the core needs, and what it is called.
execute_process(COMMAND readelf -d ${library} OUTPUT_VARIABLE dynamic COMMAND_ERROR_IS_FATAL ANY)
if(dynamic MATCHES "png|freetype|embree|openvdb")
  message(FATAL_ERROR "the core needs a library of its parts: ${dynamic}")
endif()
if(NOT dynamic MATCHES "soname: .libits.so.[0-9]+.[0-9]+.\n")
  message(FATAL_ERROR "the library has no SONAME with major and minor version: ${dynamic}")
endif()

# A user's program, by CMake and by pkg-config.
set(user ${CMAKE_COMMAND} -S ${SOURCE}/tests/install/consumer -B ${FOLDER}/user -DCMAKE_PREFIX_PATH=${prefix})
run(${user} -DCOMPONENTS=picture)
run(${CMAKE_COMMAND} --build ${FOLDER}/user)
run(${FOLDER}/user/user)
execute_process(COMMAND ${user} -DCOMPONENTS=vdb RESULT_VARIABLE failed ERROR_VARIABLE error OUTPUT_QUIET)
if(NOT failed OR NOT error MATCHES "its::vdb, which was not built")
  message(FATAL_ERROR "its::vdb was found, or the message does not say so: ${error}")
endif()
execute_process(COMMAND ${CMAKE_COMMAND} -E env PKG_CONFIG_PATH=${folder}/pkgconfig pkg-config --cflags --libs its
                OUTPUT_VARIABLE flags OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
separate_arguments(flags UNIX_COMMAND "${flags}")
run(${CXX} -std=c++20 ${SOURCE}/tests/install/consumer/main.cpp -o ${FOLDER}/user/by_pkgconfig ${flags})
run(${with_library} ${FOLDER}/user/by_pkgconfig)

# The program.
set(its ${prefix}/bin/its)
file(WRITE ${FOLDER}/a.obj "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
run(${its} build ${FOLDER}/a.obj -o ${FOLDER}/a.its --depth 3 --force --quiet)
run(${its} slice ${FOLDER}/a.its -o ${FOLDER}/a.png --size 64 --quiet)
refuses("without pages" ${its} view ${FOLDER}/a.its -o ${FOLDER}/a.html)
refuses("without pages" ${its} view --help)
refuses("without OpenVDB" ${its} surface ${FOLDER}/a.its -o ${FOLDER}/a.vdb)
refuses("without Eigen" ${its} build ${FOLDER}/a.obj -o ${FOLDER}/b.its --solver lscg)
