# sixpoint_library(NAME folder-name SOURCES ... PUBLIC ... PRIVATE ...): one static library with warnings as errors,
# known as sixpoint::NAME. Includes are written from the repository's root.
function(sixpoint_library)
  cmake_parse_arguments(ARG "" "NAME" "SOURCES;PUBLIC;PRIVATE" ${ARGN})
  add_library(sixpoint_${ARG_NAME} STATIC ${ARG_SOURCES})
  add_library(sixpoint::${ARG_NAME} ALIAS sixpoint_${ARG_NAME})
  target_include_directories(sixpoint_${ARG_NAME} PUBLIC ${CMAKE_SOURCE_DIR})
  target_link_libraries(sixpoint_${ARG_NAME} PUBLIC ${ARG_PUBLIC} PRIVATE ${ARG_PRIVATE} sixpoint::warnings)
  sixpoint_compile(sixpoint_${ARG_NAME})
endfunction()

# sixpoint_program(NAME program SOURCES ... LINK ...)
function(sixpoint_program)
  cmake_parse_arguments(ARG "" "NAME" "SOURCES;LINK" ${ARGN})
  add_executable(${ARG_NAME} ${ARG_SOURCES})
  target_link_libraries(${ARG_NAME} PRIVATE ${ARG_LINK} sixpoint::warnings)
  sixpoint_compile(${ARG_NAME})
endfunction()

set(SIXPOINT_PATIENCE 1 CACHE STRING "By how much tests may take longer than they say, under a sanitizer")

# sixpoint_test(NAME name SOURCES ... LINK ... [LABELS ...] [TIMEOUT seconds]): one GoogleTest binary, one ctest entry.
# LABELS database: needs a throw-away PostgreSQL (tests/support/throwaway_database.h); end_to_end: the real processes.
function(sixpoint_test)
  cmake_parse_arguments(ARG "" "NAME;TIMEOUT" "SOURCES;LINK;LABELS" ${ARGN})
  add_executable(${ARG_NAME} ${ARG_SOURCES})
  target_link_libraries(${ARG_NAME} PRIVATE ${ARG_LINK} GTest::gmock GTest::gtest_main sixpoint::warnings)
  sixpoint_compile(${ARG_NAME})
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 120)
  endif()
  math(EXPR ARG_TIMEOUT "${ARG_TIMEOUT} * ${SIXPOINT_PATIENCE}")
  add_test(NAME ${ARG_NAME} COMMAND ${ARG_NAME} --gtest_output=xml:${CMAKE_BINARY_DIR}/test-results/${ARG_NAME}.xml)
  set_tests_properties(${ARG_NAME} PROPERTIES TIMEOUT ${ARG_TIMEOUT} LABELS "${ARG_LABELS}"
    ENVIRONMENT "SIXPOINT_SOURCE_DIR=${CMAKE_SOURCE_DIR};SIXPOINT_BIN_DIR=${CMAKE_BINARY_DIR}/bin;SIXPOINT_SHARED_DIR=${CMAKE_SOURCE_DIR}/../shared")
endfunction()
