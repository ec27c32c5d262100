# The library within another project. Generating the build system finds what that project cannot see.
# cmake -D SOURCE=… -D FOLDER=… -P embedded.cmake
file(REMOVE_RECURSE ${FOLDER})
execute_process(COMMAND ${CMAKE_COMMAND} -S ${SOURCE}/tests/install/embedded -B ${FOLDER} -D ITS_SOURCE=${SOURCE}
                COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${CMAKE_COMMAND} --install ${FOLDER} --prefix ${FOLDER}/prefix COMMAND_ERROR_IS_FATAL ANY)
file(GLOB_RECURSE installed ${FOLDER}/prefix/*)
if(installed)
  message(FATAL_ERROR "the library's files are installed by another project: ${installed}")
endif()
file(REMOVE_RECURSE ${FOLDER})
