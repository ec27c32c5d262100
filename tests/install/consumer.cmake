# Installs into a folder of its own, and uses what is there as a user's projects do: by CMake and by pkg-config.
# cmake -D BUILD=… -D SOURCE=… -D FOLDER=… -D CXX=… -D PARTS=… -P consumer.cmake
file(REMOVE_RECURSE ${FOLDER})
set(prefix ${FOLDER}/prefix)
function(run)
  execute_process(COMMAND ${ARGN} COMMAND_ERROR_IS_FATAL ANY)
endfunction()
run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${prefix})
run(${CMAKE_COMMAND} -S ${SOURCE}/examples -B ${FOLDER}/build -DCMAKE_PREFIX_PATH=${prefix} -DCMAKE_BUILD_TYPE=Release)
run(${CMAKE_COMMAND} --build ${FOLDER}/build)
run(${FOLDER}/build/examples/make_model ${FOLDER}/model.obj 60 12)
run(${FOLDER}/build/examples/classify ${FOLDER}/model.obj)
run(${prefix}/bin/its check ${FOLDER}/model.obj)
foreach(file bin/its share/man/man1/its.1 share/bash-completion/completions/its share/doc/its/copyright
        share/doc/its/THIRD-PARTY.md include/its/export.h)
  if(NOT EXISTS ${prefix}/${file})
    message(FATAL_ERROR "${file} is not installed")
  endif()
endforeach()

# Every part that was built is found, with the core; one that does not exist is not.
set(user ${CMAKE_COMMAND} -S ${SOURCE}/tests/install/consumer -B ${FOLDER}/user -DCMAKE_PREFIX_PATH=${prefix})
run(${user} "-DCOMPONENTS=${PARTS}")
run(${CMAKE_COMMAND} --build ${FOLDER}/user)
run(${FOLDER}/user/user)
execute_process(COMMAND ${user} -DCOMPONENTS=nonsense RESULT_VARIABLE failed ERROR_VARIABLE error OUTPUT_QUIET)
if(NOT failed OR NOT error MATCHES "its::nonsense, which was not built")
  message(FATAL_ERROR "an unknown component was found, or the message does not say so: ${error}")
endif()

# pkg-config, after the folder was moved: its files name no place.
file(RENAME ${prefix} ${FOLDER}/moved)
file(GLOB_RECURSE pc ${FOLDER}/moved/its.pc)
cmake_path(GET pc PARENT_PATH pkgconfig)
execute_process(COMMAND ${CMAKE_COMMAND} -E env PKG_CONFIG_PATH=${pkgconfig} pkg-config --cflags --libs its
                OUTPUT_VARIABLE flags OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
separate_arguments(flags UNIX_COMMAND "${flags}")
run(${CXX} -std=c++20 ${SOURCE}/tests/install/consumer/main.cpp -o ${FOLDER}/by_pkgconfig ${flags})
run(${FOLDER}/by_pkgconfig)
file(REMOVE_RECURSE ${FOLDER})
