# The Debian packages: what is in them, and what they depend on.
# cmake -D BUILD=… -D FOLDER=… -P package.cmake
file(REMOVE_RECURSE ${FOLDER})
execute_process(COMMAND ${CMAKE_CPACK_COMMAND} --config ${BUILD}/CPackConfig.cmake -B ${FOLDER}
                COMMAND_ERROR_IS_FATAL ANY OUTPUT_QUIET)
function(expect package field)
  file(GLOB deb ${FOLDER}/${package}_*.deb)
  execute_process(COMMAND dpkg-deb ${field} ${deb} OUTPUT_VARIABLE text COMMAND_ERROR_IS_FATAL ANY)
  foreach(part ${ARGN})
    if(NOT text MATCHES "${part}")
      message(FATAL_ERROR "${package}.deb has no ${part}: ${text}")
    endif()
  endforeach()
endfunction()
expect(its --contents /usr/bin/its /usr/share/man/man1/its.1 /usr/share/bash-completion/completions/its
       /usr/share/zsh/vendor-completions/_its /usr/share/fish/vendor_completions.d/its.fish
       /usr/share/doc/its/copyright /usr/share/doc/its/THIRD-PARTY.md)
expect(its --info "Depends: [^\n]*libc6 [^\n]*libtbb12")
expect(libits-dev --contents /usr/include/its/shell.h /cmake/its/its-config.cmake /pkgconfig/its.pc
       /usr/share/doc/libits-dev/copyright)
expect(libits-dev --info "Depends: its \\(= [^\n]*libtbb-dev")
file(REMOVE_RECURSE ${FOLDER})
