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

# sixpoint_test(NAME name SOURCES ... LINK ... [NEEDS program...] [LABELS ...] [TIMEOUT seconds]): one ctest entry, the suites of SOURCES.
# All tests of a folder are one program, FOLDER_tests (metrology_mesh_tests), so that their sources are compiled several at once; NEEDS are
# built before it. LABELS database: needs a throw-away PostgreSQL (tests/support/throwaway_database.h); end_to_end: the real processes.
function(sixpoint_test)
  cmake_parse_arguments(ARG "" "NAME;TIMEOUT" "SOURCES;LINK;NEEDS;LABELS" ${ARGN})
  file(RELATIVE_PATH folder ${CMAKE_SOURCE_DIR}/tests ${CMAKE_CURRENT_SOURCE_DIR})
  string(REPLACE / _ program ${folder}_tests)
  get_property(suites_of_others DIRECTORY PROPERTY SIXPOINT_SUITES)
  if(NOT suites_of_others)
    add_executable(${program})
    target_link_libraries(${program} PRIVATE GTest::gmock GTest::gtest_main sixpoint::warnings)
    sixpoint_compile(${program})
  endif()
  target_sources(${program} PRIVATE ${ARG_SOURCES})
  target_link_libraries(${program} PRIVATE ${ARG_LINK})
  if(ARG_NEEDS)
    add_dependencies(${program} ${ARG_NEEDS})
  endif()

  # Of the sources as they are: whoever adds a suite need not say so, and an entry that would run nothing, and pass, is none.
  set(suites "")
  foreach(source ${ARG_SOURCES})
    file(READ ${source} text)
    string(REGEX MATCHALL "\n(TEST|TEST_F|TEST_P|TYPED_TEST|TYPED_TEST_P)\\([A-Za-z0-9]+" tests "${text}")
    list(TRANSFORM tests REPLACE ".*\\(" "")
    list(APPEND suites ${tests})
  endforeach()
  list(REMOVE_DUPLICATES suites)
  if(NOT suites)
    message(FATAL_ERROR "${ARG_NAME}: no test in ${ARG_SOURCES}")
  endif()
  foreach(suite ${suites})
    if(suite IN_LIST suites_of_others)
      message(FATAL_ERROR "${ARG_NAME}: ${suite} is a suite of another test of this folder")
    endif()
  endforeach()
  set_property(DIRECTORY APPEND PROPERTY SIXPOINT_SUITES ${suites})
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${ARG_SOURCES})
  list(TRANSFORM suites REPLACE "(.+)" "\\1.*:*/\\1.*:\\1/*:*/\\1/*")  # by themselves, with parameters, with types, with both
  list(JOIN suites : filter)

  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 120)
  endif()
  math(EXPR ARG_TIMEOUT "${ARG_TIMEOUT} * ${SIXPOINT_PATIENCE}")
  add_test(NAME ${ARG_NAME} COMMAND ${CMAKE_SOURCE_DIR}/tests/run_suites $<TARGET_FILE:${program}> ${filter}
    --gtest_output=xml:${CMAKE_BINARY_DIR}/test-results/${ARG_NAME}.xml)
  set_tests_properties(${ARG_NAME} PROPERTIES TIMEOUT ${ARG_TIMEOUT} LABELS "${ARG_LABELS}"
    ENVIRONMENT "SIXPOINT_SOURCE_DIR=${CMAKE_SOURCE_DIR};SIXPOINT_BIN_DIR=${CMAKE_BINARY_DIR}/bin;SIXPOINT_SHARED_DIR=${CMAKE_SOURCE_DIR}/../shared")
endfunction()
