# cmake -DSOURCE=file.cc -DFLAGS=... -P CheckCompile.cmake
# A file whose first line is "// expect: REGEX" must be refused with that reason; any other file must compile.
file(STRINGS "${SOURCE}" first_line LIMIT_COUNT 1)
set(ENV{LC_ALL} C)  # plain quotes in messages
execute_process(COMMAND ${COMPILER} ${FLAGS} -fsyntax-only "${SOURCE}" RESULT_VARIABLE status ERROR_VARIABLE messages)
string(REGEX REPLACE "[\r\n]+" " " messages "${messages}")
if(first_line MATCHES "^// expect: (.*)$")
  set(reason "${CMAKE_MATCH_1}")
  if(status EQUAL 0)
    message(FATAL_ERROR "${SOURCE} compiles, and must not")
  elseif(NOT messages MATCHES "${reason}")
    message(FATAL_ERROR "${SOURCE} is refused for another reason than '${reason}': ${messages}")
  endif()
elseif(NOT status EQUAL 0)
  message(FATAL_ERROR "${SOURCE} must compile: ${messages}")
endif()
