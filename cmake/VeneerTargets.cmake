# veneer_add_library(<name> SOURCES ... [DEPS ...] [PRIVATE_DEPS ...])   one static library per folder
# veneer_add_program(<name> SOURCES ... [DEPS ...])
# veneer_add_tests(<name> SOURCES ... [DEPS ...] [DEFINITIONS ...] [PROGRAMS ...] [LABELS ...] [TIMEOUT s] [AS_SHIPPED])
#                                                                       one program per folder of tests
#
# Every <topic>_test.cc of SOURCES is a test of ctest, named as its path: daemon/unit/preflight_test runs the tests of
# tests/daemon/unit/preflight_test.cc in a process of its own. PROGRAMS are those that the tests start.
#
# A test is a unit test unless LABELS say otherwise. './dev test' runs unit tests under sanitizers, which see all that an
# optimised build would and more; AS_SHIPPED ones, whose subject is not the same there (kernels that are compiled for
# each processor, limits of memory), in the optimised build as well. A slow one (LABELS slow) computes so long that
# './dev test' runs it as shipped only, and './dev soak sanitizers' under sanitizers: other tests of the same code are
# unit tests.
#
# DEPS are what a folder may include (docs/ARCHITECTURE.md: rooms include base and never each other).

# Every test with the label unit; what a sanitizer run builds.
add_custom_target(veneer_unit_tests)
# Every test with the label slow.
add_custom_target(veneer_slow_tests)
# Every program, and the tests that './dev test' runs in the optimised build.
add_custom_target(veneer_as_shipped)

add_library(veneer_settings INTERFACE)
target_compile_features(veneer_settings INTERFACE cxx_std_20)
target_include_directories(veneer_settings INTERFACE "${CMAKE_SOURCE_DIR}")
target_compile_options(veneer_settings INTERFACE -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor
                       -Woverloaded-virtual -Wcast-qual -Wextra-semi -Werror)
# g++ 12 reports false positives inside Boost and fmt when it inlines them under -O2.
target_compile_options(veneer_settings INTERFACE -Wno-maybe-uninitialized -Wno-restrict)
if(CMAKE_CXX_COMPILER_ID MATCHES Clang)
  # It does not know all of g++'s switches, and its -Wconversion warns of every int that counts into a vector as well.
  # Compiled headers without a date, so that a cache of compilations keeps what used them.
  target_compile_options(veneer_settings INTERFACE -Wno-unknown-warning-option -Wno-sign-conversion
                         "SHELL:-Xclang -fno-pch-timestamp")
endif()
# boost/asio/awaitable.hpp of 1.74 misses <utility>, and Asio's deprecated paths are not used.
target_compile_definitions(veneer_settings INTERFACE BOOST_ASIO_NO_DEPRECATED BOOST_BEAST_USE_STD_STRING_VIEW)
if(VENEER_SANITIZE)
  # Warnings are errors where nothing is instrumented: what a sanitizer puts in raises false ones.
  target_compile_options(veneer_settings INTERFACE -fsanitize=${VENEER_SANITIZE} -fno-omit-frame-pointer
                         -fno-sanitize-recover=all -Wno-error)
  target_link_options(veneer_settings INTERFACE -fsanitize=${VENEER_SANITIZE})
endif()
if(VENEER_PLAIN_GLUE)
  # A newcomer's clang may warn of more than the one this was built with.
  target_compile_options(veneer_settings INTERFACE -Wno-error)
endif()
if(VENEER_SANITIZE MATCHES undefined)
  # Checks at each pointer, of what AddressSanitizer sees as well (null, ends of objects, sums that leave the address space)
  # or a processor does not mind. Without the first three g++ compiles a batch in 0.7 of the time (40 -> 29 s, 63 -> 41,
  # 68 -> 49), without pointer-overflow in 0.9 of what is left (79 -> 70, 43 -> 36, 30 -> 28).
  target_compile_options(veneer_settings INTERFACE -fno-sanitize=null,object-size,alignment,pointer-overflow)
endif()
if(VENEER_SANITIZE MATCHES thread)
  # ThreadSanitizer does not see fences. Asio's order comes from its own mutex as well, which it sees.
  target_compile_definitions(veneer_settings INTERFACE BOOST_ASIO_DISABLE_FENCED_BLOCK)
  if(CMAKE_CXX_COMPILER_ID MATCHES Clang)
    # Clang's runtime brings operators new and delete of its own, which tests that count or refuse memory replace: theirs
    # come first. (AddressSanitizer's give way by themselves.)
    target_link_options(veneer_settings INTERFACE -Wl,--allow-multiple-definition)
  endif()
endif()

# veneer_is_glue(VARIABLE): whether this folder, or the room that it tests, moves data but does not compute. Compiling
# such code costs more than running it, and it is not optimised at all: under sanitizers a batch of daemon/api takes 37 s
# of a processor and 70 with -O1, one of tests/daemon/routes 24 and 36. As shipped, programs are optimised, and so is
# what measures them or holds their libraries; what only starts them is not: a batch of scenarios takes 17 s and 27 with
# -O2. Nor is it for a first demo (VENEER_PLAIN_GLUE): there clang compiles a batch of the daemon in 16 s, g++ with -O2 in 37.
# Under sanitizers tests are glue as well, but what they share (tests/support) is not: a batch of driver tests takes 11 s and
# 34 with -O1.
function(veneer_is_glue variable)
  file(RELATIVE_PATH folder "${CMAKE_SOURCE_DIR}" "${CMAKE_CURRENT_SOURCE_DIR}")
  if(((VENEER_SANITIZE OR VENEER_PLAIN_GLUE) AND folder MATCHES "^(tests/)?(cli|daemon|db|guardian)(/|$)") OR
     (VENEER_SANITIZE AND folder MATCHES "^tests/(base|calib|drivers|planner)(/|$)") OR
     (NOT VENEER_SANITIZE AND folder MATCHES "^tests/(cli|demo|guardian|scenarios|systemd)(/|$)"))
    set(${variable} TRUE PARENT_SCOPE)
  else()
    set(${variable} FALSE PARENT_SCOPE)
  endif()
endfunction()

# Most of a compilation is reading headers and instantiating the same templates: sources of one folder share them (option
# VENEER_UNITY).
function(veneer_compile_together name)
  set_target_properties(${name} PROPERTIES UNITY_BUILD ${VENEER_UNITY} UNITY_BUILD_BATCH_SIZE ${VENEER_UNITY_BATCH})
  veneer_is_glue(glue)
  if(glue)
    target_compile_options(${name} PRIVATE -O0)
  else()
    set_target_properties(${name} PROPERTIES VENEER_OPTIMISED TRUE)
  endif()
  if(VENEER_UNITY)
    # A source of a batch looks like a header to the compiler, which then warns of types in anonymous namespaces.
    target_compile_options(${name} PRIVATE -Wno-subobject-linkage)
  endif()
endfunction()

# veneer_optimised_libraries(VARIABLE TARGET): the project's optimised libraries that it links, near and far.
function(veneer_optimised_libraries variable target)
  set(seen "")
  set(optimised "")
  set(open ${target})
  while(open)
    list(POP_FRONT open next)
    foreach(property LINK_LIBRARIES INTERFACE_LINK_LIBRARIES)
      get_target_property(libraries ${next} ${property})
      foreach(library IN LISTS libraries)
        string(REGEX REPLACE "^\\$<LINK_ONLY:(.*)>$" "\\1" library "${library}")
        if(NOT library MATCHES "^veneer_" OR NOT TARGET ${library} OR library IN_LIST seen)
          continue()
        endif()
        list(APPEND seen ${library})
        list(APPEND open ${library})
        get_target_property(is_optimised ${library} VENEER_OPTIMISED)
        if(is_optimised)
          list(APPEND optimised ${library})
        endif()
      endforeach()
    endforeach()
  endwhile()
  set(${variable} ${optimised} PARENT_SCOPE)
endfunction()

# Of an inline function that several objects hold, the linker takes the first copy for all: where glue comes first, what
# computes calls functions that are not optimised. So the optimised libraries come before everything else; mold, which the
# order of archives does not matter to otherwise, then takes theirs. Under sanitizers the driver of the Lihuiyu board on the
# simulated one ran three to five times as fast for it.
function(veneer_link_optimised_first program)
  if(VENEER_MOLD)
    veneer_optimised_libraries(libraries ${program})
    list(TRANSFORM libraries REPLACE "(.+)" "$<TARGET_FILE:\\1>")
    target_link_options(${program} PRIVATE ${libraries})
  endif()
endfunction()

# What nearly every source begins with, read once by clang: it is a fifth to a third of what its batches take (planner 26 -> 17 s of a
# processor, daemon/api 26 -> 20, the twin 19 -> 15), and g++ gains nothing by it. One target for each way to compile,
# because headers that are compiled before have to be compiled in the same way.
if(CMAKE_CXX_COMPILER_ID MATCHES Clang)
  set(veneer_no_source "${CMAKE_BINARY_DIR}/headers.cc")
  file(CONFIGURE OUTPUT "${veneer_no_source}" CONTENT "")
  foreach(headers veneer_headers veneer_glue_headers)
    add_library(${headers} STATIC "${veneer_no_source}")
    target_link_libraries(${headers} PUBLIC veneer_settings fmt::fmt nlohmann_json::nlohmann_json)
    target_precompile_headers(${headers} PRIVATE
      <algorithm> <array> <chrono> <cmath> <filesystem> <fmt/format.h> <functional> <map> <memory> <mutex>
      <nlohmann/json.hpp> <optional> <set> <span> <stop_token> <string> <string_view> <thread> <utility> <variant> <vector>)
  endforeach()
  target_compile_options(veneer_glue_headers PRIVATE -O0)
endif()

function(veneer_read_headers_once name)
  if(NOT CMAKE_CXX_COMPILER_ID MATCHES Clang)
    return()
  endif()
  veneer_is_glue(glue)
  if(glue)
    target_precompile_headers(${name} REUSE_FROM veneer_glue_headers)
  else()
    target_precompile_headers(${name} REUSE_FROM veneer_headers)
  endif()
endfunction()

function(veneer_add_library name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "SOURCES;DEPS;PRIVATE_DEPS")
  add_library(${name} STATIC ${arg_SOURCES})
  target_link_libraries(${name} PUBLIC veneer_settings ${arg_DEPS} PRIVATE ${arg_PRIVATE_DEPS})
  target_compile_options(${name} PRIVATE -Wconversion)
  veneer_compile_together(${name})
  veneer_read_headers_once(${name})
endfunction()

function(veneer_add_program name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "SOURCES;DEPS")
  add_executable(${name} ${arg_SOURCES})
  set_property(GLOBAL APPEND PROPERTY VENEER_PROGRAMS ${name})
  target_link_libraries(${name} PRIVATE veneer_settings ${arg_DEPS})
  target_compile_options(${name} PRIVATE -Wconversion)
  veneer_compile_together(${name})
  veneer_read_headers_once(${name})
  add_dependencies(veneer_as_shipped ${name})
endfunction()

# The main() of test programs, and what nearly every test begins with, read once (tests/CMakeLists.txt makes the target).
function(veneer_add_test_main name)
  add_library(${name} STATIC "${CMAKE_SOURCE_DIR}/tests/support/test_main.cc")
  target_link_libraries(${name} PUBLIC veneer_settings GTest::gmock)
  target_compile_options(${name} PRIVATE -Wconversion)
  target_precompile_headers(${name} PRIVATE
    <gmock/gmock.h> <gtest/gtest.h> <algorithm> <chrono> <filesystem> <fstream> <functional> <memory> <nlohmann/json.hpp>
    <optional> <random> <string> <thread> <vector>)
endfunction()

function(veneer_add_tests name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "AS_SHIPPED" "TIMEOUT" "SOURCES;DEPS;DEFINITIONS;PROGRAMS;LABELS")
  add_executable(${name} ${arg_SOURCES})
  set_property(GLOBAL APPEND PROPERTY VENEER_PROGRAMS ${name})
  veneer_is_glue(glue)  # headers that are compiled before have to be compiled in the same way
  set(main veneer_test_main)
  if(glue)
    set(main veneer_glue_test_main)
  endif()
  target_link_libraries(${name} PRIVATE veneer_settings ${arg_DEPS} ${main})
  target_precompile_headers(${name} REUSE_FROM ${main})
  target_compile_options(${name} PRIVATE -Wconversion)
  veneer_compile_together(${name})
  # Most of their headers are compiled before: little is left to share.
  set_target_properties(${name} PROPERTIES UNITY_BUILD_BATCH_SIZE 8)
  target_compile_definitions(${name} PRIVATE ${arg_DEFINITIONS})
  foreach(program IN LISTS arg_PROGRAMS)
    add_dependencies(${name} ${program})
  endforeach()
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY "${CMAKE_BINARY_DIR}/tests")
  if(NOT arg_TIMEOUT)
    set(arg_TIMEOUT 400)
  endif()
  if(NOT arg_LABELS)
    set(arg_LABELS unit)
  endif()
  if("unit" IN_LIST arg_LABELS)
    add_dependencies(veneer_unit_tests ${name})
  endif()
  if("slow" IN_LIST arg_LABELS)
    add_dependencies(veneer_slow_tests ${name})
  endif()
  if("unit" IN_LIST arg_LABELS AND NOT arg_AS_SHIPPED)
    list(APPEND arg_LABELS sanitizers_suffice)
  else()
    add_dependencies(veneer_as_shipped ${name})
  endif()
  list(FILTER arg_SOURCES INCLUDE REGEX "_test\\.cc$")
  foreach(source IN LISTS arg_SOURCES)
    file(RELATIVE_PATH file "${CMAKE_SOURCE_DIR}/tests" "${CMAKE_CURRENT_SOURCE_DIR}/${source}")
    string(REGEX REPLACE "\\.cc$" "" test "${file}")
    add_test(NAME ${test} COMMAND ${name} ${file})
    set_tests_properties(${test} PROPERTIES TIMEOUT ${arg_TIMEOUT} LABELS "${arg_LABELS}" SKIP_RETURN_CODE 77
                         ENVIRONMENT "RC_PARAMS=seed=20260501")  # rapidcheck draws a fresh seed otherwise
  endforeach()
endfunction()
