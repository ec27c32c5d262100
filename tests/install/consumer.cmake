# Installs into a folder of its own, builds the examples against that, as a user's project, and runs one.
# cmake -D BUILD=… -D SOURCE=… -D FOLDER=… -P consumer.cmake
file(REMOVE_RECURSE ${FOLDER})
function(run)
  execute_process(COMMAND ${ARGN} COMMAND_ERROR_IS_FATAL ANY)
endfunction()
run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${FOLDER}/prefix)
run(${CMAKE_COMMAND} -S ${SOURCE}/examples -B ${FOLDER}/build -DCMAKE_PREFIX_PATH=${FOLDER}/prefix
    -DCMAKE_BUILD_TYPE=Release)
run(${CMAKE_COMMAND} --build ${FOLDER}/build)
run(${FOLDER}/build/examples/make_model ${FOLDER}/model.obj 60 12)
run(${FOLDER}/build/examples/classify ${FOLDER}/model.obj)
run(${FOLDER}/prefix/bin/its check ${FOLDER}/model.obj)
file(REMOVE_RECURSE ${FOLDER})
