# Parts that are built where what they need is there.

# its_part(<NAME> <description>): the option ITS_<NAME>, and its_with_<NAME>, whether the part is to be built.
# AUTO is ON in the top-level project and OFF within another one.
function(its_part name description)
  set(ITS_${name} AUTO CACHE STRING
      "${description}: ON, OFF, or AUTO: where this is the top-level project and what it needs is there")
  set_property(CACHE ITS_${name} PROPERTY STRINGS AUTO ON OFF)
  set(with ${ITS_${name}})
  if(with STREQUAL AUTO)
    set(with ${PROJECT_IS_TOP_LEVEL})
  endif()
  set(its_with_${name} ${with} PARENT_SCOPE)
endfunction()

# its_missing(<NAME> <what>...): something that the part needs is not there. A part that was asked for is an error,
# another is left out with a line that says so. For the scope that called its_part().
function(its_missing name)
  list(JOIN ARGN ", " missing)
  string(TOLOWER ${name} part)
  if(NOT ITS_${name} STREQUAL AUTO)
    message(FATAL_ERROR "ITS_${name}=${ITS_${name}}, but this was not found: ${missing}")
  endif()
  message(NOTICE "its: ${part} is left out; not found: ${missing}")
  set(its_with_${name} OFF PARENT_SCOPE)
endfunction()
